"""Measure everything that docs/results.md reports, from scratch, at any budget.

python benchmarks/everything.py -o out                 about ten minutes: a budget for seeing that it runs
python benchmarks/everything.py -o out --budget 6      the paper's methods six processor minutes each

Trains every design of `scenelang lab experiment`, draws the charts, evaluates the shipped models, runs the
stability suite, and measures the frontier. Everything is written under the folder; what was trained before is
not trained again.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path


def commands(out: Path, budget: float, scenes: int) -> list[list[str]]:
    """The commands, in order.

    Args:
        out: folder that gets everything.
        budget: processor minutes of each training.
        scenes: of evaluations; suites that draw many scenes for each value take a share of it.
    """
    few, some = max(1, scenes // 20), max(2, scenes // 5)
    experiments = f"{out}/experiments"
    options = "--budget", f"{budget}", "--scenes", f"{max(8, scenes)}"
    return [
        ["experiment", "all", "-o", experiments, *options],
        ["chart", experiments],
        ["eval", "shapes2d", "--all-sets", "--scenes", f"{some}", "-o", f"{out}/eval"],
        ["stability", "shapes2d", "--scenes", f"{few}", "-o", f"{out}/stability"],
        ["eval", "solids3d", "--all-sets", "--scenes", f"{some}", "-o", f"{out}/eval-solids3d"],
        ["stability", "solids3d", "--scenes", f"{few}", "-o", f"{out}/stability-solids3d"],
        ["frontier", "shapes2d", "--scenes", f"{some}", "-o", f"{out}/frontier"],
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--budget", type=float, default=0.01, metavar="MINUTES", help="of each training")
    parser.add_argument("--scenes", type=int, default=10, metavar="N")
    given = parser.parse_args()
    for command in commands(given.out, given.budget, given.scenes):
        started = time.perf_counter()
        subprocess.run([sys.executable, "-m", "scenelang", "lab", *command], check=True)
        print(f"-- {command[0]}: {time.perf_counter() - started:.0f} s", flush=True)


if __name__ == "__main__":
    main()
