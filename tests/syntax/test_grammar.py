"""The shipped tables are those of the grammar, and Lark itself reads the language with it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from lark import Lark
from lark.exceptions import LarkError

from scenelang.syntax import tables
from scenelang.syntax.build import Builder
from scenelang.syntax.generate import encode, generate, grammar_path
from tests.syntax.reading import SCENES, read

GRAMMAR = grammar_path().read_text(encoding="utf-8")


def test_tables_are_in_step_with_the_grammar() -> None:
    shipped = Path(tables.__file__).with_name("tables.json").read_text(encoding="utf-8")
    assert shipped == encode(generate(GRAMMAR)), "run python -m scenelang.syntax.generate"


def test_tables_read_back() -> None:
    data = generate(GRAMMAR)
    assert tables.decode(json.loads(encode(data))) == tables.tables()


def test_grammar_has_no_conflicts(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level("DEBUG", logger="lark"):
        Lark(GRAMMAR, parser="lalr", lexer="basic", debug=True)
    assert not [record for record in caplog.records if "onflict" in record.getMessage()]


def test_every_rule_has_a_callback() -> None:
    names = {name for _, _, name in tables.tables().rules if name}
    assert not [name for name in names if not callable(getattr(Builder, name, None))]


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_lark_reads_the_scenes_too(path: Path) -> None:
    Lark(GRAMMAR, parser="lalr", lexer="basic").parse(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    "text", ["let a = 1", "square { scale(2) }", "let a = 30 deg;", "star { };", "for (i in 0..3) star;", "@"]
)
def test_both_refuse(text: str) -> None:
    with pytest.raises(LarkError):
        Lark(GRAMMAR, parser="lalr", lexer="basic").parse(text)
    assert read(text)[1]
