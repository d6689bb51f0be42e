#!/usr/bin/env node
// Stands in for `dgd` in PATH: hands everything on to the program of $DGD and writes what the editor sends to the file
// $DGD_SESSION, a message a line, with $DGD_ROOT as `ROOT`. The tests of dgd-lsp play such sessions again.
import { spawn } from "node:child_process";
import { appendFileSync } from "node:fs";

const server = spawn(process.env.DGD, process.argv.slice(2), { stdio: ["pipe", "inherit", "inherit"] });
let waiting = Buffer.alloc(0);

function note(chunk) {
  waiting = Buffer.concat([waiting, chunk]);
  for (;;) {
    const head = waiting.indexOf("\r\n\r\n");
    if (head < 0) return;
    const length = Number(/Content-Length: (\d+)/i.exec(waiting.subarray(0, head).toString())[1]);
    if (waiting.length < head + 4 + length) return;
    const body = waiting.subarray(head + 4, head + 4 + length).toString();
    const message = body.replaceAll(process.env.DGD_ROOT, "ROOT");
    appendFileSync(process.env.DGD_SESSION, `{"editor":${message}}\n`);
    waiting = waiting.subarray(head + 4 + length);
  }
}

process.stdin.on("data", (chunk) => {
  note(chunk);
  server.stdin.write(chunk);
});
process.stdin.on("end", () => server.stdin.end());
server.on("exit", (code) => process.exit(code ?? 1));
