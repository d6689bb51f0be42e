#!/usr/bin/env node
// Stands in for `dgd` in PATH: hands everything on to the program of $DGD and writes what the editor sends to the file
// $DGD_SESSION, a message a line, with $DGD_ROOT as `ROOT`. The tests of dgd-lsp play such sessions again.
import { spawn } from "node:child_process";
import { appendFileSync } from "node:fs";

const server = spawn(process.env.DGD, process.argv.slice(2), { stdio: ["pipe", "inherit", "inherit"] });
let waiting = Buffer.alloc(0);
let left = false;

function write(message) {
  // A number of the machine on which it was recorded.
  if (message.params?.processId) message.params.processId = null;
  const line = JSON.stringify({ editor: message }).replaceAll(process.env.DGD_ROOT, "ROOT");
  appendFileSync(process.env.DGD_SESSION, `${line}\n`);
  left = message.method === "exit";
}

function note(chunk) {
  waiting = Buffer.concat([waiting, chunk]);
  for (;;) {
    const head = waiting.indexOf("\r\n\r\n");
    if (head < 0) return;
    const length = Number(/Content-Length: (\d+)/i.exec(waiting.subarray(0, head).toString())[1]);
    if (waiting.length < head + 4 + length) return;
    write(JSON.parse(waiting.subarray(head + 4, head + 4 + length).toString()));
    waiting = waiting.subarray(head + 4 + length);
  }
}

process.stdin.on("data", (chunk) => {
  note(chunk);
  server.stdin.write(chunk);
});
process.stdin.on("end", () => server.stdin.end());
server.on("exit", (code) => {
  // An editor that is quit may not wait to say it.
  if (!left) write({ jsonrpc: "2.0", method: "exit" });
  process.exit(code ?? 1);
});
