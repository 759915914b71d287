"""From the grammar to `tables.json`: Lark builds the LALR tables, and what is kept is plain JSON.

States are numbered breadth-first, so the same grammar always gives the same bytes. `tables` calls this where
there are no current tables, and so does the build of a wheel (``hatch_build.py``).
"""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import Any

from lark import Lark
from lark.grammar import Rule
from lark.lexer import PatternStr

from scenelang.assets.files import write_whole


def generate(grammar: str) -> dict[str, Any]:
    lark = Lark(grammar, parser="lalr", lexer="basic", maybe_placeholders=False)
    table = lark.parser.parser._parse_table
    literals = {t.name: t.pattern.value for t in lark.terminals if isinstance(t.pattern, PatternStr)}
    ignored = set(lark.ignore_tokens)
    names = ["$END", *(t.name for t in lark.terminals if t.name not in ignored)]
    used = {name for row in table.states.values() for name in row}
    declared = sorted(name for name in used if name.startswith("BAD_"))
    names += [name for name in declared if name not in names]
    kind_of = {name: kind for kind, name in enumerate(names)}

    rules: list[Rule] = []
    origins: list[str] = []
    order = [table.start_states["start"]]
    number = {order[0]: 0}
    actions: list[list[int]] = []
    gotos: list[list[int]] = []
    for state in order:  # grows while it is walked
        row: dict[int, int] = {}
        goto: dict[int, int] = {}
        for name, (_, argument) in sorted(table.states[state].items()):
            if isinstance(argument, Rule):
                if argument not in rules:
                    rules.append(argument)
                row[kind_of[name]] = ~rules.index(argument)
                continue
            if argument not in number:
                number[argument] = len(order)
                order.append(argument)
            if name in kind_of:
                row[kind_of[name]] = number[argument]
            else:
                if name not in origins:
                    origins.append(name)
                goto[origins.index(name)] = number[argument]
        actions.append([x for pair in sorted(row.items()) for x in pair])
        gotos.append([x for pair in sorted(goto.items()) for x in pair])

    return {
        "kinds": [literals.get(name, name) for name in names],
        "patterns": {
            t.name: t.pattern.value
            for t in lark.terminals
            if t.name not in ignored and not isinstance(t.pattern, PatternStr)
        },
        "declared": ["$END", *declared],
        "start": 0,
        "final": number[table.end_states["start"]],
        "actions": actions,
        "gotos": gotos,
        "rules": [_rule(rule, origins) for rule in rules],
    }


def _rule(rule: Rule, origins: list[str]) -> tuple[int, int, str]:
    callback = rule.alias or rule.origin.name
    if rule.options.expand1 and len(rule.expansion) == 1 and not rule.alias:
        callback = ""
    return len(rule.expansion), origins.index(rule.origin.name), callback


def make(grammar: Path, place: Path, mark: int) -> dict[str, Any]:
    """Make the tables and write them to ``place`` if possible; ``mark`` tells when to make them again."""
    data = {"source": mark, **generate(grammar.read_text("utf-8"))}
    with contextlib.suppress(OSError):
        write_whole(place, json.dumps(data, separators=(",", ":")).encode())
    return data
