"""What derivatives of a picture by reverse passes cost beside differences of pictures, in descents."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from scenelang.diagnostics.span import SourceFile
from scenelang.inverse import search
from scenelang.inverse.task import task_of
from scenelang.lab.about import Report, about, silent
from scenelang.lab.fits import PLANE, random_case
from scenelang.measure.scenes import interval
from scenelang.models.manifest import load_manifest

AWAY: Final = 0.05  # shares of a range by which starts lie off at most
SIZE: Final = 1  # of the sizes that a fit compares, the second smallest


def measure(
    model: str, counts: Sequence[int], scenes: int, seed: int, side: int, report: Report = silent
) -> dict[str, Any]:
    """Follow params down from near the true ones, by both, and say what it took and how near it came.

    Scenes without derivatives by reverse passes are left out. Seconds are of the processor.

    Raises:
        ValueError: a model of solids, which have none.
    """
    manifest, rows = load_manifest(model), []
    if manifest.dimension == 3:
        raise ValueError(f"{model} draws solids, whose params are followed by differences alone")
    for count in counts:
        index = kept = 0
        while kept < scenes:
            report(f"{count} params", kept, scenes)
            case = random_case(manifest, index, count, seed, side)
            task = task_of(SourceFile("scene", case.text), case.target)
            problem, index = task.problems[SIZE], index + 1
            truth = np.array([case.truth[axis.label] for axis in task.space.axes])
            rng = np.random.default_rng([seed, index, count])
            start = task.space.inside(truth + rng.uniform(-AWAY, AWAY, count))
            if problem.slopes(start) is None:  # whose first call loads torch too
                continue
            kept += 1
            row: dict[str, Any] = {"set": case.set, "params": count, "size": list(problem.canvas)}
            for name, many in (("differences", count + 1), ("reverse", 1))[:: -1 if kept % 2 else 1]:
                began, drawn = time.process_time(), problem.frames
                found = search.descend(problem, task.space, start, step=search.STEPS[SIZE], many=many)
                row[name] = {
                    "seconds": round(time.process_time() - began, 3),
                    "frames": problem.frames - drawn,
                    "db": round(-10 * np.log10(max(1e-9, found.cost if found else 1.0)), 2),
                    "off": round(float(task.space.gap(found.point, truth).max()) if found else 1.0, 5),
                }
            rows.append(row)
    return {
        **about(),
        "model": model,
        "set": " ".join(PLANE),
        "seed": seed,
        "scenes": scenes,
        "side": side,
        "away": AWAY,
        "rows": [_summary(count, [row for row in rows if row["params"] == count]) for count in counts],
        "cases": rows,
    }


def _summary(count: int, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Medians, and by which factor reverse passes take less time: the geometric mean with its interval."""
    ratios = [float(np.log(row["differences"]["seconds"] / row["reverse"]["seconds"])) for row in rows]
    mean, half = float(np.mean(ratios)), interval(ratios)
    kinds = {
        name: {
            key: round(float(np.median([row[name][key] for row in rows])), 4)
            for key in ("seconds", "frames", "db", "off")
        }
        for name in ("differences", "reverse")
    }
    return {
        "params": count,
        **kinds,
        "faster": round(float(np.exp(mean)), 3),
        "interval": [round(float(np.exp(mean - half)), 3), round(float(np.exp(mean + half)), 3)],
    }
