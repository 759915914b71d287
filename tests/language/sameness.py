"""What formatting must leave as it is, seen with other eyes than the formatter's."""

from __future__ import annotations

import dataclasses
from typing import Any

from scenelang.language.diagnostics import Span
from tests.language.reading import read


def tree_of(text: str) -> object:
    """The tree of a text without mistakes, its spans left out."""
    tree, diagnostics = read(text)
    assert diagnostics == [], text
    return without_spans(tree)


def without_spans(value: Any) -> list[object]:
    """A tree as the list of its nodes from the root down, each with the number or names of what it holds.

    A list, because deep trees would take all of Python's frames to walk and to compare.
    """
    found: list[object] = []
    left = [value]
    while left:
        value = left.pop()
        if dataclasses.is_dataclass(value):
            fields = [(f.name, getattr(value, f.name)) for f in dataclasses.fields(value)]
            kept = [(name, held) for name, held in fields if not isinstance(held, Span)]
            found.append((type(value).__name__, *(name for name, _ in kept)))
            left += [held for _, held in reversed(kept)]
        elif isinstance(value, tuple):
            found.append(("tuple", len(value)))
            left += reversed(value)
        else:
            found.append(value)
    return found


def comments(text: str) -> list[str]:
    """All comments in order, read sign by sign, with the white space at the ends of their lines taken off."""
    found: list[str] = []
    at = 0
    while at < len(text):
        if text[at] == '"':
            at += 1
            while text[at] != '"':
                at += 2 if text[at] == "\\" else 1
            at += 1
        elif text.startswith(("//", "/*"), at):
            line = text[at + 1] == "/"
            end = text.find("\n" if line else "*/", at + 2)
            end = len(text) if end < 0 else end if line else end + 2
            found.append("\n".join(part.strip() for part in text[at:end].split("\n")))
            at = end
        else:
            at += 1
    return found
