"""Random programs of the language as lists of tokens; random layouts of them, comments in any legal place."""

from __future__ import annotations

from hypothesis import strategies as st

Tokens = list[str]

_NAMES = st.sampled_from(
    ["a", "k", "star", "square", "scale", "rotate", "a_rather_long_name_of_something", "X", "step", "as"]
)
_NUMBERS = ["0", "1.", ".5", "0.25", "30deg", "0.1turn", "2s", "1e-3", "1E3"]
_OTHERS = ['"s"', '"a // b"', r'"\"/*"', "#d33", "#a0b1c2", "true", "false", "k", "X", "another_long_name"]
_ATOMS = st.sampled_from([*_NUMBERS, *_OTHERS])
_OPERATORS = st.sampled_from(["+", "-", "*", "/", "%", "^", "<", "<=", "==", "!=", "&&", "||"])
_COMBINES = st.sampled_from([["union"], ["smooth"], ["subtract"], ["intersect"]])


def _joined(*parts: st.SearchStrategy[Tokens] | str) -> st.SearchStrategy[Tokens]:
    drawn = [st.just([part]) if isinstance(part, str) else part for part in parts]
    return st.tuples(*drawn).map(lambda found: [token for part in found for token in part])


def _listed(
    item: st.SearchStrategy[Tokens], opening: str, closing: str, most: int = 5
) -> st.SearchStrategy[Tokens]:
    def join(drawn: tuple[list[Tokens], bool]) -> Tokens:
        items, trailing = drawn
        inside = [token for index, one in enumerate(items) for token in ([","] if index else []) + one]
        return [opening, *inside, *([","] if items and trailing else []), closing]

    return st.tuples(st.lists(item, max_size=most), st.booleans()).map(join)


def _maybe(strategy: st.SearchStrategy[Tokens]) -> st.SearchStrategy[Tokens]:
    return st.one_of(st.just([]), strategy)


name = _NAMES.map(lambda word: [word])
path = st.one_of(name, _joined(name, ".", name))
# `material` may stand only where a unary expression may, and a range nowhere inside another expression.
expression: st.SearchStrategy[Tokens] = st.deferred(lambda: st.one_of(_tight, _operation, _choice))
_atom = _ATOMS.map(lambda word: [word])
_arguments = _listed(st.one_of(expression, _joined(name, "=", expression)), "(", ")")
_parameters = _listed(st.one_of(name, _joined(name, "=", expression)), "(", ")")
_tight: st.SearchStrategy[Tokens] = st.deferred(
    lambda: st.one_of(
        _atom,
        _atom,
        _joined("(", expression, ")"),
        _joined(name, _arguments),
        _joined(path, _arguments),
        _listed(expression, "[", "]"),
        _listed(_atom, "[", "]", most=60),
        _joined(name, "[", expression, "]"),
        _joined(_atom, ".", name),
    )
)
_unary = st.one_of(_tight, _joined("-", _tight), _joined("!", _tight))
_operation = st.lists(st.tuples(_OPERATORS.map(lambda sign: [sign]), _unary), min_size=1, max_size=5).flatmap(
    lambda rest: _unary.map(lambda first: [*first, *(t for sign, part in rest for t in [*sign, *part])])
)
_choice = _joined(_unary, "?", _unary, ":", st.one_of(_unary, st.deferred(lambda: _choice)))
_range = _joined(_unary, st.sampled_from([[".."], ["..<"]]), _unary, _maybe(_joined("step", _unary)))
_texture = st.one_of(path, _joined(name, path))
_material = _joined("material", _texture, _maybe(st.deferred(lambda: block)))
value = st.one_of(expression, expression, _range, _material)

statement: st.SearchStrategy[Tokens] = st.deferred(
    lambda: st.one_of(
        _joined(path, _maybe(_arguments), ";"),
        _joined(path, _maybe(_arguments), block),
        _joined(_COMBINES, path, _maybe(_arguments), st.one_of(st.just([";"]), block)),
        _joined("smooth", _arguments, block),
        _joined("smooth", _arguments, path, _maybe(_arguments), st.one_of(st.just([";"]), block)),
        _joined(st.sampled_from([["group"], ["chain"], ["union"], ["smooth"], ["subtract"]]), block),
        _joined("material", _texture, st.one_of(st.just([";"]), block)),
        _joined("let", name, "=", value, ";"),
        _joined("param", name, "=", expression, _maybe(_joined("in", value)), ";"),
        _joined("fn", name, _parameters, "=", value, ";"),
        _joined("module", name, _parameters, block),
        _joined("for", "(", name, "in", value, ")", block),
        _conditional,
        st.sampled_from([["nsg", "1", ";"], ["model", '"m"', ";"], ["import", '"a.nsg"', "as", "lib", ";"]]),
    )
)
block = st.lists(statement, max_size=4).map(lambda inside: ["{", *(t for s in inside for t in s), "}"])
_conditional: st.SearchStrategy[Tokens] = _joined(
    "if", "(", expression, ")", block,
    _maybe(_joined("else", st.one_of(block, st.deferred(lambda: _conditional)))),
)  # fmt: skip
program = st.lists(statement, max_size=6).map(lambda inside: [t for s in inside for t in s])

_GAPS = [" "] * 12 + ["\n"] * 3 + ["\n\n\n", "\t", "  \n  "]
_COMMENTS = [
    " // a line\n",
    "\n// on its own\n",
    "\n\n  //\n",
    " /* b */ ",
    " /**/\n",
    "\n /* c */\n",
    "\n/* d */ ",
    " /* of\n   two */\n",
    "\n\t/* tab\n\t * bed\n\t */\n\n",
    " /* e */ /* f */ ",
    " /* g */ // h\n\n",
]


@st.composite
def laid_out(draw: st.DrawFn) -> str:
    """A random program in a random layout."""
    tokens = draw(program)
    gaps = draw(st.sampled_from([_GAPS, [" "], _GAPS + _COMMENTS, [" "] * 40 + _COMMENTS]))
    drawn = draw(st.lists(st.sampled_from(gaps), min_size=len(tokens) + 1, max_size=len(tokens) + 1))
    return drawn[0] + "".join(f"{token} {gap}" for token, gap in zip(tokens, drawn[1:], strict=True))
