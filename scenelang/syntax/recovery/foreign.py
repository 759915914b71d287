"""What people write out of habit, from OpenSCAD, GLSL, JavaScript and Python, and what is written here."""

from __future__ import annotations

from functools import lru_cache, partial
from typing import Final

from scenelang.diagnostics.suggest import ranked
from scenelang.records import Record
from scenelang.syntax.tables import tables

OPERATORS: Final = {"and": "&&", "or": "||", "not": "!", "mod": "%"}
"""Operators that other languages write as words."""

HEADS: Final = (
    dict.fromkeys(("function", "func", "fun", "def", "define"), "fn")
    | dict.fromkeys(("var", "const", "float", "int", "bool", "vec2", "vec3"), "let")
    | dict.fromkeys(("include", "use", "require"), "import")
    | {"uniform": "param", "foreach": "for", "macro": "module", "class": "module"}
)
"""Words that begin statements in other languages, and the keyword that begins them here."""


@lru_cache(maxsize=256)
def keywords_near(text: str) -> tuple[str, ...]:
    """Keywords that a word may have been meant for, nearest first."""
    words = [word for word in tables().literals if word.isalpha()]
    return tuple(word for _, word in ranked(text, words, max(1, len(text) // 3)))


class Habit(Record):
    """One habit."""

    pattern: str  # what is written (see `syntax.recovery.patterns`)
    meant: str  # what is written here; also read in its place, so that the rest can be checked
    message: str  # the fact; names and words that the pattern has found may stand in it
    help: str | None = None
    code: str = "E0133"
    safe: bool = True  # whether ``meant`` is sure to mean the same, and so is a fix


_unsafe: Final = partial(Habit, safe=False)
_LOOP: Final = "`for` takes a range or a vector"
_PASSES: Final = "write for (<i> in 0..<n) { … }"
_BRACES: Final = "blocks stand in braces"
_FUNCTION: Final = "a function is `fn` and one expression"
_PARENTHESES: Final = "missing parentheses"
_TYPES: Final = "names have no types"
_RANGE: Final = "ranges are written with `..`"
ONCE: Final = "`<n>` cannot be changed"
ONCE_HELP: Final = "names keep their values; bind another one with let, or count with for (i in 0..<n) { … }"
_BRACKETS: Final = "vectors stand in brackets"
_WIDTH: Final = "the width of a blend stands with `smooth`, `subtract` or `intersect`: smooth(k = 0.3) { … }"
_BLOCKS: Final = "write camera(eye = [0, 1, 6]); light(position = [2, 4, 3]); sphere { translate(0, 1, 0); }"
_HOLDS: Final = "the loop stands in its block: <node> { square; for (i in 0..3) { star; } }"
_NAMED: Final = "a material is named by `let`"
_CAMERA: Final = "write camera(eye = [0, 1, 6], target = [0, 0, 0]);"
_DRAWING: Final = "a drawing becomes a shape: scenelang learn drawing.svg -o zoo.safetensors"
_LISTED: Final = "vectors are not made by loops"
_WRITTEN: Final = (
    "write the items out, or draw in a loop: for (i in 0..<n) { s.disc(0.1) { translate(i, 0); } }"
)
_COMMAS: Final = "`,` between statements"
_JOINED: Final = "objects are joined by words"
_ARGUED: Final = "`<node>` takes no objects as arguments"
_NEW: Final = "objects are drawn where they stand"
_METHOD: Final = "transforms stand in the block of what they move"
_STANDS: Final = "objects stand in its block: <node> { square; star; }"
_VALUE: Final = "objects are not values"
_MODULE: Final = "a piece of scene to use again is module <n>() { … }, and is drawn by <n>();"
_ARGUMENTS: Final = "a material takes no arguments"
_COLOUR: Final = "its colour stands in its block: material <n> { color(#d33); }"
_OPERATIONS: Final = "a material's colour stands in its block"
_CONSTANT: Final = "a colour is not a material"
_UNNAMED: Final = "a scene in 2D has `flat`, one in 3D `diffuse` and `volumetric`"
_PATH: Final = "files are imported by their path"
_IMPORTED: Final = 'write import "std/shapes" as s; and what it has as s.disc(0.3);'
_IMPORT: Final = "functions are there without an import"

HABITS: Final = (
    # loops and conditions
    Habit("for (<i> = [<A>:<S>:<B>])", "for (<i> in <A>..<B> step <S>)", _LOOP),
    Habit("for (<i> = [<A>:<B>])", "for (<i> in <A>..<B>)", _LOOP),
    Habit("for (<let?> <i> = <A>; <i> < <B>; <i>++)", "for (<i> in <A>..<<B>)", _LOOP, code="E0126"),
    Habit("for (<let?> <i> = <A>; <i> <= <B>; <i>++)", "for (<i> in <A>..<B>)", _LOOP, code="E0126"),
    _unsafe("for (<let?> <i> = <A>; <B?>; <C?>)", "for (<i> in BAD_EXPRESSION)", _LOOP, _PASSES, "E0126"),
    Habit("for (<let?> <i> <=|of|in> <E>)", "for (<i> in <E>)", _LOOP),
    Habit("for <i> in <E>: <BODY>", "for (<i> in <E>) { <BODY> }", _BRACES),
    Habit("if <E>: <BODY>", "if (<E>) { <BODY> }", _BRACES),
    Habit("<control> <E> {", "<control> (<E>) {", _PARENTHESES, code="E0107"),
    Habit("<elif> <E>: <BODY>", "<elif> (<E>) { <BODY> }", _BRACES),
    Habit("<elif> <E> {", "<elif> (<E>) {", _PARENTHESES, "it is `else if (…) { … }` here", "E0107"),
    Habit("<A> if <C> else <B>", "<C> ? <A> : <B>", "`if` does not choose between values"),
    _unsafe(
        "for (<i>, <v> in <E>)",
        "for (<i> in <E>)",
        "a loop has one name",
        "count with for (<i> in 0..<len(v)) and take v[<i>]",
    ),
    _unsafe("<node> <for|if> <LINE> {", "BAD_HEAD {", "`<node>` joins no loop", _HOLDS),
    _unsafe("<node>(<P>) <for|if> <LINE> {", "BAD_HEAD {", "`<node>` joins no loop", _HOLDS),
    _unsafe(
        "let (<P>) <LINE?>", "BAD_HEAD", "`let` has no parentheses", "write let x = 1; before what uses it"
    ),
    # functions and modules
    Habit("<fn> <f>(<PARAMS?>) { return <E> <;?> }", "fn <f>(<PARAMS>) = <E>;", _FUNCTION),
    Habit("<fn> <f>(<PARAMS?>): return <LINE> <;?>", "fn <f>(<PARAMS>) = <LINE>;", _FUNCTION),
    _unsafe("def <f>(<P?>): <BODY>", "BAD_STATEMENT", _BRACES, "write module <f>() { … }"),
    Habit("<fn> <f>(<PARAMS?>) <=|-> > <E>;", "fn <f>(<PARAMS>) = <E>;", _FUNCTION),
    _unsafe("<fn> <f>(<P?>) <BLOCK>", "BAD_STATEMENT", _FUNCTION, "write fn <f>(x) = x ^ 2;"),
    _unsafe("<fn> <f>(<P?>) = <BLOCK> <;?>", "BAD_STATEMENT", _FUNCTION, "write fn <f>(x) = x ^ 2;"),
    _unsafe(
        "void <f>(<P?>) <BLOCK>",
        "BAD_STATEMENT",
        "nothing is called by itself",
        "objects stand at top level; a piece of scene to use again is module <f>() { … }",
    ),
    Habit("<let> <f> = (<PARAMS?>) => <E>;", "fn <f>(<PARAMS>) = <E>;", _FUNCTION),
    Habit("<let> <f> = <x> => <E>;", "fn <f>(<x>) = <E>;", _FUNCTION),
    Habit("<let> <f> = lambda <P?>: <E>;", "fn <f>(<P>) = <E>;", _FUNCTION),
    Habit("<let> <f> = function(<P?>) { return <E> <;?> } <;?>", "fn <f>(<P>) = <E>;", _FUNCTION),
    Habit("<let> <f>(<PARAMS?>) = <E>;", "fn <f>(<PARAMS>) = <E>;", _FUNCTION),
    Habit("module <f>(<P?>) = <E>;", "fn <f>(<P>) = <E>;", "`module` where `fn` belongs", code="E0130"),
    Habit("fn <f>(<PARAMS>) = <E>;", "fn <f>(<PARAMS>) = <E>;", _TYPES),
    Habit("module <f>(<PARAMS>) {", "module <f>(<PARAMS>) {", _TYPES),
    Habit("<f>(<PARAMS?>) = <E>;", "fn <f>(<PARAMS>) = <E>;", "missing `fn` before `<f>`", code="E0126"),
    Habit("fn <f> <P> = <E>;", "fn <f>(<P>) = <E>;", _PARENTHESES, code="E0107"),
    Habit("module <f> <P> {", "module <f>(<P>) {", _PARENTHESES, code="E0107"),
    # names
    Habit("const <type> <n> = <E>;", "let <n> = <E>;", _TYPES),
    Habit("<let> <n>: <t> = <E>;", "let <n> = <E>;", _TYPES),
    Habit("uniform <type> <n> = <E>;", "param <n> = <E>;", "it is `param` here"),
    _unsafe(
        "uniform <type?> <n>;",
        "BAD_STATEMENT",
        "`<n>` has no value",
        "write param <n> = 0.5 in 0..1; the time is t, after animate(seconds = 2, fps = 24);",
    ),
    Habit("param <n> = <E> in (<A>, <B>);", "param <n> = <E> in <A>..<B>;", _RANGE),
    Habit("<call> <=|:> (<E>);", "<call>(<E>);", "`<call>` is called, not set"),
    Habit("<call> <=|:> <E>;", "<call>(<E>);", "`<call>` is called, not set"),
    Habit("<n>: <E>;", "<n>(<E>);", "`<n>` is called, not set"),
    Habit("<n> = <LINE> <;?>", "let <n> = <LINE>;", "missing `let` before `<n>`", code="E0126"),
    Habit("<n> = <E>;", "let <n> = <E>;", "missing `let` before `<n>`", code="E0126"),
    _unsafe("<n> <+|-|*|/|%> = <E>;", "let <n> = BAD_EXPRESSION;", ONCE, ONCE_HELP),
    _unsafe("<n>++;", "let <n> = BAD_EXPRESSION;", ONCE, ONCE_HELP),
    _unsafe("<n>--;", "let <n> = BAD_EXPRESSION;", ONCE, ONCE_HELP),
    _unsafe("<n>[<I>] = <E>;", "let <n> = BAD_EXPRESSION;", ONCE, ONCE_HELP),
    # blocks
    _unsafe("new <LINE> <;?>", "BAD_STATEMENT", _NEW, "write sphere { scale(0.5); }"),
    _unsafe("<let> <n> = new <LINE> <;?>", "BAD_STATEMENT", _VALUE, _MODULE),
    _unsafe("<let> <n> = <object> <BLOCK> <;?>", "BAD_STATEMENT", _VALUE, _MODULE),
    _unsafe("<let> <n> = <node>(<P?>) <;?>", "BAD_STATEMENT", _VALUE, _MODULE),
    Habit("<object>().<call>(<P?>);", "<object> { <call>(<P>); }", _METHOD),
    _unsafe("<object>().<LINE> <;?>", "BAD_STATEMENT", _METHOD, "square { scale(0.5); translate(1, 0); }"),
    Habit("<n> <o> }", "<n>; <o>; }", "missing `;`", code="E0102"),
    Habit("<difference|minus|without> <o>", "subtract <o>", "it is `subtract` here"),
    Habit("<blend|smin> <o>", "smooth <o>", "it is `smooth` here"),
    Habit("intersection <o>", "intersect <o>", "it is `intersect` here"),
    Habit("<n> - <o>;", "subtract { <n>; <o>; }", _JOINED),
    Habit("<n> + <o>;", "union { <n>; <o>; }", _JOINED),
    Habit("<n>, <o> }", "<n>; <o>; }", _COMMAS),
    _unsafe("<n>, <LINE> }", "BAD_STATEMENT }", _COMMAS, "every statement ends with `;`"),
    Habit("<n> <VALUES>;", "<n>(<VALUES>);", _PARENTHESES, code="E0107"),
    Habit("<node>(<A>, <B>);", "<node> { <A>; <B>; }", _ARGUED, _STANDS),
    Habit("<node>(<A>, <B>, <C>);", "<node> { <A>; <B>; <C>; }", _ARGUED, _STANDS),
    _unsafe("<node>(<P>);", "BAD_STATEMENT", _ARGUED, _STANDS),
    Habit("<node>()", "<node>", "`<node>` takes no arguments"),
    _unsafe("group(<P>) {", "group {", "`group` takes no arguments", "a name stands in a comment: // wheels"),
    _unsafe("<node>(<P>) {", "<node> {", "`<node>` takes no arguments", _WIDTH),
    _unsafe("< <A>, <B>, <C> > <LINE?>", "BAD_STATEMENT", _BRACKETS, _BLOCKS),
    _unsafe("< <A>, <B>, <C> > <LINE?> <BLOCK>", "BAD_STATEMENT", _BRACKETS, _BLOCKS),
    _unsafe("< <n> <LINE>", "BAD_STATEMENT", "this is SVG or HTML", _DRAWING),
    _unsafe("<n> < <A>, <B>, <C> > <LINE?>", "BAD_STATEMENT", _BRACKETS, _BLOCKS),
    Habit("<call> <rgb|srgb> < <A>, <B>, <C> >", "<call>([<A>, <B>, <C>]);", _BRACKETS),
    Habit("<call> <rgb|srgb> < <A>, <B>, <C> >;", "<call>([<A>, <B>, <C>]);", _BRACKETS),
    Habit(
        "material { <call>(",
        "material <material> { <call>(",
        "material without a name",
        _UNNAMED,
    ),
    Habit("material <=|:?> <VALUES>;", "material <material> { color(<VALUES>); }", _CONSTANT, _UNNAMED),
    Habit("material(<VALUES>);", "material <material> { color(<VALUES>); }", _CONSTANT, _UNNAMED),
    Habit("material <n>();", "material <n>;", _ARGUMENTS),
    _unsafe("material <n>(<A>, <P>);", "material <n>;", _ARGUMENTS, _COLOUR),
    Habit("material <n>(color = <E>);", "material <n> { color(<E>); }", _ARGUMENTS, _COLOUR),
    Habit("material <n>(<E>);", "material <n> { color(<E>); }", _ARGUMENTS, _COLOUR),
    Habit("material <m> = <n> <BLOCK> <;?>", "let <m> = material <n> <BLOCK>;", _NAMED),
    Habit("material <n> <VALUES>;", "material <n> { color(<VALUES>); }", _OPERATIONS),
    _unsafe(
        "<location|look_at|angle> [<A>] <LINE?> <;?>", "BAD_STATEMENT", "a camera has arguments", _CAMERA
    ),
    Habit("material <n> <,?> color(<E>);", "material <n> { color(<E>); }", _OPERATIONS),
    Habit("<let> <m> = material <n>();", "let <m> = material <n>;", _ARGUMENTS),
    _unsafe("<let> <m> = material <n>(<A>, <P>);", "let <m> = material <n>;", _ARGUMENTS, _COLOUR),
    Habit("<let> <m> = material <n>(color = <E>);", "let <m> = material <n> { color(<E>); };", _ARGUMENTS),
    Habit("<let> <m> = material <n>(<E>);", "let <m> = material <n> { color(<E>); };", _ARGUMENTS, _COLOUR),
    Habit("material = <n>;", "material <n>;", "`material` is not set"),
    Habit("material(<n>)", "material <n>", "a material's name stands without parentheses"),
    # expressions
    _unsafe("[for <E>]", "BAD_EXPRESSION", _LISTED, _WRITTEN),
    _unsafe("[<E> for <F>]", "BAD_EXPRESSION", _LISTED, _WRITTEN),
    Habit("[<A>:<S>:<B>]", "<A>..<B> step <S>", _RANGE),
    Habit("[<A>:<B>]", "<A>..<B>", _RANGE),
    Habit("(<A>, <E>)", "[<A>, <E>]", _BRACKETS),
    Habit("(<A>, <B>, <C>)", "[<A>, <B>, <C>]", _BRACKETS),
    Habit("<rgb|srgb> < <A>, <B>, <C> >", "[<A>, <B>, <C>]", _BRACKETS),
    Habit("< <A>, <B>, <C> >", "[<A>, <B>, <C>]", _BRACKETS),
    # settings and imports
    Habit("canvas(<A> x <B>);", "canvas(<A>, <B>);", "sides are separated by a comma"),
    Habit("import <library> <LINE?> <;?>", "", _IMPORT),
    Habit("from <library> import <LINE> <;?>", "", _IMPORT),
    Habit("import <n> from <A>;", "import <A> as <n>;", "the path comes first"),
    _unsafe("import <n>.<m>;", "BAD_STATEMENT", _PATH, _IMPORTED),
    _unsafe("import <n>;", "BAD_STATEMENT", _PATH, _IMPORTED),
    _unsafe("from <n> import <LINE> <;?>", "BAD_STATEMENT", _PATH, _IMPORTED),
    _unsafe("import <A>;", "import <A> as s;", "missing `as` and a name", _IMPORTED, "E0126"),
)
"""Habits that do not parse. The first that fits, and after which more of the text reads, is taken.

Those of code E0133 may depend on all of a text, others on their statement alone: an editor reads no more
of a text again than it must.
"""
