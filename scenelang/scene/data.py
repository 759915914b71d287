"""Scenes to JSON and back, whatever their depth, with clear errors for hostile text.

pydantic does the work where it can. Its JSON reader stops at 200 brackets and its writer at about as
many nested models, while a Scene may nest 400 nodes: deeper ones are taken apart here.
"""

from __future__ import annotations

import json
import re
from typing import Any, Final

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import PydanticSerializationError

from scenelang.diagnostics.diagnostic import Diagnostic, SceneError
from scenelang.scene.schema import Scene, SceneNode
from scenelang.scene.session import MAX_NODE_DEPTH, deep_stack

MAX_CHARS: Final = 200_000_000
_BRACKETS_PER_NODE: Final = 3  # a link of a chain: list, link, node
_PLAIN_DEPTH: Final = 150  # brackets that pydantic reads by itself
_TOKENS: Final = re.compile(r'"(?:[^"\\]|\\.)*"|[\[{]|[\]}]', re.DOTALL)
_MAX_SHOWN: Final = 20


def to_json(scene: Scene) -> str:
    """JSON of a Scene."""
    try:
        return scene.model_dump_json()
    except PydanticSerializationError:
        with deep_stack():
            return json.dumps(_plain(scene), separators=(",", ":"), allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return {name: _plain(item) for name, item in value.__dict__.items()}
    return [_plain(item) for item in value] if isinstance(value, tuple) else value


def from_json(text: str | bytes) -> Scene:
    """A Scene from JSON.

    Raises:
        SceneError: text that is no JSON, or no Scene.
    """
    if isinstance(text, bytes):
        try:
            text = text.decode("utf-8")
        except UnicodeDecodeError as error:
            raise _failure(f"not UTF-8 text: byte {error.start}") from None
    if len(text) > MAX_CHARS:
        raise _failure(f"more than {MAX_CHARS:,} characters of JSON")
    depth = _depth(text)
    if depth > (MAX_NODE_DEPTH + 4) * _BRACKETS_PER_NODE:
        raise _failure(f"nodes nested deeper than {MAX_NODE_DEPTH}")
    try:
        if depth <= _PLAIN_DEPTH:
            return Scene.model_validate_json(text)
        with deep_stack():
            return _read_deep(text)
    except ValidationError as error:
        raise SceneError(_problems(error)) from None


def _depth(text: str) -> int:
    """How deep brackets nest, those in strings left out."""
    depth = deepest = 0
    for token in _TOKENS.finditer(text):
        first = token.group()[0]
        if first in "[{":
            depth += 1
            deepest = max(deepest, depth)
        elif first in "]}":
            depth -= 1
    return deepest


def _read_deep(text: str) -> Scene:
    def refuse(constant: str) -> float:
        raise ValueError(f"{constant} is no JSON number")

    try:
        data = json.loads(text, parse_constant=refuse)
    except ValueError as error:
        raise _failure(f"not JSON: {str(error).lower()}") from None
    if isinstance(data, dict) and isinstance(data.get("nodes"), list):
        adapter: TypeAdapter[Any] = TypeAdapter(SceneNode)
        data = {**data, "nodes": [_build(node, adapter) for node in data["nodes"]]}
    return Scene.model_validate(data)


def _build(data: Any, adapter: TypeAdapter[Any]) -> Any:
    """A node whose children are validated before it, so that no validation goes deep."""
    if isinstance(data, dict) and isinstance(data.get("children"), list):
        children = [
            {**child, "node": _build(child["node"], adapter)}
            if data.get("kind") == "chain" and isinstance(child, dict) and "node" in child
            else _build(child, adapter)
            for child in data["children"]
        ]
        data = {**data, "children": children}
    return adapter.validate_python(data)


def _failure(message: str) -> SceneError:
    return SceneError([Diagnostic("E0313", message, None)])


def _problems(error: ValidationError) -> list[Diagnostic]:
    """One diagnostic for each place that does not fit."""
    found = []
    for item in error.errors(include_url=False, include_input=False)[:_MAX_SHOWN]:
        where = ".".join(str(part) for part in item["loc"])
        said = item["msg"].removeprefix("Value error, ")
        said = said[:1].lower() + said[1:]
        found.append(Diagnostic("E0313", f"{where}: {said}" if where else said, None))
    return found
