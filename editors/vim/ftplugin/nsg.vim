" Scenes of scenelang: comments, two spaces, `gq` and `=` through `scenelang fmt`.
if exists('b:did_ftplugin')
  finish
endif
let b:did_ftplugin = 1

setlocal commentstring=//\ %s comments=s1:/*,mb:*,ex:*/,:// iskeyword=@,48-57,_
setlocal expandtab shiftwidth=2 softtabstop=2 textwidth=100 formatoptions-=t formatoptions+=croql
setlocal suffixesadd=.nsg include=^\\s*import\\s\\+\"
setlocal makeprg=scenelang\ check\ --format\ concise\ %:S errorformat=%f:%l:%c:\ %m

" :NsgFormat lays the whole file out; a file with mistakes stays as it is.
function! s:Format() abort
  let l:lines = systemlist('scenelang fmt -', getline(1, '$'))
  if v:shell_error
    echohl ErrorMsg | echomsg get(l:lines, 0, 'scenelang fmt failed') | echohl None
    return
  endif
  let l:view = winsaveview()
  if len(l:lines) < line('$')
    silent execute (len(l:lines) + 1) . ',$delete _'
  endif
  call setline(1, l:lines)
  call winrestview(l:view)
endfunction
command! -buffer -bar NsgFormat call s:Format()

let b:undo_ftplugin = 'setlocal commentstring< comments< iskeyword< expandtab< shiftwidth< softtabstop<'
      \ . ' textwidth< formatoptions< suffixesadd< include< makeprg< errorformat< | delcommand NsgFormat'
