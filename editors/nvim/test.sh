#!/usr/bin/env bash
# Debian's Neovim as the client of `dgd lsp`: hover, a rename through all files, and a mistake while typing.
# `.ci/editors` calls it, with Neovim installed and `dgd` in PATH.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cp -r "$here/../../models" "$folder/models"
cd "$folder/models"
export DGD_NVIM="$here/dgd.lua"
timeout 120 nvim --headless --clean -n -S "$here/test.lua" </dev/null
# Every model is as sound as before.
find . -name '*.dgd' -not -path './lib/*' -print0 | xargs -0 -n1 dgd check >/dev/null 2>&1
echo "Neovim: 1 passed, 0 failed"
