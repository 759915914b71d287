"""Hunting for slow input: random pumps of 100 KB, each in a process whose processor time is bounded.

Coverage, which fuzzers follow, says nothing about time.
"""

from __future__ import annotations

import hashlib
import itertools
import os
import resource
import time
from pathlib import Path
from random import Random
from typing import Final

from fuzz import pumps

LETTERS: Final = 100_000
MOST_S: Final = 2.0
"""Processor time of one reading that is a finding."""
KILLED_S: Final = 20
_SMALL: Final = 10_000
_NOTED_S: Final = 0.15
"""A small text that takes longer is tried at full length."""


def hunt(minutes: float, findings: Path, seed: int = 1) -> int:
    """Read pumps, known ones first, for so long, and write slow ones into ``findings``; the exit status."""
    known, end_s = pumps.seeds(), time.monotonic() + 60 * minutes
    for read in pumps.READERS.values():
        read("")  # what is imported at the first reading is no part of any
    generator, slowest_s, found = Random(seed), 0.0, 0
    for count in itertools.count():
        if time.monotonic() > end_s:
            print(f"{count:,} pumps, the slowest {slowest_s:.2f} s; findings: {found}")
            return int(found > 0)
        pump = known[count] if count < len(known) else pumps.drawn(generator)
        if reading(pump, _SMALL) <= _NOTED_S and count >= len(known):
            continue
        taken_s = reading(pump, LETTERS)
        slowest_s = max(slowest_s, taken_s)
        if taken_s > MOST_S:
            found += 1
            data = pump.data()
            path = findings / f"slow-{hashlib.sha256(data).hexdigest()[:8]}.json"
            path.write_bytes(data)
            print(f"{pump.reader}: {pump.unit[:60]!r} took {taken_s:.2f} s: {path}")
    raise AssertionError


def reading(pump: pumps.Pump, letters: int) -> float:
    """Processor seconds of the reader of a pump, in a child that ends after `KILLED_S`."""
    text = pump.text(letters)
    readable, writable = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(readable)
        resource.setrlimit(resource.RLIMIT_CPU, (KILLED_S, KILLED_S + 1))
        begin = time.process_time()
        try:
            pumps.READERS[pump.reader](text)
        finally:
            os.write(writable, str(time.process_time() - begin).encode())
            os._exit(0)
    os.close(writable)
    with os.fdopen(readable, "rb") as answer:
        told = answer.read()
    os.waitpid(child, 0)
    return float(told or KILLED_S)
