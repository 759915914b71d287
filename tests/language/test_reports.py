"""Reports in every format: texts with labels, fixes, tabs, wide characters, long lines and no place."""

from __future__ import annotations

import json
import os
import unicodedata
from itertools import product
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenelang.language.diagnostics import Diagnostic, Diagnostics, Edit, Fix, Label, SourceFile, Span
from scenelang.language.pages import CODES, read_page
from scenelang.language.reports import (
    SceneError,
    render_concise,
    render_github,
    render_json,
    render_sarif,
    render_text,
)

SOURCE = SourceFile("dir/a b.nsg", "nsg 1;\nlet x = 3;\nlet x = 4;\n\tsquare { scale(2) }\n")


def span(text: str, source: SourceFile = SOURCE, nth: int = 0) -> Span:
    at = -1
    for _ in range(nth + 1):
        at = source.text.index(text, at + 1)
    return Span(source, at, at + len(text))


TWICE = Diagnostic(
    "E0202",
    "`x` is defined twice",
    span("x", nth=1),
    (Label(span("x"), "first defined here"),),
    "choose another name",
)
MISSING = Diagnostic(
    "E0102",
    "missing `;`",
    Span(SOURCE, span(" }").start, span(" }").start),
    fix=Fix("insert `;`", (Edit(Span(SOURCE, span(" }").start, span(" }").start), ";"),)),
)
PLACELESS = Diagnostic("W0501", "too many objects", None, help="use fewer")
ALL = [MISSING, TWICE, PLACELESS]


def test_text() -> None:
    assert render_text(ALL) == (
        "warning[W0501]: too many objects\n"
        "  = help: use fewer\n"
        "\n"
        "error[E0202]: `x` is defined twice\n"
        " --> dir/a b.nsg:3:5\n"
        "  |\n"
        "2 | let x = 3;\n"
        "  |     - first defined here\n"
        "3 | let x = 4;\n"
        "  |     ^\n"
        "  |\n"
        "  = help: choose another name\n"
        "\n"
        "error[E0102]: missing `;`\n"
        " --> dir/a b.nsg:4:19\n"
        "  |\n"
        "4 |     square { scale(2) }\n"
        "  |                      ^\n"
        "  |\n"
        "  = fix: insert `;`\n"
        "  |\n"
        "4 |     square { scale(2); }\n"
        "  |                      +\n"
        "\n"
        "2 errors, 1 warning; 1 fixable with `scenelang check --fix`\n"
    )


def test_nothing_to_say() -> None:
    assert render_text([]) == render_concise([]) == render_github([]) == ""
    assert json.loads(render_json([])) == {"version": 1, "diagnostics": []}
    assert json.loads(render_sarif([]))["runs"][0]["results"] == []


def test_colour_changes_nothing_but_colour() -> None:
    coloured = render_text(ALL, color=True)
    assert "\x1b[1;31m" in coloured
    for code in ("0", "1", "1;31", "1;33", "1;34", "31", "32"):
        coloured = coloured.replace(f"\x1b[{code}m", "")
    assert coloured == render_text(ALL)


def test_a_file_cannot_reach_the_terminal() -> None:
    source = SourceFile("a\x1b[2J.nsg", "let \x1b[31m = 3;\x07\n")
    found = [
        Diagnostic("E0113", "bad \x1b", Span(source, 4, 5), (Label(Span(source, 0, 3), "\x1b"),), "\x1b")
    ]
    assert "\x1b" not in render_text(found) + render_concise(found)


def test_json() -> None:
    data = json.loads(render_json(ALL))
    assert data["version"] == 1
    placeless, twice, missing = data["diagnostics"]
    assert placeless == {
        "code": "W0501",
        "severity": "warning",
        "message": "too many objects",
        "file": None,
        "start": None,
        "end": None,
        "labels": [],
        "help": "use fewer",
        "fix": None,
    }
    assert twice["start"] == {"line": 3, "column": 5}
    assert twice["end"] == {"line": 3, "column": 6}
    assert twice["labels"][0]["message"] == "first defined here"
    assert twice["labels"][0]["start"] == {"line": 2, "column": 5}
    assert missing["fix"]["edits"] == [
        {
            "file": "dir/a b.nsg",
            "start": {"line": 4, "column": 19},
            "end": {"line": 4, "column": 19},
            "replacement": ";",
        }
    ]
    source = SourceFile("a.nsg", "\t😀日 x\n")  # columns count code points
    start = json.loads(render_json([Diagnostic("E0101", "m", span("x", source))]))["diagnostics"][0]["start"]
    assert start == {"line": 1, "column": 5}


def test_concise() -> None:
    assert render_concise(ALL) == (
        "warning[W0501] too many objects\n"
        "dir/a b.nsg:3:5: error[E0202] `x` is defined twice\n"
        "dir/a b.nsg:4:19: error[E0102] missing `;`\n"
    )


def test_github() -> None:
    source = SourceFile("a,b:c.nsg", "x\ny\n")
    odd = Diagnostic("E0101", "50% of\nit", Span(source, 0, 3))
    assert render_github([odd, TWICE]) == (
        "::error file=a%2Cb%3Ac.nsg,line=1,col=1,endLine=2,title=E0101::50%25 of%0Ait\n"
        "::error file=dir/a b.nsg,line=3,col=5,endColumn=6,title=E0202::"
        "`x` is defined twice%0Ahelp: choose another name\n"
    )


def test_order_is_by_file_and_place() -> None:
    first = SourceFile("a.nsg", "xy\n")
    found = [
        Diagnostic("E0102", "m", Span(SOURCE, 1, 2)),
        Diagnostic("E0101", "m", Span(SOURCE, 1, 2)),
        Diagnostic("E0101", "m", Span(first, 1, 2)),
        Diagnostic("E0101", "m", Span(first, 0, 1)),
    ]
    codes = [line.split()[0] for line in render_concise(found).splitlines()]
    assert codes == ["a.nsg:1:1:", "a.nsg:1:2:", "dir/a", "dir/a"]
    assert render_concise(found) == render_concise(found[::-1])


def test_collector_keeps_a_diagnostic_once() -> None:
    diagnostics = Diagnostics()
    for _ in range(2):
        diagnostics.add("E0101", "m", span("x"))
    diagnostics.add("E0102", "m", span("x"))
    diagnostics.add("W0101", "m", None)
    assert [d.code for d in diagnostics] == ["E0101", "E0102", "W0101"]
    assert len(diagnostics.errors) == 2


def test_scene_error_shows_its_diagnostics() -> None:
    shown = str(SceneError([TWICE, MISSING]))
    assert "error[E0202]" in shown
    assert shown.endswith("\n2 errors\n")  # without a command: its text may not be in a file


def test_positions() -> None:
    source = SourceFile("a.nsg", "ab\r\nc\n")
    assert [source.position(at) for at in (0, 2, 4, 6, 99)] == [(1, 1), (1, 3), (2, 1), (3, 1), (3, 1)]
    assert [source.line(number) for number in (0, 1, 2, 3, 4)] == ["", "ab", "c", "", ""]


# ---------------------------------------------------------------- snippets: where marks, bars and words go

SNIPPET = """\
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
SHORT = SourceFile("a.nsg", SNIPPET)
OTHER = SourceFile("lib.nsg", "fn f() = 1;\n")


def at(first: str, last: str | None = None, source: SourceFile = SHORT) -> Span:
    """From the start of one text to the end of another."""
    start = source.text.index(first)
    end = start + len(first) if last is None else source.text.index(last, start) + len(last)
    return Span(source, start, end)


def rows(primary: Span, *labels: tuple[Span, str], width: int = 140) -> list[str]:
    """The rows of the snippet, below its first bar."""
    found = Diagnostic("E0101", "m", primary, tuple(Label(*label) for label in labels))
    return render_text([found], width=width, summary=False).splitlines()[3:]


def test_words_stand_beside_and_below_their_marks() -> None:
    line = "1 | aa + bb - cc"
    two = (at("aa"), "one"), (at("aa"), "two")
    over = rows(at("{\n    y", "y1"), (at("z"), "zed"))
    between = rows(at("x"), (at("aa"), "a"), (at("y2"), "y"))
    assert rows(at("bb")) == [line, "  |      ^^"]
    assert rows(at("aa"), (at("cc"), "right")) == [line, "  | ^^        -- right"]
    assert rows(at("bb"), (at("aa", "cc"), "all")) == [line, "  | -----^^----- all"]
    assert rows(at("bb"), *two) == [line, "  | --   ^^", "  | two", "  | one"]
    hanging = [line, "  | --   ^^ - -- right", "  |         minus", "  | left"]  # from right to left
    assert rows(at("bb"), (at("aa"), "left"), (at("cc"), "right"), (at("-"), "minus")) == hanging
    # One line between is shown, more are not.
    near = [line, "  | -- a", "2 | group {", "3 |   x; {", "  |   ^"]
    assert between == [*near, "...", "6 |     y2", "  |     -- y"]
    # Of a mark over lines the first is underlined.
    assert rows(at("group", "x;")) == ["2 | group {", "  | ^^^^^^^"]
    assert over == ["3 |   x; {", "  |      ^", "...", "9 |   } z", "  |     - zed"]
    assert rows(Span(SHORT, 0, 13)) == [line, "  | ^^^^^^^^^^^^"]
    assert rows(Span(SHORT, len(SNIPPET), len(SNIPPET))) == ["12 |", "   | ^"]
    other = ["  |", " ::: lib.nsg:1:4", "  |", "1 | fn f() = 1;", "  |    --- defined here"]
    assert rows(at("cc"), (at("f()", source=OTHER), "defined here"))[2:] == other


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


def test_carets_stand_under_what_they_mark() -> None:
    for before in ("", "\t", "日本 ", "\t\té ", "x" * 150, "日" * 200):
        shown, marks = rows(at("here", source=SourceFile("a.nsg", f"{before}here{'y' * 300}\n")))
        assert marks.count("^") == 4
        assert cells(marks[: marks.index("^")]) == cells(shown[: shown.index("here")])


def test_long_lines_are_cut_around_the_mark() -> None:
    lengths = (0, 30, 97, 500)
    for width, before, after, fill in product((40, 60, 100), lengths, lengths, "日x"):
        source = SourceFile("a.nsg", fill * before + "here" + fill * after)
        shown, marks = rows(at("here", source=source), width=width)
        assert cells(shown) <= width
        assert "here" in shown
        assert cells(marks[: marks.index("^")]) == cells(shown[: shown.index("here")])
        whole = 4 + len("here") + (before + after) * cells(fill) <= width
        assert ("…" in shown) != whole


def test_a_mark_wider_than_the_screen_shows_its_beginning() -> None:
    source = SourceFile("a.nsg", "x" * 100 + "here" + "y" * 300)
    shown, marks = rows(at("here", "y" * 300, source=source), width=60)
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
    place = Span(SHORT, 2, 2)
    found = Diagnostic("E0101", "m", place, fix=Fix("put it in", (Edit(place, " * 2"), Edit(at(" -"), " +"))))
    assert "1 - aa + bb - cc\n1 + aa * 2 + bb + cc\n" in render_text([found])
    found = Diagnostic(
        "E0101", "m", place, fix=Fix("put it in", (Edit(place, " * 2"), Edit(Span(SHORT, 12, 12), ";")))
    )
    assert render_text([found], summary=False).splitlines()[-3:] == [
        "  |",
        "1 | aa * 2 + bb - cc;",
        "  |    +++          +",
    ]
    source = SourceFile("a.nsg", "aa\r\nbb\r\n")
    found = Diagnostic("E0101", "m", None, fix=Fix("end it", (Edit(Span(source, 2, 2), ";"),)))
    assert "1 | aa;\n" in render_text([found])


def test_a_replacement_shows_both_lines() -> None:
    assert fixed(SHORT, ("bb", "dd")) == ["  |", "1 - aa + bb - cc", "1 + aa + dd - cc"]


def test_a_removed_line_has_no_new_one() -> None:
    assert fixed(SHORT, ("aa + bb - cc\n", "")) == ["  |", "1 - aa + bb - cc"]


def test_changes_in_two_places() -> None:
    assert fixed(SHORT, ("bb", "dd"), ("y2", "y5")) == [
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


@settings(max_examples=150)
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


# ---------------------------------------------------------------- SARIF


# Trimmed from the OASIS schema of SARIF 2.1.0: types, required properties, bounds and enumerations as there,
# and no other properties.
LOG = json.loads(Path(__file__).with_name("sarif.json").read_text("utf-8"))


def log(found: list[Diagnostic]) -> Any:
    data = json.loads(render_sarif(found, "1.2.3"))
    jsonschema.validate(data, LOG)
    return data["runs"][0]


def test_it_keeps_to_the_schema() -> None:
    run = log(ALL)
    assert run["properties"] == {"errors": 2, "warnings": 1, "fixable": 1}
    assert run["tool"]["driver"]["version"] == "1.2.3"
    rules = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    assert rules == ["E0102", "E0202", "W0501"]
    placeless, twice, missing = run["results"]
    assert "locations" not in placeless
    assert placeless["level"] == "warning"
    assert rules[twice["ruleIndex"]] == twice["ruleId"] == "E0202"
    place = twice["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == "dir/a%20b.nsg"
    assert place["region"] == {"startLine": 3, "startColumn": 5, "endLine": 3, "endColumn": 6}
    assert twice["relatedLocations"][0]["message"]["text"] == "first defined here"
    change = missing["fixes"][0]["artifactChanges"][0]
    assert change["artifactLocation"]["uri"] == "dir/a%20b.nsg"
    assert change["replacements"] == [
        {
            "deletedRegion": {"startLine": 4, "startColumn": 19, "endLine": 4, "endColumn": 19},
            "insertedContent": {"text": ";"},
        }
    ]
    assert log([])["results"] == []
    data = json.loads(render_sarif(ALL))
    del data["runs"][0]["results"][0]["message"]
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data, LOG)


def test_rules_carry_their_pages() -> None:
    rules = log([Diagnostic(code, "m", span("x")) for code in CODES])["tool"]["driver"]["rules"]
    assert {rule["id"] for rule in rules} == set(CODES)
    for rule in rules:
        page = read_page(rule["id"])
        assert rule["shortDescription"]["text"] == page.title
        assert rule["help"]["markdown"] == page.text
        assert page.examples[0].text.splitlines()[0] in rule["help"]["text"]
        assert rule["defaultConfiguration"]["level"] == page.severity
        assert rule["fullDescription"]["text"] in " ".join(page.text.split())


def test_names_are_relative_to_the_working_folder() -> None:
    """Code scanning matches them with the files of a repository."""
    for name, uri in {
        os.path.join(os.getcwd(), "dir", "ä b.nsg"): "dir/%C3%A4%20b.nsg",
        "/elsewhere/a.nsg": "file:///elsewhere/a.nsg",
        "<stdin>": "%3Cstdin%3E",
    }.items():
        found = Diagnostic("E0302", "m", Span(SourceFile(name, "x"), 0, 1))
        place = log([found])["results"][0]["locations"][0]["physicalLocation"]
        assert place["artifactLocation"]["uri"] == uri
    inside = os.path.join(os.getcwd(), "a.nsg")
    shown = render_github([Diagnostic("E0302", "m", Span(SourceFile(inside, "x"), 0, 1))])
    assert shown.startswith("::error file=a.nsg,line=1,")
