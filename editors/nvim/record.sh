#!/usr/bin/env bash
# Records what Neovim sends to `dgd lsp` in session.lua, for the tests of dgd-lsp: `record.sh DGD`. Their answers are
# then written by `UPDATE_GOLDEN=1 cargo test -p dgd-lsp recorded`.
set -euo pipefail
DGD=$(realpath "$1")
here=$(cd "$(dirname "$0")" && pwd)
DGD_ROOT=$(mktemp -d)
trap 'rm -rf "$DGD_ROOT"' EXIT
DGD_SESSION=$here/../../dgd-lsp/sessions/neovim.jsonl
DGD_NVIM=$here/dgd.lua
export DGD DGD_ROOT DGD_SESSION DGD_NVIM
cp -r "$here/../../models" "$DGD_ROOT/models"
mkdir "$DGD_ROOT/bin"
ln -s "$here/record.mjs" "$DGD_ROOT/bin/dgd"
cd "$DGD_ROOT/models"
git init --quiet
rm -f "$DGD_SESSION"
PATH=$DGD_ROOT/bin:$PATH timeout 120 nvim --headless --clean -n -S "$here/session.lua" < /dev/null
wc -l "$DGD_SESSION"
