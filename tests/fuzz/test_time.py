"""No text of 100 KB takes `check`, `check --fix` or `fmt` more than 2 s: the hunt for those that do."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from random import Random
from types import FrameType

import pytest

from fuzz.pumps import READERS, Pump
from scenelang.language.tables import tables

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no timer of processor time")

MOST_S = 2.0
MARGIN = 2.0
"""Machines are slower, and cores that others work on too."""
MODES = ("check", "fix", "fmt")
TOKENS = (
    *sorted(tables().literals),
    *(
        "a",
        "a\u00a4",
        "a.b",
        "star",
        "sphere",
        "t",
        "PI",
        "sin",
        "scale",
        "color",
        "flat",
        "camera",
        "animate",
    ),
    *("1", "30deg", "5 deg", "0x1f", "1x", '"x"', "#d33", "#", "(1,2)", "[1]", "{}", "rotate(45)", "foo(1)"),
    *("/*", "*/", "/* c */", "// c\n", "\n", "$", "@", "\\", '"', "'", "**", "\u00d7", "\u00e9"),
    *("return", "def", "function", "fi", "and", "let a\u00a4 = 1;", "star;", "let x = 1; {", "scale = 2;"),
)
FORMER: tuple[tuple[str, Pump], ...] = (
    ("check", Pump("check", "{", "nsg 1;\n")),
    ("fmt", Pump("fmt", "{", "square;\n")),
    ("check", Pump("check", "let x = 1; {")),
    ("check", Pump("check", 'import "std/shapes" as a\u00a4;')),
    ("check", Pump("check", "..\n(1,2)\n")),
    ("check", Pump("check", "s.disc(0.3);", 'import "std/shapes" as s;')),
    ("check", Pump("check", "star { scale(; } group } [ ")),
    ("check", Pump("check", "", "for (i in 0..1e9) { for (j in 0..1e9) {} }")),
    ("fix", Pump("fix", "star{rotate(TAU*u);}", "animate(1, 24);")),
    ("fix", Pump("fix", "scale = 2; ")),
    ("fix", Pump("fix", "(1,2) step ")),
    ("fix", Pump("fix", "rotate(45);", "star {", tail="}")),
    ("fix", Pump("fix", ";")),
    ("fix", Pump("fix", "/*")),
)
"""What once took seconds to minutes."""


class TooLong(BaseException):
    """Raised in whatever has taken its time; no `except Exception` of a reader keeps it."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Processor time that this process may take."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise TooLong

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def slow(mode: str, pumps: list[Pump], letters: int, most_s: float) -> list[tuple[str, float]]:
    """The units that take a reader longer, and how long."""
    found = []
    READERS[mode]("star { scale(; } squar;")  # what is loaded at the first mistake
    for pump in pumps:
        text, started = pump.text(letters), time.process_time()
        try:
            with limited(most_s):
                READERS[mode](text)
        except TooLong:
            found.append((pump.head + pump.unit, time.process_time() - started))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("gap", ["", " ", "\n"])
def test_every_token_alone(mode: str, gap: str) -> None:
    pumps = [Pump(mode, token + gap) for token in TOKENS]
    assert slow(mode, pumps, 100_000, MARGIN * MOST_S) == []


@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("gap", ["", " ", "\n"])
def test_pairs_of_tokens(mode: str, gap: str) -> None:
    """Behind a line of its own, as braces are looked at by lines; other pairs for each mode and gap."""
    generator = Random(f"{mode}{gap}")
    pairs = [generator.sample(TOKENS, 2) for _ in range(150)]
    pumps = [Pump(mode, one + gap + other + gap, generator.choice(("", "nsg 1;\n"))) for one, other in pairs]
    assert slow(mode, pumps, 100_000, MARGIN * MOST_S) == []


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "pump"), FORMER, ids=lambda part: getattr(part, "unit", part))
def test_what_once_took_long(mode: str, pump: Pump) -> None:
    assert slow(mode, [pump], 100_000, MARGIN * MOST_S) == []


@pytest.mark.parametrize(("mode", "pump"), FORMER[:3], ids=lambda part: getattr(part, "unit", part))
def test_braces_that_once_took_a_minute(mode: str, pump: Pump) -> None:
    """5 KB of them took 43 s and take 10 ms."""
    assert slow(mode, [pump], 5_000, 10.0) == []
