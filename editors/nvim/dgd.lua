-- Starts `dgd lsp` for .dgd files. For Neovim 0.7 and later.

vim.api.nvim_create_autocmd({ "BufRead", "BufNewFile" }, {
  pattern = "*.dgd",
  callback = function()
    vim.bo.filetype = "dgd"
    vim.bo.commentstring = "# %s"
  end,
})

-- One server for each folder.
local clients = {}

local function root_of(file)
  local git = vim.fn.finddir(".git", vim.fn.fnamemodify(file, ":p:h") .. ";")
  if git ~= "" then
    return vim.fn.fnamemodify(git, ":p:h:h")
  end
  return vim.fn.fnamemodify(file, ":p:h")
end

vim.api.nvim_create_autocmd("FileType", {
  pattern = "dgd",
  callback = function(event)
    local root = root_of(event.match == "dgd" and vim.api.nvim_buf_get_name(event.buf) or event.file)
    if not clients[root] then
      clients[root] = vim.lsp.start_client({ name = "dgd", cmd = { "dgd", "lsp" }, root_dir = root })
    end
    vim.lsp.buf_attach_client(event.buf, clients[root])
  end,
})

-- Code lenses, where `vim.lsp.codelens` is used: a terminal with the command, to which data and options are added.
vim.lsp.commands = vim.lsp.commands or {}
for _, command in ipairs({ "simulate", "sensitivity", "discover" }) do
  vim.lsp.commands["dgd." .. command] = function(lens)
    vim.cmd("split | terminal")
    vim.fn.chansend(vim.b.terminal_job_id, "dgd " .. command .. " " .. vim.fn.shellescape(lens.arguments[1]) .. " ")
  end
end
