// What the cases of this crate give as WebAssembly, against what they give on this machine:
//
//   node compare.mjs dgd_wasm.wasm dgd-wasm [--all]
//
// Texts must be equal: events, verdicts, names. Numbers of a line are samples or values of one quantity; each may
// be off by what the line says, 1e-12 in most, of the largest of them on this machine. Arithmetic is the same
// everywhere, so that all there is comes from elementary functions, whose last digit is the platform's: glibc's here,
// libm's in Rust there. Where a problem multiplies that, the case says why it may (`close` in src/cases.rs, RIVALS in
// src/discovery.rs).
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";

const [module, program, extent] = process.argv.slice(2);

const { instance } = await WebAssembly.instantiate(readFileSync(module), {});
const { memory, cases, is_long, run, buffer, length } = instance.exports;

const text = () => new TextDecoder().decode(new Uint8Array(memory.buffer, buffer(), length()));

function there(position) {
    try {
        run(position);
    } catch (error) {
        throw new Error(`case ${position}: ${text() || error}`);
    }
    return text();
}

const here = (position) =>
    execFileSync(program, [String(position)], { encoding: "utf8", maxBuffer: 1 << 28 });

const lines = (text) => text.trimEnd().split("\n").map((line) => line.split("\t"));

// How far numbers are from those expected, relative to the largest of these.
function distance(found, expected) {
    const [a, b] = [found, expected].map((text) => (text === "" ? [] : text.split(" ").map(Number)));
    if (a.length !== b.length) return Infinity;
    const largest = Math.max(0, ...b.filter(Number.isFinite).map(Math.abs));
    const off = a.map((x, k) => (Object.is(x, b[k]) || x === b[k] ? 0 : Math.abs(x - b[k]) / largest));
    return Math.max(0, ...off.map((x) => (Number.isNaN(x) ? Infinity : x)));
}

// What is wrong with a case, and how far off its numbers are at most.
function compare(found, expected) {
    if (found.length !== expected.length) {
        return { wrong: [`${found.length} lines, not ${expected.length}`], farthest: Infinity };
    }
    const wrong = [];
    let farthest = 0;
    for (const [k, [kind, what, value]] of expected.entries()) {
        const [its_kind, its_what, its_value] = found[k];
        if (kind !== its_kind || what !== its_what || (kind === "text" && value !== its_value)) {
            wrong.push(`${its_what} is ${its_value}, not ${what} ${value}`);
        } else if (kind !== "text") {
            const off = distance(its_value, value);
            farthest = Math.max(farthest, off);
            if (off > Number(kind)) wrong.push(`${what} is off by ${off.toExponential(1)}`);
        }
    }
    return { wrong, farthest };
}

let [passed, failed] = [0, 0];
for (let position = 0; position < cases(); position++) {
    if (is_long(position) && extent !== "--all") continue;
    const expected = lines(here(position));
    const began = performance.now();
    const found = lines(there(position));
    const seconds = ((performance.now() - began) / 1000).toFixed(2);
    const { wrong, farthest } = compare(found, expected);
    const name = expected[0][2];
    console.log(`${name}: ${expected.length} lines, off by ${farthest.toExponential(1)}, ${seconds} s`);
    for (const line of wrong) console.error(`  ${line}`);
    wrong.length === 0 ? passed++ : failed++;
}
console.log(`${passed} passed, ${failed} failed`);
process.exit(failed === 0 && passed > 0 ? 0 : 1);
