"""Mistakes in data of nodes in words, as constructors raise them and as readers of JSON report them."""

from __future__ import annotations

from typing import Any, Final

from pydantic import ValidationError
from pydantic_core import ErrorDetails

TAGS: Final = frozenset(("stated", "several", "unsaid", "object", "group", "boolean", "chain"))
"""Parts of the place of a mistake in pydantic that text does not nest by."""
_MOST: Final = 3  # mistakes that one exception tells
_WIDTH: Final = 40  # characters of a value that are shown
_KINDS: Final = {
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "text",
    "bool_type": "true or false",
    "tuple_type": "a sequence",
}


def said(item: ErrorDetails) -> str:
    """A mistake's message as it stands after the name of its place and a colon."""
    match item["type"]:
        case "string_pattern_mismatch":
            return "not a possible name"
        case "missing":
            return "is missing"
    words = item["msg"].removeprefix("Value error, ")
    return (words[:1].lower() + words[1:]).removeprefix("input ")


def refusal(name: str, error: ValidationError, known: list[str]) -> ValueError:
    """Exception that the constructor of class ``name`` raises; ``known`` are the names of its arguments."""
    errors = error.errors(include_url=False)
    lines = [_line(item, known) for item in errors[:_MOST]]
    more = f"; and {len(errors) - _MOST} more" if len(errors) > _MOST else ""
    return ValueError(f"{name}: {'; '.join(lines)}{more}")


def _line(item: ErrorDetails, known: list[str]) -> str:
    parts = [part for part in item["loc"] if part not in TAGS]
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts).lstrip(".")
    kind, value = item["type"], item["input"]
    if kind == "extra_forbidden":
        from difflib import get_close_matches  # only mistakes need it

        near = get_close_matches(path, known, 1)
        there = f"did you mean `{near[0]}`?" if near else f"only {', '.join(known)}"
        return f"there is no `{path}`, {there}"
    if kind == "missing":
        return f"`{path}` is missing"
    if kind == "union_tag_invalid":
        wanted = item["ctx"]["expected_tags"].replace("'", "")
        return f"`{path}` is a {_shown(value)}; it may be {wanted}"
    if "class_name" in item.get("ctx", {}):
        return f"`{path}` is {_shown(value)}, not a {item['ctx']['class_name']}"
    if kind in _KINDS:
        return f"`{path}` is {_shown(value)}, not {_KINDS[kind]}"
    return f"`{path}`: {said(item)}" if path else said(item)


def _shown(value: Any) -> str:
    if hasattr(value, "kind"):
        return type(value).__name__
    text = repr(value)
    return text if len(text) <= _WIDTH else f"{text[: _WIDTH - 1]}…"
