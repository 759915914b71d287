"""Accuracy of the times that `scenelang.drawing.small` predicts, and a fit of its numbers.

    python -m lab bench work [--share S]

Draws the examples and random scenes on several canvases by numpy on one core, in processor time, the least of
three drawings each, and fits the numbers of `work_ms` to what they took. Says of the numbers in use and of
those found how many times as long as foretold 5, 50 and 95 of 100 pictures take at most.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator

import numpy as np

import scenelang as nsg
from lab import ROOT
from lab.bench.floor import of_set, stars
from lab.frontier.fit import fit_cost
from scenelang.compiler.program import Program
from scenelang.drawing.how import Samples
from scenelang.drawing.small import draw_small
from scenelang.drawing.work import _NS, _SHARES, load_of, work_ms
from scenelang.output.frontier import UNITS

EXAMPLES = ROOT / "examples"
CANVASES = (64, 64), (160, 120), (256, 256), (600, 400)
SETS = "shapes2d", "chains", "many", "crowd", "tiny", "large", "textures2d-mixed"
EACH = 4  # scenes of a set, on each canvas


def programs(share: float) -> Iterator[Program]:
    """A share of the pictures, of the plane."""
    made = [nsg.load(path) for path in sorted(EXAMPLES.glob("*.nsg"))]
    made += [of_set(frame, name) for frame in range(EACH) for name in SETS]
    made += [stars(frame, 25 << 2 * frame, 0.3 / 2**frame, 256) for frame in range(EACH)]
    scenes = [scene.sized(canvas) for canvas in CANVASES for scene in made]
    for at, scene in enumerate(scenes):
        if int(at * share) == int((at + 1) * share):
            continue
        try:
            program = nsg.compile(scene)
        except nsg.SceneError:
            continue
        if program.stage is None:
            yield program


def frame_ms(program: Program, samples: Samples = "adaptive") -> float:
    taken = []
    for _ in range(3):
        started = time.process_time()
        draw_small(program, samples=samples)
        taken.append(1e3 * (time.process_time() - started))
    return min(taken)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--share", type=float, default=1.0, metavar="S", help="of the pictures")
    loads, told, ms = [], [], []
    shares: dict[Samples, list[float]] = {samples: [] for samples in _SHARES}
    for at, program in enumerate(programs(parser.parse_args().share)):
        loads.append(load_of(program))
        told.append(work_ms(program))
        ms.append(frame_ms(program))
        for samples, result in shares.items() if at % 4 == 0 else ():
            result.append(frame_ms(program, samples) / ms[-1])
    cost = fit_cost(loads, ms, skip=True)
    terms = np.array([cost.frame, cost.thousand_objects, cost.megapixel, cost.megameeting, cost.outline])
    fitted = np.array([load.row(True) for load in loads]) @ (terms / UNITS)
    numbers = ", ".join(f"{1e6 * term / unit:.0f}" for term, unit in zip(terms, UNITS, strict=True))
    print(f"{len(ms)} pictures of {min(ms):.1f} to {max(ms):.0f} ms")
    for name, guess in ((str(_NS), told), (f"({numbers})", fitted)):
        low, middle, high = np.percentile(np.array(ms) / guess, (5, 50, 95))
        print(f"{name} ns: {low:.2f}, {middle:.2f}, {high:.2f} times what is foretold")
    print(
        ", ".join(f"{samples} {np.median(result):.2f}" for samples, result in shares.items()), "of adaptive"
    )


if __name__ == "__main__":
    main()
