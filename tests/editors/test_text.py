"""Offsets and positions, and the shortest edit between two texts, against slow definitions."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsprotocol import types

from scenelang.editors.workspace import Encoding, Lines, difference, width

TEXTS = st.text(st.sampled_from("ab\té𝄞\n\r\u2028\x0b"), max_size=30)
SIZES: dict[Encoding, tuple[str, int]] = {
    "utf-8": ("utf-8", 1),
    "utf-16": ("utf-16-le", 2),
    "utf-32": ("utf-32-le", 4),
}


def slow_position(text: str, offset: int, encoding: Encoding) -> tuple[int, int]:
    """Line and column by splitting what is before."""
    if text[offset - 1 : offset + 1] == "\r\n":
        offset -= 1  # inside a newline: the end of its line
    before = re.split(r"\r\n|\n|\r", text[:offset])
    name, size = SIZES[encoding]
    return len(before) - 1, len(before[-1].encode(name)) // size


@given(TEXTS, st.integers(0, 30), st.sampled_from(list(SIZES)))
def test_positions_are_those_of_the_protocol(text: str, offset: int, encoding: Encoding) -> None:
    offset = min(offset, len(text))
    if text[offset - 1 : offset + 1] == "\r\n":
        return
    lines = Lines(text, encoding)
    place = lines.position(offset)
    assert (place.line, place.character) == slow_position(text, offset, encoding)
    assert lines.offset(place) == offset


@given(TEXTS, st.integers(0, 40), st.integers(0, 40), st.sampled_from(list(SIZES)))
def test_every_position_means_an_offset(text: str, line: int, character: int, encoding: Encoding) -> None:
    offset = Lines(text, encoding).offset(types.Position(line, character))
    assert 0 <= offset <= len(text)


@pytest.mark.parametrize(("encoding", "units"), [("utf-8", 8), ("utf-16", 5), ("utf-32", 4)])
def test_width_counts_code_units(encoding: Encoding, units: int) -> None:
    assert width("aé𝄞b", encoding) == units


@given(TEXTS, TEXTS)
def test_the_difference_makes_one_text_of_the_other(old: str, new: str) -> None:
    edit = difference(old, new)
    assert old[: edit.start] + new[edit.start : edit.new_end] + old[edit.old_end :] == new
    assert edit.start == edit.old_end == edit.new_end or old != new
