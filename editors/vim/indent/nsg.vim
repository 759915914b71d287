" Two spaces a bracket; braces and brackets as in C.
if exists('b:did_indent')
  finish
endif
let b:did_indent = 1
setlocal cindent cinoptions=L0,(s,m1,J1,j1,W2 cinkeys=0{,0},0),0],!^F,o,O,e
let b:undo_indent = 'setlocal cindent< cinoptions< cinkeys<'
