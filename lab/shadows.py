"""Pictures of a medium's shadow on a solid, and the error inside it: the paper's Figure 5.

The shadow's mask is found from exact pictures alone: pixels that show the solid and no medium, and that are
lit otherwise where the medium is taken away. Beside the error of the pixels stands the share of the shadow
that is wrong: 0 is the exact shadow, and 100 % is as wrong as a picture without one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from lab.about import Report, about, silent
from lab.evaluate import contact_sheet
from lab.sets.scenes import draw_scene, spread
from lab.solid_probes import shadow
from scenelang.compiler.manifest import Manifest
from scenelang.drawing.image import Image
from scenelang.drawing.metrics import MOST_DB, UNCAPPED_DB, psnr, side_by_side
from scenelang.drawing.neural.load import Model
from scenelang.language.scene import Scene
from scenelang.output.frontier import reference_of

SEEN = 4 / 255  # by how much light has to change where there is a shadow
LEAST = 0.01  # share of the canvas that is in shadow
SHOWN = 6  # scenes of the strip

Array = npt.NDArray[np.float64]


def shadow_mask(scene: Scene, manifest: Manifest) -> tuple[npt.NDArray[np.bool_], Array, Array]:
    """Mask (H, W) of a solid in a medium's shadow, and exact pictures (H, W, 3) with and without it."""
    solid, medium = scene.nodes

    def exact(**changes: Any) -> Array:
        return np.asarray(reference_of(scene.model_copy(update=changes), manifest), np.float64)

    alone: dict[str, Any] = {"ground": None, "background": None}
    covers, seen_through = (exact(nodes=(node,), **alone)[..., 3] for node in (solid, medium))
    picture, lit = exact(), exact(nodes=(solid,))
    darker = np.abs(picture - lit).max(2) > SEEN
    return darker & (covers == 1) & (seen_through == 0), picture, lit


def measure_shadows(
    model: Model, count: int, seed: int, side: int, *, report: Report = silent
) -> tuple[dict[str, Any], Image]:
    """Draw ``count`` scenes in which a medium's shadow on a solid takes at least 1 % of the canvas.

    Returns a summary for JSON, and the first scenes: network, exact picture and FLIP map.
    """
    result: list[dict[str, float]] = []
    rows: list[Image] = []
    attempt = 0
    while len(result) < count:
        made = shadow(np.random.default_rng([seed, attempt])).sized((side, side))
        attempt += 1
        mask, exact, lit = shadow_mask(made, model.manifest)
        if mask.mean() < LEAST:
            continue
        picture = np.asarray(draw_scene(model, made)[1], np.float64)
        inside, whole = picture[mask], exact[mask]
        result.append(
            {
                "psnr": psnr(inside, whole, MOST_DB),
                "psnr_uncapped": psnr(inside, whole, UNCAPPED_DB),
                "without": psnr(lit[mask], whole, UNCAPPED_DB),
                "wrong_percent": 100
                * float(np.abs(inside - whole).mean() / np.abs(lit[mask] - whole).mean()),
                "share": float(mask.mean()),
            }
        )
        if len(rows) < SHOWN:
            rows.append(side_by_side(picture, exact, f"{result[-1]['psnr_uncapped']:.1f} dB in shadow"))
        report("shadow", len(result), count)
    summary = {"scenes": count, "seed": seed, "canvas": [side, side], "tried": attempt}
    return {**summary, **about(), "model": model.manifest.name, **_summary(result)}, contact_sheet(rows)


def _summary(found: Sequence[dict[str, float]]) -> dict[str, Any]:
    bad_ends = {"wrong_percent": 95}
    return {name: spread([one[name] for one in found], bad_ends.get(name, 5)) for name in found[0]}
