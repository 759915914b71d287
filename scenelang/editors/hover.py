"""Hover and inlay hints: the meaning of a word, and its value when the scene was evaluated."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
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
from scenelang.editors.workspace import ClientSettings, Document, Seen, Workspace
from scenelang.language import scene_text as to_nsg
from scenelang.language import tree, words
from scenelang.language.definitions import Symbol, Use
from scenelang.language.tree import walk
from scenelang.language.values import show
from scenelang.language.words import word_for_call

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
    names = (name, name.removesuffix("_size"))  # what an element says has its size
    result = [element for element in zoo.elements if element.name in names and element.material == worn]
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
