"""Where the values of JSON text stand, so that mistakes in scenes from JSON are shown in their text."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import field
from typing import Final

from scenelang.diagnostics.span import SourceFile, Span
from scenelang.records import Record
from scenelang.scene.fields import Frozen
from scenelang.scene.modifiers import Transform
from scenelang.scene.nodes import Chain, Object, SceneData, SceneNode
from scenelang.scene.spans import SpanMap, Written
from scenelang.scene.wording import TAGS
from scenelang.words import STAGE

Key = str | int

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
    """Where brackets first nest deeper than ``most``, in a text where they do."""
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
    """What pydantic's location of an error leads to, and its path as `nodes[0].transforms[1].x`.

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
    named = root.items.get("model")
    if named is not None:
        spans.record(scene, _written(named, root, source))
    for word in STAGE:
        if (value := root.items.get(word)) is not None and isinstance(getattr(scene, word), Frozen):
            spans.record(getattr(scene, word), _written(value, value, source))
    todo: list[tuple[SceneNode, Value]] = _pairs(scene.nodes, root.get("nodes"))
    while todo:
        node, value = todo.pop()
        heading = "geometry" if isinstance(node, Object) else "op" if node.kind == "boolean" else "kind"
        spans.record(node, _written(value.get(heading), value, source))
        _record_steps(node.transforms, value.get("transforms"), source, spans)
        if node.material is not None:
            material = value.get("material")
            spans.record(node.material, _written(material.get("name"), material, source))
            _record_steps(node.material.ops, material.get("ops"), source, spans)
        if isinstance(node, Chain):
            links = value.get("children")
            todo += [(link.node, links.get(at).get("node")) for at, link in enumerate(node.children)]
        elif not isinstance(node, Object):
            todo += _pairs(node.children, value.get("children"))


def _pairs(nodes: Sequence[SceneNode], values: Value) -> list[tuple[SceneNode, Value]]:
    return [(node, values.get(at)) for at, node in enumerate(nodes)]


def _record_steps(
    steps: Sequence[Transform | object], values: Value, source: SourceFile, spans: SpanMap
) -> None:
    for at, step in enumerate(steps):
        value = values.get(at)
        spans.record(step, _written(value.get("kind"), value, source))


def _written(name: Value, statement: Value, source: SourceFile) -> Written:
    return Written(name.span(source), statement.span(source))
