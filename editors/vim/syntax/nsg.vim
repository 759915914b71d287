" Scenes of scenelang.
if exists('b:current_syntax')
  finish
endif

syntax iskeyword @,48-57,_

" Calls: a name before `(` or `{`. Later rules win over earlier ones at the same place.
syntax match nsgCall /\<[A-Za-z_]\w*\>\ze\s*(/
syntax match nsgObject /\<[A-Za-z_]\w*\>\ze\s*{/
syntax match nsgOperator /\.\.<\?\|||\|&&\|[=!<>]=\|[-+*%^!?:=<>.]\|\/[\/*]\@!/
" Words, written by lab/docs/make_words.py.
syntax keyword nsgDeclare nsg model param let fn module import as
syntax keyword nsgControl for in step if else
syntax keyword nsgNode group chain union smooth subtract intersect
syntax keyword nsgMaterial material
syntax keyword nsgTruth true false
syntax keyword nsgConstant PI TAU X Y Z none
syntax keyword nsgAnimated t u frame frames
syntax match nsgSetting /\<\%(canvas\|background\|animate\|samples\|camera\|light\|ground\|sky\)\>\ze\s*(/
syntax match nsgTransform /\<\%(translate\|rotate\|scale\|shear\|matrix\|twirl\|bend\|twist\|displace\|grow\|shell\|flip\|color\|grayscale\|hue\|opacity\|glow\|density\|roughness\|stop\)\>\ze\s*(/
syntax match nsgFunction /\<\%(sin\|cos\|tan\|asin\|acos\|atan2\|abs\|min\|max\|clamp\|floor\|ceil\|round\|sqrt\|exp\|log\|mix\|smoothstep\|len\|str\|rand\|noise\|rgb\|hsv\)\>\ze\s*(/
syntax match nsgNumber /\<\d\+\%(\.\.\@!\d*\)\?\%([eE][-+]\?\d\+\)\?\%(deg\|rad\|turn\|ms\|s\)\?\w\@!/
syntax match nsgNumber /\w\@<!\.\d\+\%([eE][-+]\?\d\+\)\?\%(deg\|rad\|turn\|ms\|s\)\?\w\@!/
" End of words
syntax match nsgDefined /\%(\<\%(fn\|module\)\s\+\)\@<=[A-Za-z_]\w*/
syntax match nsgColor /#\%(\x\{6}\|\x\{3}\)\w\@!/
syntax match nsgEscape contained /\\["\\nt]/
syntax region nsgString start=/"/ skip=/\\./ end=/"\|$/ contains=nsgEscape
syntax keyword nsgTodo contained TODO FIXME XXX
syntax match nsgComment +//.*$+ contains=nsgTodo,@Spell
syntax region nsgComment start=+/\*+ end=+\*/+ contains=nsgTodo,@Spell fold

syntax sync ccomment nsgComment

highlight default link nsgDeclare Statement
highlight default link nsgControl Repeat
highlight default link nsgNode Structure
highlight default link nsgMaterial StorageClass
highlight default link nsgTruth Boolean
highlight default link nsgConstant Constant
highlight default link nsgAnimated Special
highlight default link nsgCall Identifier
highlight default link nsgObject Type
highlight default link nsgSetting PreProc
highlight default link nsgTransform Function
highlight default link nsgFunction Function
highlight default link nsgDefined Identifier
highlight default link nsgOperator Operator
highlight default link nsgNumber Number
highlight default link nsgColor Constant
highlight default link nsgString String
highlight default link nsgEscape SpecialChar
highlight default link nsgComment Comment
highlight default link nsgTodo Todo

let b:current_syntax = 'nsg'
