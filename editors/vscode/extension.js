// Starts `dgd lsp` for .dgd files.

const { workspace } = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

function activate() {
  const command = workspace.getConfiguration("dgd").get("path");
  const server = { command, args: ["lsp"] };
  client = new LanguageClient("dgd", "dgd", server, { documentSelector: [{ language: "dgd" }] });
  return client.start();
}

function deactivate() {
  return client?.stop();
}

module.exports = { activate, deactivate };
