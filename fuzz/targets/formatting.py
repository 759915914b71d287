"""Any text to its canonical layout: the same tree and comments, and no change the second time."""

from __future__ import annotations

import re
from dataclasses import fields, is_dataclass
from typing import Any

from fuzz import text
from fuzz.oracles import check_diagnostics
from fuzz.target import Target, hold
from scenelang.assets.records import deep_stack
from scenelang.language.diagnostics import Diagnostics, SourceFile, Span
from scenelang.language.formatting import format_text
from scenelang.language.parser import parse
from scenelang.language.reports import SceneError

_LEXEMES = re.compile(r'"(?:\\.|[^"\\\n])*"|(//[^\n]*|/\*[\s\S]*?\*/)')


def check(data: bytes) -> None:
    """Format, format again, and compare trees without their places, and comments."""
    scene = text.decode(data)
    found = Diagnostics()
    tree = parse(SourceFile("fuzz.nsg", scene), found)
    try:
        laid = format_text(scene, name="fuzz.nsg")
    except SceneError as error:
        hold(found.errors, "a sound text is formatted", error)
        check_diagnostics(error.diagnostics, None)
        return
    hold(not found.errors, "a text with mistakes is refused", found.errors)
    again = Diagnostics()
    after = parse(SourceFile("fuzz.nsg", laid), again)
    hold(not again.errors, "what is formatted is sound", again.errors)
    with deep_stack():
        hold(bare(after) == bare(tree), "formatting keeps the tree", laid[:500])
    hold(comments(laid) == comments(scene), "formatting keeps comments", laid[:500])
    hold(format_text(laid) == laid, "formatting twice is formatting once", laid[:500])
    inside = laid.removeprefix("\ufeff").replace("\r\n", "\n")
    hold(inside == "" or inside.endswith("\n"), "a text ends with its last line", laid[-80:])
    hold("\r" not in comments_cut(inside), "lines end alike", laid[:500])


def bare(node: Any) -> Any:
    """A tree without places."""
    if isinstance(node, tuple):
        return tuple(map(bare, node))
    if is_dataclass(node) and not isinstance(node, type):
        parts = (getattr(node, field.name) for field in fields(node))
        return type(node).__name__, tuple(bare(part) for part in parts if not isinstance(part, Span))
    return node


def comments(scene: str) -> list[str]:
    """Comments of a sound text, white space aside."""
    return [" ".join(match[1].split()) for match in _LEXEMES.finditer(scene) if match[1]]


def comments_cut(scene: str) -> str:
    """A sound text without its comments and strings."""
    return _LEXEMES.sub("", scene)


TARGET = Target(
    name="formatting",
    summary="a text without mistakes is formatted to one with the same tree and the same comments, which is "
    "not changed again; any other is refused with its mistakes",
    check=check,
    seeds=text.seeds,
    mutate=text.mutate,
    dictionary=text.dictionary,
    most_bytes=1200,
    runs=5,
)
