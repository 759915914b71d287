-- Neovim 0.11 or newer: require this file, or copy it into your init.lua. Colours come from editors/vim.
vim.filetype.add({ extension = { nsg = "nsg" } })
vim.lsp.config("scenelang", {
  cmd = { "scenelang", "lsp" },
  filetypes = { "nsg" },
  root_markers = { ".git" },
  workspace_required = false,
  init_options = { scenelang = { inlayHints = { values = true, arguments = true } } },
})
vim.lsp.enable("scenelang")

-- Format on save.
vim.api.nvim_create_autocmd("BufWritePre", {
  pattern = "*.nsg",
  callback = function(event)
    vim.lsp.buf.format({ bufnr = event.buf, timeout_ms = 2000 })
  end,
})
