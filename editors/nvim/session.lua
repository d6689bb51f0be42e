-- What a user does in a few minutes, to be recorded by record.mjs. Nothing is written to a file.
vim.cmd("source " .. vim.fn.fnameescape(vim.env.DGD_NVIM))
vim.cmd("filetype on")

local function ask(method, params)
  vim.lsp.buf_request_sync(0, method, params, 10000)
end

local function here()
  return vim.lsp.util.make_position_params()
end

local function open(file)
  vim.cmd("edit! " .. file)
  vim.wait(10000, function()
    return next(vim.lsp.buf_get_clients(0)) ~= nil
  end)
end

-- Types a last line, and asks what can be written at its end.
local function type(line)
  vim.api.nvim_buf_set_lines(0, -1, -1, false, { line })
  vim.api.nvim_win_set_cursor(0, { vim.fn.line("$"), #line })
  vim.wait(300, function()
    return false
  end)
  local params = here()
  params.position.character = vim.str_utfindex(line)
  ask("textDocument/completion", params)
  ask("textDocument/signatureHelp", params)
  local range = vim.lsp.util.make_range_params()
  range.context = { diagnostics = {} }
  ask("textDocument/codeAction", range)
  vim.api.nvim_buf_set_lines(0, -2, -1, false, {})
end

local function whole()
  local params = { textDocument = vim.lsp.util.make_text_document_params() }
  for _, method in ipairs({ "documentSymbol", "codeLens", "foldingRange", "inlayHint", "semanticTokens/full", "formatting" }) do
    ask("textDocument/" .. method, params)
  end
end

open("pendulum.dgd")
vim.fn.search("^state theta")
vim.fn.search("theta")
ask("textDocument/hover", here())
ask("textDocument/definition", here())
local params = here()
params.context = { includeDeclaration = true }
ask("textDocument/references", params)
whole()
type("let ω_2 = 1 + thet")
type("equation der(theta) = ")
open("effects/pump_wear.dgd")
vim.fn.search("^replace")
vim.fn.search("c0")
ask("textDocument/hover", here())
local renamed = here()
renamed.newName = "κ_0"
ask("textDocument/rename", renamed)
whole()
type("add wear to ")
vim.cmd("qall!")
