"""How long scenes take to parse and evaluate, and how much memory; run it as it is.

Each line is one fresh process: objects, seconds to parse, seconds to evaluate, peak resident MB.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.span import SourceFile
from scenelang.evaluate.evaluation import evaluate
from scenelang.syntax import parse

BODY = (
    "square {{ scale(0.01 + 0.001 * rand({i})); rotate(1turn * {i} / 7); "
    "translate(rand({i} + 1) * 2 - 1, rand({i} + 2) * 2 - 1); "
    "material flat {{ color(hsv({i} / 100, 0.5, 0.9)); }} }}\n"
)
FLAT = (
    "square {{ scale(0.0{i}); rotate({i}deg); translate(0.{i}, -0.{i}); "
    "material flat {{ color(#d3{j:04x}); }} }}\n"
)


def text_of(kind: str, count: int) -> str:
    """A scene of ``count`` objects, by one loop or written out."""
    if kind == "loop":
        return f"for (i in 0..<{count}) {{ {BODY.format(i='i')} }}"
    return "".join(FLAT.format(i=i + 1, j=i % 65536) for i in range(count))


def measure(kind: str, count: int) -> None:
    """Print one line for one scene."""
    source = SourceFile("bench.nsg", text_of(kind, count))
    found = Diagnostics()
    start = time.perf_counter()
    file = parse(source, found)
    parsed = time.perf_counter()
    scene, _ = evaluate(file, diagnostics=found)
    done = time.perf_counter()
    assert scene is not None
    assert len(scene.nodes) == count
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    times = f"parse {parsed - start:6.3f} s  evaluate {done - parsed:6.3f} s"
    print(f"{kind:4} {count:7,d}  {times}  {peak_mb:5.0f} MB")


def main() -> None:
    """Measure each case in a process of its own."""
    if len(sys.argv) == 3:
        measure(sys.argv[1], int(sys.argv[2]))
        return
    for kind in ("loop", "flat"):
        for count in (100, 1_000, 10_000):
            subprocess.run([sys.executable, __file__, kind, str(count)], check=True)


if __name__ == "__main__":
    main()
