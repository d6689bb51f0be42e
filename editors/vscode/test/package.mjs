#!/usr/bin/env node
// Looks into an extension that was packed and unpacked again: `package.mjs FOLDER`. All that its manifest names is there,
// and it starts: beside a `vscode` that stands in for the editor's, it loads what it brings along, registers the commands
// of the code lenses, and begins `dgd lsp`.
import assert from "node:assert/strict";
import { existsSync, readdirSync, readFileSync } from "node:fs";
import Module, { createRequire } from "node:module";
import { join, resolve } from "node:path";

const folder = resolve(process.argv[2], "extension");
const manifest = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
const { languages, grammars } = manifest.contributes;
const named = [manifest.main, ...languages.map((one) => one.configuration), ...grammars.map((one) => one.path)];
for (const file of named) {
  assert(existsSync(join(folder, file)), `${file} is not in the package`);
}
const expected = "LICENSE-APACHE LICENSE-MIT extension.js language-configuration.json node_modules package.json readme.md syntaxes";
assert.equal(readdirSync(folder).sort().join(" "), expected);
assert.deepEqual(languages[0].extensions, [".dgd"]);
assert.equal(grammars[0].scopeName, "source.dgd");

// Whatever is asked of the editor, there is something: a class, a function, an object.
const anything = new Proxy(class {}, {
  get: (target, key) => (key === "prototype" || key === Symbol.toPrimitive ? target[key] : anything),
  apply: () => anything,
});
const registered = new Map();
const written = [];
const editor = {
  commands: { registerCommand: (name, run) => registered.set(name, run) },
  window: { createTerminal: () => ({ show() {}, sendText: (...line) => written.push(line) }) },
  workspace: { getConfiguration: () => ({ get: (key) => manifest.contributes.configuration.properties[`dgd.${key}`].default }) },
};
const vscode = new Proxy(editor, { get: (own, key) => own[key] ?? anything });
const load = Module._load;
Module._load = (name, ...rest) => (name === "vscode" ? vscode : load(name, ...rest));

const require = createRequire(join(folder, "package.json"));
const client = require("vscode-languageclient/node");
const started = [];
client.LanguageClient = class {
  constructor(...all) {
    started.push(all);
  }
  start() {
    return Promise.resolve();
  }
};
const extension = require(join(folder, manifest.main));
await extension.activate({ subscriptions: [] });
assert.deepEqual([...registered.keys()], ["dgd.simulate", "dgd.sensitivity", "dgd.discover"]);
registered.get("dgd.simulate")("/a model.dgd");
assert.deepEqual(written, [["dgd simulate '/a model.dgd' ", false]]);
const [[, , server, options]] = started;
assert.deepEqual(server, { command: "dgd", args: ["lsp"] });
assert.deepEqual(options.documentSelector, [{ language: "dgd" }]);
console.log("Visual Studio Code's package: 1 passed, 0 failed");
