"""Scenes to JSON and back, whatever their depth, with clear errors for hostile text.

pydantic does the work where it can. Its JSON reader stops at 200 brackets and its writer at about as
many nested models, while a Scene may nest 400 nodes: deeper ones are taken apart here.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import field
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final, TypeVar

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails, PydanticSerializationError

from scenelang.assets.files import depth_of_json, no_number
from scenelang.assets.records import Record, deep_stack
from scenelang.language import nodes
from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile, Span
from scenelang.language.library import SpanMap, Written
from scenelang.language.nodes import MAX_NODE_DEPTH, TAGS, Link, Object, SceneNode, said
from scenelang.language.reports import SceneError
from scenelang.language.scene_data import SceneData
from scenelang.language.words import BLEND

Key = str | int
_HEADINGS: Final = ("model", "geometry", "op", "name", "kind")
"""Keys that tell what a node is, the most telling first."""

# Possessive: text without end is read once, not once for each of its characters.
_TOKENS: Final = re.compile(r'"(?:[^"\\]++|\\.)*+"?|[\[\]{},:]|[^\s\[\]{},:"]++', re.DOTALL)


class Value(Record, frozen=False):
    """A JSON value: its place in the text and, in a list or an object, the values in it."""

    start: int
    end: int = -1
    items: dict[Key, Value] = field(default_factory=dict)

    def span(self, source: SourceFile) -> Span:
        """The place as a span."""
        return Span(source, self.start, self.end)

    def get(self, key: Key) -> Value:
        """The value at ``key``, or this one where there is none."""
        return self.items.get(key, self)


def deeper_than(text: str, most: int) -> int:
    """Offset at which brackets first nest deeper than ``most``, in a text where they do."""
    depth = 0
    for token in _TOKENS.finditer(text):
        first = text[token.start()]
        if first in "[{":
            depth += 1
            if depth > most:
                return token.start()
        elif first in "]}":
            depth -= 1
    return len(text)


def read_places(text: str, twice: list[Value] | None = None) -> Value:
    """The places in a text that is known to be JSON; keys that their object has already go to ``twice``."""
    root = Value(0, len(text))
    stack: list[tuple[Value, bool]] = []  # open lists and objects, and whether they are lists
    key: Key | None = None
    for token in _TOKENS.finditer(text):
        first = text[token.start()]
        if first in ",:":
            continue
        if first in "]}":
            value, _ = stack.pop()
            value.end = token.end()
            key = None
        else:
            if stack:
                inside, is_list = stack[-1]
                if is_list:
                    key = len(inside.items)
                elif key is None:
                    word = token.group()
                    key = str(json.loads(word)) if "\\" in word else word[1:-1]
                    if twice is not None and key in inside.items:
                        twice.append(Value(token.start(), token.end()))
                    continue
                value = inside.items[key] = Value(token.start(), token.end())
            else:
                value = root = Value(token.start(), token.end())
            key = None
            if first in "[{":
                stack.append((value, first == "["))
    return root


def follow(root: Value, location: Sequence[Key]) -> tuple[Value, str]:
    """Value at pydantic's location of an error, and its path as `nodes[0].transforms[1].x`.

    A location also names the kinds of nodes on the way, which JSON does not nest by, and may end in a
    name that is missing.
    """
    value, path = root, ""
    for at, key in enumerate(location):
        if key in value.items:
            value = value.items[key]
        elif at + 1 < len(location) or isinstance(key, int) or key in TAGS:
            continue
        path += f"[{key}]" if isinstance(key, int) else f".{key}" if path else key
    return value, path


def record_places(scene: SceneData, root: Value, source: SourceFile, spans: SpanMap) -> None:
    """Put the places of a scene and all its nodes, transforms and materials into ``spans``."""
    todo: list[tuple[BaseModel, Value]] = [(scene, root)]
    while todo:
        node, value = todo.pop()
        heading = next((name for name in _HEADINGS if name in type(node).model_fields), "")
        if heading in value.items or node is not scene:
            spans.record(node, Written(value.get(heading).span(source), value.span(source)))
        for name, item in node:
            here = value.get(name)
            items = enumerate(item) if isinstance(item, tuple) else ()
            todo += [(part, here.get(at)) for at, part in items if isinstance(part, BaseModel)]
            if isinstance(item, BaseModel):
                todo.append((item, here))


S = TypeVar("S", bound=SceneData)

MAX_CHARS: Final = 200_000_000
_BRACKETS_PER_NODE: Final = 3  # a link of a chain: list, link, node
_PLAIN_DEPTH: Final = 150  # brackets that pydantic reads by itself
_MAX_SHOWN: Final = 20
_MAX_PATH: Final = 80
_WIDTH: Final = 90


def to_json(scene: SceneData) -> str:
    """JSON of a Scene, on one line."""
    try:
        return scene.model_dump_json()
    except PydanticSerializationError:
        with deep_stack():
            return json.dumps(_plain(scene), separators=(",", ":"), allow_nan=False)


def to_readable_json(scene: SceneData) -> str:
    """JSON of a Scene for people: what differs from the defaults, indented, short values on one line."""
    with deep_stack():
        return _laid_out(_plain(scene, brief=True), "") + "\n"


def _plain(value: Any, *, brief: bool = False) -> Any:
    if isinstance(value, BaseModel):
        fields = type(value).model_fields
        return {
            name: _plain(item, brief=brief)
            for name, item in value.__dict__.items()
            if not brief or name in ("kind", "version") or not _same(item, fields[name].default)
        }
    return [_plain(item, brief=brief) for item in value] if isinstance(value, tuple) else value


def _same(item: Any, default: Any) -> bool:
    """Test whether a value is the default, bit for bit: -0.0 is not 0.0."""
    return bool(item == default) and repr(item) == repr(default)


def _laid_out(value: Any, margin: str) -> str:
    """JSON text whose lists and objects go over several lines where one is too short for them."""
    if not isinstance(value, dict | list) or not value:
        return json.dumps(value, ensure_ascii=False, allow_nan=False)
    inner = margin + "  "
    if isinstance(value, dict):
        parts = [f"{json.dumps(key)}: {_laid_out(item, inner)}" for key, item in value.items()]
    else:
        parts = [_laid_out(item, inner) for item in value]
    start, end = "{}" if isinstance(value, dict) else "[]"
    if sum(map(len, parts)) + 2 * len(parts) + len(margin) <= _WIDTH and not any("\n" in p for p in parts):
        return f"{start}{', '.join(parts)}{end}"
    return f"{start}\n{inner}" + f",\n{inner}".join(parts) + f"\n{margin}{end}"


def from_json(text: str | bytes, kind: type[S], root: Path | None = None) -> S:
    """A Scene of class ``kind`` from JSON, with its files of elements if their folder is given.

    Raises:
        SceneError: text that is not JSON, or not a Scene, or a file that cannot be read.
    """
    if isinstance(text, bytes):
        try:
            text = text.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise _failure(f"not UTF-8 text: byte {error.start}") from None
    source = SourceFile("<json>", text)
    scene, diagnostics = _read(source, kind), Diagnostics()
    if root is not None and scene.elements:
        _read_elements(scene, root, source, read_places(text), diagnostics)
    if diagnostics.errors:
        raise SceneError(diagnostics)
    return scene


def load_json(
    source: SourceFile, kind: type[S], diagnostics: Diagnostics, root: Path | None = None
) -> tuple[S | None, SpanMap]:
    """A Scene from JSON text, or None after reports, and where its nodes are written there.

    Its files of elements are read from the folder ``root``, if there is one.
    """
    spans = SpanMap()
    try:
        scene = _read(source, kind)
    except SceneError as error:
        for d in error.diagnostics:
            diagnostics.add(d.code, d.message, d.span, help=d.help)
        return None, spans
    places = read_places(source.text)
    record_places(scene, places, source, spans)
    if root is not None:
        _read_elements(scene, root, source, places, diagnostics)
    return scene, spans


def _read_elements(
    scene: SceneData, root: Path, source: SourceFile, places: Value, diagnostics: Diagnostics
) -> None:
    for at, file in enumerate(scene.elements):
        if (fault := file.read(root)) is not None:
            value, _ = follow(places, ("elements", at, "path"))
            diagnostics.add(*fault, value.span(source))


def _read(source: SourceFile, kind: type[S]) -> S:
    text = source.text
    if len(text) > MAX_CHARS:
        raise _failure(f"more than {MAX_CHARS:,} characters of JSON")
    depth, most = depth_of_json(text), (MAX_NODE_DEPTH + 4) * _BRACKETS_PER_NODE
    if depth > most:
        bracket = deeper_than(text, most)
        raise _failure(f"nodes nested deeper than {MAX_NODE_DEPTH}", Span(source, bracket, bracket + 1))
    try:
        if depth <= _PLAIN_DEPTH:
            scene = kind.model_validate_json(text)
        else:
            with deep_stack():
                scene = _read_deep(source, kind)
            if _node_depth(scene) > MAX_NODE_DEPTH:
                raise _failure(f"nodes nested deeper than {MAX_NODE_DEPTH}")
    except ValidationError as error:
        raise SceneError(_problems(error, source)) from None
    except UnicodeEncodeError as error:
        half = Span(source, error.start, error.end)
        raise _failure(f"half of a character at {error.start}", half) from None
    _refuse_repeated(source)
    return scene


def _refuse_repeated(source: SourceFile) -> None:
    """Refuse a sound text whose objects have a key twice: readers take the last one, people see the first."""
    repeated = False

    def note(pairs: list[tuple[str, Any]]) -> None:
        nonlocal repeated
        repeated = repeated or len({key for key, _ in pairs}) < len(pairs)

    with deep_stack():
        json.loads(source.text, object_pairs_hook=note, parse_int=len)  # of long numbers Python refuses some
    if repeated:
        twice: list[Value] = []
        read_places(source.text, twice)
        result = [Diagnostic("E0313", "a key that the object has already", v.span(source)) for v in twice]
        raise SceneError(result[:_MAX_SHOWN])


def _node_depth(scene: SceneData) -> int:
    """Depth of nested nodes: 0 where none holds another."""
    depth, level = -1, list(scene.nodes)
    while level:
        depth += 1
        inside = [child for node in level if not isinstance(node, Object) for child in node.children]
        level = [child.node if isinstance(child, Link) else child for child in inside]
    return depth


def _read_deep(source: SourceFile, kind: type[S]) -> S:
    try:
        data = json.loads(source.text, parse_constant=no_number)
    except ValueError as error:
        raise _no_json(error, source) from None
    if isinstance(data, dict) and isinstance(data.get("nodes"), list):
        adapter: TypeAdapter[Any] = TypeAdapter(SceneNode)
        built = [_build(node, adapter, source, ("nodes", at)) for at, node in enumerate(data["nodes"])]
        data = {**data, "nodes": built}
    return kind.model_validate(data)


def _build(data: Any, adapter: TypeAdapter[Any], source: SourceFile, path: tuple[Key, ...]) -> Any:
    """A node whose children are validated before it, so that no validation goes deep."""
    if isinstance(data, dict) and isinstance(data.get("children"), list):
        inside = [(*path, "children", at) for at in range(len(data["children"]))]
        children = [
            {**child, "node": _build(child["node"], adapter, source, (*here, "node"))}
            if data.get("kind") == "chain" and isinstance(child, dict) and "node" in child
            else _build(child, adapter, source, here)
            for child, here in zip(data["children"], inside, strict=True)
        ]
        for child in (data, *children):
            if isinstance(child, dict) and child.get("k") == BLEND:
                child["k"] = None
        data = {**data, "children": children}
    try:
        return adapter.validate_python(data)
    except ValidationError as error:
        raise SceneError(_problems(error, source, path)) from None


def _failure(message: str, span: Span | None = None, help: str | None = None) -> SceneError:
    return SceneError([Diagnostic("E0313", message, span, help=help)])


def _no_json(error: ValueError, source: SourceFile) -> SceneError:
    if isinstance(error, json.JSONDecodeError):
        said = error.msg[:1].lower() + error.msg[1:]
        return _failure(f"not JSON: {said}", Span(source, error.pos, min(error.pos + 1, len(source.text))))
    reason = str(error).partition(":")[0]
    return _failure(f"not JSON: {reason[:1].lower()}{reason[1:]}")


def _problems(error: ValidationError, source: SourceFile, path: tuple[Key, ...] = ()) -> list[Diagnostic]:
    """One diagnostic for each place that does not fit."""
    errors = error.errors(include_url=False, include_input=False)[:_MAX_SHOWN]
    if errors[0]["type"] == "json_invalid":
        try:
            json.loads(source.text, parse_constant=no_number)
        except ValueError as wrong:
            return list(_no_json(wrong, source).diagnostics)
        return [Diagnostic("E0313", errors[0]["msg"].lower(), None)]
    root = read_places(source.text)
    return [_problem(item, (*path, *item["loc"]), root, source) for item in errors]


def _problem(item: ErrorDetails, location: tuple[Key, ...], root: Value, source: SourceFile) -> Diagnostic:
    value, path = follow(root, location)
    message, help = said(item), None
    match item["type"]:
        case "union_tag_not_found":
            message, path = "is missing", f"{path}.kind" if path else "kind"
        case "union_tag_invalid":
            context = item["ctx"]
            words = context["expected_tags"].replace("'", "")
            near = get_close_matches(str(context["tag"]), words.split(", "), 1)
            message, path = f"no such kind, `{str(context['tag'])[:40]}`", f"{path}.kind" if path else "kind"
            help = f"did you mean `{near[0]}`? there are {words}" if near else f"there are {words}"
            value = value.get("kind")
        case "extra_forbidden":
            message = "unknown key"
            near = get_close_matches(str(location[-1]), _FIELDS, 1)
            help = f"did you mean `{near[0]}`?" if near else None
    path = path if len(path) <= _MAX_PATH else f"…{path[-_MAX_PATH:]}"
    return Diagnostic("E0313", f"{path}: {message}" if path else message, value.span(source), help=help)


_FIELDS: Final = sorted(
    {
        name
        for model in vars(nodes).values()
        if isinstance(model, type) and issubclass(model, BaseModel)
        for name in model.__annotations__
        if not name.startswith(("_", "model_"))
    }
)
