"""The index of codes in the documentation is the one that the pages make, and its sample is a real one."""

from __future__ import annotations

import re
from pathlib import Path

from lab.docs.make_errors import index
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source
from scenelang.language.pages import CODES
from scenelang.language.reports import render_text

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "errors.md").read_text("utf-8")


def test_the_index_is_made_from_the_pages() -> None:
    """`python -m lab docs errors` writes it anew."""
    assert index() == PAGE
    assert set(re.findall(r"^\| \[([EW]\d{4})\]", PAGE, re.MULTILINE)) == set(CODES)


def test_the_sample_is_what_is_printed() -> None:
    sample = re.search(r"```text\n(.*?)```", PAGE, re.DOTALL)
    assert sample is not None
    found = Diagnostics()
    Source(text=SourceFile("scene.nsg", "square { rotate(45); }\n")).scene(found)
    assert render_text(found, summary=False) == sample[1]
