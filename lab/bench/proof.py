"""Proofs of pictures of evaluation sets: proved shares, pixels that break their proof, and costs.

    python -m lab bench proof [--scenes N] [--set NAME ...] [--seed N] [-o docs/results/proof.json]

A line of JSON for each set, and all of them in a record: means of the share of pixels proved right to
1/255, of those that are, and of those drawn again; the largest bound and difference from the exact picture;
and how many pixels are farther from it than their bound, before and after they were drawn again. Of processor
time of one thread, medians of ratios to a plain frame: of a proof, of what drawing again adds to it, and of
the reference. Of each the least of three counts, in turn; the reference is drawn once.
Exits with 1 if a pixel breaks its proof.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from lab.about import about, write_json
from lab.sets.plane import SETS
from lab.sets.scenes import interval, sets_of
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.graph import Graph
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.exact.picture import reference_image
from scenelang.drawing.how import keep_memory
from scenelang.drawing.image import PROVED
from scenelang.drawing.proof import prove_image
from scenelang.drawing.small import draw_small

ROUNDS = 3


def timed(function: Callable[[], Any]) -> tuple[float, Any]:
    start = time.process_time()
    result = function()
    return time.process_time() - start, result


def over(picture: Any) -> Any:
    """In float64, premultiplied where there is alpha."""
    values = np.array(picture, np.float64)
    if values.shape[2] == 4:
        values[..., :3] *= values[..., 3:]
    return values


def measured(name: str, index: int, seed: int) -> dict[str, float]:
    """Figures of a scene of a set."""
    manifest = load_manifest("shapes2d")
    scene, graphs = sets_of(manifest)[name](np.random.default_rng([seed, index])), dict[str, Graph]()
    program = compile_scene(scene, model=manifest.name, after=graphs.__setitem__)
    given = graphs["lower"], graphs["flatten"], manifest
    ways: dict[str, Callable[[], Any]] = {
        "frame": lambda: draw_small(program).image,
        "proof": lambda: prove_image(*given, image),
        "both": lambda: prove_image(*given, image, redraw=True),
    }
    image = ways["frame"]()
    times: dict[str, list[float]] = {way: [] for way in ways}
    result: dict[str, Any] = {}
    for _ in range(ROUNDS):
        for way, function in ways.items():
            seconds, result[way] = timed(function)
            times[way].append(seconds)
    least = {way: min(values) for way, values in times.items()}
    reference_s, reference = timed(lambda: over(reference_image(graphs["lower"])))
    (_, proof), (again, whole) = result["proof"], result["both"]
    off, mended = (abs(over(picture) - reference).max(-1) for picture in (image, again))
    return {
        "pixels": proof.bound.size,
        "proved": proof.share,
        "right": (off <= PROVED).mean(),
        "redrawn": whole.redrawn / proof.bound.size,
        "proved_again": whole.share,
        "bound": proof.worst,
        "off": off.max(),
        "broken": (off > proof.bound).sum() + (mended > whole.bound).sum(),
        "x_proof": least["proof"] / least["frame"],
        "x_redraw": (least["both"] - least["proof"]) / least["frame"],
        "x_reference": reference_s / least["frame"],
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--scenes", type=int, default=40)
    parser.add_argument("--seed", type=int, default=2021)
    parser.add_argument("--set", action="append", choices=list(SETS))
    parser.add_argument("-o", "--out", type=Path, metavar="FILE")
    given = parser.parse_args()
    keep_memory()
    result = []
    for name in given.set or SETS:
        cases = [measured(name, index, given.seed) for index in range(given.scenes)]
        row: dict[str, Any] = {"set": name, "scenes": len(cases), "pixels": sum(c["pixels"] for c in cases)}
        for key in [key for key in cases[0] if key != "pixels"]:
            values = [case[key] for case in cases]
            if key == "broken":
                row[key] = int(sum(values))
            else:
                function = np.max if key in ("bound", "off") else np.median if key[:2] == "x_" else np.mean
                row[key] = round(float(function(values)), 2 if key[:2] == "x_" else 5)
        row["proved_interval"] = interval([case["proved"] for case in cases])
        result.append(row)
        print(json.dumps(row), flush=True)
    if given.out:
        write_json(given.out, {**about(), "seed": given.seed, "sets": result})
    return int(any(row["broken"] for row in result))


if __name__ == "__main__":
    raise SystemExit(main())
