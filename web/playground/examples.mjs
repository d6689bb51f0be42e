// Copies the files of the examples into a folder: node examples.mjs FOLDER
import { copyFileSync, mkdirSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const folder = process.argv[2];
const root = fileURLToPath(new URL("../..", import.meta.url));
// Where a file lies, by the beginning of its name.
const PLACES = [
  ["motor/model.dgd", "bench/discovery_bank/domains/electrical/dc_motor/model.dgd"],
  ["motor/", "crates/dgd-cli/templates/motor/"],
  ["booster_stop.", "examples/data/booster_stop."],
  ["", "models/"],
];
const examples = JSON.parse(readFileSync(new URL("page/examples.json", import.meta.url), "utf8"));
for (const name of new Set(examples.flatMap(({ files, data, valid }) => [...files, data, valid].filter(Boolean)))) {
  const [begins, place] = PLACES.find(([begins]) => name.startsWith(begins));
  mkdirSync(dirname(join(folder, name)), { recursive: true });
  copyFileSync(join(root, place + name.slice(begins.length)), join(folder, name));
}
