"""What formatting costs: ``python -m lab bench fmt``.

Prints, for files of 1,000 and 10,000 lines, the best of three whole `scenelang fmt` processes and of three
calls in this process: a file as people lay scenes out, one of long lines, each an object that is broken into
many, and one in which every line has a comment. The bound is 3 s for 10,000 lines.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from scenelang.formatting import format_text

LIMIT_S = 3.0
USUAL = """module petal{i}(size, colour) {{
  square {{
    rotate(45deg); bend(0.9);
    scale(size, 0.55*size);
    translate(size, {i} / 100);
    material flat {{ color(colour); }}
  }}
}}
for (i in 0..<{i}) {{
  petal{i}(size = 0.1 + 0.2*rand(i), colour = hsv(0.1*i, 0.7, 0.8));
}}

"""
LONG = (
    "square {{ scale(0.2*{i}); rotate({i}deg); translate(0.{i:05}, -0.25); "
    "material flat {{ color(mix(#d33, #3a6ea5, 0.{i:05})); hue(0.1turn*{i}); }} }}\n"
)
NOTED = "let value{i} = {i} * sin(0.5turn * {i});   // what it is for\n"


def repeated(template: str, lines: int) -> str:
    """A text of so many lines, made of a template."""
    count = lines // template.count("\n")
    return "".join(template.format(i=i) for i in range(1, count + 1))


def best_s(run: Callable[[], object], runs: int = 3) -> float:
    """The shortest of several times."""
    taken = []
    for _ in range(runs):
        started = time.perf_counter()
        run()
        taken.append(time.perf_counter() - started)
    return min(taken)


def process(path: Path, text: str) -> None:
    """Format a file in a process of its own."""
    path.write_text(text)
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    command = [sys.executable, "-m", "scenelang", "fmt", str(path)]
    subprocess.run(command, env=environment, check=True, capture_output=True)


def main() -> None:
    """Print the table."""
    print(f"{'lines':<22}{'KB':>8}{'process, s':>12}{'call, s':>10}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "scene.nsg")
        for name, template in (("usual", USUAL), ("long", LONG), ("with comments", NOTED)):
            for lines in (1_000, 10_000):
                text = repeated(template, lines)
                whole_s = best_s(lambda text=text: process(path, text))  # type: ignore[misc]
                call_s = best_s(lambda text=text: format_text(text))  # type: ignore[misc]
                print(f"{lines:>6,} {name:<15}{len(text) / 1000:>8.0f}{whole_s:>12.2f}{call_s:>10.2f}")
    print(f"bound: {LIMIT_S} s for 10,000 lines, whole process")


if __name__ == "__main__":
    main()
