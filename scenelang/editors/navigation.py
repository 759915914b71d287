"""Meaning and targets of a place: definition, references, rename, links, symbols, folding, hover, hints."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import groupby
from typing import Any, Final

from lsprotocol import types

from scenelang.assets.element import Element, told
from scenelang.compiler.chain import merged
from scenelang.compiler.graph import Move
from scenelang.compiler.manifest import Manifest, load_manifest
from scenelang.compiler.steps import composed
from scenelang.editors import completion
from scenelang.editors.completion import space_of
from scenelang.editors.context import find_symbol, path_to, word_of
from scenelang.editors.workspace import ClientSettings, Document, Seen, Workspace, uri_of
from scenelang.language import library, tree, words
from scenelang.language import scene_text as to_nsg
from scenelang.language.definitions import Symbol, Use
from scenelang.language.tree import walk
from scenelang.language.values import show
from scenelang.language.words import LANGUAGE, RESERVED, STAGE, word_for_call

_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


class RenameRefused(Exception):
    """Raised where a name cannot be changed, with the reason."""


def definition(docs: Workspace, document: Document, offset: int) -> types.Location | None:
    """The definition of the name at an offset; for an import's path the file."""
    if (use := document.names.at(offset)) is None:
        return None
    if use.role == "path":
        library = docs.imported(document, use.text)
        return types.Location(library.uri, library.lines.range(0, 0)) if library is not None else None
    result = docs.definition(document, use)
    if result is None and use.symbol is not None and use.symbol.kind == "import":
        result = document, use.symbol  # a file of elements
    if result is None:
        return None
    where, symbol = result
    return types.Location(where.uri, where.lines.span(symbol.span))


def references(docs: Workspace, document: Document, offset: int, declaration: bool) -> list[types.Location]:
    """All uses of the definition that the name at an offset means."""
    use = document.names.at(offset)
    result = docs.definition(document, use) if use is not None else None
    return [
        types.Location(where.uri, where.lines.range(use.start, use.end))
        for where, use in (docs.uses(*result) if result is not None else ())
        if declaration or not use.defines
    ]


def highlights(docs: Workspace, document: Document, offset: int) -> list[types.DocumentHighlight]:
    """The uses in this file of the definition that the name at an offset means."""
    if (use := document.names.at(offset)) is None:
        return []
    result = docs.definition(document, use)

    def alike(other: Use) -> bool:
        if result is None:  # a word of the language: the same word elsewhere
            return other.role == use.role
        meant = docs.definition(document, other)
        return meant is not None and meant[1] is result[1]

    same = [other for other in document.names.uses if other.text == use.text and alike(other)]
    read, write = types.DocumentHighlightKind.Read, types.DocumentHighlightKind.Write
    place = document.lines.range
    return [types.DocumentHighlight(place(u.start, u.end), write if u.defines else read) for u in same]


def prepare_rename(docs: Workspace, document: Document, offset: int) -> types.PrepareRenamePlaceholder | None:
    """The name at an offset; raises `RenameRefused` where it belongs to the language or to a model."""
    if (use := document.names.at(offset)) is None:
        return None
    if (result := docs.definition(document, use)) is None:
        raise RenameRefused(f"`{use.text}` is not defined in a scene file")
    _check_owner(result[0], use)
    return types.PrepareRenamePlaceholder(document.lines.range(use.start, use.end), use.text)


def rename(
    docs: Workspace, document: Document, offset: int, new: str, versioned: bool
) -> types.WorkspaceEdit | None:
    """Rename a definition and all its uses, in all files, in versioned edits where the client takes them.

    Raises `RenameRefused` where the new name is not a name, or would mean something else somewhere.
    """
    use = document.names.at(offset)
    result = docs.definition(document, use) if use is not None else None
    if result is None or use is None:
        return None
    where, symbol = result
    _check_owner(where, use)
    if new == symbol.name:
        return None
    if not _NAME.fullmatch(new):
        raise RenameRefused(f"`{new}` is not a name: letters, digits and _, not beginning with a digit")
    if new in RESERVED:
        raise RenameRefused(f"`{new}` is a keyword")
    if symbol.kind == "module" and new in LANGUAGE:
        raise RenameRefused(f"`{new}` is a word of the language and names no module")
    places = list(docs.uses(where, symbol))
    for other, place in places:
        _check_place(other, place, symbol, new)
    _check_captures(docs, where, symbol, new)
    edits: dict[str, list[types.TextEdit]] = {}
    for other, place in places:
        edits.setdefault(other.uri, []).append(types.TextEdit(other.lines.range(place.start, place.end), new))
    if not versioned:
        return types.WorkspaceEdit(changes=edits)
    name, versions = types.OptionalVersionedTextDocumentIdentifier, {d.uri: d.version for d, _ in places}
    changes = [types.TextDocumentEdit(name(uri, versions[uri]), edits[uri]) for uri in edits]
    return types.WorkspaceEdit(document_changes=changes)


def _check_owner(where: Document, use: Use) -> None:
    if where.path is not None and library.owns(where.path):
        raise RenameRefused(f"`{use.text}` belongs to the library that ships")


def _check_place(other: Document, place: Use, symbol: Symbol, new: str) -> None:
    """Raise `RenameRefused` where the new name already means something else at a place to rename."""
    if place.role in ("member", "argument"):
        return
    scope = symbol.scope if place.defines else other.names.scope_at(place.start)
    for inner in scope.outwards():
        if (taken := inner.names.get(new)) is not None:
            line = taken.span.locate()[0][0]
            raise RenameRefused(f"`{new}` is already defined in line {line} of {other.name}")
        if inner is symbol.scope:
            return


def _check_captures(docs: Workspace, where: Document, symbol: Symbol, new: str) -> None:
    """Raise `RenameRefused` where the new name, now of something else, would come to mean the definition."""
    scope = symbol.scope
    if symbol.owner is not None and any(p.name == new for p in symbol.owner.params):
        raise RenameRefused(f"`{symbol.owner.name}` has a parameter `{new}` already")
    for use in where.names.uses:
        if use.text != new or use.role in ("member", "argument", "property", "material", "model", "path"):
            continue
        if not scope.start <= use.start < scope.end:
            continue
        meant = where.names.scope_at(use.start).find(new)
        if meant is None or not (scope.start <= meant.scope.start and meant.scope.end <= scope.end):
            line = where.lines.position(use.start).line + 1
            raise RenameRefused(f"`{new}` in line {line} of {where.name} would mean this")


def links(docs: Workspace, document: Document) -> list[types.DocumentLink]:
    """Links of imports whose files there are."""
    result = []
    for path in (stmt.path for stmt in document.file.statements if isinstance(stmt, tree.Import)):
        if (library := docs.imported(document, path.value)) is not None and library.path is not None:
            place = document.lines.range(path.span.start + 1, max(path.span.end - 1, 0))
            result.append(types.DocumentLink(place, uri_of(library.path), tooltip=str(library.path)))
    return result


Kind = types.SymbolKind
_DEFINES: Final = {
    tree.Param: Kind.Property,
    tree.Let: Kind.Variable,
    tree.Fn: Kind.Function,
    tree.Module: Kind.Module,
}
# Possessive: a string or comment without end is read once, not once for each of its characters.
_COMMENT: Final = re.compile(
    r'"(?:[^"\\\n]|\\[^\n])*+"?|/\*(?:[\s\S]*?\*/|[\s\S]*)|(?:^[ \t]*+//[^\n]*+\n?)++', re.MULTILINE
)


def symbols(document: Document, statements: Iterable[tree.Stmt]) -> Iterator[types.DocumentSymbol]:
    """Definitions and objects among statements, as a tree."""
    for stmt in statements:
        word = ""
        if isinstance(stmt, tree.Combined):
            word, stmt = f"{stmt.op} ", stmt.child
        if (entry := _entry(stmt)) is None:
            continue
        name, kind, selection, inner, detail = entry
        yield types.DocumentSymbol(
            name=word + name,
            kind=kind,
            range=document.lines.span(stmt.span),
            selection_range=document.lines.span(selection),
            detail=detail or None,
            children=list(symbols(document, inner)),
        )


def _entry(stmt: tree.Stmt) -> tuple[str, types.SymbolKind, Any, tuple[tree.Stmt, ...], str] | None:
    match stmt:
        case tree.Param() | tree.Let():
            value = stmt.default if isinstance(stmt, tree.Param) else stmt.value
            shown = " ".join(value.span.text.split())[:60]
            return stmt.name.text, _DEFINES[type(stmt)], stmt.name.span, (), shown
        case tree.Fn() | tree.Module():
            inner = stmt.body.statements if isinstance(stmt, tree.Module) else ()
            params = ", ".join(p.name.text for p in stmt.params)
            return stmt.name.text, _DEFINES[type(stmt)], stmt.name.span, inner, f"({params})"
        case tree.Import():
            return stmt.alias.text, Kind.File, stmt.alias.span, (), stmt.path.value
        case tree.Node():
            detail = f"({', '.join(arg.span.text for arg in stmt.args)})" if stmt.args else ""
            return stmt.kind, Kind.Struct, stmt.keyword, stmt.body.statements, detail
        case tree.Call() if stmt.name.text in STAGE and stmt.args is not None and stmt.body is None:
            detail = f"({', '.join(arg.span.text for arg in stmt.args)})"
            return stmt.name.text, Kind.Field, stmt.name.span, (), detail
        case tree.For():
            return f"for {stmt.variable.text}", Kind.Array, stmt.variable.span, stmt.body.statements, ""
        case tree.If():
            inner = stmt.then.statements
            other = stmt.otherwise
            inner += (other,) if isinstance(other, tree.If) else other.statements if other else ()
            return "if", Kind.Boolean, stmt.condition.span, inner, ""
        case tree.Call() if stmt.body is not None or stmt.args is None:
            within = stmt.body.statements if stmt.body else ()
            nested = tuple(s for s in within if isinstance(s, tree.Let | tree.For | tree.If))
            return stmt.name.text, Kind.Object, stmt.name.span, nested, ""
        case _:
            return None


def workspace_symbols(docs: Workspace, query: str) -> list[types.WorkspaceSymbol]:
    """Definitions at the top of all files whose names have the letters of a query, in order."""
    query, result = query.lower(), []
    for document in docs.known():
        for stmt in document.file.statements:
            if isinstance(stmt, tree.Param | tree.Let | tree.Fn | tree.Module):
                letters = iter(stmt.name.text.lower())
                if not all(letter in letters for letter in query):
                    continue
                place = types.Location(document.uri, document.lines.span(stmt.name.span))
                kind = _DEFINES[type(stmt)]
                result += [types.WorkspaceSymbol(place, stmt.name.text, kind, container_name=document.name)]
                if len(result) >= 500:
                    return result
    return result


def folding(document: Document) -> list[types.FoldingRange]:
    """Blocks, brackets, comments and runs of imports that take more than a line."""
    result: dict[int, types.FoldingRange] = {}
    lines = document.lines

    def add(start: int, end: int, kind: types.FoldingRangeKind | None = None, tail: int = 0) -> None:
        first, last = lines.position(start).line, lines.position(end).line - tail
        if last > first:
            result.setdefault(first, types.FoldingRange(first, last, kind=kind))

    for stmt in document.file.statements:
        for node in walk(stmt):
            if isinstance(node, tree.Block | tree.Vector):
                closes = document.text[node.span.end - 1 : node.span.end] in ("}", "]")
                add(node.span.start, node.span.end, None, int(closes))
    for group, run in groupby(document.file.statements, lambda stmt: isinstance(stmt, tree.Import)):
        if group:
            imports = list(run)
            add(imports[0].span.start, imports[-1].span.end, types.FoldingRangeKind.Imports)
    for match in _COMMENT.finditer(document.text):
        if not match[0].startswith('"'):
            add(match.start(), match.end() - match[0].endswith("\n"), types.FoldingRangeKind.Comment)
    return [result[line] for line in sorted(result)]


def selection(document: Document, offset: int) -> types.SelectionRange:
    """The nodes around an offset, innermost first, each within the next."""
    spans = [(0, len(document.text)), *((n.span.start, n.span.end) for n in path_to(document.file, offset))]
    if (use := document.names.at(offset)) is not None:
        spans.append((use.start, use.end))
    result: types.SelectionRange | None = None
    last = (-1, -1)
    for start, end in spans:
        if (start, end) != last and (last == (-1, -1) or (last[0] <= start and end <= last[1])):
            result = types.SelectionRange(document.lines.range(start, end), result)
            last = (start, end)
    assert result is not None
    return result


_TABLES: Final = {
    "function": words.FUNCTIONS,
    "constant": words.CONSTANTS,
    "animated": words.ANIMATED,
    "setting": words.SETTINGS,
}


def hover(
    docs: Workspace, document: Document, offset: int, picture: Callable[[Element], str] = lambda element: ""
) -> types.Hover | None:
    """The hover at an offset; ``picture`` gives an element's picture in Markdown."""
    if (use := document.names.at(offset)) is not None:
        text = _elements(docs, document, use, picture) or _use(docs, document, use)
        return _answer(document, use.start, use.end, text) if text else None
    for node in reversed(path_to(document.file, offset)):
        start, head = node.span.start, re.match(r"[a-z]+", node.span.text)
        if head is not None and head[0] in words.RESERVED and offset <= start + len(head[0]):
            text = _word(words.KEYWORDS[head[0]]) + _node_facts(document, node)
            return _answer(document, start, start + len(head[0]), text)
    return None


def _answer(document: Document, start: int, end: int, text: str) -> types.Hover:
    content = types.MarkupContent(types.MarkupKind.Markdown, text)
    return types.Hover(content, document.lines.range(start, end))


def _code(text: str) -> str:
    return f"```nsg\n{text}\n```"


def _word(word: words.Word) -> str:
    about = [f"- `{name}`: {line}" for name, line in word.notes.items()]
    return "\n\n".join([_code(word.head), word.text, *(["\n".join(about)] if about else [])])


def _use(docs: Workspace, document: Document, use: Use) -> str | None:
    if (result := docs.definition(document, use)) is not None:
        return _definition(document, *result)
    text = use.text
    match use.role:
        case "function" | "constant" | "animated" | "setting":
            return _word(_TABLES[use.role][text]) if text in _TABLES[use.role] else None
        case "transform" | "operation":
            table = words.OPERATIONS if use.role == "operation" else words.TRANSFORMS
            return (_word(table[text]) + _transform_facts(document, use)) if text in table else None
        case "geometry":
            about = _offered(text, text, words.GEOMETRIES)
            about = f"{_word(words.OUTLINES[text])}\n\nof flat scenes" if text in words.OUTLINES else about
            node = next((n for n in _calls(document, use) if n.name.text == text), None)
            return about and about + _node_facts(document, node)
        case "material":
            return _offered(f"material {text}", text, words.MATERIALS | words.PAINTS)
        case "model":
            try:
                return _model(load_manifest(text))
            except KeyError:
                return None
        case "argument":
            word = word_for_call(use.callee.text, use.callee.role == "operation") if use.callee else None
            if word is None or text not in word.params:
                return None
            line = word.notes.get(text)
            return f"{_code(word.head)}\n\n`{text}`: {line}" if line else _code(word.head)
        case "path":
            library = docs.imported(document, text)
            return f"`{library.path}`" if library is not None else "no such file"
    return None


def _elements(docs: Workspace, document: Document, use: Use, picture: Callable[[Element], str]) -> str | None:
    """The geometry or material of an imported file that a name means, in Markdown."""
    worn, symbol = use.role == "material", use.symbol
    if not (worn or use.role == "member") or symbol is None or not isinstance(symbol.node, tree.Import):
        return None
    zoo, name = docs.zoo(document, symbol.node), use.text.partition(".")[0]
    if zoo is None:
        return ""
    if zoo.font is not None and name in words.LETTERS and not worn:
        about = (f"{key}: {value}" for key, value in zoo.font.about.items())
        letters = "\n".join([f"a font of {len(zoo.font.letters):,} letters", *about]).replace("`", "'")
        return f"{_word(words.LETTERS[name])}\n\n```text\n{letters}\n```"
    result = [e for e in zoo.elements if name in (e.name, *e.values) and e.material == worn]
    parts = [f"```text\n{e.told().replace('`', chr(39))}\n```{picture(e)}" for e in result]
    if name in zoo.groups and not worn:
        parts.append(f"```text\n{name}(): {told(zoo.groups[name])}\n```")
    return "\n\n".join(parts)


def _definition(document: Document, where: Document, symbol: Symbol) -> str:
    word = word_of(symbol)
    parts = [_code(word.head), *([word.text] if word.text else [])]
    seen = seen_at(document, where, symbol.span.start, symbol.span.end)
    shown = [completion.show_value(value) for value in seen.values] if seen is not None else []
    known = list(dict.fromkeys(text for text in shown if text is not None))
    line = "= " + ", ".join(f"`{text}`" for text in known) if known else ""
    line += ", …" if seen is not None and seen.count > len(seen.values) and len(known) > 1 else ""
    node = symbol.node
    value = node.value if isinstance(node, tree.Let) else getattr(node, "default", None)
    if line and not (value is not None and line == f"= `{value.span.text}`"):  # it stands there
        parts.append(line)
    if where is not document and where.path is not None:
        parts.append(f"in `{where.path.name}`")
    return "\n\n".join(parts)


def seen_at(document: Document, where: Document, start: int, end: int) -> Seen | None:
    """Values of a place in a document's last check; None where it has been edited since."""
    if (checked := document.checked) is None:
        return None
    if where is document:
        old_start, old_end = document.before(start), document.before(end)
        if old_start is None or old_end is None:
            return None
        start, end = old_start, old_end
    return checked.seen.get((where.source.name, start, end))


def _offered(head: str, text: str, about: Mapping[str, str]) -> str | None:
    """A geometry or a material with its description."""
    if text not in about:
        return None
    dimension = words.dimension_of(text)
    scenes = "" if dimension is None else f"\n\nof {words.SCENES[dimension]} scenes"
    return f"{_code(f'{head} {{ … }}')}\n\n{about[text]}{scenes}"


def _model(manifest: Manifest) -> str:
    ranges = [f"{name} {low:g} to {high:g}" for name, (low, high) in manifest.trained.items()]
    rows = [
        ("geometries", ", ".join(manifest.geometries)),
        ("materials", ", ".join(manifest.materials)),
        ("measured for", "; ".join(ranges)),
    ]
    table = "\n".join(f"| {name} | {text} |" for name, text in rows if text)
    head = f"{_code(f'model {chr(34)}{manifest.name}{chr(34)};')}\n\n{manifest.summary}"
    return f"{head}\n\n| {manifest.dimension}D | |\n|---|---|\n{table}"


def _calls(document: Document, use: Use) -> Iterator[tree.Call]:
    """The calls around a name, the innermost first."""
    path = path_to(document.file, use.start)
    return (node for node in reversed(path) if isinstance(node, tree.Call))


def _transform_facts(document: Document, use: Use) -> str:
    """The matrix or the formula of a transform."""
    node = next(_calls(document, use), None)
    seen = seen_at(document, document, node.span.start, node.span.end) if node is not None else None
    values = seen.values if seen is not None else []
    parts, space = [], space_of(document)
    for item in values[:2]:
        steps = completion.steps_of((item,), space) if item.kind in words.TRANSFORMS else ()
        if (shown := next(completion.show_steps(steps, space), None)) is not None:
            parts.append(f"`{to_nsg.transform(item)}`\n\n```text\n{shown}\n```")
    more = "\n\n…" if len(values) > 2 else ""
    return "\n\n---\n\n" + "\n\n".join(parts) + more if parts else ""


def _node_facts(document: Document, node: Any) -> str:
    """The composed chain of an object or a group, and the number of times that it was created."""
    if not isinstance(node, tree.Call | tree.Node):
        return ""
    seen = seen_at(document, document, node.span.start, node.span.end)
    created = [item for item in (seen.values if seen else ()) if getattr(item, "transforms", None)]
    if seen is None or not created:
        return ""
    space = space_of(document)
    item = created[0]
    steps = completion.steps_of(item.transforms, space)
    low, high = space.stretches(composed(steps))
    stretch = show(low) if abs(low - high) < 1e-9 * max(high, 1.0) else f"{show(low)} to {show(high)}"
    merged_steps = (move.step for move in merged(map(Move, steps)))
    chain = "\n".join(to_nsg.transform(t) for t in item.transforms)
    times = f" (the first of {seen.count})" if seen.count > 1 else ""
    shown = completion.show_steps(merged_steps, space)
    whole = "\n\nthen\n\n".join(f"```text\n{step}\n```" for step in shown)
    return f"\n\n---\n\ntransforms{times}:\n{_code(chain)}\ncomposed:\n\n{whole}\n\nscales by {stretch}"


_LONGEST: Final = 28
_PLAIN: Final = (tree.NumberLiteral, tree.String, tree.Bool, tree.ColorLiteral, tree.Unary, tree.Vector)
_CLEAR: Final = {"translate", "rotate", "scale", "canvas", "color", "min", "max", "rgb", "hsv", "animate"}


def inlay_hints(
    docs: Workspace, document: Document, place: types.Range, settings: ClientSettings
) -> list[types.InlayHint]:
    """The hints of a range."""
    low, high = document.lines.offset(place.start), document.lines.offset(place.end)
    result: list[types.InlayHint] = []
    inside = (s for s in document.file.statements if s.span.end >= low and s.span.start <= high)
    for node in (node for stmt in inside for node in walk(stmt)):
        if node.span.end < low or node.span.start > high:
            continue
        if isinstance(node, tree.Let) and settings.value_hints and (hint := _value(document, node)):
            result.append(hint)
        elif isinstance(node, tree.Call | tree.CallExpr) and settings.argument_hints:
            result += _arguments(docs, document, node)
    return sorted(result, key=lambda hint: (hint.position.line, hint.position.character))


def _value(document: Document, let: tree.Let) -> types.InlayHint | None:
    """The value of a let, unless it is written there or differs from pass to pass."""
    if all(isinstance(node, _PLAIN) for node in walk(let.value)):
        return None
    seen = seen_at(document, document, let.name.span.start, let.name.span.end)
    if seen is None or not seen.values:
        return None
    shown = {completion.show_value(value) for value in seen.values}
    text = shown.pop()
    if shown or text is None or len(text) > _LONGEST or text == let.value.span.text:
        return None
    place, tooltip = document.lines.position(let.value.span.end), "the value that this scene gives it"
    return types.InlayHint(place, f" = {text}", padding_left=False, tooltip=tooltip)


def _arguments(docs: Workspace, document: Document, call: tree.Call | tree.CallExpr) -> list[types.InlayHint]:
    name = call.name.text
    args = call.args or ()
    if name in _CLEAR or not args:
        return []
    result = find_symbol(docs, document, name, call.name.span.start)
    callee = word_of(result) if result is not None else word_for_call(name, False)
    if callee is None or callee.variadic or len(callee.params) < 2:
        return []
    hints = []
    for arg, param in zip(args, callee.params, strict=False):
        value = arg.value
        alike = isinstance(value, tree.NameRef) and value.name.text == param
        if arg.name is not None or alike or isinstance(value, tree.BadExpr):
            continue
        if result is None and len(param) == 1:
            continue  # x, y, t: shorter than any help
        place = document.lines.position(arg.span.start)
        hints.append(types.InlayHint(place, f"{param}:", types.InlayHintKind.Parameter, padding_right=True))
    return hints
