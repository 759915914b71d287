"""Snippets as people see them: where marks, bars and words go, and what is cut."""

from __future__ import annotations

import unicodedata
from itertools import product

from hypothesis import given, settings
from hypothesis import strategies as st

from scenelang.language.diagnostics import Diagnostic, Edit, Fix, Label, SourceFile, Span
from scenelang.language.reports import render_text

TEXT = """\
aa + bb - cc
group {
  x; {
    y
    y1
    y2
    y3
    y4
  } z
}
end
"""
SOURCE = SourceFile("a.nsg", TEXT)
OTHER = SourceFile("lib.nsg", "fn f() = 1;\n")


def at(first: str, last: str | None = None, source: SourceFile = SOURCE) -> Span:
    """From the start of one text to the end of another."""
    start = source.text.index(first)
    end = start + len(first) if last is None else source.text.index(last, start) + len(last)
    return Span(source, start, end)


def rows(primary: Span, *labels: tuple[Span, str], width: int = 140) -> list[str]:
    """The rows of the snippet, from its first bar on."""
    found = Diagnostic("E0101", "m", primary, tuple(Label(*label) for label in labels))
    return render_text([found], width=width, summary=False).splitlines()[2:]


def test_one_mark() -> None:
    assert rows(at("bb")) == ["  |", "1 | aa + bb - cc", "  |      ^^"]


def test_words_stand_beside_the_last_mark() -> None:
    assert rows(at("aa"), (at("cc"), "right")) == ["  |", "1 | aa + bb - cc", "  | ^^        -- right"]


def test_words_of_other_marks_hang_below_from_right_to_left() -> None:
    assert rows(at("bb"), (at("aa"), "left"), (at("cc"), "right"), (at("-"), "minus")) == [
        "  |",
        "1 | aa + bb - cc",
        "  | --   ^^ - -- right",
        "  |         minus",
        "  | left",
    ]


def test_a_mark_inside_another() -> None:
    assert rows(at("bb"), (at("aa", "cc"), "all")) == [
        "  |",
        "1 | aa + bb - cc",
        "  | -----^^----- all",
    ]


def test_two_words_for_one_place() -> None:
    assert rows(at("bb"), (at("aa"), "one"), (at("aa"), "two")) == [
        "  |",
        "1 | aa + bb - cc",
        "  | --   ^^",
        "  | two",
        "  | one",
    ]


def test_lines_between_marks() -> None:
    """One line between is shown, more are not."""
    assert rows(at("x"), (at("aa"), "a"), (at("y2"), "y")) == [
        "  |",
        "1 | aa + bb - cc",
        "  | -- a",
        "2 | group {",
        "3 |   x; {",
        "  |   ^",
        "...",
        "6 |     y2",
        "  |     -- y",
    ]


def test_of_a_mark_over_lines_the_first_is_underlined() -> None:
    assert rows(at("group", "x;")) == ["  |", "2 | group {", "  | ^^^^^^^"]
    assert rows(at("{\n    y", "y1"), (at("z"), "zed")) == [
        "  |",
        "3 |   x; {",
        "  |      ^",
        "...",
        "9 |   } z",
        "  |     - zed",
    ]


def test_a_mark_that_ends_with_a_line_break() -> None:
    assert rows(Span(SOURCE, 0, 13)) == ["  |", "1 | aa + bb - cc", "  | ^^^^^^^^^^^^"]


def test_the_end_of_the_text() -> None:
    end = len(TEXT)
    assert rows(Span(SOURCE, end, end)) == ["   |", "12 |", "   | ^"]


def test_several_files() -> None:
    assert rows(at("cc"), (at("f()", source=OTHER), "defined here"))[2:] == [
        "  |           ^^",
        "  |",
        " ::: lib.nsg:1:4",
        "  |",
        "1 | fn f() = 1;",
        "  |    --- defined here",
    ]


def test_labels_without_a_primary_place() -> None:
    """`-D` has no place in a text, the param that it nearly names has one."""
    found = Diagnostic("E0211", "no param `k` to set", None, (Label(at("bb"), "this param"),))
    assert render_text([found], summary=False).splitlines() == [
        "error[E0211]: no param `k` to set",
        " --> a.nsg:1:6",
        "  |",
        "1 | aa + bb - cc",
        "  |      -- this param",
    ]


# ---------------------------------------------------------------- long lines


def test_long_lines_are_cut_around_the_mark() -> None:
    lengths = (0, 30, 97, 500)
    for width, before, after, fill in product((40, 60, 100), lengths, lengths, "日x"):
        source = SourceFile("a.nsg", fill * before + "here" + fill * after)
        _, shown, marks = rows(at("here", source=source), width=width)
        assert cells(shown) <= width
        assert "here" in shown
        assert cells(marks[: marks.index("^")]) == cells(shown[: shown.index("here")])
        whole = 4 + len("here") + (before + after) * cells(fill) <= width
        assert ("…" in shown) != whole


def test_a_mark_wider_than_the_screen_shows_its_beginning() -> None:
    source = SourceFile("a.nsg", "x" * 100 + "here" + "y" * 300)
    _, shown, marks = rows(at("here", "y" * 300, source=source), width=60)
    assert "here" in shown
    assert len(shown) <= 60
    assert len(marks) <= 61


def cells(text: str) -> int:
    return sum(2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text)


# ---------------------------------------------------------------- fixes


def fixed(source: SourceFile, *edits: tuple[str, str]) -> list[str]:
    """The rows that show a fix."""
    changes = tuple(Edit(at(old, source=source), new) for old, new in edits)
    found = Diagnostic("E0101", "m", changes[0].span, fix=Fix("do it", changes))
    text = render_text([found], summary=False).splitlines()
    return text[text.index("  = fix: do it") + 1 :]


def test_an_insertion_shows_the_new_line() -> None:
    place = Span(SOURCE, 2, 2)
    found = Diagnostic("E0101", "m", place, fix=Fix("put it in", (Edit(place, " * 2"), Edit(at(" -"), " +"))))
    assert "1 - aa + bb - cc\n1 + aa * 2 + bb + cc\n" in render_text([found])
    found = Diagnostic(
        "E0101", "m", place, fix=Fix("put it in", (Edit(place, " * 2"), Edit(Span(SOURCE, 12, 12), ";")))
    )
    assert render_text([found], summary=False).splitlines()[-3:] == [
        "  |",
        "1 | aa * 2 + bb - cc;",
        "  |    +++          +",
    ]


def test_a_replacement_shows_both_lines() -> None:
    assert fixed(SOURCE, ("bb", "dd")) == ["  |", "1 - aa + bb - cc", "1 + aa + dd - cc"]


def test_a_removed_line_has_no_new_one() -> None:
    assert fixed(SOURCE, ("aa + bb - cc\n", "")) == ["  |", "1 - aa + bb - cc"]


def test_changes_in_two_places() -> None:
    assert fixed(SOURCE, ("bb", "dd"), ("y2", "y5")) == [
        "  |",
        "1 - aa + bb - cc",
        "1 + aa + dd - cc",
        "...",
        "6 -     y2",
        "6 +     y5",
    ]


def test_a_change_of_many_lines_is_cut() -> None:
    source = SourceFile("a.nsg", "".join(f"line {n}\n" for n in range(8)))
    shown = fixed(source, (source.text, "one\n"))
    assert shown[1:7] == [f"{n + 1} - line {n}" for n in range(6)]
    assert shown[7:] == ["...", "1 + one"]


# ---------------------------------------------------------------- whatever is marked


@settings(max_examples=300)
@given(
    text=st.text(alphabet="ab {};\n\t日é\u0301\u202e\x1b", max_size=80),
    places=st.lists(st.tuples(st.integers(0, 90), st.integers(0, 90)), min_size=1, max_size=5),
    width=st.integers(1, 60),
)
def test_any_marks_in_any_text(text: str, places: list[tuple[int, int]], width: int) -> None:
    """Nothing crashes, no row ends in a space, no control character comes through, every word is there."""
    source = SourceFile("a.nsg", text)
    spans = [Span(source, min(a, b, len(text)), min(max(a, b), len(text))) for a, b in places]
    labels = tuple(Label(span, f"words{index}") for index, span in enumerate(spans[1:]))
    fix = Fix("do it", (Edit(spans[0], "new\n"),))
    shown = render_text([Diagnostic("E0101", "m", spans[0], labels, "help", fix)], width=width)
    assert all(row == row.rstrip() for row in shown.splitlines())
    assert not set(shown) & set("\t\x1b\u202e")
    assert "^" in shown
    for index in range(len(labels)):
        assert f"words{index}" in shown
