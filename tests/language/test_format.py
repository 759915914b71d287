"""The canonical layout, example by example; what a text's ends and lines look like."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import scenelang
from scenelang.language.formatting import Layout, format_text
from scenelang.language.reports import SceneError
from scenelang.language.tables import tables
from tests.language.sameness import tree_of

GOLDEN = re.findall(
    r"^//// (?!becomes)(.*)\n([\s\S]*?)^//// becomes\n([\s\S]*?)(?=^////|\Z)",
    Path(__file__).with_name("golden.nsgs").read_text("utf-8"),
    re.MULTILINE,
)


@pytest.mark.parametrize(("before", "after"), [pytest.param(*pair, id=name) for name, *pair in GOLDEN])
def test_golden(before: str, after: str) -> None:
    assert format_text(before) == after
    assert format_text(after) == after
    assert tree_of(after) == tree_of(before)


def test_there_are_golden_cases() -> None:
    assert len(GOLDEN) >= 7


def test_public_name() -> None:
    assert scenelang.format_text is format_text


def test_every_rule_is_laid_out() -> None:
    names = {name for _, _, name in tables().rules if name and not name.startswith("bad_")}
    assert not [name for name in names if not callable(getattr(Layout, name, None))]


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_line_ends_and_byte_order_mark_stay(newline: str, mark: str) -> None:
    before = "square   {}// a\n\n\n/* b\n   c */\nstar{}"
    after = "square {}  // a\n\n/* b\n   c */\nstar {}\n"
    assert format_text(mark + before.replace("\n", newline)) == mark + after.replace("\n", newline)


def test_first_line_end_decides() -> None:
    assert format_text("a;\r\nb;\nc;\n") == "a;\r\nb;\r\nc;\r\n"
    assert format_text("a;\nb;\r\nc;\r\n") == "a;\nb;\nc;\n"


def test_last_line_ends() -> None:
    assert format_text("a;") == "a;\n"
    assert format_text("// a") == "// a\n"


def test_numbers_and_strings_stay_as_written() -> None:
    text = 'f(1.0, 1., .50, 1E+3, 0x, #FFF, #AbCdEf, "a\\tb  c", 007);\n'.replace("0x, ", "")
    assert format_text(text) == text


def test_white_space_of_all_kinds_is_white_space() -> None:
    assert format_text("a;\t\x0b\x0c\u00a0\u2003b;\r\rc;") == "a;\nb;\nc;\n"


def test_mistakes_are_told_in_the_text_as_given() -> None:
    with pytest.raises(SceneError) as caught:
        format_text("a;\r\nsquare {\r\n  scale(;\r\n}\r\n", name="some.nsg")
    spans = [d.span for d in caught.value.diagnostics]
    assert spans
    assert spans[0] is not None
    assert (spans[0].source.name, spans[0].locate()[0]) == ("some.nsg", (3, 8))
