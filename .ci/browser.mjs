// What must hold of every page, in a browser: no error in the console, all panels drawn, zoom and cursors linked, tables
// sorted, nothing serious by axe-core, no part wider than the screen, pictures without JavaScript; and the page of a
// recording of 6000 × 8 samples soon ready. `node browser.mjs --recording` prints that recording.

import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

// Seconds until a page of 6000 × 8 samples answers.
const SOON = 0.5;

function recording() {
  const names = Array.from({ length: 8 }, (_, i) => `x${i + 1} [bar]`);
  console.log(["time [s]", ...names].join(","));
  let seed = 1;
  const noise = () => { seed = (seed * 48271) % 2147483647; return seed / 2147483647 - 0.5; };
  for (let k = 0; k < 6000; k++) {
    const wave = (i) => (10 + Math.sin(k / (100 + 20 * i)) + 0.1 * noise()).toFixed(4);
    console.log([k, ...names.map((_, i) => wave(i))].join(","));
  }
}

const [folder, ...options] = process.argv.slice(2);
if (folder === "--recording") { recording(); process.exit(0); }

// It starts a browser.
const { check, end, open: opened, judge: judged, painted, picturesOf, scrollThrough } = await import("./pages.mjs");
const pictures = picturesOf(options);
// The policy of a page refuses what tests add to it; whether it holds is seen without that.
const open = (file, ...rest) => opened(pathToFileURL(join(folder, file)).href, ...rest);

async function look(file, width, scheme) {
  const where = `${file} at ${width}, ${scheme}`;
  const { context, page, errors } = await open(file, width, scheme);
  await scrollThrough(page);
  const before = await painted(page);
  check(where, before.length > 0 && before.every(({ colours }) => colours > 3), "a panel is not drawn");
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  check(where, wide <= 0, `wider than the screen by ${wide}`);
  if (pictures) {
    await page.screenshot({ path: join(pictures, `${file.replace(".html", "")}-${width}-${scheme}.png`), fullPage: true });
  }

  // Zoom by keys: the panels of a figure together, and back.
  const first = page.locator(".plot").first();
  const together = await page.locator("figure.chart").first().locator(".plot").count();
  const changed = (a, b) => a.map((one, i) => one.digest !== b[i].digest).slice(0, together);
  await first.focus();
  await page.keyboard.press("+");
  await page.waitForTimeout(150);
  const zoomed = await painted(page);
  check(where, changed(before, zoomed).every(Boolean), "a panel is not zoomed with the others");
  await page.keyboard.press("0");
  await page.waitForTimeout(150);
  check(where, !changed(before, await painted(page)).some(Boolean), "a panel does not come back");
  // By dragging.
  const box = await first.locator(".u-over").boundingBox();
  await page.mouse.move(box.x + 0.3 * box.width, box.y + 0.5 * box.height);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.6 * box.width, box.y + 0.5 * box.height, { steps: 4 });
  await page.mouse.up();
  await page.waitForTimeout(150);
  check(where, changed(before, await painted(page)).every(Boolean), "dragging does not zoom");
  await page.mouse.dblclick(box.x + 0.5 * box.width, box.y + 0.5 * box.height);
  await page.waitForTimeout(150);
  check(where, !changed(before, await painted(page)).some(Boolean), "a double click does not show all");
  // Values at the cursor, for eyes and for ears.
  await first.focus();
  for (let i = 0; i < 3; i++) { await page.keyboard.press("ArrowRight"); await page.waitForTimeout(60); }
  const said = await page.locator("[role=status]").textContent();
  const values = await page.locator("figure.chart").first().locator(".key output").allTextContents();
  check(where, /\d/.test(said), "the cursor says nothing");
  check(where, values.some((value) => /\d/.test(value)), "no value at the cursor");
  // Tables.
  const head = page.locator("table.sortable thead th button").nth(1);
  if (await head.count()) {
    await head.click();
    await head.click();
    const sorted = await head.evaluate((button) => button.closest("th").getAttribute("aria-sort"));
    check(where, sorted === "descending", "a table is not sorted");
  }
  check(where, errors.length === 0, `the console has: ${errors.join("; ")}`);
  await context.close();
}

async function judge(file, width, scheme) {
  const { context, page } = await open(file, width, scheme, { bypassCSP: true });
  await scrollThrough(page);
  await judged(`${file} at ${width}, ${scheme}`, page);
  await context.close();
}

async function withoutScript(file) {
  const { context, page, errors } = await open(file, 1400, "light", { javaScriptEnabled: false });
  const pictures = page.locator(".picture svg");
  const count = await pictures.count();
  check(file, count > 0, "no picture without JavaScript");
  for (let i = 0; i < count; i++) check(file, await pictures.nth(i).isVisible(), "a picture is hidden without JavaScript");
  check(file, errors.length === 0, `without JavaScript the console has: ${errors.join("; ")}`);
  await context.close();
}

// Until the first panel has its curves, and until a key answers.
async function timed(file) {
  const times = [];
  for (let i = 0; i < 5; i++) {
    const { context, page } = await open(file, 1400, "light");
    await page.waitForFunction(() => document.querySelector(".plot canvas") && performance.getEntriesByName("interactive").length);
    times.push(await page.evaluate(() => performance.getEntriesByName("interactive")[0].startTime / 1000));
    await context.close();
  }
  times.sort((a, b) => a - b);
  const size = readFileSync(join(folder, file)).length;
  console.log(`${file}: ${(size / 1e6).toFixed(1)} MB, interactive after ${times[2].toFixed(2)} s (median of five; ${times[0].toFixed(2)} to ${times[4].toFixed(2)})`);
  check(file, times[2] < SOON, `interactive after ${times[2].toFixed(2)} s`);
}

const files = readdirSync(folder).filter((name) => name.endsWith(".html")).sort();
for (const file of files) {
  for (const width of [1400, 390]) {
    for (const scheme of ["light", "dark"]) {
      await look(file, width, scheme);
      await judge(file, width, scheme);
    }
  }
  await withoutScript(file);
}
await timed("large.html");
await end(`${files.length} pages`);
