"""Completion, semantic tokens and colours of a document, and its values and transforms in words."""

from __future__ import annotations

import colorsys
import math
import os
import re
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from itertools import islice, pairwise
from typing import Any, Final

from lsprotocol import types

from scenelang.assets.element import told
from scenelang.assets.records import Record
from scenelang.compiler.lower import step_of
from scenelang.compiler.manifest import available, load_manifest
from scenelang.compiler.spaces import SPACES, Refusal, Space
from scenelang.compiler.steps import Affine, Step, Warp
from scenelang.editors.context import Cursor, cursor_at, find_callee, word_of
from scenelang.editors.workspace import Document, Workspace, scenes_below, width
from scenelang.language import library, tree, words
from scenelang.language import scene_text as to_nsg
from scenelang.language.definitions import Names, Symbol, Use
from scenelang.language.tables import tables
from scenelang.language.tree import walk
from scenelang.language.values import Angle, MaterialValue, RangeValue, Time, Vec, pack, show
from scenelang.language.words import COMBINE, LEAVES, OPERATIONS, SETTINGS, UNITS

COLOURS: Final = ("c", "color", "horizon", "zenith")
COLOURED: Final = ("color", "background", "glow", "light", "ground", "sky")
"""Words with an argument `c` or `color`."""

TYPES: Final = (
    *("comment", "keyword", "number", "string", "operator"),
    *("variable", "parameter", "property", "function", "namespace", "class", "method", "macro", "enumMember"),
)
MODIFIERS: Final = ("declaration", "readonly", "defaultLibrary")
LEGEND: Final = types.SemanticTokensLegend(list(TYPES), list(MODIFIERS))
_COMMENTS: Final = re.compile(r"//[^\n]*|/\*[\s\S]*?(?:\*/|\Z)")
_LINE: Final = re.compile(r"[^\r\n]+")
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
Kind = types.CompletionItemKind
_KINDS: Final = {
    "let": ("variable", 2, Kind.Variable),
    "param": ("property", 2, Kind.Property),
    "argument": ("parameter", 0, Kind.Variable),
    "loop": ("variable", 0, Kind.Variable),
    "fn": ("function", 0, Kind.Function),
    "module": ("class", 0, Kind.Module),
    "import": ("namespace", 0, Kind.File),
}
"""Of each kind of definition, the type and the modifiers of its tokens, and the kind of its proposals."""


def semantic_tokens(
    docs: Workspace, document: Document, place: types.Range | None = None
) -> types.SemanticTokens:
    """The tokens of a text or of a range, encoded as the protocol wants them."""
    low, high = 0, len(document.text)
    if place is not None:
        low, high = document.lines.offset(place.start), document.lines.offset(place.end)
    result = [item for item in _tokens(docs, document, low, high) if item[1] > low and item[0] < high]
    data: list[int] = []
    line = column = 0
    for start, end, kind, modifiers in sorted(result):
        at = document.lines.position(start)
        length = width(document.text[start:end], document.encoding)
        data += (at.line - line, at.character - column if at.line == line else at.character)
        data += (length, TYPES.index(kind), modifiers)
        line, column = at.line, at.character
    return types.SemanticTokens(data)


def _tokens(docs: Workspace, document: Document, low: int, high: int) -> list[tuple[int, int, str, int]]:
    text, tokens = document.text, document.tokens
    names = tables().kinds
    uses = {use.start: use for use in document.names.uses}
    result: list[tuple[int, int, str, int]] = []
    before = 0
    for kind, start, end in zip(tokens.kinds, tokens.starts, tokens.ends, strict=True):
        if before < start and before < high and start > low:
            result += _comments(text, before, start)
        before = end
        if start == end or end <= low or start >= high:
            continue
        use = uses.get(start)
        name = names[kind]
        if use is not None and use.end <= end and use.role not in ("path", "model"):
            result.append((start, end, *_named(docs, document, use)))
        elif name == "NUMBER" or name == "COLOR":
            result.append((start, end, "number", 0))
        elif name == "STRING":
            result.append((start, end, "string", 0))
        elif name[0].isalpha() and name != "NAME":
            result.append((start, end, "keyword", 0))
        elif name not in ("NAME", "(", ")", "[", "]", "{", "}", ",", ";", "."):
            result.append((start, end, "operator", 0))
    return [item for item in result if "\n" not in text[item[0] : item[1]]]


def _comments(text: str, start: int, end: int) -> list[tuple[int, int, str, int]]:
    """Comments between two tokens, line by line, as a token must not span lines."""
    matches = _COMMENTS.finditer(text, start, end)
    parts = (part for match in matches for part in _LINE.finditer(text, *match.span()))
    return [(part.start(), part.end(), "comment", 0) for part in parts]


def _named(docs: Workspace, document: Document, use: Use) -> tuple[str, int]:
    symbol: Symbol | None = use.symbol
    if use.role == "member":
        target = docs.definition(document, use)
        symbol = target[1] if target is not None else None
    if use.role in ("name", "member") and symbol is not None:
        kind, modifiers, _ = _KINDS[symbol.kind]
        return kind, modifiers | int(use.defines)
    return _ROLES.get(use.role, ("variable", 0))


def colours(document: Document) -> list[types.ColorInformation]:
    """Colours that are written out: `#hex`, `rgb(…)`, `hsv(…)` and vectors where a colour is wanted."""
    result = []
    for stmt in document.file.statements:
        wanted: set[int] = set()
        for node in walk(stmt):
            if isinstance(node, tree.Call) and node.args and node.name.text in COLOURED:
                params = (OPERATIONS | SETTINGS)[node.name.text].params
                for arg, param in zip(node.args, params, strict=False):
                    if (arg.name.text if arg.name else param) in COLOURS:
                        wanted.add(id(arg.value))
            if (rgb := _colour(node, id(node) in wanted)) is not None:
                place = document.lines.span(node.span)
                result.append(types.ColorInformation(place, types.Color(*rgb, 1.0)))
    result.sort(key=lambda c: (c.range.start.line, c.range.start.character))
    return result


def _colour(node: object, wanted: bool) -> tuple[float, float, float] | None:
    if isinstance(node, tree.ColorLiteral):
        return node.rgb
    letters, given = "rgb", []
    if isinstance(node, tree.Vector) and wanted:
        given = [_number(item) for item in node.items]
    elif isinstance(node, tree.CallExpr) and node.name.text in ("rgb", "hsv"):
        letters = node.name.text
        pairs = zip(letters, node.args, strict=False)
        named = {arg.name.text if arg.name else letter: _number(arg.value) for letter, arg in pairs}
        given = [named.get(letter) for letter in letters]
    parts = [part for part in given if part is not None]
    if not len(parts) == len(given) == 3:
        return None
    first, second, third = (min(max(part, 0.0), 1.0) for part in parts)
    return colorsys.hsv_to_rgb(parts[0] % 1.0, second, third) if letters == "hsv" else (first, second, third)


def _number(expr: tree.Expr) -> float | None:
    """A literal number, an angle in turns."""
    if isinstance(expr, tree.Unary) and expr.op == "-":
        inner = _number(expr.operand)
        return None if inner is None else -inner
    if not isinstance(expr, tree.NumberLiteral):
        return None
    per_turn = {"": 1.0, "turn": 1.0, "deg": 360.0, "rad": 6.283185307179586}
    return expr.value / per_turn[expr.unit] if expr.unit in per_turn else None


def presentations(document: Document, rgb: types.Color, place: types.Range) -> list[types.ColorPresentation]:
    """The notations of a picked colour, the current one first."""
    red, green, blue = rgb.red, rgb.green, rgb.blue
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


_MOST_ITEMS: Final = 8


def dimensions_of(document: Document) -> tuple[int, ...]:
    """The dimension of the model that a document names; both where it names none."""
    for stmt in document.heads:
        if isinstance(stmt, tree.ModelStatement) and isinstance(stmt.name, tree.String):
            with suppress(KeyError):
                return (load_manifest(stmt.name.value).dimension,)
    return (*LEAVES,)


def space_of(document: Document) -> Space:
    """The space of the model which draws a document."""
    if document.checked is not None and document.checked.manifest is not None:
        return SPACES[document.checked.manifest.dimension]
    return SPACES[dimensions_of(document)[0]]


def show_value(value: Any) -> str | None:
    """A value in the notation of the language; None for one that a mistake has made unknown."""
    cls = value.__class__
    if isinstance(value, float):
        return show(value)
    if cls is bool:
        return "true" if value else "false"
    if cls is str:
        short: str = value if len(value) <= 60 else value[:57] + "…"
        return '"' + short.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if cls is Angle:
        return f"{show(round(math.degrees(value.size), 6))}deg"
    if cls is Time:
        return f"{show(value.size)}s"
    if cls is Vec:
        items = [show_value(item) or "?" for item in value.items[:_MOST_ITEMS]]
        more = [f"… {len(value.items)} items"] if len(value.items) > _MOST_ITEMS else []
        return f"[{', '.join([*items, *more])}]"
    if cls is RangeValue:
        ends = [show_value(pack(x, value.unit)) or "?" for x in (value.start, value.stop)]
        step = "" if value.step is None else f" step {show_value(pack(value.step, value.unit))}"
        return f"{ends[0]}{'..<' if value.exclusive else '..'}{ends[1]}{step}"
    if cls is MaterialValue:
        return to_nsg.material(value.material).rstrip(";")
    return "none" if value is None else None


def steps_of(transforms: Iterable[Any], space: Space) -> list[Step]:
    """The steps of transforms, without those that have none."""
    result = [step_of(transform, space) for transform in transforms]
    return [step for step in result if not isinstance(step, Refusal)]


def show_steps(steps: Iterable[Step], space: Space) -> Iterator[str]:
    """The matrix of each affine step, and the formula of each warp's inverse at a point."""
    for step in steps:
        if isinstance(step, Affine):
            table = [[step.rows[at] for at in row] for row in space.shown]
            table.append([0.0] * space.dimension + [1.0])
            cells = [[f"{value + 0.0:.4g}" for value in row] for row in table]
            width = max(len(cell) for row in cells for cell in row)
            yield "\n".join("[ " + "  ".join(cell.rjust(width) for cell in row) + " ]" for row in cells)
        elif isinstance(step, Warp):
            factors = (step.twirl, "|p|"), (step.bend[0], "p.x"), (step.bend[1], "p.y")
            angle = " + ".join(f"{show(factor)} {name}" for factor, name in factors if factor)
            yield f"p → R({angle or '0'}) p"


_MOST_PATHS: Final = 200
_MOST_FILES: Final = 2000


class Proposal(Record):
    """A proposal."""

    label: str
    kind: Kind
    text: str = ""  # inserted in place of the label, with placeholders in a snippet
    rank: str = "m"  # by which proposals are sorted, the likeliest first
    detail: str = ""
    about: str = ""  # Markdown
    snippet: bool = False


_HEADS: Final = ("let", "fn", "module", "for", "if", *words.NODES)


def complete(docs: Workspace, document: Document, offset: int, snippets: bool) -> types.CompletionList:
    """Proposals at an offset."""
    names = document.names_at(offset)
    holders = ("let", "argument", "loop", "param")
    values = frozenset(s.name for s in names.visible(offset) if s.kind in holders)
    cursor = cursor_at(document.tokens_to(offset), offset, values)
    start, end = cursor.start, cursor.end
    if cursor.inside == "string":
        start += 1
        end = max(end - (end > start and document.text[end - 1] == '"'), start)
    place = document.lines.range(start, end)
    items: dict[str, types.CompletionItem] = {}
    for item in _Maker(docs, document, cursor, names).items():
        filled = item.snippet and snippets
        text = item.text if item.text and (filled or not item.snippet) else item.label
        about = types.MarkupContent(types.MarkupKind.Markdown, item.about) if item.about else None
        proposed = types.CompletionItem(
            label=item.label,
            kind=item.kind,
            detail=item.detail or None,
            documentation=about,
            sort_text=f"{item.rank}{item.label}",
            filter_text=item.label,
            insert_text_format=types.InsertTextFormat.Snippet if filled else None,
            text_edit=types.TextEdit(place, text),
        )
        items.setdefault(item.label, proposed)
    return types.CompletionList(is_incomplete=False, items=[*items.values()])


class _Maker:
    """Proposals for one cursor."""

    def __init__(self, docs: Workspace, document: Document, cursor: Cursor, names: Names) -> None:
        self.docs, self.document, self.cursor, self.names = docs, document, cursor, names
        dimensions = dimensions_of(document)
        self.geometries = {name for d in dimensions for name in words.LEAVES[d]}
        self.shadings = {name for d in dimensions for name in words.SHADINGS[d]}
        hidden = () if 3 in dimensions else words.SOLID_TRANSFORMS
        self.transforms = {name: word for name, word in words.TRANSFORMS.items() if name not in hidden}

    def items(self) -> Iterator[Proposal]:
        cursor, before = self.cursor, self.cursor.before
        last = before[-1] if before else ""
        if cursor.inside in ("comment", "colour"):
            return
        if cursor.inside == "string":
            yield from self._strings()
        elif cursor.inside == "number":
            typed = self.document.text[cursor.start : cursor.offset]
            number = re.match(r"([0-9]++\.?[0-9]*+|\.[0-9]++)(.+)", typed)
            for unit in UNITS:
                if number is not None and unit.startswith(number[2]):
                    yield Proposal(f"{number[1]}{unit}", Kind.Unit)
        elif last == ".":
            yield from self._members(before)
        elif not before:
            yield from self._statements()
        elif last in ("let", "param", "fn", "module", "nsg", "as", "#") or before[-2:] == ("for", "("):
            return
        elif before[-3:-1] == ("for", "("):
            yield Proposal("in", Kind.Keyword, "in ")
        elif before[0] == "import":
            if len(before) == 2:
                yield Proposal("as", Kind.Keyword, "as ")
        elif last == "material":
            yield from self._materials(self.shadings)
        elif before[-2:-1] == ("material",) and last in self.shadings:
            yield from self._materials(frozenset())
        elif (len(before) == 1 and last in COMBINE) or (before[0] in COMBINE and last == ")"):
            yield from self._children("a")
            yield from (self._keyword(word) for word in ("group", *COMBINE, "chain"))
        elif before[0] == "param" and len(before) > 3 and "in" not in before and _ends_operand(last):
            yield Proposal("in", Kind.Keyword, "in ", "a", about=words.KEYWORDS["in"].text)
        elif last == ")" and before[0] == "if":
            return
        elif before[0] in ("fn", "module") and ")" not in before and last in ("(", ","):
            return  # the name of a parameter
        elif (loops := _begins_item(before)) or not _ends_operand(last):
            yield from self._expressions()
            for word, inside in (("for", "${1:i} in ${2:0..<5}"), ("if", "${1:condition}")) if loops else ():
                about = words.KEYWORDS[word].text
                yield Proposal(word, Kind.Keyword, f"{word} ({inside}) ", "n", about=about, snippet=True)
        elif ".." in before or "..<" in before:
            yield Proposal("step", Kind.Keyword, "step ")

    def _strings(self) -> Iterator[Proposal]:
        """Contents of a string: names of models, files to import."""
        if self.cursor.before == ("model",):
            for manifest in map(load_manifest, available()):
                yield Proposal(manifest.name, Kind.Module, about=manifest.summary)
        elif self.cursor.before == ("import",):
            yield from (Proposal(name, Kind.File, rank="a") for name in library.names())
            own = self.document.path
            folder = own.parent if own is not None else next(iter(self.docs.folders), None)
            for path in islice(scenes_below(folder, _MOST_FILES), _MOST_PATHS) if folder is not None else ():
                if path != own:
                    yield Proposal(os.path.relpath(path, folder).replace(os.sep, "/"), Kind.File)

    def _keyword(self, word: str, rank: str = "p") -> Proposal:
        known = words.KEYWORDS[word]
        text = known.snippet or f"{word} {{\n\t$0\n}}"
        return Proposal(word, Kind.Keyword, text, rank, known.head, known.text, True)

    def _statements(self) -> Iterator[Proposal]:
        block = self.cursor.block
        kind = block.kind
        if kind in ("material", "object"):
            yield from _calls(words.OPERATIONS if kind == "material" else self.transforms, "a")
            if kind == "object":
                yield self._keyword("material", "b")
                yield from self._material_values("b")
            yield from (self._keyword(word) for word in ("let", "for", "if"))
            return
        if kind == "file" and not block.nested:
            given = {type(stmt) for stmt in self.document.heads}
            if tree.Version not in given:
                yield self._keyword("nsg", "c")
            if tree.ModelStatement not in given:
                yield self._keyword("model", "q")
            yield from (self._keyword(word, "q") for word in ("param", "import"))
            yield from _calls(words.SETTINGS, "q")
        yield from self._children("a")
        if kind == "chain":
            for word in COMBINE:
                yield Proposal(word, Kind.Keyword, f"{word} ", "b", about=words.KEYWORDS[word].text)
        yield from (self._keyword(word) for word in _HEADS if kind != "chain" or word not in COMBINE)
        if kind in ("group", "chain"):
            yield from _calls(self.transforms, "n")
            yield self._keyword("material", "n")
            yield from self._material_values("n")

    def _children(self, rank: str) -> Iterator[Proposal]:
        for name in sorted(self.geometries):
            text = f"{name} {{ ${{1:scale(0.5);}} }}"
            yield Proposal(name, Kind.Class, text, rank, "geometry", words.GEOMETRIES[name], True)
        yield from _calls(words.OUTLINES if "square" in self.geometries else {}, rank, Kind.Class)
        for symbol in self.names.visible(self.cursor.offset):
            if symbol.kind == "module":
                yield self._symbol(symbol, statement=True)
            elif symbol.kind == "import":
                yield self._symbol(symbol)

    def _material_values(self, rank: str) -> Iterator[Proposal]:
        may_be = tree.MaterialExpr | tree.NameRef | tree.Member
        for symbol in self.names.visible(self.cursor.offset):
            fits = symbol.kind != "let" or isinstance(getattr(symbol.node, "value", None), may_be)
            if fits and symbol.kind in ("let", "argument", "loop"):
                yield Proposal(symbol.name, Kind.Variable, f"{symbol.name};", rank, "material value")

    def _materials(self, constant: Collection[str]) -> Iterator[Proposal]:
        """Materials, and files that may hold others."""
        for name in sorted({*constant, *words.PAINTS}):
            text, kind = f"{name} {{ ${{1:color(#d33);}} }}", "material" if name in constant else "texture"
            if name in words.GRADIENTS:
                text, kind = f"{name} {{ stop(0, ${{1:#d33}}); stop(1, ${{2:#33d}}); }}", "gradient"
            about = (words.MATERIALS | words.PAINTS)[name]
            yield Proposal(name, Kind.EnumMember, text, "a", kind, about, True)
        for symbol in self.names.visible(self.cursor.offset):
            stmt = symbol.node
            zoo = self.docs.zoo(self.document, stmt) if isinstance(stmt, tree.Import) else None
            if zoo is not None and zoo.materials:
                yield self._symbol(symbol)

    def _symbol(self, symbol: Symbol, *, statement: bool = False) -> Proposal:
        text, snippet = "", False
        if symbol.kind in ("fn", "module"):
            required = [p.name for p in symbol.params if not getattr(p.node, "default", None)]
            holes = ", ".join(f"${{{at}:{name}}}" for at, name in enumerate(required, 1))
            text, snippet = f"{symbol.name}({holes}){';' if statement else ''}", True
        elif symbol.kind == "import":
            text = symbol.name
        rank = "b" if symbol.scope.parent is not None else "d"
        word = word_of(symbol)
        return Proposal(symbol.name, _KINDS[symbol.kind][2], text, rank, word.head, word.text, snippet)

    def _expressions(self) -> Iterator[Proposal]:
        if (callee := find_callee(self.docs, self.document, self.cursor)) is not None:
            yield from self._arguments(callee)
        for symbol in self.names.visible(self.cursor.offset):
            if symbol.kind != "module":
                yield self._symbol(symbol)
        yield from _calls(words.FUNCTIONS, "k", Kind.Function)
        for word in (words.CONSTANTS | words.ANIMATED).values():
            yield Proposal(word.name, Kind.Constant, "", "l", about=word.text)
        for name in ("true", "false"):
            yield Proposal(name, Kind.Keyword, "", "n")
        yield Proposal("material", Kind.Keyword, "material ", "n", about=words.KEYWORDS["material"].text)

    def _arguments(self, callee: words.Word) -> Iterator[Proposal]:
        """Names of arguments that are not given yet, and values for the current one."""
        call = self.cursor.call
        assert call is not None
        positional = callee is not words.TRANSFORMS["shear"]
        if (name := call.named) is None:
            start = self.cursor.before[-1] in ("(", ",")
            left = callee.params[call.index :] if positional else callee.params
            for param in left if start else ():
                if param not in call.given:
                    about = callee.notes.get(param, "")
                    yield Proposal(f"{param} =", Kind.Field, f"{param} = ", "a", "argument", about)
            if call.index < len(callee.params) and positional:
                name = callee.params[call.index]
        yield from self._values(callee.name, name)

    def _values(self, callee: str, param: str | None) -> Iterator[Proposal]:
        if param == "axis":
            for axis in ("X", "Y", "Z"):
                yield Proposal(axis, Kind.EnumMember, "", "0", about=words.CONSTANTS[axis].text)
        elif param == "loop":
            for value in ("true", "false"):
                yield Proposal(value, Kind.EnumMember, "", "0")
        elif param in ("angle", "fov"):
            for value, unit in (("30", "deg"), ("0.25", "turn"), ("0.5", "rad")):
                text = f"${{1:{value}}}{unit}"
                yield Proposal(f"{value}{unit}", Kind.Unit, text, "0", "an angle", "", True)
        elif param in COLOURS and callee in COLOURED:
            yield Proposal("#d33", Kind.Color, "#${1:d33}", "0", "a colour", "", True)
            for name in ("rgb", "hsv"):
                yield Proposal(name, Kind.Function, words.FUNCTIONS[name].snippet, "0", "a colour", "", True)
        if (callee, param) in (("background", "c"), ("ground", "y"), ("light", "position")):
            yield Proposal("none", Kind.EnumMember, "", "0", about=words.CONSTANTS["none"].text)

    def _members(self, before: tuple[str, ...]) -> Iterator[Proposal]:
        alias = before[-2] if len(before) > 1 else ""
        symbol = self.names.scope_at(self.cursor.offset).find(alias)
        if symbol is None or symbol.kind != "import" or not isinstance(symbol.node, tree.Import):
            if before[-3:-2] != (".",) and re.fullmatch(r"[\w\])]+", alias):
                for name in "xyzrgb":
                    yield Proposal(name, Kind.Field)
            return
        zoo, worn = self.docs.zoo(self.document, symbol.node), "material" in before[-4:-2]
        for name, group in zoo.groups.items() if zoo is not None and not worn else ():
            yield Proposal(f"{name}()", Kind.Module, f"{name}() {{ $0 }}", "a", "group", told(group), True)
        statement = len(before) == 2 or (len(before) == 3 and before[0] in COMBINE)
        if zoo is not None and zoo.font is not None and not worn:
            name = "text" if statement else "width"
            yield from _calls({name: words.LETTERS[name]}, "a", Kind.Module if statement else Kind.Function)
        for element in zoo.elements if zoo is not None else ():
            if element.material == worn and element.form != "outline":
                name, about = element.name, element.told()
                yield Proposal(name, Kind.Class, f"{name} {{ $0 }}", "a", element.kind, about, True)
            for name, value in element.values.items() if not worn else ():
                numbers = ", ".join(f"{x:g}" for x in (value if isinstance(value, tuple) else (value,)))
                yield Proposal(name, Kind.Constant, "", "b", numbers)
        if (library := self.docs.imported(self.document, symbol.node.path.value)) is None:
            return
        for known in library.names.exported():
            if not statement or known.kind in ("module", "let"):
                yield self._symbol(known, statement=statement)


def _calls(known: dict[str, words.Word], rank: str, kind: Kind = Kind.Method) -> Iterator[Proposal]:
    for _, word in sorted(known.items()):
        yield Proposal(word.name, kind, word.snippet, rank, word.head, word.text, True)


def _begins_item(before: tuple[str, ...]) -> bool:
    """Test whether an item of a vector begins behind tokens, perhaps with a loop."""
    heads, closed = [""], ""
    for last, text in pairwise(("", *before)):
        if text in ("(", "["):
            heads.append(last + text)
        elif text in (")", "]"):
            closed = heads.pop() if heads[1:] else ""
    if not heads[-1].endswith("[") or _ends_operand(heads[-1][:-1]):
        return False
    return before[-1] in ("[", ",") or (before[-1] == ")" and closed in ("for(", "if("))


def _ends_operand(text: str) -> bool:
    """True for tokens that an expression can end with, so that an operator and not an operand comes next."""
    return text in (")", "]", "}", "true", "false") or (
        (text[:1].isalnum() or text[:1] in '_#"') and text not in words.KEYWORDS
    )
