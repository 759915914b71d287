"""Examples and the documentation's scenes are laid out as `scenelang fmt` does."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenelang.language.formatting import format_text
from tests.language.shipped import EXAMPLES, PAGES, ROOT, formatted_page

MEND = "run python -m tests.language.shipped"


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("path", EXAMPLES, ids=relative)
def test_examples_are_formatted(path: Path) -> None:
    text = path.read_text("utf-8")
    assert format_text(text) == text, MEND


@pytest.mark.parametrize("path", PAGES, ids=relative)
def test_scenes_of_pages_are_formatted(path: Path) -> None:
    text = path.read_text("utf-8")
    assert formatted_page(text) == text, MEND


def test_a_page_is_changed_in_its_scenes_alone() -> None:
    page = "a  b\n\n```nsg W0401\nstar   {}\n```\n\n```sh\na  b\n```\n\n```nsg\nstar {{\n```\n"
    assert formatted_page(page) == page.replace("star   {}", "star {}")
