-- A session with Neovim as the client, run by test.sh in a copy of models/.

dofile(os.getenv("DGD_NVIM"))
vim.cmd("filetype on")

local function fail(message)
  io.stderr:write(message .. "\n")
  vim.cmd("cquit 1")
end

local function ask(method, params)
  local answers = vim.lsp.buf_request_sync(0, method, params, 10000)
  for _, answer in pairs(answers or {}) do
    if answer.err then
      fail(method .. ": " .. vim.inspect(answer.err))
    end
    return answer.result
  end
  fail("no answer to " .. method)
end

vim.cmd("edit mud_circulation.dgd")
if not vim.wait(10000, function()
  return next(vim.lsp.buf_get_clients(0)) ~= nil
end) then
  fail("the server does not start")
end

-- What is under the cursor.
vim.fn.search("^state h_r")
vim.fn.search("h_r")
local params = vim.lsp.util.make_position_params()
local hover = ask("textDocument/hover", params)
if not hover.contents.value:find("state h_r", 1, true) then
  fail("hover says: " .. vim.inspect(hover))
end

-- A new name reaches the effects.
params.newName = "κ_level"
local edit = ask("textDocument/rename", params)
if vim.tbl_count(edit.changes) < 3 then
  fail("renamed in too few files: " .. vim.inspect(vim.tbl_keys(edit.changes)))
end
vim.lsp.util.apply_workspace_edit(edit, "utf-16")
vim.cmd("wall")

-- A mistake is told, as it is typed, behind a Greek letter.
vim.api.nvim_buf_set_lines(0, -1, -1, false, { "let τ_x = κ_level + κ_levl" })
local function mistakes()
  return vim.diagnostic.get(0)
end
if not vim.wait(10000, function()
  return #mistakes() == 1
end) then
  fail("mistakes: " .. vim.inspect(mistakes()))
end
local line = vim.api.nvim_buf_get_lines(0, -2, -1, false)[1]
local col = mistakes()[1].col
if line:sub(col + 1) ~= "κ_levl" then
  fail("the mistake stands at column " .. col .. " of " .. line)
end
vim.cmd("qall!")
