"""Evaluate a model on seeded unseen scenes against the exact reference."""

from __future__ import annotations

import hashlib
import io
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lab.about import Report, about, silent
from lab.sets.scenes import draw_scene, scenes_of, spread, summarise
from scenelang.assets.files import write_whole
from scenelang.compiler.groups import OPERATOR
from scenelang.compiler.manifest import Manifest
from scenelang.drawing.image import Image
from scenelang.drawing.metrics import (
    GAP,
    MOST_DB,
    UNCAPPED_DB,
    compare,
    over_white,
    psnr,
    side_by_side,
)
from scenelang.drawing.neural.load import Model
from scenelang.language.scene import Scene
from scenelang.language.words import COMBINE, TOKENS
from scenelang.output.frontier import reference_of

SHOWN = 12  # worst cases


@dataclass(frozen=True, slots=True)
class SceneFigures:
    """One scene's figures."""

    index: int  # in its set
    last: str  # the word that joins the last object of the stream
    objects: int  # of its stream
    figures: dict[str, float]  # psnr and psnr_uncapped (dB), ssim, flip


def exact_of(scene: Scene, manifest: Manifest, kept: Path | None) -> Image:
    """The exact picture of a scene, from a folder where it was kept, or drawn and kept there."""
    if kept is None:
        return reference_of(scene, manifest)
    path = kept / f"{hashlib.sha256(scene.model_dump_json().encode()).hexdigest()}.npy"
    if not path.exists():
        data = io.BytesIO()
        np.save(data, reference_of(scene, manifest))
        kept.mkdir(parents=True, exist_ok=True)
        write_whole(path, data.getvalue())
    return np.asarray(np.load(path, allow_pickle=False)).view(Image)


def sheet(
    model: Model,
    name: str,
    seed: int,
    cases: list[SceneFigures],
    side: int | None = None,
    kept: Path | None = None,
) -> Image:
    """A contact sheet of cases of a set: network, reference, FLIP map."""
    scene_at = scenes_of(model, name, seed, side)
    rows = []
    for case in cases:
        scene = scene_at(case.index)
        label = f"#{case.index} {case.figures['psnr']:.1f} dB"
        picture, exact = draw_scene(model, scene)[1], exact_of(scene, model.manifest, kept)
        rows.append(side_by_side(over_white(picture), over_white(exact), label))
    return contact_sheet(rows)


def contact_sheet(rows: Sequence[Image], columns: int = 2) -> Image:
    """Put pictures of one size on a sheet, row by row."""
    height, width = rows[0].shape[:2]
    lines = -(-len(rows) // columns)
    sheet = np.ones((lines * (height + GAP), columns * (width + 3 * GAP), 3), np.float32)
    for index, row in enumerate(rows):
        top, left = index // columns * (height + GAP), index % columns * (width + 3 * GAP)
        sheet[top : top + height, left : left + width] = row
    return sheet.view(Image)


def evaluate_set(
    model: Model,
    name: str,
    count: int,
    seed: int,
    *,
    side: int | None = None,
    kept: Path | None = None,
    threads: int = 1,
    report: Report = silent,
) -> tuple[dict[str, Any], list[SceneFigures]]:
    """Draw a set and compare; returns a summary for JSON, and the cases of the lowest PSNR.

    ``side`` is the canvas's shorter one in pixels; ``kept`` is a folder of exact pictures.
    """
    scene_at = scenes_of(model, name, seed, side)
    started = time.perf_counter()
    cases = []
    for index in range(count):
        cases.append(_case(model, scene_at, index, kept, threads))
        report(name, index + 1, count)
    scene = scene_at(count - 1)
    worst = sorted(cases, key=lambda c: c.figures["psnr_uncapped"])[:SHOWN]
    summary = {
        "set": name,
        "scenes": count,
        "seed": seed,
        "canvas": scene.canvas,
        "psnr_cap_db": MOST_DB,
        "weights": model.digest,
        **about(),
        "seconds": round(time.perf_counter() - started, 1),
        **_summary(cases),
        "psnr_uncapped": spread([c.figures["psnr_uncapped"] for c in cases], 5),
        "worst_cases": [{"index": c.index, "last": c.last, **c.figures} for c in worst],
        "by_last_token": {
            word: _summary([c for c in cases if c.last == word])
            for word in (*TOKENS, "all_union")
            if any(c.last == word for c in cases)
        },
        "by_objects": {
            str(count): _summary([c for c in cases if c.objects == count])
            for count in sorted({c.objects for c in cases})
        },
    }
    return summary, worst


def _case(
    model: Model, scene_at: Callable[[int], Scene], index: int, kept: Path | None, threads: int
) -> SceneFigures:
    scene = scene_at(index)
    program, picture = draw_scene(model, scene, threads)
    exact = exact_of(scene, model.manifest, kept)
    uncapped = psnr(over_white(picture), over_white(exact), UNCAPPED_DB)
    last = COMBINE[int(program.tokens[-1]) & OPERATOR] if program.tokens.any() else "all_union"
    return SceneFigures(index, last, len(program), {**compare(picture, exact), "psnr_uncapped": uncapped})


def _summary(cases: list[SceneFigures]) -> dict[str, Any]:
    return {"count": len(cases), **summarise([case.figures for case in cases])}
