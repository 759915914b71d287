"""Reading scene text in tests, and the mistakes that a fixture says it has.

A line of a fixture that ends in ``//~ E0102:13 E0103:20`` has those mistakes, at those columns.
"""

from __future__ import annotations

import re
from pathlib import Path

from scenelang.language import tree as nodes
from scenelang.language.diagnostics import Diagnostic, Diagnostics, Fix, SourceFile
from scenelang.language.parser import parse

HERE = Path(__file__).parent
MALFORMED = sorted((HERE / "malformed").glob("*.nsg"))
SCENES = sorted((HERE / "scenes").glob("*.nsg"))

Mistake = tuple[int, int, str]
"""Line, column and code."""


def read(text: str, name: str = "test.nsg") -> tuple[nodes.File, list[Diagnostic]]:
    """The tree and the diagnostics of a text."""
    diagnostics = Diagnostics()
    tree = parse(SourceFile(name, text), diagnostics)
    return tree, list(diagnostics)


def read_well(text: str) -> nodes.File:
    """The tree of a text that has no mistakes."""
    tree, diagnostics = read(text)
    assert diagnostics == []
    return tree


def mistakes(diagnostics: list[Diagnostic]) -> list[Mistake]:
    found = []
    for diagnostic in diagnostics:
        assert diagnostic.span is not None
        found.append((*diagnostic.span.locate()[0], diagnostic.code))
    return found


def expected(text: str) -> list[Mistake]:
    """The mistakes that the comments of a fixture tell of."""
    found = []
    for number, line in enumerate(text.split("\n"), start=1):
        if note := re.search(r"//~ (.*)", line):
            for item in note[1].split():
                code, column = item.split(":")
                found.append((number, int(column), code))
    return sorted(found)


def apply(text: str, fix: Fix) -> str:
    """The text with a fix made."""
    for edit in sorted(fix.edits, key=lambda edit: edit.span.start, reverse=True):
        text = text[: edit.span.start] + edit.replacement + text[edit.span.end :]
    return text
