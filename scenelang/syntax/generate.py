"""Make `tables.json` from the grammar: ``python -m scenelang.syntax.generate``.

Lark reads the grammar and builds the LALR tables; what is kept is plain JSON. States are numbered in the
order a breadth-first walk meets them, so the same grammar always gives the same bytes.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from lark import Lark
from lark.grammar import Rule
from lark.lexer import PatternStr

PACKAGE = Path(__file__).resolve().parent.parent


def grammar_path() -> Path:
    """Where the grammar lies: inside an installed package, beside it in a checkout."""
    inside = PACKAGE / "grammar" / "scenelang.lark"
    return inside if inside.exists() else PACKAGE.parent / "grammar" / "scenelang.lark"


def generate(grammar: str) -> dict[str, Any]:
    """The plain data of `tables.json` for a grammar text."""
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


def encode(data: dict[str, Any]) -> str:
    """JSON with one state or rule a line, so that a change of the grammar shows as a readable diff."""
    parts = []
    for key, value in data.items():
        if isinstance(value, list) and key != "declared":
            rows = ",\n".join(json.dumps(row, separators=(",", ":")) for row in value)
            parts.append(f'"{key}": [\n{rows}\n]')
        else:
            parts.append(f'"{key}": {json.dumps(value)}')
    return "{\n" + ",\n".join(parts) + "\n}\n"


def main() -> None:
    """Write `tables.json` beside this file."""
    text = encode(generate(grammar_path().read_text(encoding="utf-8")))
    (PACKAGE / "syntax" / "tables.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
