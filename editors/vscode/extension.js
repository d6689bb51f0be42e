// Starts `dgd lsp` for .dgd files.

const { commands, window, workspace } = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

// Writes a command into a terminal; data and options are the user's.
function type(command, path) {
  const terminal = window.createTerminal("dgd");
  terminal.show();
  terminal.sendText(`${workspace.getConfiguration("dgd").get("path")} ${command} '${path}' `, false);
}

function activate(context) {
  for (const command of ["simulate", "sensitivity", "discover"]) {
    const run = (path) => type(command, path);
    context.subscriptions.push(commands.registerCommand(`dgd.${command}`, run));
  }
  const command = workspace.getConfiguration("dgd").get("path");
  const server = { command, args: ["lsp"] };
  client = new LanguageClient("dgd", "dgd", server, { documentSelector: [{ language: "dgd" }] });
  return client.start();
}

function deactivate() {
  return client?.stop();
}

module.exports = { activate, deactivate };
