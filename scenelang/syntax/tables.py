"""The parse tables at run time: read from the generated `tables.json`, no Lark import.

`scenelang.syntax.generate` makes that file from `grammar/scenelang.lark`. Importing Lark and building the
tables takes over 100 ms of a process that should answer within 250; reading them takes about 2.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

END = 0
"""The kind of the end of the text."""


@dataclass(frozen=True, slots=True)
class Tables:
    """The LALR automaton and the terminals of the language.

    Token kinds are small integers, indices into ``kinds``.

    Args:
        kinds: a name for each kind: the text itself for a literal, else the terminal's name.
        literals: text of a keyword or of punctuation to its kind.
        patterns: name of any other terminal to its regular expression.
        start: the first state.
        final: the state in which the whole text has been read.
        actions: per state, token kind to what to do: ``s >= 0`` goes to state s after taking the token,
            ``r < 0`` applies rule ``~r``.
        gotos: per state, index of a nonterminal to the next state.
        rules: length, nonterminal, callback; an empty callback passes the only value on.
    """

    kinds: tuple[str, ...]
    literals: dict[str, int]
    patterns: dict[str, str]
    start: int
    final: int
    actions: tuple[dict[int, int], ...]
    gotos: tuple[dict[int, int], ...]
    rules: tuple[tuple[int, int, str], ...]

    def kind(self, name: str) -> int:
        """The kind with a name: ``kind("NUMBER")``, ``kind(";")``."""
        return self.kinds.index(name)


def decode(data: dict[str, Any]) -> Tables:
    """Tables from the plain data of `tables.json`."""

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


@cache
def tables() -> Tables:
    """The shipped tables, read once."""
    return decode(json.loads(Path(__file__).with_name("tables.json").read_text(encoding="utf-8")))
