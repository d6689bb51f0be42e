// What the checks of pages share: a browser, checks that are counted, and pages whose errors are kept.

import { mkdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const require = createRequire(join(process.env.TOOLS, "node_modules", "x.js"));
const { chromium } = require("playwright-core");
const axe = readFileSync(join(process.env.TOOLS, "node_modules/axe-core/axe.min.js"), "utf8");
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });

// The folder behind `--pictures`, which is made, or nothing.
export function picturesOf(options) {
  const at = options.indexOf("--pictures");
  if (at < 0) return null;
  mkdirSync(options[at + 1], { recursive: true });
  return options[at + 1];
}

const failures = [];
let checks = 0;
export function check(where, holds, said) {
  checks += 1;
  if (!holds) { failures.push(`${where}: ${said}`); console.log(`FAILED ${where}: ${said}`); }
}

export async function open(url, width, colorScheme, more = {}) {
  const context = await browser.newContext({ viewport: { width, height: 900 }, colorScheme, ...more });
  const page = await context.newPage();
  const errors = [];
  // What the browser says of a script's own reading of pixels is left out.
  const counts = (message) => ["error", "warning"].includes(message.type()) && !message.text().startsWith("Canvas2D:");
  page.on("console", (message) => { if (counts(message)) errors.push(message.text()); });
  page.on("pageerror", (error) => errors.push(error.message));
  await page.goto(url);
  return { context, page, errors };
}

// Panels are drawn as they come into sight.
export async function scrollThrough(page) {
  const height = await page.evaluate(() => document.documentElement.scrollHeight);
  for (let y = 0; y < height; y += 600) {
    await page.evaluate((to) => scrollTo(0, to), y);
    await page.waitForTimeout(50);
  }
  await page.evaluate(() => scrollTo(0, 0));
  await page.waitForTimeout(100);
}

// For each panel a digest of its pixels, and how many colours it has.
export const painted = (page) => page.evaluate(() => [...document.querySelectorAll(".plot")].map((plot) => {
  const canvas = plot.querySelector("canvas");
  if (!canvas || !canvas.width || !canvas.height) return { digest: 0, colours: 0 };
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const pixels = new Uint32Array(data.buffer);
  const colours = new Set();
  let digest = 7;
  for (const pixel of pixels) { digest = (Math.imul(digest, 31) + pixel) | 0; if (colours.size < 50) colours.add(pixel); }
  return { digest, colours: colours.size };
}));

// Nothing serious by axe-core; what else it finds is said.
export async function judge(where, page) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => axe.run());
  for (const { id, impact, nodes, help } of violations) {
    const isSerious = ["serious", "critical"].includes(impact);
    check(where, !isSerious, `axe-core: ${id} (${impact}): ${help}: ${nodes.slice(0, 3).map((node) => node.html.slice(0, 200)).join(" | ")}`);
    if (!isSerious) console.log(`  ${where}: ${id} (${impact}), ${nodes.length} times`);
  }
}

// Says how many checks held, and ends.
export async function end(what) {
  await browser.close();
  console.log(`${what}: ${checks - failures.length} passed, ${failures.length} failed`);
  process.exit(failures.length ? 1 : 0);
}
