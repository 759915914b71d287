"""What a text is shown in: semantic tokens, which a grammar of regular expressions cannot know, and the
colours that it writes, with what a picker may write instead."""

from __future__ import annotations

import colorsys
import re
from typing import Final

from lsprotocol import types

from scenelang.lsp.text import width
from scenelang.lsp.workspace import Document, Workspace
from scenelang.resolve.names import Symbol, Use
from scenelang.syntax import nodes
from scenelang.syntax.nodes import walk
from scenelang.syntax.tables import tables
from scenelang.words import OPERATIONS, SETTINGS

COLOURED: Final = ("color", "background", "light", "ground")
"""What has an argument `c` or `color`."""

TYPES: Final = (
    *("comment", "keyword", "number", "string", "operator"),
    *("variable", "parameter", "property", "function", "namespace", "class", "method", "macro", "enumMember"),
)
MODIFIERS: Final = ("declaration", "readonly", "defaultLibrary")
LEGEND: Final = types.SemanticTokensLegend(list(TYPES), list(MODIFIERS))
_COMMENTS: Final = re.compile(r"//[^\n]*|/\*[\s\S]*?(?:\*/|\Z)")
_ROLES: Final = {
    "function": ("function", 4),
    "constant": ("variable", 6),
    "animated": ("variable", 4),
    "geometry": ("class", 4),
    "transform": ("method", 4),
    "operation": ("method", 4),
    "setting": ("macro", 4),
    "material": ("enumMember", 4),
    "argument": ("parameter", 0),
    "property": ("property", 0),
    "model": ("string", 0),
    "path": ("string", 0),
}
_KINDS: Final = {
    "let": ("variable", 2),
    "param": ("property", 2),
    "argument": ("parameter", 0),
    "loop": ("variable", 0),
    "fn": ("function", 0),
    "module": ("class", 0),
    "import": ("namespace", 0),
}


def semantic_tokens(docs: Workspace, document: Document, place: types.Range | None = None) -> list[int]:
    """The tokens of a text or of a range, encoded as the protocol wants them."""
    low, high = 0, len(document.text)
    if place is not None:
        low, high = document.lines.offset(place.start), document.lines.offset(place.end)
    found = [item for item in _tokens(docs, document, low, high) if item[1] > low and item[0] < high]
    data: list[int] = []
    line = column = 0
    for start, end, kind, modifiers in sorted(found):
        at = document.lines.position(start)
        length = width(document.text[start:end], document.encoding)
        data += (at.line - line, at.character - column if at.line == line else at.character)
        data += (length, TYPES.index(kind), modifiers)
        line, column = at.line, at.character
    return data


def _tokens(docs: Workspace, document: Document, low: int, high: int) -> list[tuple[int, int, str, int]]:
    text, tokens = document.text, document.tokens
    names = tables().kinds
    uses = {use.start: use for use in document.names.uses}
    found: list[tuple[int, int, str, int]] = []
    before = 0
    for kind, start, end in zip(tokens.kinds, tokens.starts, tokens.ends, strict=True):
        if before < start and before < high and start > low:
            found += _comments(text, before, start)
        before = end
        if start == end or end <= low or start >= high:
            continue
        use = uses.get(start)
        name = names[kind]
        if use is not None and use.end <= end and use.role not in ("path", "model"):
            found.append((start, end, *_named(docs, document, use)))
        elif name == "NUMBER" or name == "COLOR":
            found.append((start, end, "number", 0))
        elif name == "STRING":
            found.append((start, end, "string", 0))
        elif name[0].isalpha() and name != "NAME":
            found.append((start, end, "keyword", 0))
        elif name not in ("NAME", "(", ")", "[", "]", "{", "}", ",", ";", "."):
            found.append((start, end, "operator", 0))
    return [item for item in found if "\n" not in text[item[0] : item[1]]]


def _comments(text: str, start: int, end: int) -> list[tuple[int, int, str, int]]:
    """Comments between two tokens, line by line, as a token must not span lines."""
    found = []
    for match in _COMMENTS.finditer(text, start, end):
        at = match.start()
        for part in match[0].splitlines(keepends=True):
            bare = part.rstrip("\r\n")
            if bare:
                found.append((at, at + len(bare), "comment", 0))
            at += len(part)
    return found


def _named(docs: Workspace, document: Document, use: Use) -> tuple[str, int]:
    symbol: Symbol | None = use.symbol
    if use.role == "member":
        target = docs.definition(document, use)
        symbol = target[1] if target is not None else None
    if use.role in ("name", "member") and symbol is not None:
        kind, modifiers = _KINDS[symbol.kind]
        return kind, modifiers | int(use.defines)
    return _ROLES.get(use.role, ("variable", 0))


def colours(document: Document) -> list[types.ColorInformation]:
    """Colours that are written out: `#hex`, `rgb(…)`, `hsv(…)` and vectors where a colour is wanted."""
    found = []
    for stmt in document.file.statements:
        wanted: set[int] = set()
        for node in walk(stmt):
            if isinstance(node, nodes.Call) and node.args and node.name.text in COLOURED:
                params = (OPERATIONS | SETTINGS)[node.name.text].params
                for arg, param in zip(node.args, params, strict=False):
                    if (arg.name.text if arg.name else param) in ("c", "color"):
                        wanted.add(id(arg.value))
            rgb = _colour(node, id(node) in wanted)
            if rgb is not None:
                place = document.lines.span(node.span)
                found.append(types.ColorInformation(place, types.Color(*rgb, 1.0)))
    found.sort(key=lambda c: (c.range.start.line, c.range.start.character))
    return found


def _colour(node: object, wanted: bool) -> tuple[float, float, float] | None:
    if isinstance(node, nodes.Color):
        return node.rgb
    if isinstance(node, nodes.Vector) and wanted:
        return _clamped([_number(item) for item in node.items])
    if isinstance(node, nodes.CallExpr) and node.name.text in ("rgb", "hsv"):
        order = ("r", "g", "b") if node.name.text == "rgb" else ("h", "s", "v")
        given: dict[str, float | None] = {}
        for index, arg in enumerate(node.args):
            if index < 3:
                name = arg.name.text if arg.name is not None else order[index]
                given[name] = _number(arg.value)
        parts = [given.get(name) for name in order]
        rgb = _clamped(parts, first_free=node.name.text == "hsv")
        if rgb is None or node.name.text == "rgb":
            return rgb
        return colorsys.hsv_to_rgb(rgb[0] % 1.0, rgb[1], rgb[2])
    return None


def _number(expr: nodes.Expr) -> float | None:
    """A literal number, an angle in turns."""
    if isinstance(expr, nodes.Unary) and expr.op == "-":
        inner = _number(expr.operand)
        return None if inner is None else -inner
    if not isinstance(expr, nodes.Number):
        return None
    per_turn = {"": 1.0, "turn": 1.0, "deg": 360.0, "rad": 6.283185307179586}
    return expr.value / per_turn[expr.unit] if expr.unit in per_turn else None


def _clamped(parts: list[float | None], first_free: bool = False) -> tuple[float, float, float] | None:
    known = [part for part in parts if part is not None]
    if not len(known) == len(parts) == 3:
        return None
    first, second, third = (min(max(part, 0.0), 1.0) for part in known)
    return known[0] if first_free else first, second, third


def presentations(
    document: Document, color: types.Color, place: types.Range
) -> list[types.ColorPresentation]:
    """How a picked colour may be written, the way it is written now first."""
    red, green, blue = color.red, color.green, color.blue
    bytes_ = [min(max(round(255 * x), 0), 255) for x in (red, green, blue)]
    long = "#" + "".join(f"{b:02x}" for b in bytes_)
    short = "#" + "".join(f"{b:02x}"[0] for b in bytes_) if all(b % 17 == 0 for b in bytes_) else long
    h, s, v = colorsys.rgb_to_hsv(red, green, blue)

    def listed(values: tuple[float, ...]) -> str:
        return ", ".join(f"{round(x, 3) + 0.0:g}" for x in values)

    forms = {
        "#": short,
        "rgb": f"rgb({listed((red, green, blue))})",
        "hsv": f"hsv({listed((h, s, v))})",
        "[": f"[{listed((red, green, blue))}]",
    }
    lines = document.lines
    now = document.text[lines.offset(place.start) : lines.offset(place.end)]
    order = sorted(forms, key=lambda form: not now.startswith(form))
    return [types.ColorPresentation(forms[form], types.TextEdit(place, forms[form])) for form in order]
