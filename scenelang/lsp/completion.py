"""Completion: what may stand at the cursor."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterable, Iterator
from itertools import islice
from typing import Final

from lsprotocol import types

from scenelang import words
from scenelang.elements.groups import told
from scenelang.lsp.callees import find_callee, word_of
from scenelang.lsp.context import Cursor, cursor_at
from scenelang.lsp.tokens import COLOURED
from scenelang.lsp.values import dimensions_of
from scenelang.lsp.workspace import Document, Workspace, scenes_below
from scenelang.models.manifest import available, load_manifest
from scenelang.records import Record
from scenelang.resolve.names import Names, Symbol
from scenelang.scene import library
from scenelang.syntax import nodes
from scenelang.words import COMBINE, UNITS

Kind = types.CompletionItemKind
_MOST_PATHS: Final = 200
_MOST_FILES: Final = 2000


class Item(Record):
    """A proposal.

    Args:
        text: what is inserted; the label without it.
        rank: one letter; what is likelier comes first.
        about: Markdown.
        snippet: whether ``text`` has placeholders.
    """

    label: str
    kind: Kind
    text: str = ""
    rank: str = "m"
    detail: str = ""
    about: str = ""
    snippet: bool = False


def units(typed: str) -> Iterator[Item]:
    """Units that a number may be getting."""
    number = re.match(r"[0-9]*\.?[0-9]*", typed)
    if number is None or not number[0] or number[0] == ".":
        return
    rest = typed[number.end() :]
    for unit in UNITS:
        if rest and unit.startswith(rest):
            yield Item(f"{number[0]}{unit}", Kind.Unit)


def strings(docs: Workspace, document: Document, before: tuple[str, ...]) -> Iterator[Item]:
    """What a string may say: a model's name, a file to import."""
    if before == ("model",):
        for manifest in map(load_manifest, available()):
            yield Item(manifest.name, Kind.Module, about=manifest.summary)
    elif before == ("import",):
        yield from (Item(name, Kind.File, rank="a") for name in library.names())
        folder = document.path.parent if document.path is not None else next(iter(docs.folders), None)
        for path in islice(scenes_below(folder, _MOST_FILES), _MOST_PATHS) if folder is not None else ():
            if path != document.path:
                yield Item(os.path.relpath(path, folder).replace(os.sep, "/"), Kind.File)


_HEADS: Final = ("let", "fn", "module", "for", "if", *words.NODES)
_SYMBOLS: Final = {
    "let": Kind.Variable,
    "param": Kind.Property,
    "argument": Kind.Variable,
    "loop": Kind.Variable,
    "fn": Kind.Function,
    "module": Kind.Module,
    "import": Kind.File,
}


def complete(docs: Workspace, document: Document, offset: int, snippets: bool) -> types.CompletionList:
    """What may stand at an offset."""
    names = document.names
    holders = ("let", "argument", "loop", "param")
    values = frozenset(s.name for s in names.visible(offset) if s.kind in holders)
    cursor = cursor_at(document.tokens, offset, values)
    start, end = cursor.start, cursor.end
    if cursor.inside == "string":
        start += 1
        end = max(end - (end > start and document.text[end - 1] == '"'), start)
    place = document.lines.range(start, end)
    items = []
    seen = set()
    for item in _Maker(docs, document, cursor, names).items():
        if item.label in seen:
            continue
        seen.add(item.label)
        filled = item.snippet and snippets
        text = item.text if item.text and (filled or not item.snippet) else item.label
        about = types.MarkupContent(types.MarkupKind.Markdown, item.about) if item.about else None
        items.append(
            types.CompletionItem(
                label=item.label,
                kind=item.kind,
                detail=item.detail or None,
                documentation=about,
                sort_text=f"{item.rank}{item.label}",
                filter_text=item.label,
                insert_text_format=types.InsertTextFormat.Snippet if filled else None,
                text_edit=types.TextEdit(place, text),
            )
        )
    return types.CompletionList(is_incomplete=False, items=items)


class _Maker:
    """Collects what fits at one cursor."""

    def __init__(self, docs: Workspace, document: Document, cursor: Cursor, names: Names) -> None:
        self.docs, self.document, self.cursor, self.names = docs, document, cursor, names
        dimensions = dimensions_of(document)
        self.geometries = {name for d in dimensions for name in words.LEAVES[d]}
        self.shadings = {name for d in dimensions for name in words.SHADINGS[d]}
        self.transforms = set(words.TRANSFORMS) - set(words.SOLID_TRANSFORMS if 3 not in dimensions else ())

    def items(self) -> Iterator[Item]:
        cursor, before = self.cursor, self.cursor.before
        last = before[-1] if before else ""
        if cursor.inside == "comment":
            return
        if cursor.inside == "string":
            yield from strings(self.docs, self.document, before)
        elif cursor.inside == "number":
            yield from units(self.document.text[cursor.start : cursor.offset])
        elif cursor.inside == "colour":
            return
        elif last == ".":
            yield from self._members(before)
        elif not before:
            yield from self._statements()
        elif last in ("let", "param", "fn", "module", "nsg", "as", "#") or before == ("for", "("):
            return
        elif before[:2] == ("for", "(") and len(before) == 3:
            yield Item("in", Kind.Keyword, "in ")
        elif before[0] == "import":
            if len(before) == 2:
                yield Item("as", Kind.Keyword, "as ")
        elif last == "material":
            yield from self._materials(self.shadings)
        elif before[-2:-1] == ("material",) and last in self.shadings:
            yield from self._materials(frozenset())
        elif (len(before) == 1 and last in COMBINE) or (before[0] in COMBINE and last == ")"):
            yield from self._children("a")
            yield from (self._keyword(word) for word in ("group", *COMBINE, "chain"))
        elif before[0] == "param" and len(before) > 3 and "in" not in before and _ends_operand(last):
            yield Item("in", Kind.Keyword, "in ", "a", about=words.KEYWORDS["in"].text)
        elif last == ")" and before[0] == "if":
            return
        elif before[0] in ("fn", "module") and ")" not in before and last in ("(", ","):
            return  # the name of a parameter
        elif not _ends_operand(last):
            yield from self._expressions()
        elif ".." in before or "..<" in before:
            yield Item("step", Kind.Keyword, "step ")

    # ------------------------------------------------------------ statements

    def _keyword(self, word: str, rank: str = "p") -> Item:
        known = words.KEYWORDS[word]
        text = known.snippet or f"{word} {{\n\t$0\n}}"
        return Item(word, Kind.Keyword, text, rank, known.head, known.text, True)

    def _statements(self) -> Iterator[Item]:
        block = self.cursor.block
        kind = block.kind
        if kind == "material":
            yield from self._calls(words.OPERATIONS, words.OPERATIONS, "a")
            yield from (self._keyword(word) for word in ("let", "for", "if"))
            return
        if kind == "file" and not block.nested:
            tops = [s for s in self.document.file.statements if isinstance(s, nodes.Version | nodes.Model)]
            given = {type(stmt) for stmt in tops}
            if nodes.Version not in given:
                yield self._keyword("nsg", "c")
            if nodes.Model not in given:
                yield self._keyword("model", "q")
            yield from (self._keyword(word, "q") for word in ("param", "import"))
            yield from self._calls(words.SETTINGS, words.SETTINGS, "q")
        if kind == "object":
            yield from self._calls(words.TRANSFORMS, self.transforms, "a")
            yield self._keyword("material", "b")
            yield from self._material_values("b")
            yield from (self._keyword(word) for word in ("let", "for", "if"))
            return
        yield from self._children("a")
        if kind == "chain":
            for word in COMBINE:
                yield Item(word, Kind.Keyword, f"{word} ", "b", about=words.KEYWORDS[word].text)
        yield from (self._keyword(word) for word in _HEADS if kind != "chain" or word not in COMBINE)
        if kind in ("group", "chain"):
            yield from self._calls(words.TRANSFORMS, self.transforms, "n")
            yield self._keyword("material", "n")
            yield from self._material_values("n")

    def _calls(self, known: dict[str, words.Word], offered: Iterable[str], rank: str) -> Iterator[Item]:
        for name in sorted(offered):
            yield _item(known[name], Kind.Method, rank)

    def _children(self, rank: str) -> Iterator[Item]:
        for name in sorted(self.geometries):
            text = f"{name} {{ ${{1:scale(0.5);}} }}"
            yield Item(name, Kind.Class, text, rank, "geometry", words.GEOMETRIES[name], True)
        for symbol in self.names.visible(self.cursor.offset):
            if symbol.kind == "module":
                yield self._symbol(symbol, statement=True)
            elif symbol.kind == "import":
                yield self._symbol(symbol)

    def _material_values(self, rank: str) -> Iterator[Item]:
        may_be = nodes.MaterialExpr | nodes.NameRef | nodes.Member
        for symbol in self.names.visible(self.cursor.offset):
            fits = symbol.kind != "let" or isinstance(getattr(symbol.node, "value", None), may_be)
            if fits and symbol.kind in ("let", "argument", "loop"):
                yield Item(symbol.name, Kind.Variable, f"{symbol.name};", rank, "material value")

    def _materials(self, constant: Collection[str]) -> Iterator[Item]:
        """Materials, and files that may hold others."""
        for name in sorted({*constant, *words.TEXTURES}):
            text, kind = f"{name} {{ ${{1:color(#d33);}} }}", "material" if name in constant else "texture"
            yield Item(name, Kind.EnumMember, text, "a", kind, words.MATERIALS.get(name, ""), True)
        for symbol in self.names.visible(self.cursor.offset):
            stmt = symbol.node
            zoo = self.docs.zoo(self.document, stmt) if isinstance(stmt, nodes.Import) else None
            if zoo is not None and zoo.materials:
                yield self._symbol(symbol)

    # ------------------------------------------------------------ expressions

    def _symbol(self, symbol: Symbol, *, statement: bool = False) -> Item:
        text, snippet = "", False
        if symbol.kind in ("fn", "module"):
            required = [p.name for p in symbol.params if not getattr(p.node, "default", None)]
            holes = ", ".join(f"${{{at}:{name}}}" for at, name in enumerate(required, 1))
            text, snippet = f"{symbol.name}({holes}){';' if statement else ''}", True
        elif symbol.kind == "import":
            text = symbol.name
        rank = "b" if symbol.scope.parent is not None else "d"
        word = word_of(symbol)
        return Item(symbol.name, _SYMBOLS[symbol.kind], text, rank, word.head, word.text, snippet)

    def _expressions(self) -> Iterator[Item]:
        callee = find_callee(self.docs, self.document, self.cursor)
        if callee is not None and self.cursor.call is not None:
            yield from self._arguments(callee)
        for symbol in self.names.visible(self.cursor.offset):
            if symbol.kind != "module":
                yield self._symbol(symbol)
        yield from (_item(word, Kind.Function, "k") for word in words.FUNCTIONS.values())
        for word in (words.CONSTANTS | words.ANIMATED).values():
            yield Item(word.name, Kind.Constant, "", "l", about=word.text)
        for name in ("true", "false"):
            yield Item(name, Kind.Keyword, "", "n")
        yield Item("material", Kind.Keyword, "material ", "n", about=words.KEYWORDS["material"].text)

    def _arguments(self, callee: words.Word) -> Iterator[Item]:
        """Names of arguments that are left, and values that the one at hand takes."""
        call = self.cursor.call
        assert call is not None
        positional = callee is not words.TRANSFORMS["shear"]
        name = call.named
        if name is None:
            start = self.cursor.before[-1] in ("(", ",")
            left = callee.params[call.index :] if positional else callee.params
            for param in left if start else ():
                if param not in call.given:
                    about = callee.notes.get(param, "")
                    yield Item(f"{param} =", Kind.Field, f"{param} = ", "a", "argument", about)
            if call.index < len(callee.params) and positional:
                name = callee.params[call.index]
        yield from self._values(callee.name, name)

    def _values(self, callee: str, param: str | None) -> Iterator[Item]:
        if param == "axis":
            for axis in ("X", "Y", "Z"):
                yield Item(axis, Kind.EnumMember, "", "0", about=words.CONSTANTS[axis].text)
        elif param == "loop":
            for value in ("true", "false"):
                yield Item(value, Kind.EnumMember, "", "0")
        elif param in ("angle", "fov"):
            for value, unit in (("30", "deg"), ("0.25", "turn"), ("0.5", "rad")):
                text = f"${{1:{value}}}{unit}"
                yield Item(f"{value}{unit}", Kind.Unit, text, "0", "an angle", "", True)
        elif param in ("c", "color") and callee in COLOURED:
            yield Item("#d33", Kind.Color, "#${1:d33}", "0", "a colour", "", True)
            for name in ("rgb", "hsv"):
                yield Item(name, Kind.Function, words.FUNCTIONS[name].snippet, "0", "a colour", "", True)
        if (callee, param) in (("background", "c"), ("ground", "y")):
            yield Item("none", Kind.EnumMember, "", "0", about=words.CONSTANTS["none"].text)

    def _members(self, before: tuple[str, ...]) -> Iterator[Item]:
        alias = before[-2] if len(before) > 1 else ""
        symbol = self.names.scope_at(self.cursor.offset).find(alias)
        if symbol is None or symbol.kind != "import" or not isinstance(symbol.node, nodes.Import):
            if before[-3:-2] != (".",) and re.fullmatch(r"[\w\])]+", alias):
                for name in "xyzrgb":
                    yield Item(name, Kind.Field)
            return
        zoo, worn = self.docs.zoo(self.document, symbol.node), "material" in before[-4:-2]
        for name, group in zoo.groups.items() if zoo is not None and not worn else ():
            yield Item(f"{name}()", Kind.Module, f"{name}() {{ $0 }}", "a", "group", told(group), True)
        for found in zoo.elements if zoo is not None else ():
            if found.material == worn:
                yield Item(
                    found.name, Kind.Class, f"{found.name} {{ $0 }}", "a", found.kind, found.told(), True
                )
        library = self.docs.imported(self.document, symbol.node.path.value)
        if library is None:
            return
        statement = len(before) == 2 or (len(before) == 3 and before[0] in COMBINE)
        for known in library.names.exported():
            if not statement or known.kind in ("module", "let"):
                yield self._symbol(known, statement=statement)


def _item(word: words.Word, kind: Kind, rank: str) -> Item:
    return Item(word.name, kind, word.snippet, rank, word.head, word.text, True)


def _ends_operand(text: str) -> bool:
    """Whether an expression can end with a token, so that an operator and not an operand comes next."""
    return text in (")", "]", "}", "true", "false") or (
        (text[:1].isalnum() or text[:1] in '_#"') and text not in words.KEYWORDS
    )
