#!/usr/bin/env node
// Writes every model as a test of the grammar: `models.mjs DGD MODELS FOLDER`. What each word is, `dgd lsp` says by the
// compiler's own reading; below each line of a model stands which scope that is in the grammar, and
// vscode-tmgrammar-test compares. So the colours of a word never differ between the two.
import { spawn } from "node:child_process";
import { mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { basename, join, relative, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [dgd, models, folder] = process.argv.slice(2);
const server = spawn(dgd, ["lsp"], { stdio: ["pipe", "pipe", "inherit"] });
let waiting = Buffer.alloc(0);
let next = 0;
const answers = new Map();

server.stdout.on("data", (chunk) => {
  waiting = Buffer.concat([waiting, chunk]);
  for (;;) {
    const head = waiting.indexOf("\r\n\r\n");
    if (head < 0) return;
    const length = Number(/Content-Length: (\d+)/i.exec(waiting.subarray(0, head).toString())[1]);
    if (waiting.length < head + 4 + length) return;
    const message = JSON.parse(waiting.subarray(head + 4, head + 4 + length).toString());
    waiting = waiting.subarray(head + 4 + length);
    answers.get(message.id)?.(message.result);
  }
});

function tell(method, params, id) {
  const body = JSON.stringify({ jsonrpc: "2.0", id, method, params });
  server.stdin.write(`Content-Length: ${Buffer.byteLength(body)}\r\n\r\n${body}`);
}

function ask(method, params) {
  next += 1;
  const id = next;
  tell(method, params, id);
  return new Promise((answer) => answers.set(id, answer));
}

// All models below a folder.
function files(of) {
  return readdirSync(of, { withFileTypes: true }).flatMap((entry) => {
    const path = join(of, entry.name);
    return entry.isDirectory() ? files(path) : path.endsWith(".dgd") ? [path] : [];
  });
}

const DECLARING =
  /^(model|effect|part|variant|modes|function|equation|constant|parameter|input|state|unknown|size|let|output)$/;

// The scope of a word in the grammar; nothing where the grammar cannot know it.
function scope(kind, text, isFirst) {
  switch (kind) {
    case "comment":
      return text.startsWith("///") ? "comment.line.documentation.dgd" : "comment.line.number-sign.dgd";
    case "string":
      return "string.quoted.double.dgd";
    case "number":
      return "constant.numeric.dgd";
    case "type":
      return "support.type.unit.dgd";
    case "keyword":
      return isFirst && DECLARING.test(text) ? "keyword.declaration.dgd" : undefined;
    default:
      return undefined;
  }
}

const root = pathToFileURL(resolve(models)).href;
const { capabilities } = await ask("initialize", { rootUri: root, capabilities: {} });
const kinds = capabilities.semanticTokensProvider.legend.tokenTypes;
tell("initialized", {});
mkdirSync(folder, { recursive: true });
let n = 0;
for (const path of files(models).sort()) {
  const text = readFileSync(path, "utf8");
  const uri = pathToFileURL(resolve(path)).href;
  tell("textDocument/didOpen", { textDocument: { uri, languageId: "dgd", version: 1, text } });
  const { data } = await ask("textDocument/semanticTokens/full", { textDocument: { uri } });
  const lines = text.split("\n");
  const below = lines.map(() => []);
  let [line, column] = [0, 0];
  for (let at = 0; at < data.length; at += 5) {
    column = data[at] > 0 ? data[at + 1] : column + data[at + 1];
    line += data[at];
    const word = lines[line].slice(column, column + data[at + 2]);
    const isFirst = lines[line].slice(0, column).trim() === "";
    const name = scope(kinds[data[at + 3]], word, isFirst);
    if (name === undefined) continue;
    n += 1;
    const mark = column === 0 ? `# <${"-".repeat(word.length)}` : `#${" ".repeat(column - 1)}${"^".repeat(word.length)}`;
    below[line].push(`${mark} ${name}`);
  }
  const name = relative(models, path).replaceAll("/", "_");
  const title = `# SYNTAX TEST "source.dgd" "${basename(path)}"`;
  writeFileSync(join(folder, name), [title, ...lines.flatMap((one, at) => [one, ...below[at]])].join("\n"));
}
await ask("shutdown", null);
tell("exit", null);
console.log(`${n} words of ${models}`);
