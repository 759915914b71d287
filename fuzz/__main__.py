"""The command: ``python -m fuzz TARGET [--minutes M | --replay FILE | --minimise FILE]``."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

from fuzz.target import PROPERTIES, PUMPED, TARGETS, Target, load_target

TIMEOUT_S = 120
"""Wall time after which one input counts as a hang; processes may get little of a busy machine."""
MOST_RSS_MB = 3000


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit status, other than 0 where there is a finding."""
    parser = argparse.ArgumentParser(prog="python -m fuzz", description="Fuzz scenelang.")
    parser.add_argument("target", choices=(*TARGETS, PROPERTIES), help="what to fuzz")
    parser.add_argument("--minutes", type=float, default=60.0, help="wall time of the run (60)")
    parser.add_argument("--seed", type=int, default=1, help="of the fuzzer's random numbers (1)")
    parser.add_argument("--work", type=Path, default=Path("out/fuzz"), help="corpus and findings (out/fuzz)")
    parser.add_argument("--replay", type=Path, metavar="FILE", help="run the target once on this input")
    parser.add_argument(
        "--minimise", type=Path, metavar="FILE", help="print a smaller input that fails alike"
    )
    wanted = parser.parse_args(arguments)
    target = load_target(wanted.target)
    if wanted.replay is not None:
        target.check(wanted.replay.read_bytes())
        return 0
    if wanted.minimise is not None:
        return _minimise(target, wanted.minimise.read_bytes())
    if target.name == PROPERTIES:
        from fuzz.properties import turns

        return turns(60 * wanted.minutes, wanted.seed)
    folder = wanted.work / target.name
    (folder / "findings").mkdir(parents=True, exist_ok=True)
    if target.name == PUMPED:
        from fuzz.hunt import hunt

        return hunt(wanted.minutes, folder / "findings", wanted.seed)
    return _fuzz(target, wanted.minutes, folder, wanted.seed)


def _fuzz(target: Target, minutes: float, folder: Path, seed: int) -> int:
    """Have libFuzzer run a target, in a process of its own, from the seeds and the corpus so far."""
    (folder / "corpus").mkdir(exist_ok=True)
    for index, data in enumerate(target.seeds()):
        (folder / "corpus" / f"seed-{index:04}").write_bytes(data[: target.most_bytes])
    options = [
        f"-max_total_time={round(60 * minutes)}",
        f"-timeout={TIMEOUT_S}",
        f"-rss_limit_mb={MOST_RSS_MB}",
        f"-artifact_prefix={folder}/findings/",
        "-print_final_stats=1",
    ]
    command = [sys.executable, "-m", "fuzz.drive", target.name, str(folder), str(seed), *options]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONHASHSEED": "0"}
    return subprocess.run(command, env=environment, check=False).returncode


def _minimise(target: Target, data: bytes) -> int:
    from fuzz.minimise import failure_of, minimise

    failure = failure_of(target, data)
    if failure is None:
        print("this input does not fail", file=sys.stderr)
        return 2
    sys.stdout.buffer.write(minimise(data, lambda smaller: failure_of(target, smaller) == failure))
    return 0


if __name__ == "__main__":
    sys.exit(main())
