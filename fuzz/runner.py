"""Runs of a target for a given time, each written down as a record.

libFuzzer ends its process at a hard crash, a hang or when memory runs out; the runner keeps the input,
starts the next process with the corpus so far, and adds up.
"""

from __future__ import annotations

import json
import os
import re
import resource
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from fuzz.keeper import SLOW_S, Finding, minimise, shows_signature
from fuzz.target import PROPERTIES, Target, load_target

ROOT: Final = Path(__file__).resolve().parent.parent
RECORDS: Final = ROOT / "fuzz" / "records"
HANG_S: Final = 120
"""Wall time after which one input counts as a hang; processes may get little of a busy machine."""
MOST_RSS_MB: Final = 3000
_STATUS: Final = re.compile(r"^#\d+\s.*?cov: (\d+)(?: ft: (\d+))?(?: corp: (\d+))?", re.MULTILINE)


@dataclass(slots=True)
class Record:
    """One run. Sizes are in bytes, times in seconds."""

    target: str
    started: str
    revision: str
    asked_s: float
    wall_s: float = 0.0
    cpu_s: float = 0.0
    executions: int = 0
    edges: int = 0
    features: int = 0
    corpus: int = 0
    seeds: int = 0
    peak_bytes: int = 0
    processes: int = 0
    crashes: int = 0
    slowest: dict[str, Any] = field(default_factory=dict)
    findings: list[dict[str, Any]] = field(default_factory=list)


def fuzz(name: str, minutes: float, work: Path, seed: int = 1, records: Path | None = None) -> Record:
    """Fuzz a target and write the record, ``record.json``, beside its corpus.

    Args:
        name: the target.
        minutes: wall time.
        work: folder for corpus, log and findings; what an earlier run left there is gone on from.
        seed: of the first process.
        records: folder that takes the record, too, under a name with the time.
    """
    target = load_target(name)
    folder = work / name
    (folder / "corpus").mkdir(parents=True, exist_ok=True)
    seeds = target.seeds()
    for index, data in enumerate(seeds):
        (folder / "corpus" / f"seed-{index:04}").write_bytes(data[: target.most_bytes])
    now = datetime.now(UTC)
    record = Record(name, now.isoformat(timespec="seconds"), revision(), 60 * minutes, seeds=len(seeds))
    start_s = time.monotonic()
    with (folder / "log.txt").open("ab") as log:
        while (left_s := record.asked_s - (time.monotonic() - start_s)) > 1:
            _one_process(target, folder, log, int(left_s), seed + record.processes, record)
            if record.processes >= 3 and record.executions == 0:
                raise SystemExit(f"the fuzzing process does not start: see {folder / 'log.txt'}")
    record.wall_s = round(time.monotonic() - start_s, 1)
    if name != PROPERTIES:
        record.corpus = sum(1 for _ in (folder / "corpus").iterdir())
    _settle(target, folder, record)
    told = json.dumps(asdict(record), indent=2) + "\n"
    (folder / "record.json").write_text(told, encoding="utf-8")
    if records is not None:
        records.mkdir(parents=True, exist_ok=True)
        (records / f"{now:%Y%m%dT%H%M%S}-{name}.json").write_text(told, encoding="utf-8")
    return record


def _one_process(target: Target, folder: Path, log: Any, left_s: int, seed: int, record: Record) -> None:
    """One process of libFuzzer, added to the record."""
    state = folder / "state.json"
    state.unlink(missing_ok=True)
    options = [
        f"-max_total_time={left_s}",
        f"-timeout={HANG_S}",
        f"-rss_limit_mb={MOST_RSS_MB}",
        f"-artifact_prefix={folder}/findings/",
        "-print_final_stats=1",
    ]
    command = [sys.executable, "-m", "fuzz.drive", target.name, str(folder), str(seed), *options]
    if target.name == PROPERTIES:
        command = [sys.executable, "-m", "fuzz.properties", str(folder), str(left_s), str(seed)]
    begin = log.tell()
    before = {path.name for path in (folder / "findings").glob("*")}
    cpu_s = children_s()
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONHASHSEED": "0"}
    done = subprocess.run(command, cwd=ROOT, stdout=log, stderr=log, env=environment, check=False)
    record.processes += 1
    record.cpu_s = round(record.cpu_s + children_s() - cpu_s, 1)
    with (folder / "log.txt").open("rb") as lines:
        lines.seek(begin)
        text = lines.read().decode("utf-8", "replace")
    for edges, features, _ in _STATUS.findall(text):
        record.edges = max(record.edges, int(edges))
        record.features = max(record.features, int(features or 0))
    counted = re.findall(r"number_of_executed_units:\s*(\d+)", text)
    if state.exists():
        told = json.loads(state.read_text(encoding="utf-8"))
        record.executions += int(counted[-1]) if counted else told["executions"]
        record.peak_bytes = max(record.peak_bytes, told["peak_bytes"])
        if told["slowest"]["cpu_s"] > record.slowest.get("cpu_s", 0.0):
            record.slowest = told["slowest"]
        for finding in told["findings"].values():
            _add(record, finding)
    new = {path.name for path in (folder / "findings").glob("*")} - before
    for name in sorted(new):
        if name.startswith(("crash-", "timeout-", "oom-", "leak-")) and not name.endswith(".bin"):
            kind, size = name.partition("-")[0], (folder / "findings" / name).stat().st_size
            error = f"the process ended with {done.returncode}"
            _add(record, asdict(Finding(name, kind, error, 1, size, name, 0.0)))


def _add(record: Record, finding: dict[str, Any]) -> None:
    for known in record.findings:
        if known["signature"] == finding["signature"]:
            known["times"] += finding["times"]
            known["bytes"] = min(known["bytes"], finding["bytes"])
            return
    record.findings.append(finding)
    record.crashes = len(record.findings)


def _settle(target: Target, folder: Path, record: Record) -> None:
    """Make the inputs of findings small, and leave out what is slow only because it is watched."""
    for finding in list(record.findings):
        path = folder / "findings" / finding["file"]
        if path.suffix != ".bin" or not path.exists():
            continue
        data = path.read_bytes()
        if finding["kind"] in ("crash", "oracle") and target.name != PROPERTIES:
            small = minimise(data, shows_signature(target, finding["signature"]))
            path.write_bytes(small)
            finding["bytes"] = len(small)
        elif finding["kind"] == "slow":
            seconds = min(_seconds(target, data) for _ in range(3))
            finding["error"] += f"; {seconds:.2f} s without instrumentation"
            if seconds < SLOW_S * target.runs:
                record.findings.remove(finding)
    record.crashes = len(record.findings)


def _seconds(target: Target, data: bytes) -> float:
    """CPU time of one run."""
    before = time.process_time()
    with suppress(Exception):  # a finding of its own
        target.check(data)
    return time.process_time() - before


def children_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def revision() -> str:
    """The commit that was fuzzed, with a plus where files differ from it; unknown outside a checkout."""
    try:
        commit = _git("rev-parse", "--short=12", "HEAD")
        return commit + ("+" if _git("status", "--porcelain", "scenelang", "fuzz") else "")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def _git(*arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()
