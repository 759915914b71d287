"""Costs of whole commands, next to those of Python and ``import torch`` on the same machine.

Each round runs every command once, in a process of its own, so that a busy or slow machine slows all of
them alike; the figures that matter are the ratios of the medians. Bytecode is cached, as after an install.

    python -m lab bench startup [ROUNDS] [-o docs/results/startup.json]
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from scenelang.language.formatting import format_text

CHECK_LIMIT_S = 0.25
CHECK_LIMIT = 1.4  # of what it cannot do without: click, and one pydantic model
NEEDED = "import click, pydantic\nclass Model(pydantic.BaseModel):\n    x: int"
RENDER_LIMIT = 0.35  # of import torch

FOUR = """chain {
  square           { scale(0.8); translate(-0.2, 0); material flat { color(#d33); } }
  smooth pentagon  { twirl(0.6); bend(0.2); scale(0.5); rotate(30deg); }
  subtract star    { scale(0.3); translate(0.1, 0.1); }
  intersect square { rotate(45deg); }
}
"""
HEAD = """nsg 1;
canvas(256, 256);
param k = 0.6 in 0..1;
let warm = hsv(0.05, 0.8, 0.9);
fn wave(i) = 0.5 + 0.4 * sin(1turn * i / 7);
module petal(at, c = warm) { star { scale(0.1); twirl(k); translate(at); material flat { color(c); } } }
for (i in 0..<6) { petal(at = [wave(i), wave(i + 2)], c = hsv(i / 6, 0.7, 0.8)); }
"""
LINE = (
    "square {{ scale(0.2); rotate({angle}deg); translate({x}, -0.3); material flat {{ color(#3a6ea5); }} }}\n"
)


def forty_lines() -> str:
    """A scene of 40 lines that uses most of the language."""
    return HEAD + "".join(LINE.format(angle=7 * i, x=-0.8 + i / 20) for i in range(33))


def seconds(command: list[str], environment: dict[str, str]) -> float:
    """Wall time of a process that must succeed."""
    started = time.perf_counter()
    subprocess.run(command, env=environment, check=True, capture_output=True)
    return time.perf_counter() - started


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("rounds", nargs="?", type=int, default=11)
    parser.add_argument("-o", "--out", type=Path, metavar="FILE")
    given = parser.parse_args()
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    with tempfile.TemporaryDirectory() as folder:
        forty, four = Path(folder, "forty.nsg"), Path(folder, "four.nsg")
        forty.write_text(forty_lines())
        four.write_text(FOUR)
        neat = Path(folder, "neat.nsg")
        neat.write_text(format_text(forty_lines()))
        run = [sys.executable, "-m", "scenelang"]
        commands = {
            "python": [sys.executable, "-c", "pass"],
            "click and pydantic": [sys.executable, "-c", NEEDED],
            "import torch": [sys.executable, "-c", "import torch"],
            "--help": [*run, "--help"],
            "check, 40 lines": [*run, "check", str(forty)],
            "fmt --check, 40 lines": [*run, "fmt", "--check", str(neat)],
            "compile, 4 objects": [*run, "compile", str(four), "-o", f"{folder}/four.safetensors"],
            "render, 4 objects, 256 x 256": [*run, "render", str(four), "-o", f"{folder}/four.png"],
        }
        taken: dict[str, list[float]] = {name: [] for name in commands}
        for command in commands.values():
            seconds(command, environment)  # files into the page cache, bytecode onto the disk
        for _ in range(given.rounds):
            for name, command in commands.items():
                taken[name].append(seconds(command, environment))
    median = {name: statistics.median(values) for name, values in taken.items()}
    torch_s = median["import torch"]
    for name, value in median.items():
        spread = f"{min(taken[name]):.3f} to {max(taken[name]):.3f}"
        print(f"{name:30} {value:.3f} s ({spread}), {value / torch_s:.2f} x import torch")
    check_s, fmt_s = median["check, 40 lines"], median["fmt --check, 40 lines"]
    render = median["render, 4 objects, 256 x 256"] / torch_s
    needed = check_s / median["click and pydantic"]
    print(f"check:  {check_s:.3f} s of {CHECK_LIMIT_S} s")
    print(f"        {needed:.2f} of click and pydantic, at most {CHECK_LIMIT}")
    print(f"fmt:    {fmt_s:.3f} s of {CHECK_LIMIT_S} s")
    print(f"render: {render:.2f} of import torch, at most {RENDER_LIMIT}")
    if given.out:
        from lab.about import about, write_json

        record = {**about(), "rounds": given.rounds, "median_s": median}
        write_json(given.out, record)


if __name__ == "__main__":
    main()
