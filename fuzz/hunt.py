"""Hunting for slow input: pumps of 100 KB, each in a process of its own whose processor time is bounded.

What coverage is followed by says nothing about time, so no fuzzer drives this: pumps are drawn at random.
"""

from __future__ import annotations

import hashlib
import json
import os
import resource
import time
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from random import Random
from typing import Final

from fuzz import pumps
from fuzz.keeper import Finding
from fuzz.runner import Record, children_s, revision

LETTERS: Final = 100_000
MOST_S: Final = 2.0
"""Processor time of one reading that is a finding."""
KILLED_S: Final = 20
_SMALL: Final = 10_000
_NOTED_S: Final = 0.15
"""A small text that takes longer is tried at full length."""


def hunt(minutes: float, work: Path, seed: int = 1, records: Path | None = None) -> Record:
    """Read pumps, first those that thought found, until the time is over.

    Args:
        minutes: wall time.
        work: folder for findings.
        seed: of what is drawn.
        records: folder that takes the record.
    """
    folder = work / "slow"
    (folder / "findings").mkdir(parents=True, exist_ok=True)
    now, start_s, cpu_s = datetime.now(UTC), time.monotonic(), children_s()
    known = pumps.seeds()
    record = Record("slow", now.isoformat(timespec="seconds"), revision(), 60 * minutes, seeds=len(known))
    for read in pumps.READERS.values():
        read("")  # what is imported at the first reading is no part of any
    generator, slowest = Random(seed), 0.0
    while time.monotonic() - start_s < record.asked_s:
        first = record.executions < len(known)
        pump = known[record.executions] if first else pumps.drawn(generator)
        record.executions += 1
        taken_s, _ = reading(pump, _SMALL)
        if taken_s <= _NOTED_S and not first:
            continue
        taken_s, peak = reading(pump, LETTERS)
        record.peak_bytes = max(record.peak_bytes, peak)
        if taken_s > slowest:
            slowest = taken_s
            record.slowest = {"cpu_s": taken_s, "bytes": LETTERS, "start": repr(pump)}
        if taken_s > MOST_S:
            _note(record, folder, pump, taken_s)
    record.wall_s = round(time.monotonic() - start_s, 1)
    record.cpu_s = round(children_s() - cpu_s, 1)
    told = json.dumps(asdict(record), indent=2) + "\n"
    for place in [folder / "record.json", *([records / f"{now:%Y%m%dT%H%M%S}-slow.json"] if records else [])]:
        place.write_text(told, encoding="utf-8")
    return record


def reading(pump: pumps.Pump, letters: int) -> tuple[float, int]:
    """Processor seconds and peak bytes of the reader of a pump, in a child that ends after `KILLED_S`."""
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
            os.write(writable, json.dumps(time.process_time() - begin).encode())
            os._exit(0)
    os.close(writable)
    with os.fdopen(readable, "rb") as answer:
        told = answer.read()
    _, _, used = os.wait4(child, 0)
    return (json.loads(told) if told else float(KILLED_S)), used.ru_maxrss * 1024


def _note(record: Record, folder: Path, pump: pumps.Pump, taken_s: float) -> None:
    data = pump.data()
    name = f"slow-{hashlib.sha256(data).hexdigest()[:8]}.json"
    (folder / "findings" / name).write_bytes(data)
    signature = f"{pump.reader}: {pump.unit[:60]!r}"
    record.findings.append(
        asdict(Finding(signature, "slow", f"{taken_s:.2f} s", 1, len(data), name, taken_s))
    )
    record.crashes = len(record.findings)
