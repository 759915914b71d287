"""The language server, `scenelang lsp`: pure functions over documents by feature, and a thin pygls server."""
