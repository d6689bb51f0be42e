// What the playground's module gives of the repository's models, against what `dgd simulate --engine interpreter` gives:
//
//   node compare.mjs dgd.wasm dgd [--all]
//
// All numbers of a run, in the units of the model; all texts must be equal. Arithmetic is the same everywhere, so that
// all there is comes from elementary functions, whose last digit is the platform's. `--all` takes every model and every
// choice of its variants, not a few.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, relative } from "node:path";
import { fileURLToPath } from "node:url";
import { MODELS } from "./models.mjs";

const [module, program, extent] = process.argv.slice(2);
const CLOSE = 1e-12;
// Of a run with the relative tolerance that is usual, 1e-6, and values near 1.
const ZERO = 1e-5;
const FEW = ["every_intrinsic.dgd", "mud_circulation.dgd", "cstr.dgd", "dual_gradient_drilling.dgd", "tank_with_weir.dgd"];
const root = fileURLToPath(new URL("../..", import.meta.url));
const models = join(root, "models");

// ---- what the module says ----

const compiled = await WebAssembly.compile(readFileSync(module));
async function answers(messages) {
  const { exports } = await WebAssembly.instantiate(compiled, {});
  const text = () => new TextDecoder().decode(new Uint8Array(exports.memory.buffer, exports.buffer(), exports.length()));
  return messages.map((message) => {
    const bytes = new TextEncoder().encode(JSON.stringify(message));
    const at = exports.room(bytes.length);
    new Uint8Array(exports.memory.buffer, at, bytes.length).set(bytes);
    try { exports.answer(); } catch (error) { throw new Error(text() || String(error)); }
    return JSON.parse(text());
  });
}

// ---- the models ----

const all = readdirSync(models, { recursive: true }).filter((name) => name.endsWith(".dgd")).map((name) => name.replaceAll("\\", "/"));
const texts = Object.fromEntries(all.map((name) => [`models/${name}`, readFileSync(join(models, name), "utf8")]));
const isModel = (name) => /^model /m.test(texts[`models/${name}`]);
const names = all.filter((name) => !name.startsWith("effects/") && isModel(name)).sort();

const problems = [];
for (const name of names) if (!MODELS[name]) problems.push(`models.mjs does not say how ${name} is run`);
for (const name of Object.keys(MODELS)) if (!names.includes(name)) problems.push(`there is no model ${name}`);

const folder = mkdtempSync(join(tmpdir(), "dgd-compare-"));
function native(name, { data, file, until, every }, variant) {
  const path = file ? join(root, "examples/data", file) : join(folder, "data.csv");
  if (data) writeFileSync(path, data);
  const words = ["simulate", `models/${name}`, "--engine", "interpreter", "--format", "json", "--quiet"];
  if (data || file) words.push("--data", path);
  if (until != null) words.push("--until", String(until));
  if (every != null) words.push("--every", String(every));
  for (const choice of variant) words.push("--variant", choice);
  try {
    return JSON.parse(execFileSync(program, words, { cwd: root, encoding: "utf8", maxBuffer: 1 << 30 }));
  } catch (error) {
    return { failed: true, ...JSON.parse(error.stdout || "{}") };
  }
}

function variants(name) {
  const described = JSON.parse(execFileSync(program, ["check", `models/${name}`, "--format", "json"], { cwd: root, encoding: "utf8", maxBuffer: 1 << 28 }));
  const others = described.variants.flatMap((one) => one.choices.filter((choice) => choice !== one.chosen).map((choice) => [`${one.name}=${choice}`]));
  return [[], ...others];
}

// ---- the comparison ----

// How far numbers are from those expected, relative to the largest of these.
function distance(found, expected) {
  if (found.length !== expected.length) return Infinity;
  const largest = Math.max(0, ...expected.filter(Number.isFinite).map(Math.abs));
  let most = 0;
  expected.forEach((x, k) => {
    if (x === found[k] || (x == null && found[k] == null)) return;
    const off = Math.abs(found[k] - x) / largest;
    most = Math.max(most, Number.isNaN(off) ? Infinity : off);
  });
  return most;
}

let farthest = 0, compared = 0;
for (const name of extent === "--all" ? names : FEW) {
  const how = MODELS[name];
  for (const variant of extent === "--all" ? variants(name) : [[]]) {
    const what = [name, ...variant].join(" ");
    const data = how.data ?? (how.file && readFileSync(join(root, "examples/data", how.file), "utf8"));
    const open = { files: { ...texts, ...(data ? { "data.csv": data } : {}) }, model: `models/${name}`, data: data ? "data.csv" : null, until: how.until ?? null, every: how.every ?? null, variant };
    const expected = native(name, how, variant);
    const began = performance.now();
    const [, answer] = await answers([{ open }, { table: { values: {} } }]);
    const seconds = ((performance.now() - began) / 1000).toFixed(2);
    if (expected.failed || expected.error || !answer.ok || answer.result.error) {
      const [here, there] = [expected.error ?? (expected.failed ? JSON.stringify(expected) : ""), answer.ok ? answer.result.error ?? "" : answer.error];
      problems.push(`${what}: here ${here || "it ran"}; there ${there || "it ran"}`);
      continue;
    }
    const found = answer.result;
    compared += 1;
    for (const part of ["model", "method", "rows", ...(how.steps === false ? [] : ["steps", "rejected"])]) {
      if (found[part] !== expected[part]) problems.push(`${what}: ${part} is ${found[part]}, not ${expected[part]}`);
    }
    const words = (events) => JSON.stringify(events.map(({ modes, from, to }) => [modes, from, to]));
    if (words(found.events) !== words(expected.events)) problems.push(`${what}: other events`);
    const close = how.close ?? CLOSE;
    let most = distance(found.time, expected.time);
    for (const [k, column] of expected.columns.entries()) {
      const own = found.columns[k] ?? { name: "nothing", unit: "", values: [] };
      if (own.name !== column.name || own.unit !== column.unit) problems.push(`${what}: ${own.name} [${own.unit}] is not ${column.name} [${column.unit}]`);
      if (how.zero?.test(column.name)) {
        const size = Math.max(...own.values.concat(column.values).map(Math.abs));
        if (!(size < ZERO)) problems.push(`${what}: ${column.name} is not zero but ${size.toExponential(1)}`);
        continue;
      }
      const off = distance(own.values, column.values);
      if (off > close) problems.push(`${what}: ${column.name} is off by ${off.toExponential(1)}`);
      most = Math.max(most, off);
    }
    farthest = Math.max(farthest, most);
    console.log(`${what}: ${expected.columns.length} columns of ${expected.rows}, off by ${most.toExponential(1)}, ${seconds} s`);
  }
}
rmSync(folder, { recursive: true });
for (const problem of problems) console.error(`  ${problem}`);
console.log(`${compared} runs compared, off by ${farthest.toExponential(1)} at most; ${problems.length} problems`);
process.exit(problems.length || !compared ? 1 : 0);
