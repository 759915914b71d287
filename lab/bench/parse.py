"""Parsing speed: ``python -m lab bench parse``.

Prints, for a flat file of 100, 1,000 and 10,000 objects and for one with a mistake in every fiftieth, the
best of five runs in one process, and the peak memory of the largest.
"""

from __future__ import annotations

import time
import tracemalloc

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.span import SourceFile
from scenelang.syntax import parse


def flat(count: int, mistake_every: int = 0) -> str:
    """A text of about 100 bytes an object."""
    lines = []
    for i in range(count):
        end = "" if mistake_every and i % mistake_every == 0 else ";"
        lines.append(
            f"square {{ scale({0.1 + i / 1e5:.4f}); rotate({i % 360}deg); "
            f"translate({i * 1e-4:.4f}, -0.25){end} material flat {{ color(#d3{i % 16:x}); }} }}\n"
        )
    return "".join(lines)


def seconds(text: str, runs: int = 5) -> tuple[float, int]:
    """The best time of several runs, and how many mistakes were found."""
    best = float("inf")
    found = 0
    for _ in range(runs):
        diagnostics = Diagnostics()
        start = time.perf_counter()
        parse(SourceFile("flat.nsg", text), diagnostics)
        best = min(best, time.perf_counter() - start)
        found = len(diagnostics)
    return best, found


def main() -> None:
    """Print the table."""
    seconds(flat(10))
    print(f"{'text':<34}{'KB':>8}{'ms':>10}{'KB/s':>8}{'mistakes':>10}")
    cases = [(f"{count:,} objects", flat(count)) for count in (100, 1_000, 10_000)]
    cases.append(("1,000 objects, 20 mistakes", flat(1_000, mistake_every=50)))
    for name, text in cases:
        best, found = seconds(text)
        kilobytes = len(text) / 1000
        print(f"{name:<34}{kilobytes:>8.0f}{best * 1000:>10.1f}{kilobytes / best:>8.0f}{found:>10}")
    tracemalloc.start()
    seconds(cases[2][1], runs=1)
    print(f"peak memory of 10,000 objects: {tracemalloc.get_traced_memory()[1] / 1e6:.0f} MB")


if __name__ == "__main__":
    main()
