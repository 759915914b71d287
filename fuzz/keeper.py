"""Runs a target over inputs and keeps what is worth keeping: findings, once each, and what inputs cost.

A finding does not end a run: its smallest input is written down and the run goes on, so that an hour
finds more than one mistake.
"""

from __future__ import annotations

import hashlib
import json
import os
import resource
import time
import traceback
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Final

from fuzz.target import Failure, Target

SLOW_S: Final = 2.0
"""CPU seconds of one input that are a finding."""
MOST_BYTES: Final = 500_000_000
"""Growth of the peak memory by one input that is a finding."""


@dataclass(slots=True)
class Finding:
    """One mistake, however many inputs show it.

    Args:
        signature: what and where: exception and place in the code, or oracle.
        kind: ``crash``, ``oracle``, ``slow`` or ``memory``.
        error: the message of the first time.
        times: how many inputs showed it.
        bytes: size of the smallest of them.
        file: where that is kept, a name in the folder of findings.
        cost: CPU seconds or bytes of the costliest, where that is the finding.
    """

    signature: str
    kind: str
    error: str
    times: int
    bytes: int
    file: str
    cost: float


@dataclass(slots=True)
class Slowest:
    """The input that took most CPU time."""

    cpu_s: float = 0.0
    bytes: int = 0
    sha256: str = ""
    start: str = ""


@dataclass(slots=True)
class State:
    """What a run has come to, written to a file now and then."""

    executions: int = 0
    cpu_s: float = 0.0
    peak_bytes: int = 0
    first_peak_bytes: int = 0
    slowest: Slowest = field(default_factory=Slowest)
    findings: dict[str, Finding] = field(default_factory=dict)


def signature_of(error: BaseException) -> tuple[str, str]:
    """Kind and signature of what a target raised: the same for the same mistake."""
    if isinstance(error, Failure):
        return "oracle", error.oracle
    place = "outside"
    for frame in traceback.extract_tb(error.__traceback__):
        if f"{os.sep}scenelang{os.sep}" in frame.filename:
            inside = frame.filename.rpartition(f"{os.sep}scenelang{os.sep}")[2]
            place = f"{inside}:{frame.name}"
    return "crash", f"{type(error).__name__} in {place}"


class Keeper:
    """One target's run.

    Args:
        target: what is fuzzed.
        folder: takes findings, the slowest input and the state.
        every_s: how often the state is written.
    """

    def __init__(self, target: Target, folder: Path, every_s: float = 5.0) -> None:
        self.target = target
        self.folder = folder
        self.every_s = every_s
        self.slow_s = SLOW_S * target.runs
        self.state = State()
        self.written_s = 0.0
        (folder / "findings").mkdir(parents=True, exist_ok=True)
        self.state.first_peak_bytes = self.state.peak_bytes = peak_bytes()

    def run(self, data: bytes) -> None:
        """One input; never raises but for what ends the process."""
        state = self.state
        state.executions += 1
        before_s = time.process_time()
        found = None
        try:
            self.target.check(data)
        except Exception as error:
            kind, signature = signature_of(error)
            found = kind, signature, f"{type(error).__name__}: {error}"
        cpu_s = time.process_time() - before_s
        peak = peak_bytes()
        grown, state.peak_bytes = peak - state.peak_bytes, max(peak, state.peak_bytes)
        if found is not None:
            self._note(data, *found)
        if cpu_s > self.slow_s:
            self._note(data, "slow", f"more than {self.slow_s:g} s of CPU time", f"{cpu_s:.2f} s", cpu_s)
        if grown > MOST_BYTES:
            self._note(data, "memory", f"more than {MOST_BYTES:,} bytes", f"{grown:,} bytes", grown)
        if cpu_s > state.slowest.cpu_s:
            digest = hashlib.sha256(data).hexdigest()
            state.slowest = Slowest(cpu_s, len(data), digest, repr(data[:80]))
            (self.folder / "slowest.bin").write_bytes(data)
        now = time.monotonic()
        if now - self.written_s > self.every_s:
            self.written_s = now
            self.write()

    def write(self) -> None:
        """The state, for who watches and for the record."""
        self.state.cpu_s = time.process_time()
        text = json.dumps(asdict(self.state), indent=2)
        whole = self.folder / "state.json.part"
        whole.write_text(text, encoding="utf-8")
        whole.replace(self.folder / "state.json")

    def _note(self, data: bytes, kind: str, signature: str, error: str, cost: float = 0.0) -> None:
        """Count a finding; of its inputs the smallest is kept, or the one that costs most."""
        known = self.state.findings.get(signature)
        if known is None:
            name = f"{kind}-{hashlib.sha256(signature.encode()).hexdigest()[:8]}.bin"
            known = Finding(signature, kind, "", 0, len(data) + 1, name, -1.0)
            self.state.findings[signature] = known
        known.times += 1
        if cost > known.cost if cost else len(data) < known.bytes:
            known.bytes, known.cost, known.error = len(data), cost, error[:2000]
            (self.folder / "findings" / known.file).write_bytes(data)
            self.write()


def peak_bytes() -> int:
    """The process's largest resident memory so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def minimise(data: bytes, shows: Callable[[bytes], bool], tries: int = 3000) -> bytes:
    """A smaller input that shows the same: pieces are left out, large ones first.

    Args:
        data: shows it.
        shows: whether an input does.
        tries: inputs to try at most.
    """
    size = max(1, len(data) // 2)
    while size and tries > 0:
        at, smaller = 0, False
        while at < len(data) and tries > 0:
            candidate = data[:at] + data[at + size :]
            tries -= 1
            if shows(candidate):
                data, smaller = candidate, True
            else:
                at += size
        if not smaller:
            size //= 2
    return data


def shows_signature(target: Target, signature: str) -> Callable[[bytes], bool]:
    """Whether an input makes ``target`` raise what has this signature."""

    def shows(data: bytes) -> bool:
        try:
            target.check(data)
        except Exception as error:
            return signature_of(error)[1] == signature
        return False

    return shows
