"""Time that light from everywhere takes, and how still it is: ``python -m lab bench light_times``.

Frames of 256² of three random solids, or two and one of mist: without a sky, and with a sky and a soft lamp.
Both are drawn in turns, cold, the light's nodes included, and their least times kept: processor seconds with
one thread, seconds with more. Then scenes of families in which one object moves by 1e-4: how much pictures
change.
"""

from __future__ import annotations

import argparse
import gc
import re
import time
from pathlib import Path
from typing import Any

import numpy as np

from lab.about import about, write_json
from lab.light.families import FAMILIES, diffuse, lamp, mist_of, scene_text, sky_of, solid
from scenelang import Program, loads, render
from scenelang import compile as compile_scene
from scenelang.drawing.metrics import over_white
from scenelang.drawing.solid.network import SolidArrays

SCENES, TURNS, SIZE = 6, 9, 256
MOVED, STEP = 128, 1e-4  # pixels a side, and world units


def programs(seed: int, misty: bool) -> list[Program]:
    """The same solids without a sky, and with a sky and a soft lamp."""
    rng = np.random.default_rng(seed)
    solids = "".join(solid(rng, diffuse(rng)) for _ in range(2 if misty else 3))
    solids += solid(rng, mist_of(rng)) if misty else ""
    lit = lamp(rng, 20.0, float(rng.uniform(0.2, 0.8))) + sky_of(rng, 0.3, 1.0)
    return [compile_scene(loads(f"nsg 1; canvas({SIZE}, {SIZE});\n{text}{solids}")) for text in ("", lit)]


def times(both: list[Program], threads: int) -> list[float]:
    """Least seconds of each."""
    clock = time.process_time if threads == 1 else time.perf_counter
    best = [float("inf")] * len(both)
    for turn in range(TURNS + 1):
        for at, program in enumerate(both):
            for network in gc.get_objects() if turn else ():
                if type(network) is SolidArrays:
                    network.last = None  # it keeps the light of the last picture
            began = clock()
            render(program, threads=threads)
            if turn:  # the first loads the weights
                best[at] = min(best[at], clock() - began)
    return best


def moved(family: str, seed: int) -> list[float]:
    """Mean and 99th percentile of how pixels change where the first object moves a little."""
    text = scene_text(family, 2021, seed, MOVED)

    def aside(found: re.Match[str]) -> str:
        return f"translate({float(found[1]) + STEP:.6f},"

    other = re.sub(r"translate\((-?[\d.]+),", aside, text, count=1)
    first, second = (over_white(render(compile_scene(loads(each)))) for each in (text, other))
    change = abs(first - second).max(2)
    return [float(change.mean()), float(np.percentile(change, 99))]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m lab bench light_times")
    parser.add_argument("--scenes", type=int, default=SCENES)
    parser.add_argument("-o", "--out", type=Path, default=Path("docs/results/light/times.json"))
    chosen = parser.parse_args()
    result: dict[str, Any] = {}
    for misty in (False, True):
        for threads in (1, 2):
            rows = np.array([times(programs(seed, misty), threads) for seed in range(chosen.scenes)])
            name = f"{'mist' if misty else 'diffuse'}, {threads} threads"
            ratios = (rows[:, 1] / rows[:, 0]).tolist()
            result[name] = {
                "ms": (1e3 * rows.mean(0)).tolist(),
                "of sums": float(np.divide(*rows.sum(0)[::-1])),
            }
            result[name]["ratios"] = ratios
            print(name, {key: np.round(value, 2) for key, value in result[name].items()}, flush=True)
    still = {}
    for family in FAMILIES:
        rows = np.array([moved(family, seed) for seed in range(chosen.scenes)])
        still[family] = {"mean": rows[:, 0].tolist(), "99th percentile": rows[:, 1].tolist()}
        print(family, rows.max(0), flush=True)
    write_json(chosen.out, about() | {"times": result, "moved": still})


if __name__ == "__main__":
    main()
