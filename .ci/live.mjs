// What must hold of the pages that a program keeps up to date, in a browser, wide and on a phone, light and dark: no error
// in the console, panels drawn, nothing serious by axe-core, no part wider than the screen, all of it usable by keys.
//
//   node live.mjs watch DGD FOLDER [--quick] [--pictures DIR]     `dgd watch`: saved, dragged, kept, written, ended
//   node live.mjs play FOLDER [--quick] [--pictures DIR]          the playground: typed, dragged, dropped, fitted, shared
//
// How long a redraw takes is said, and that it is not many times as long as it should be is checked: other work slows
// a machine down. `--quick`, for programs that were not built to be fast, checks no speed, and looks at two screens of four.

import { spawn } from "node:child_process";
import { cpSync, createReadStream, existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { extname, join, normalize } from "node:path";

import { check, end, judge, open as openPage, painted, picturesOf, scrollThrough } from "./pages.mjs";

const [what, ...rest] = process.argv.slice(2);
const pictures = picturesOf(rest);
const quick = rest.includes("--quick");
const screens = quick ? [[1400, "light"], [390, "dark"]] : [[1400, "light"], [1400, "dark"], [390, "light"], [390, "dark"]];

async function open(url, width, colorScheme, more = {}) {
  const opened = await openPage(url, width, colorScheme, more);
  await redrawn(opened.page, 0);
  return opened;
}
const redraws = (page) => page.evaluate(() => Number(document.documentElement.dataset.redraws ?? 0));
const redrawn = (page, before) => page.waitForFunction((n) => Number(document.documentElement.dataset.redraws ?? 0) > n, before, { timeout: 60000, polling: 10 });
const settled = (page) => page.waitForFunction(() => document.querySelectorAll(".slopes .plot").length > 0, null, { timeout: 60000 });

async function look(url, name, width, scheme) {
  const where = `${name} at ${width}, ${scheme}`;
  const { context, page, errors } = await open(url, width, scheme);
  await settled(page);
  await scrollThrough(page);
  const all = await painted(page);
  check(where, all.length > 3 && all.every(({ colours }) => colours > 3), `a panel is not drawn: ${JSON.stringify(all.map(({ colours }) => colours))}`);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  check(where, wide <= 0, `wider than the screen by ${wide}`);
  if (pictures) {
    await page.screenshot({ path: join(pictures, `${name}-${width}-${scheme}.png`) });
    await page.screenshot({ path: join(pictures, `${name}-${width}-${scheme}-full.png`), fullPage: true });
  }
  check(where, errors.length === 0, `the console has: ${errors.join("; ")}`);
  await context.close();

  const judged = await open(url, width, scheme, { bypassCSP: true });
  await settled(judged.page);
  await judge(where, judged.page);
  await judged.context.close();
}

// Redraws in a second while a slider is dragged; the pointer moves more often than that.
async function dragged(page, slider) {
  await slider.scrollIntoViewIfNeeded();
  const box = await slider.boundingBox();
  const y = box.y + box.height / 2;
  await page.mouse.move(box.x + 0.5 * box.width, y);
  await page.mouse.down();
  const before = await redraws(page), began = performance.now();
  for (let k = 0; performance.now() - began < 2000; k++) await page.mouse.move(box.x + (0.5 + 0.2 * Math.sin(k / 20)) * box.width, y);
  const rate = (await redraws(page) - before) / ((performance.now() - began) / 1000);
  await page.mouse.up();
  return rate;
}

// ---- dgd watch ----

async function watched(dgd, folder) {
  const work = mkdtempSync(join(tmpdir(), "dgd-watch-"));
  cpSync(join(folder, "models"), work, { recursive: true });
  const model = join(work, "mud_circulation.dgd");
  const text = readFileSync(model, "utf8");
  const child = spawn(dgd, ["watch", model, "--data", join(folder, "examples/data/circulation.csv")], { stdio: ["ignore", "pipe", "inherit"] });
  const address = await new Promise((resolve, reject) => {
    child.stdout.once("data", (bytes) => resolve(String(bytes).trim()));
    child.once("exit", (code) => reject(new Error(`dgd watch ended with ${code}`)));
  });
  for (const [width, scheme] of screens) await look(address, "watch", width, scheme);

  const { context, page, errors } = await open(address, 1400, "light");
  await settled(page);
  // A save, and how long its redraw takes.
  const times = [];
  for (const c0 of [280, 281, 282, 283, 284]) {
    const before = await redraws(page), began = performance.now();
    writeFileSync(model, text.replace("= 275 ", `= ${c0} `));
    await redrawn(page, before);
    times.push((performance.now() - began) / 1000);
    await page.waitForTimeout(700);
  }
  times.sort((a, b) => a - b);
  console.log(`from a save to its redraw ${times[2].toFixed(2)} s (median of five; ${times[0].toFixed(2)} to ${times[4].toFixed(2)})`);
  check("watch", quick || times[2] < 1, `a redraw takes ${times[2].toFixed(2)} s`);
  const field = page.locator(".parameter", { hasText: "c0" }).locator("input[type=number]");
  check("watch", await field.inputValue() === "284", "the field does not have what was saved");

  const slider = page.locator(".parameter", { hasText: "c0" }).locator("input[type=range]");
  const rate = await dragged(page, slider);
  console.log(`${rate.toFixed(0)} redraws a second while a slider of mud_circulation is dragged`);
  check("watch", quick || rate >= 20, `${rate.toFixed(0)} redraws a second`);

  // By keys: a value, keep it, another value, let go.
  await slider.focus();
  const moved = await field.inputValue();
  let before = await redraws(page);
  await page.keyboard.press("ArrowRight");
  await redrawn(page, before);
  check("watch", await field.inputValue() !== moved, "an arrow key does not move a slider");
  await page.getByRole("button", { name: "Keep this set" }).focus();
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => [...document.querySelectorAll(".key")].filter((key) => key.textContent.includes("kept 1")).length > 3);
  await field.focus();
  await field.fill("290");
  before = await redraws(page);
  await page.keyboard.press("Enter");
  await redrawn(page, before);
  if (pictures) await page.screenshot({ path: join(pictures, "watch-kept.png") });
  // Into the file, and not where it has changed.
  await page.getByRole("button", { name: "Write into the file" }).focus();
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.querySelector(".news").textContent.startsWith("Written"));
  check("watch", readFileSync(model, "utf8") === text.replace("= 275 ", "= 290 "), "the file does not have the value, or more was changed");
  await page.waitForTimeout(700);
  // A variant and an effect by keys.
  await page.locator("#variant-0").focus();
  before = await redraws(page);
  await page.keyboard.press("ArrowDown");
  await redrawn(page, before);
  check("watch", await page.locator("#variant-0").inputValue() === "static", "a key does not choose a variant");
  await page.locator("details summary", { hasText: "Effects" }).focus();
  await page.keyboard.press("Enter");
  await page.locator(".choice", { hasText: "pump_wear" }).locator("input").focus();
  before = await redraws(page);
  await page.keyboard.press("Space");
  await redrawn(page, before);
  check("watch", (await page.locator(".parameter").count()) > 6, "the effect's parameters are not there");
  // A mistake, over its line; and none any more.
  before = await redraws(page);
  writeFileSync(model, text.replace("- q_boost - q_tf", "- q_bost - q_tf"));
  await redrawn(page, before);
  check("watch", /q_bost/.test(await page.locator(".mistake mark").first().textContent()), "the mistake is not marked");
  check("watch", (await page.locator(".charts.stale").count()) > 0, "old curves look like new ones");
  if (pictures) await page.screenshot({ path: join(pictures, "watch-mistake.png") });
  before = await redraws(page);
  writeFileSync(model, text);
  await redrawn(page, before);
  check("watch", (await page.locator(".mistake").count()) === 0, "the mistake stays");
  check("watch", errors.length === 0, `the console has: ${errors.join("; ")}`);
  // Without the secret there is a sentence, and nothing of the model.
  const stranger = await context.newPage();
  await stranger.goto(address.split("#")[0]);
  await stranger.waitForFunction(() => document.querySelector("main").textContent.includes("secret"));
  check("watch", !(await stranger.locator("main").textContent()).includes("c0"), "a stranger sees the model");
  child.kill("SIGINT");
  await page.waitForFunction(() => document.documentElement.dataset.ended === "true");
  await context.close();
  rmSync(work, { recursive: true });
}

// ---- the playground ----

const KINDS = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml", ".json": "application/json", ".wasm": "application/wasm" };
function served(folder, asked) {
  const server = createServer((request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, "http://x").pathname));
    // The browser's own, whenever it has time.
    if (path !== "/icon.svg") asked.push(path);
    const file = join(folder, path.endsWith("/") ? "index.html" : path);
    if (!existsSync(file)) { response.writeHead(404).end(); return; }
    response.writeHead(200, { "content-type": KINDS[extname(file)] ?? "text/plain" });
    createReadStream(file).pipe(response);
  });
  return new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(server)));
}

async function played(folder) {
  const asked = [];
  const server = await served(folder, asked);
  const address = `http://127.0.0.1:${server.address().port}/`;
  for (const [width, scheme] of screens) await look(address, "play", width, scheme);

  const { context, page, errors } = await open(address, 1400, "light", { permissions: ["clipboard-read", "clipboard-write"] });
  await settled(page);
  const rate = await dragged(page, page.locator(".parameter", { hasText: "c0" }).locator("input[type=range]"));
  console.log(`${rate.toFixed(0)} redraws a second while a slider of the playground is dragged`);
  check("play", quick || rate >= 5, `${rate.toFixed(0)} redraws a second`);
  // From now on nothing is fetched.
  const before = asked.length;
  // A mistake is marked in the text, and its place is a key away.
  const area = page.locator("#text");
  const text = await area.inputValue();
  await area.fill(text.replace("- q_boost - q_tf", "- q_bost - q_tf"));
  await page.waitForSelector(".editor mark");
  check("play", (await page.locator(".editor mark").first().textContent()) === "q_bost", "another place is marked");
  if (pictures) await page.screenshot({ path: join(pictures, "play-mistake.png") });
  await page.locator(".mistake button").first().focus();
  await page.keyboard.press("Enter");
  const selected = await area.evaluate((one) => one.value.slice(one.selectionStart, one.selectionEnd));
  check("play", selected === "q_bost", `the place of the mistake is ${selected}`);
  await area.fill(text);
  await page.waitForFunction(() => !document.querySelector(".mistake"));
  // A recording of one's own, and a fit to it.
  const secret = "time [s],T [K]\n0,80.123456\n50,53.2\n100,36.1\n200,16.0\n300,7.1\n";
  await area.fill("model cooling\nparameter tau [s] = 100 in 1 .. 1e4\nstate T [K] = 80\nequation cooling: tau*der(T) = -T\noutput T [K] noise 0.1\n");
  await page.locator(".drop input[type=file]").setInputFiles({ name: "cup.csv", mimeType: "text/csv", buffer: Buffer.from(secret) });
  await page.waitForFunction(() => document.querySelector("h1").textContent.startsWith("Fits T "));
  await page.getByRole("button", { name: "Fit to the recording" }).focus();
  await page.keyboard.press("Enter");
  await page.waitForSelector("pre.result");
  const tau = Number(await page.locator(".parameter", { hasText: "tau" }).locator("input[type=number]").inputValue());
  check("play", Math.abs(tau - 124.5) < 1, `the fit gives ${tau}`);
  if (pictures) await page.screenshot({ path: join(pictures, "play-fit.png"), fullPage: true });
  // The link has the model and not the recording.
  await page.getByRole("button", { name: "Share as a link" }).click();
  await page.waitForFunction(() => location.hash.startsWith("#m="));
  const link = page.url();
  const packed = Buffer.from(link.split("#m=")[1].replaceAll("-", "+").replaceAll("_", "/"), "base64");
  const { inflateRawSync } = await import("node:zlib");
  const inside = inflateRawSync(packed).toString();
  check("play", inside.includes("model cooling") && !inside.includes("80.123456") && !inside.includes("cup.csv"), "the link has the recording, or not the model");
  check("play", asked.length === before, `something was fetched: ${asked.slice(before).join(", ")}`);
  check("play", errors.length === 0, `the console has: ${errors.join("; ")}`);
  const other = await open(link, 1400, "light");
  check("play", (await other.page.locator("#text").inputValue()).startsWith("model cooling"), "the link does not open the model");
  check("play", Math.abs(Number(await other.page.locator(".parameter", { hasText: "tau" }).locator("input[type=number]").inputValue()) - tau) < 1e-9, "the link does not have the values");
  check("play", other.errors.length === 0, `the console has: ${other.errors.join("; ")}`);
  await other.context.close();
  // What takes long can be stopped, and all goes on.
  await page.goto("about:blank");
  await page.goto(address);
  await redrawn(page, 0);
  await page.getByRole("button", { name: "Find what is missing" }).click();
  await page.waitForTimeout(2500);
  await page.getByRole("button", { name: "Stop" }).click();
  await page.waitForFunction(() => document.querySelector(".news").textContent.startsWith("Stopped"));
  check("play", asked.includes("/dgd-discover.wasm"), "the module for discoveries was not fetched");
  check("play", errors.length === 0, `the console has: ${errors.join("; ")}`);
  await context.close();
  server.close();
}

if (what === "watch") await watched(rest[0], rest[1]);
else await played(rest[0]);
await end(what);
