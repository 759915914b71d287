"""Evaluate a model on seeded unseen scenes against the exact reference."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from scenelang.image import Image
from scenelang.lab.about import Report, about, silent
from scenelang.measure.metrics import MOST_DB, compare, contact_sheet, side_by_side
from scenelang.measure.scenes import draw_scene, reference_of, scenes_of, summarise
from scenelang.models.load import Model
from scenelang.words import TOKENS


@dataclass(frozen=True, slots=True)
class Case:
    """One scene's figures."""

    index: int  # in its set
    last: str  # the word that joins the last object of the stream
    objects: int  # rows of the Program
    figures: dict[str, float]  # psnr (dB), ssim, flip


def _worst(cases: list[Case], count: int = 12) -> list[Case]:
    return sorted(cases, key=lambda c: c.figures["psnr"])[:count]


def worst_sheet(model: Model, name: str, seed: int, cases: list[Case], count: int = 12) -> Image:
    """A contact sheet of the cases of a set with the lowest PSNR: network, reference, FLIP map."""
    scene_at = scenes_of(model, name, seed)
    rows = []
    for case in _worst(cases, count):
        scene = scene_at(case.index)
        label = f"#{case.index} {case.last} {case.figures['psnr']:.1f} dB FLIP {case.figures['flip']:.4f}"
        rows.append(side_by_side(draw_scene(model, scene)[1], reference_of(scene, model.manifest), label))
    return contact_sheet(rows)


def evaluate_set(
    model: Model,
    name: str,
    count: int,
    seed: int,
    *,
    threads: int = 1,
    report: Report = silent,
) -> tuple[dict[str, Any], list[Case]]:
    """Draw a set and compare.

    Args:
        model: what draws.
        name: the set.
        count: scenes.
        seed: of the scenes.
        threads: for drawing.
        report: called with the set, scenes done and all.

    Returns:
        A summary for JSON, and every case.
    """
    scene_at = scenes_of(model, name, seed)
    started = time.perf_counter()
    cases = []
    for index in range(count):
        scene = scene_at(index)
        program, picture = draw_scene(model, scene, threads)
        figures = compare(picture, reference_of(scene, model.manifest))
        cases.append(Case(index, _last_word(program.tokens), len(program), figures))
        report(name, index + 1, count)
    summary = {
        "set": name,
        "scenes": count,
        "seed": seed,
        "psnr_cap_db": MOST_DB,
        "weights": model.digest,
        **about(),
        "seconds": round(time.perf_counter() - started, 1),
        **_summary(cases),
        "worst_cases": [{"index": c.index, "last": c.last, **c.figures} for c in _worst(cases)],
        "by_last_token": {
            word: _summary([c for c in cases if c.last == word])
            for word in (*TOKENS, "all_union")
            if any(c.last == word for c in cases)
        },
    }
    return summary, cases


def _last_word(tokens: npt.NDArray[np.int8]) -> str:
    if not tokens.any():
        return "all_union"
    return next(word for word, value in TOKENS.items() if value == tokens[-1])


def _summary(cases: list[Case]) -> dict[str, Any]:
    return {"count": len(cases), **summarise([case.figures for case in cases])}
