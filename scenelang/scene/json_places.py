"""Where the values of JSON text stand, so that mistakes in scenes from JSON are shown in their text."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import field
from typing import Final

from pydantic import BaseModel

from scenelang.diagnostics.span import SourceFile, Span
from scenelang.records import Record
from scenelang.scene.data import SceneData
from scenelang.scene.fields import TAGS
from scenelang.scene.spans import SpanMap, Written

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
