"""The parse tables at run time: read from `tables.json`, no Lark import.

A wheel brings them; a checkout makes them by `scenelang.language.generate` whenever the grammar has changed:
that takes over 100 ms of a process that should answer within 250, reading them about 2.
"""

from __future__ import annotations

import contextlib
import json
from functools import cache
from pathlib import Path
from typing import Any, Final
from zlib import crc32

from scenelang.assets.records import Record

PACKAGE: Final = Path(__file__).resolve().parent.parent
PLACE: Final = PACKAGE / "language" / "tables.json"
END = 0
"""The kind of the end of the text."""


class Tables(Record):
    """The LALR automaton; an action ``s >= 0`` takes the token to state s, ``r < 0`` applies rule ``~r``."""

    kinds: tuple[str, ...]  # a name for each kind: the text itself for a literal, else the terminal's name
    literals: dict[str, int]  # text of a keyword or of punctuation to its kind
    patterns: dict[str, str]  # name of any other terminal to its regular expression
    start: int
    final: int  # the state in which the whole text has been read
    actions: tuple[dict[int, int], ...]  # per state, token kind to what to do
    gotos: tuple[dict[int, int], ...]  # per state, index of a nonterminal to the next state
    rules: tuple[tuple[int, int, str], ...]  # length, nonterminal, callback; empty, it passes the only value

    def kind(self, name: str) -> int:
        """The kind with a name: ``kind("NUMBER")``, ``kind(";")``."""
        return self.kinds.index(name)


def decode(data: dict[str, Any]) -> Tables:

    def pairs(flat: list[int]) -> dict[int, int]:
        return dict(zip(flat[::2], flat[1::2], strict=True))

    kinds = tuple(data["kinds"])
    literals = set(kinds) - set(data["patterns"]) - set(data["declared"])
    return Tables(
        kinds=kinds,
        literals={text: kind for kind, text in enumerate(kinds) if text in literals},
        patterns=data["patterns"],
        start=data["start"],
        final=data["final"],
        actions=tuple(map(pairs, data["actions"])),
        gotos=tuple(map(pairs, data["gotos"])),
        rules=tuple((length, origin, callback) for length, origin, callback in data["rules"]),
    )


def sections(module: str) -> dict[str, str]:
    """The parts of the text beside a module by their titles, each a line ``[title]`` above the part."""
    text = Path(__file__).with_name(f"{module}.txt").read_text("utf-8")
    parts = (part.partition("]\n") for part in f"\n{text}".split("\n[")[1:])
    return {title: body for title, _, body in parts}


def rows(module: str, title: str) -> list[list[str]]:
    """The rows of a table in the text beside a module: columns between bars, below ``[title]``."""
    return [row.split(" | ") for row in sections(module)[title].partition("\n\n")[0].splitlines()]


def grammar_path() -> Path:
    """Path of the grammar: inside an installed package, next to it in a checkout."""
    inside = PACKAGE / "grammar" / "scenelang.lark"
    return inside if inside.exists() else PACKAGE.parent / "grammar" / "scenelang.lark"


def source_mark(grammar: Path) -> int:
    """A checksum of what tables are made from: a grammar, and the program that makes them."""
    return crc32(grammar.read_bytes(), crc32(Path(__file__).with_name("generate.py").read_bytes()))


def current(grammar: Path, place: Path, *, shipped: bool) -> dict[str, Any]:
    """The plain data at ``place``, made anew if missing, damaged or, where not ``shipped``, out of date."""
    with contextlib.suppress(OSError, ValueError):
        loaded = json.loads(place.read_text("utf-8"))
        if isinstance(loaded, dict) and (shipped or loaded.get("source") == source_mark(grammar)):
            return loaded
    from scenelang.language.generate import make  # and Lark with it

    return make(grammar, place, source_mark(grammar))


@cache
def tables() -> Tables:
    grammar = grammar_path()
    return decode(current(grammar, PLACE, shipped=grammar.is_relative_to(PACKAGE)))
