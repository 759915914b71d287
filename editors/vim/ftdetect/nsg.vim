autocmd BufRead,BufNewFile *.nsg setfiletype nsg
