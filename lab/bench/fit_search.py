"""Global search of `scenelang fit` by CMA-ES beside the look around that it has.

    python -m lab bench fit_search [-o docs/results/fit-search.json] [--scenes N] [--params N] [--seed N]

Fits the scenes of `python -m lab fit shapes2d` twice. The rival's rounds look for places that come near in
pictures of 32 pixels by CMA-ES (Hansen and Ostermeier 2001) with restarts of two regimes (Hansen 2009), as
the package cma has it, in as many pictures as ours took a round; the best of its places are then followed
down as ours are. Larger pictures, and when a search ends, are the same. Needs the extra ``oracles``.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import cma
import numpy as np

from lab.about import about
from lab.fits import NEAR, NEAR_DB, Case, random_case
from scenelang.diagnostics.span import SourceFile
from scenelang.files import write_whole
from scenelang.inverse import search
from scenelang.inverse.focus import Lens
from scenelang.inverse.search import Found, Look, Report, Residuals
from scenelang.inverse.space import Point, Space
from scenelang.inverse.task import task_of
from scenelang.measure.metrics import UNCAPPED_DB
from scenelang.models.manifest import load_manifest

MODEL: Final = "shapes2d"
OUT: Final = Path("docs/results/fit-search.json")
WIDE: Final = 0.3  # standard deviation that a run starts with, shares of a range
RESTARTS: Final = 9
UNSEEN: Final = 10.0  # cost of values that have no picture


def evolved(pictures: int) -> Look:
    """CMA-ES in place of `search.look`, of so many pictures."""

    def look(
        coarse: Residuals, space: Space, known: Sequence[Found], seed: int, until: float, report: Report
    ) -> list[Found]:
        rng, seen, starts = np.random.default_rng(seed), list[Found](), [one.point for one in known]

        def begin() -> Point:
            return starts.pop(0) if starts else rng.random(len(space.axes))

        def cost(u: Point) -> float:
            u = space.inside(np.asarray(u))
            there = coarse(u)
            seen.append(Found(u, UNSEEN if there is None else float(there @ there)))
            return seen[-1].cost

        bounds = [[None if wraps else end for wraps in space.wraps] for end in (0.0, 1.0)]
        options = {"bounds": bounds, "maxfevals": pictures, "seed": seed + 1, "verbose": -9}
        cma.fmin2(cost, begin, WIDE, options, restarts=RESTARTS, bipop=True)
        picked = search.apart(space, seen, search.DESCENTS + len(space.axes))
        near = (search.descend(coarse, space, one.point, step=search.STEPS[0]) for one in picked)
        return [one for one in near if one is not None]

    return look


def fitted(case: Case, seed: int, look: Look) -> tuple[dict[str, Any], int]:
    """What a search found, and pictures of the smallest size that it drew a round."""
    task, rounds = task_of(SourceFile("scene", case.text), case.target), []

    def counted(*given: Any) -> list[Found]:
        rounds.append(1)
        return look(*given)

    started = time.process_time()
    lens = Lens(task.problems[-1], task.space, math.inf)
    places, done = search.solve(
        task.problems, task.space, task.first, seed=seed, noise=lens.noise, look=counted
    )
    spent, best = time.process_time() - started, places[0]
    truth = np.array([case.truth[axis.label] for axis in task.space.axes])
    off = float(task.space.gap(best.point, truth).max())
    db = min(UNCAPPED_DB, -10 * float(np.log10(max(best.cost, 1e-12))))
    row = {
        "db": round(db, 2),
        "off": round(off, 5),
        "found": bool(off <= NEAR or db >= NEAR_DB),
        "done": done,
        "rounds": len(rounds),
        "frames": sum(problem.frames for problem in task.problems),
        "seconds": round(spent, 2),
    }
    return row, task.problems[0].frames // len(rounds)


def measure(scenes: int, params: int, seed: int) -> dict[str, Any]:
    """Fit scenes by both."""
    cases: list[dict[str, Any]] = []
    for index in range(scenes):
        case = random_case(load_manifest(MODEL), index, params, seed, 256)
        ours, pictures = fitted(case, seed, search.look)
        theirs, _ = fitted(case, seed, evolved(pictures))
        cases.append({"set": case.set, "ours": ours, "cma": theirs})
        print(f"{index:3}  {ours}\n     {theirs}", flush=True)

    def of(way: str) -> dict[str, Any]:
        rows = [case[way] for case in cases]
        medians = {key: statistics.median(row[key] for row in rows) for key in ("db", "frames", "seconds")}
        return {"found": sum(row["found"] for row in rows), "median": medians}

    return {
        **about(), "cma": cma.__version__.split()[0], "model": MODEL, "seed": seed, "scenes": scenes,
        "params": params, "ways": {"ours": of("ours"), "cma": of("cma")}, "cases": cases,
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--out", type=Path, default=OUT, metavar="FILE")
    parser.add_argument("--scenes", type=int, default=20, metavar="N")
    parser.add_argument("--params", type=int, default=6, metavar="N")
    parser.add_argument("--seed", type=int, default=2021)
    given = parser.parse_args()
    found = measure(given.scenes, given.params, given.seed)
    write_whole(given.out, (json.dumps(found, indent=1) + "\n").encode())
    for name, way in found["ways"].items():
        print(f"{name:8}{way['found']:4} of {given.scenes} found; medians {way['median']}")


if __name__ == "__main__":
    main()
