"""Pumps: no reader's work grows faster than its text."""

from __future__ import annotations

from random import Random
from typing import Final
from unittest.mock import patch

from fuzz import pumps, text
from fuzz.target import Target, hold
from scenelang.language import reporter
from tests.work import lines_run

LETTERS: Final = 600
FACTOR: Final = 4
"""The larger text is so many times the smaller one."""
ROOM: Final = 30_000
"""Lines of Python that may come on top: limits that are met, tables that are made once."""


def check(data: bytes) -> None:
    """Count the lines of Python that a reader runs for a pump, and for one of four times the length."""
    try:
        pump = pumps.Pump.of(data)
    except ValueError:
        return
    less, more = (work(pump, letters) for letters in (LETTERS, FACTOR * LETTERS))
    hold(more <= 1.5 * FACTOR * less + ROOM, f"{pump.reader} slows down", (less, more))


def work(pump: pumps.Pump, letters: int) -> int:
    """Lines of Python that the reader of a pump runs."""
    read, written = pumps.READERS[pump.reader], pump.text(letters)
    with patch.object(reporter, "MAX_COMPARED", 5_000):  # as of a larger text
        return lines_run(lambda: read(written))


def mutate(data: bytes, generator: Random) -> bytes:
    """A pump changed, or another one."""
    if generator.random() < 0.5:
        return pumps.drawn(generator).data()
    return pumps.mutated(pumps.Pump.of(data), generator).data()


TARGET = Target(
    name="slow",
    summary="no text of 100 KB, made of a piece that is repeated or nested, takes any reader more than 2 s "
    "of processor time; the lines of Python run for small ones grow no faster than the text",
    check=check,
    seeds=lambda: [pump.data() for pump in pumps.seeds()],
    mutate=mutate,
    dictionary=text.dictionary,
    most_bytes=2000,
    runs=20,
)
