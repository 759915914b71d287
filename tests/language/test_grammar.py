"""The tables are those of the grammar, whatever lies there, and Lark itself reads the language with it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
from lark import Lark

from scenelang.language import generate as maker
from scenelang.language import tables
from scenelang.language.generate import generate
from scenelang.language.parser import PLAIN, TreeBuilder

GRAMMAR = tables.grammar_path().read_text(encoding="utf-8")


def test_tables_are_in_step_with_the_grammar() -> None:
    data = json.loads(json.dumps(generate(GRAMMAR)))
    assert tables.decode(data) == tables.tables()


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The grammars that Lark is asked to read, in order."""
    asked: list[str] = []

    def counted(grammar: str) -> dict[str, Any]:
        asked.append(grammar)
        return generate(grammar)

    monkeypatch.setattr(maker, "generate", counted)
    return asked


def test_tables_follow_the_grammar_and_nothing_else(tmp_path: Path, made: list[str]) -> None:
    grammar, place = tmp_path / "scenelang.lark", tmp_path / "tables.json"

    def look(*, shipped: bool = False) -> dict[str, Any]:
        return tables.current(grammar, place, shipped=shipped)

    grammar.write_text(GRAMMAR, "utf-8")
    first = look()
    assert (len(made), [p.name for p in tmp_path.glob("*.json")]) == (1, ["tables.json"])
    assert look() == json.loads(json.dumps(first))
    assert len(made) == 1
    grammar.write_text(GRAMMAR.replace('"group"', '"bundle"'), "utf-8")
    os.utime(grammar, (0, 0))  # older than the tables, as files out of an archive may be
    assert "group" in look(shipped=True)["kinds"]
    assert "bundle" in look()["kinds"]
    assert (len(made), "bundle" in look()["kinds"], len(made)) == (2, True, 2)
    for harm in (b"", b"{", b"[1]", b"\xff"):
        place.write_bytes(harm)
        assert "bundle" in look(shipped=True)["kinds"]
    assert len(made) == 6


def test_tables_are_made_in_memory_where_nothing_can_be_written(tmp_path: Path, made: list[str]) -> None:
    grammar = tmp_path / "scenelang.lark"
    grammar.write_text(GRAMMAR, "utf-8")
    for count in (1, 2):
        data = tables.current(grammar, tmp_path / "none" / "tables.json", shipped=False)
        assert tables.decode(json.loads(json.dumps(data))) == tables.tables()
        assert len(made) == count
    assert [p.name for p in tmp_path.iterdir()] == ["scenelang.lark"]


def test_grammar_has_no_conflicts(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level("DEBUG", logger="lark"):
        Lark(GRAMMAR, parser="lalr", lexer="basic", debug=True)
    assert not [record for record in caplog.records if "onflict" in record.getMessage()]


def test_every_rule_has_a_callback() -> None:
    names = {name for _, _, name in tables.tables().rules if name}
    assert not [
        name for name in names if name not in PLAIN and not callable(getattr(TreeBuilder, name, None))
    ]
