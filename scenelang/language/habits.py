"""Habits from OpenSCAD, GLSL, JavaScript and Python: the pattern that people write, and its form here.

A habit is a pattern and its replacement, as texts with holes: ``for (<i> = [<A>:<B>])`` and
``for (<i> in <A>..<B>)``.

======================  ======================================================================
``<i>``                 one name
``<A>``                 text of one statement whose brackets match, up to what follows
``<in|of>``             one of these words or signs
``<type>``              one of the words that `_WORDS` has under this name
``<VALUES>``            as ``<A>``, where it begins with a number, a colour or a vector
``<LINE>``              the rest of the line, or of the statement on it
``<BODY>``              the same, or all lines below that stand further in
``<STMT>``              one statement with its ``;`` or block
``<BLOCK>``             a block with its braces
``<PARAMS>``            parameters; the replacement has them without their types
``…?`` before ``>``     may be missing
======================  ======================================================================
"""

from __future__ import annotations

import re
from bisect import bisect_left
from functools import cache, lru_cache, partial
from math import inf
from typing import Final

from scenelang.assets.records import Record
from scenelang.language.diagnostics import Fix, ranked
from scenelang.language.lexer import Report, Token, Tokens, reach
from scenelang.language.tables import END, tables
from scenelang.language.words import GEOMETRIES, NODES, OPERATIONS, TRANSFORMS

OPERATORS: Final = {"and": "&&", "or": "||", "not": "!", "mod": "%"}
"""Operators that other languages write as words."""

HEADS: Final = (
    dict.fromkeys(("function", "func", "fun", "def", "define"), "fn")
    | dict.fromkeys(("var", "const", "float", "int", "bool", "vec2", "vec3"), "let")
    | dict.fromkeys(("include", "use", "require"), "import")
    | {"uniform": "param", "foreach": "for", "macro": "module", "class": "module"}
)
"""Words that begin statements in other languages, and the keyword that begins them here."""

MAX_REPLAY: Final = 400
"""A statement with more tokens before the mistake is not tried again from its start."""

_FOLLOWED: Final = 80  # tokens behind a habit that are read to see whether it was one
_LONGEST: Final = 1000  # letters of a habit, without its block
_BEHIND: Final = ("BODY", "BLOCK", "STMT")  # holes at the end of a pattern, which tokens tell
_MOST: Final = 100  # mistakes of a file among which habits are looked for

_TYPES: Final = ("float", "int", "bool", "double", "number", "string", *(f"vec{n}" for n in "234"), "color")
_ELSEWHERE: Final = ("mirror", "resize", "offset", "multmatrix", "linear_extrude", "rotate_extrude", "hull")
_MOVES: Final = (*TRANSFORMS, "color", *_ELSEWHERE)
_WORDS: Final[dict[str, tuple[str, ...]]] = {
    "type": _TYPES,
    "fn": ("fn", "function", "func", "fun", "def", *_TYPES),
    "let": ("let", "var", "const", *_TYPES),
    "use": ("use", "include", "require"),
    "node": tuple(NODES),
    "object": (*NODES, *GEOMETRIES),
    "elif": ("elif", "elsif", "elseif"),
    "call": (*(TRANSFORMS | OPERATIONS), "canvas", "background"),
    "move": tuple(TRANSFORMS),
    "turn": tuple(TRANSFORMS),
    "before": _MOVES,
    "next": _MOVES,
    "block": (*NODES, "for", "if"),
    "control": ("for", "if"),
    "color": ("color", "colour"),
    "library": ("math", "numpy", "random", "sys", "os", "Math"),
}
"""Words that a hole of this name takes."""


@lru_cache(maxsize=256)
def keywords_near(text: str) -> tuple[str, ...]:
    """Keywords that a word may have been meant for, nearest first."""
    words = [word for word in tables().literals if word.isalpha()]
    return tuple(word for _, word in ranked(text, words, max(1, len(text) // 3)))


class Habit(Record):
    pattern: str  # what is written
    meant: str  # what is written here; also read in its place, so that the rest can be checked
    message: str  # the fact; words that the pattern has found may stand in it
    help: str | None = None
    code: str = "E0133"
    safe: bool = True  # whether ``meant`` is sure to mean the same, and so is a fix


_unsafe: Final = partial(Habit, safe=False)


_LOOP: Final = "`for` takes a range or a vector"
_PASSES: Final = "write for (<i> in 0..<n) { … }"
_BRACES: Final = "blocks stand in braces"
_FUNCTION: Final = "a function is `fn` and one expression"
_UNNAMED_FN: Final = "missing `fn` before `<f>`"
_SQUARE: Final = "write fn <f>(x) = x ^ 2;"
_PIECE_OF: Final = "write module <f>() { … }"
_PARENTHESES: Final = "missing parentheses"
_UNTYPED: Final = "names have no types"
_RANGE: Final = "ranges are written with `..`"
_CALLED: Final = "`<call>` is called, not set"
_BOUND: Final = "missing `let` before `<n>`"
_ONCE: Final = "`<n>` cannot be changed"
_NEW_NAME: Final = "names keep their values; bind another one with let, or count with for (i in 0..<n) { … }"
_BRACKETS: Final = "vectors stand in brackets"
_BLOCKS: Final = "write camera(eye = [0, 1, 6]); light(position = [2, 4, 3]); sphere { translate(0, 1, 0); }"
_JOINS: Final = "`<node>` joins no loop"
_HOLDS: Final = "the loop stands in its block: <node> { square; for (i in 0..3) { star; } }"
_LISTED: Final = "a vector is made by `for` before its values"
_COMMAS: Final = "`,` between statements"
_JOINED: Final = "objects are joined by words"
_ARGUED: Final = "`<node>` takes no objects as arguments"
_STANDS: Final = "objects stand in its block: <node> { square; star; }"
_METHOD: Final = "transforms stand in the block of what they move"
_VALUE: Final = "objects are not values"
_DRAWN: Final = "objects are drawn where they stand"
_MODULE: Final = "a piece of scene to use again is module <n>() { … }, and is drawn by <n>();"
_BEFORE: Final = "transforms stand behind what they apply to"
_INSIDE: Final = "it stands in the block, as in square { translate(1, 0); material flat { color(#d33); } }"
_ARGUMENTS: Final = "a material takes no arguments"
_OPERATIONS: Final = "a material's colour stands in its block"
_COLOUR: Final = "its colour stands in its block: material <n> { color(#d33); }"
_CONSTANT: Final = "a colour is not a material"
_UNNAMED: Final = "a scene in 2D has `flat`, one in 3D `diffuse` and `volumetric`"
_PATH: Final = "files are imported by their path"
_IMPORTED: Final = 'write import "std/shapes" as s; and what it has as s.disc(0.3);'
_IMPORT: Final = "functions are there without an import"
_MANDATORY: Final = "braces are mandatory here"

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
    _unsafe("for (<i>, <v> in <E>)", "for (<i> in <E>)", "a loop has one name", _PASSES),
    Habit("<control> (<E>) <STMT>", "<control> (<E>) { <STMT> }", "missing braces", _MANDATORY, "E0106"),
    Habit("else <STMT>", "else { <STMT> }", "missing braces", _MANDATORY, "E0106"),
    _unsafe("<node> <for|if> <LINE> {", "BAD_HEAD {", _JOINS, _HOLDS),
    _unsafe("<node>(<P>) <for|if> <LINE> {", "BAD_HEAD {", _JOINS, _HOLDS),
    _unsafe("let (<P>) <LINE?>", "BAD_HEAD", "`let` has no parentheses", "write let x = 1; before its use"),
    # functions and modules
    Habit("<fn> <f>(<PARAMS?>) { return <E> <;?> }", "fn <f>(<PARAMS>) = <E>;", _FUNCTION),
    Habit("<fn> <f>(<PARAMS?>): return <LINE> <;?>", "fn <f>(<PARAMS>) = <LINE>;", _FUNCTION),
    _unsafe("def <f>(<P?>): <BODY>", "BAD_STATEMENT", _BRACES, _PIECE_OF),
    Habit("<fn> <f>(<PARAMS?>) <=|-> > <E>;", "fn <f>(<PARAMS>) = <E>;", _FUNCTION),
    _unsafe("<fn> <f>(<P?>) <=?> <BLOCK>", "BAD_STATEMENT", _FUNCTION, _SQUARE),
    _unsafe("void <f>(<P?>) <BLOCK>", "BAD_STATEMENT", _FUNCTION, _PIECE_OF),
    Habit("<let> <f> = (<PARAMS?>) => <E>;", "fn <f>(<PARAMS>) = <E>;", _FUNCTION),
    Habit("<let> <f> = <x> => <E>;", "fn <f>(<x>) = <E>;", _FUNCTION),
    Habit("<let> <f> = lambda <P?>: <E>;", "fn <f>(<P>) = <E>;", _FUNCTION),
    Habit("<let?> <f>(<PARAMS?>) = <E>;", "fn <f>(<PARAMS>) = <E>;", _UNNAMED_FN, code="E0126"),
    Habit("module <f>(<P?>) = <E>;", "fn <f>(<P>) = <E>;", "`module` where `fn` belongs", code="E0130"),
    Habit("fn <f>(<PARAMS>) = <E>;", "fn <f>(<PARAMS>) = <E>;", _UNTYPED),
    Habit("module <f>(<PARAMS>) {", "module <f>(<PARAMS>) {", _UNTYPED),
    Habit("fn <f> <P> = <E>;", "fn <f>(<P>) = <E>;", _PARENTHESES, code="E0107"),
    Habit("module <f> <P> {", "module <f>(<P>) {", _PARENTHESES, code="E0107"),
    # names
    Habit("const <type> <n> = <E>;", "let <n> = <E>;", _UNTYPED),
    Habit("<let> <n>: <t> = <E>;", "let <n> = <E>;", _UNTYPED),
    Habit("uniform <type> <n> = <E>;", "param <n> = <E>;", "it is `param` here"),
    _unsafe("uniform <type?> <n>;", "BAD_STATEMENT", "`<n>` has no value", "write param <n> = 0.5 in 0..1;"),
    Habit("param <n> = <E> in (<A>, <B>);", "param <n> = <E> in <A>..<B>;", _RANGE),
    Habit("<call> <=|:> (<E>);", "<call>(<E>);", _CALLED),
    Habit("<call> <=|:> <E>;", "<call>(<E>);", _CALLED),
    Habit("<n>: <E>;", "<n>(<E>);", "`<n>` is called, not set"),
    Habit("<n> = <LINE> <;?>", "let <n> = <LINE>;", _BOUND, code="E0126"),
    _unsafe("<n> <+|-|*|/|%> = <E>;", "let <n> = BAD_EXPRESSION;", _ONCE, _NEW_NAME),
    _unsafe("<n><++|-->;", "let <n> = BAD_EXPRESSION;", _ONCE, _NEW_NAME),
    _unsafe("<n>[<I>] = <E>;", "let <n> = BAD_EXPRESSION;", _ONCE, _NEW_NAME),
    # objects and their blocks
    Habit("<move>(<P>) <o>;", "<o> { <move>(<P>); }", _BEFORE, _INSIDE),
    Habit("<move>(<P>) <o>(<Q?>);", "<o>(<Q>) { <move>(<P>); }", _BEFORE, _INSIDE),
    Habit("color(<E>) <o>;", "<o> { material <material> { color(<E>); } }", _BEFORE, _INSIDE),
    _unsafe("<before>(<P>) <next>(<Q>) <o>", "<o>", _BEFORE, _INSIDE),
    _unsafe("<before>(<P>) <o>", "<o>", _BEFORE, _INSIDE),
    _unsafe("<before>(<P>) <next>(<Q>) <block>", "<block>", _BEFORE, _INSIDE),
    _unsafe("<before>(<P>) <node>()", "<node>", _BEFORE, _INSIDE),
    _unsafe("<before>(<P>) <block>", "<block>", _BEFORE, _INSIDE),
    _unsafe("<let> <n> = new <LINE> <;?>", "BAD_STATEMENT", _VALUE, _MODULE),
    _unsafe("<let> <n> = <object> <BLOCK>", "BAD_STATEMENT", _VALUE, _MODULE),
    _unsafe("<let> <n> = <node>(<P?>) <;?>", "BAD_STATEMENT", _VALUE, _MODULE),
    _unsafe("new <LINE> <;?>", "BAD_STATEMENT", _DRAWN, "write sphere { scale(0.5); }"),
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
    _unsafe("<node>(<P>);", "BAD_STATEMENT", _ARGUED, _STANDS),
    Habit("<node>()", "<node>", "`<node>` takes no arguments"),
    _unsafe(
        "<node>(<P>) {",
        "<node> {",
        "`<node>` takes no arguments",
        "the width of a blend stands with `smooth`, `subtract` or `intersect`: smooth(k = 0.3) { … }",
    ),
    _unsafe("<n?> < <A>, <B>, <C> > <LINE?> <BLOCK?>", "BAD_STATEMENT", _BRACKETS, _BLOCKS),
    _unsafe(
        "< <n> <LINE>",
        "BAD_STATEMENT",
        "this is SVG or HTML",
        "a drawing becomes a shape: scenelang learn drawing.svg -o zoo.safetensors",
    ),
    _unsafe("<location|look_at|angle> [<A>] <LINE?> <;?>", "BAD_STATEMENT", _BRACKETS, _BLOCKS),
    Habit("<call> <rgb|srgb> < <A>, <B>, <C> ><;?>", "<call>([<A>, <B>, <C>]);", _BRACKETS),
    # materials
    Habit("material { <call>(", "material <material> { <call>(", "material without a name", _UNNAMED),
    Habit("material <=|:?> <VALUES>;", "material <material> { color(<VALUES>); }", _CONSTANT, _UNNAMED),
    Habit("material(<VALUES>);", "material <material> { color(<VALUES>); }", _CONSTANT, _UNNAMED),
    Habit("material = <n>;", "material <n>;", "`material` is not set"),
    Habit("material(<n>)", "material <n>", "a material's name stands without parentheses"),
    Habit("material <n>()", "material <n>", _ARGUMENTS),
    _unsafe("material <n>(<A>, <P>)", "material <n>", _ARGUMENTS, _COLOUR),
    Habit("material <n>(<color?> <=?> <E>);", "material <n> { color(<E>); }", _ARGUMENTS, _COLOUR),
    Habit("material <n>(<color?> <=?> <E>)", "material <n> { color(<E>); }", _ARGUMENTS, _COLOUR),
    Habit("material <m> = <n> <BLOCK>", "let <m> = material <n> <BLOCK>;", "a material is named by `let`"),
    Habit("material <n> <VALUES>;", "material <n> { color(<VALUES>); }", _OPERATIONS),
    Habit("material <n> <,?> color(<E>);", "material <n> { color(<E>); }", _OPERATIONS),
    # expressions
    Habit("[for <i> in <F>: <E>]", "[for (<i> in <F>) <E>]", _LISTED),
    Habit("[<E> for <i> in <F> if <C>]", "[for (<i> in <F>) if (<C>) <E>]", _LISTED),
    Habit("[<E> for <i> in <F>]", "[for (<i> in <F>) <E>]", _LISTED),
    Habit("[<A>:<S>:<B>]", "<A>..<B> step <S>", _RANGE),
    Habit("[<A>:<B>]", "<A>..<B>", _RANGE),
    Habit("(<A>, <E>)", "[<A>, <E>]", _BRACKETS),
    Habit("(<A>, <B>, <C>)", "[<A>, <B>, <C>]", _BRACKETS),
    Habit("<rgb|srgb?> < <A>, <B>, <C> >", "[<A>, <B>, <C>]", _BRACKETS),
    Habit("<A>%", "<A> / 100", "`%` is the rest of a division", "a share is a number: 50 % is 0.5"),
    # settings and imports
    Habit("canvas(<A> x <B>);", "canvas(<A>, <B>);", "sides are separated by a comma"),
    Habit("import <library> <LINE?> <;?>", "", _IMPORT),
    Habit("from <library> import <LINE> <;?>", "", _IMPORT),
    Habit("import <n> from <A>;", "import <A> as <n>;", "the path comes first"),
    _unsafe("import <A> as <n>;", "BAD_STATEMENT", "a path stands in quotes", _IMPORTED, "E0126"),
    _unsafe("import <n> <LINE?> <;?>", "BAD_STATEMENT", _PATH, _IMPORTED),
    _unsafe("from <n> import <LINE> <;?>", "BAD_STATEMENT", _PATH, _IMPORTED),
    _unsafe("<use> < <LINE> <;?>", "BAD_STATEMENT", _PATH, _IMPORTED, "E0126"),
    _unsafe("<use> <A>;", "BAD_STATEMENT", _PATH, _IMPORTED, "E0126"),
)
"""Habits that do not parse. The first that fits, and after which more of the text reads, is taken."""


# ---------------------------------------------------------------- patterns over text

_PIECE: Final = re.compile(
    r"(?P<gap>\s*)(?:<(?P<hole>[^<>\s?]+)(?P<optional>\??)>"
    r"|(?P<text>\w+|\.\.<(?!\w+>)|\.\.|[<>=!]=|&&|\|\||\S))"
)
_TYPED: Final = re.compile(rf"\b(?:{'|'.join(_TYPES)})\s+(?=[A-Za-z_])|\s*:\s*[A-Za-z_]\w*")
"""The types that stand before or after the names of parameters."""

_FLAT: Final = re.compile(r"\b(?:square|triangle|pentagon|star)\b")
_SOLID: Final = re.compile(r"\b(?:sphere|torus)\b")


def _balanced(besides: str = "", word: str = "", depth: int = 4) -> str:
    """Expression for text whose brackets match, without a `;`, a brace or some signs, up to a word."""
    inner = rf"[(\[](?:{_balanced(depth=depth - 1)})?[)\]]" if depth else r"[(\[][)\]]"
    before = rf"(?!\b{word}\b)" if word else ""
    return rf'(?:{before}(?:"[^"\n]*"|[^"(){{}}\[\];{re.escape(besides)}]|{inner}))++'


@cache
def _expression(pattern: str) -> re.Pattern[str]:
    """The expression of a pattern, with a group for each hole; a block or body at its end is left out."""
    keywords = "|".join(word for word in tables().literals if word.isalpha() and word not in ("step", "as"))
    pieces = [match for match in _PIECE.finditer(pattern) if match["hole"] not in _BEHIND]
    parts, seen = [], set()
    for number, piece in enumerate(pieces):
        hole, text = piece["hole"], piece["text"]
        following = next((p["text"] for p in pieces[number + 1 :] if not p["optional"]), None)
        words = _WORDS.get(hole or "", re.findall(r"[^|]+", hole) if hole and not hole.isidentifier() else ())
        if not hole or words:
            choice = sorted(words or (text,), key=len, reverse=True)
            part = "|".join(
                re.escape(w) + (r"(?!\w)" if w[-1].isalnum() else "(?!=)" * (w in "<=>")) for w in choice
            )
        elif hole.islower():
            others = f"{keywords}|{'|'.join(_MOVES)}" if hole == "o" else keywords
            part = f"(?P=g_{hole})" if hole in seen else rf"(?!(?:{others})\b)\$?[A-Za-z_]\w*+"
        elif hole == "LINE":
            part = r"[^\n;{}]++"
        else:
            word = following if following and following[0].isalpha() else ""
            sign = following[0] if following and not word else "," * (number + 1 == len(pieces))
            part = _balanced(sign, word)
            part = rf"(?=[\d.#\[]){part}" if hole == "VALUES" else rf"(?=\S){part}"
        name = re.sub(r"\W", "_", f"g_{hole}") if hole else ""
        part = f"(?P<{name}>{part})" if hole and hole not in seen else f"(?:{part})"
        seen.add(hole)
        parts.append(rf"\s*+{part}" + "?" * bool(piece["optional"]))
    return re.compile("".join(parts))


_Match = dict[str, tuple[int, int]]
"""Indices of the first token and past the last one of each hole, and of the whole at ``""``."""


def _text(tokens: Tokens, place: tuple[int, int]) -> str:
    return tokens.source.text[slice(*tokens.place(*place))]


def _find(pattern: str, tokens: Tokens, at: int) -> _Match | None:
    """The tokens from ``at`` on that a pattern describes; None where they are others."""
    begin = tokens.starts[at]
    matched = _expression(pattern).match(tokens.source.text, begin, begin + _LONGEST)
    if matched is None:
        return None

    def index(offset: int) -> int:
        return bisect_left(tokens.starts, offset, at, len(tokens.starts) - 1)

    holes, stop = {}, index(matched.end())
    for piece in _PIECE.finditer(pattern):
        hole = piece["hole"]
        if hole in _BEHIND:
            end = _extent(tokens, hole, stop, at)
            if end > stop:
                holes[hole], stop = (stop, end), end
                stop += hole == "BLOCK" and tokens.text(stop) == ";"
            elif not piece["optional"]:
                return None
        elif hole:
            start, end = matched.span(re.sub(r"\W", "_", f"g_{hole}"))
            if start < end:
                holes[hole] = (index(start), index(end))
    if stop <= at or any(first >= last for first, last in holes.values()):
        return None
    return {**holes, "": (at, stop)}


def _extent(tokens: Tokens, hole: str, at: int, head: int) -> int:
    """Index after what a hole of `_BEHIND` takes from ``at`` on, behind a head."""

    def column(index: int) -> int:
        return tokens.starts[index] - tokens.source.text.rfind("\n", 0, tokens.starts[index])

    level = column(head) if tokens.on_new_line(at) else inf
    depth, last = 0, min(at + 4000, len(tokens.kinds) - 1)
    for index in range(at, last):
        sign = tables().kinds[tokens.kinds[index]]
        ended = depth == 0 and tokens.on_new_line(index) and column(index) <= level
        if (hole == "BODY" and ended) or (hole == "BLOCK" and index == at and sign != "{"):
            return index
        depth += (sign in ("(", "[", "{")) - (sign in (")", "]", "}"))
        if depth < 0:
            return index
        if hole != "BODY" and depth == 0 and (sign == "}" or (sign == ";" and hole == "STMT")):
            return index + 1
    return last


def _replaced(tokens: Tokens, match: _Match, meant: str) -> tuple[str, list[Token]]:
    """Text and tokens of a replacement: holes in order keep their places, all else is empty."""
    language = tables()
    text, new, (at, close) = "", [], tokens.place(*match[""])
    for piece in _PIECE.finditer(meant):
        hole, word = piece["hole"], piece["text"]
        if hole and hole not in match and hole != "material":
            continue  # what may be missing
        text += " " * bool(piece["gap"] and text)
        if hole in match:
            begin, written = tokens.starts[match[hole][0]], _text(tokens, match[hole])
            types = [t.span() for t in _TYPED.finditer(written)] if hole == "PARAMS" else []
            text += _TYPED.sub("", written) if types else written
            if begin >= at:
                part = tokens.part(*match[hole])
                new += [one for one in part if not any(i <= one[1] - begin < j for i, j in types)]
                at = part[-1][2]
            else:
                new.append((language.kind("BAD_EXPRESSION" if hole.isupper() else "NAME"), at, at))
        elif word and word.startswith("BAD_"):
            new.append((language.kind(word), at, close))  # behind the holes before it, so that spans nest
            at = close
        else:
            if hole:
                solid, flat = (shapes.search(tokens.source.text) for shapes in (_SOLID, _FLAT))
                word = "…" if bool(solid) == bool(flat) else "diffuse" if solid else "flat"
            text += word
            new.append((language.literals.get(word, language.kind("NAME")), at, at))
    return text, new


# ---------------------------------------------------------------- looking one up


def mend_habit(tokens: Tokens, report: Report, stack: list[int], first: int, at: int) -> bool:
    """Report a habit in the statement from ``first`` on, in which token ``at`` does not fit, and mend it."""
    if len(report.found) > _MOST:
        return False
    anchors = _anchors(tokens, first, at)
    for habit in HABITS:
        lead = _PIECE.match(habit.pattern)
        assert lead is not None
        text = lead["text"] or lead["hole"]
        for start in anchors.get(text, anchors["word" if text[1:] else "name"]):
            match = _find(habit.pattern, tokens, start)
            if match is None:
                continue
            written, new = _replaced(tokens, match, habit.meant)
            if written != _text(tokens, match[""]) and _reads_on(
                tokens, stack, first, at, match, new, habit.meant
            ):
                _tell(tokens, report, habit, match, written)
                tokens.splice(*match[""], new)
                return True
    return False


def _anchors(tokens: Tokens, first: int, at: int) -> dict[str, list[int]]:
    """Indices at which a pattern may begin, by its first word, sign or hole."""
    anchors: dict[str, list[int]] = {"(": [], "[": [], "<": [at], "A": [], "name": [first], "word": [first]}
    anchors["word"] += [at - 1] * (at - 1 > first)
    depth = 0
    for index in range(at - 1, max(first, at - 200), -1):
        text = tokens.text(index)
        depth += (text in (")", "]")) - (text in ("(", "["))
        if depth <= 0 and text in ("(", "[", ",", "=", "return") and not anchors["A"]:
            anchors["A"] = [index + 1]
        if depth < 0:
            before = tokens.text(index - 1)
            anchors |= {"for": [index - 1]} if before == "for" else {}
            operand = before in (")", "]") or (before.isidentifier() and before not in ("in", "return"))
            anchors[text] = [] if operand else [index]
            break
    anchors["material"] = [first, *anchors["A"]]
    anchors["rgb|srgb"] = [*anchors["word"], at]
    return anchors


def _reads_on(
    tokens: Tokens, stack: list[int], first: int, at: int, match: _Match, new: list[Token], meant: str
) -> bool:
    """Test whether a replacement lets the rest of the statement read, or the head of one with a block."""
    start, stop = match[""]
    if start > at:
        return False
    before, after = tokens.part(first, start), tokens.part(stop, stop + _FOLLOWED)

    def left(middle: list[Token]) -> int:
        """Number of tokens behind the first that does not fit; words for operators are mended later."""
        words = [(kind, OPERATORS.get(tokens.source.text[i:j])) for kind, i, j in before + middle + after]
        kinds = [tables().literals[sign] if sign else kind for kind, sign in words]
        return len(kinds) - reach(stack.copy(), kinds, 0, len(kinds))

    rest = left(new)
    read = len(after) - rest
    ends = [tables().literals[sign] for sign in ";{}"]
    end, whole = 0, meant[-1:] in (";", "}", "{", "") or "BAD_S" in meant
    while not whole and end < len(after) and after[end][0] != END:
        end += 1
        whole = after[end - 1][0] in ends
    head = "BODY" in meant or meant[:3] == "for"
    further = rest < left(tokens.part(start, stop))
    if "STMT" in meant:  # what is wrong in the statement itself is reported later
        return further
    return further and read >= max(meant[:3] != "for", at - stop + 1) and (read >= end or head)


def _tell(tokens: Tokens, report: Report, habit: Habit, match: _Match, new: str) -> None:
    def filled(words: str) -> str:
        return re.sub("<([a-z]+)>", lambda hole: _text(tokens, match[hole[1]]), words)

    start, end = tokens.place(*match[""])
    if start in tokens.reported:
        return
    text = tokens.source.text
    old = text[start:end]
    code, message, help = habit.code, filled(habit.message), habit.help and filled(habit.help)
    safe = habit.safe and "…" not in new and "//" not in old and "/*" not in old
    if habit.message == _BOUND:
        if re.search(rf"\b{_text(tokens, match['n'])}\b", text[:start]):
            code, message, help, safe = "E0133", filled(_ONCE), _NEW_NAME, False
        elif text.count("{", 0, start) > text.count("}", 0, start):  # perhaps a property
            help, safe = "in a block write material flat { color(…); }, translate(…); or scale(s);", False
    elif habit.message == _BEFORE and match[""][0] and head(tokens, match[""][0] - 1) in _MOVES:
        safe = False  # it may lack its `;`, and what follows be a material
    elif "STMT" in match and tokens.on_new_line(match["STMT"][0]):
        safe = False  # more of the lines below may be meant
    # What both have at their ends is not shown.
    lead = _alike(old, new)
    tail = _alike(old[lead:][::-1], new[lead:][::-1])
    lead += len(old[lead:]) - len(old[lead:].lstrip())
    place = (start + lead, end - tail) if lead + tail < len(old) else (start, end)
    fix: Fix | None = None
    if safe:
        shown = " ".join(new.split())
        shown = shown if len(shown) <= 40 else f"{shown[:37]}…"
        fix = report.change(start, end, new, f"write `{shown}`" if shown else "remove it")
    report.add(code, message, *place, help=help, fix=fix)


def head(tokens: Tokens, at: int) -> str:
    first = at
    while first and at - first < MAX_REPLAY and tokens.text(first - 1) not in (";", "{", "}"):
        first -= 1
    return tokens.text(first) if first < at else ""


def _alike(one: str, other: str) -> int:
    """Number of letters that two texts have in common at their start, without half a word."""
    pairs = enumerate(zip(one, other, strict=False))
    count = next((at for at, (a, b) in pairs if a != b), min(len(one), len(other)))
    while count and re.match(r"\w\w", one[count - 1 : count + 1] + other[count : count + 1]):
        count -= 1
    return count
