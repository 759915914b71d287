"""Every format, on diagnostics with labels, fixes, tabs, wide characters, long lines and no place."""

from __future__ import annotations

import json
import unicodedata

import pytest

from scenelang.language.diagnostics import Diagnostic, Diagnostics, Edit, Fix, Label, SourceFile, Span
from scenelang.language.machine import render_concise, render_github, render_json, render_sarif
from scenelang.language.reports import SceneError, render_text

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


def cells(text: str) -> int:
    return sum(2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text)


@pytest.mark.parametrize("before", ["", "\t", "日本 ", "\t\té ", "x" * 150, "日" * 200])
def test_carets_stand_under_what_they_mark(before: str) -> None:
    source = SourceFile("a.nsg", f"{before}here{'y' * 300}\n")
    rows = render_text([Diagnostic("E0101", "m", span("here", source))]).split("\n")
    shown, marks = rows[3], rows[4]
    assert marks.count("^") == 4
    assert cells(marks[: marks.index("^")]) == cells(shown[: shown.index("here")])


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


def test_columns_count_code_points() -> None:
    source = SourceFile("a.nsg", "\t😀日 x\n")
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


def test_sarif() -> None:
    log = json.loads(render_sarif(ALL, version="1.2.3"))
    assert log["version"] == "2.1.0"
    run = log["runs"][0]
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
    assert change["replacements"][0]["insertedContent"]["text"] == ";"


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
