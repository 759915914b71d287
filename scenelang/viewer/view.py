"""The view: everything a page needs to draw a scene, as JSON data and one piece of arrays."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from scenelang.elements.element import credit_of
from scenelang.models.framed import load_arrays
from scenelang.models.manifest import Manifest, load_manifest
from scenelang.program.program import Program, ProgramError
from scenelang.renderers.network import FramedArrays
from scenelang.renderers.solid.network import SolidArrays
from scenelang.scene.schema import Animation
from scenelang.viewer import plane, solid
from scenelang.viewer.describe import alternative
from scenelang.viewer.form import Form
from scenelang.viewer.grids import paints_of, shapes_of
from scenelang.viewer.rows import rows_of, stage_of
from scenelang.viewer.store import Store, packed

FORMAT: Final = 1


@dataclass(frozen=True, slots=True)
class View:
    """What a page draws.

    Args:
        data: JSON data; docs/architecture.md has its parts.
        blob: the arrays that it names.
    """

    data: dict[str, Any]
    blob: bytes = field(repr=False)

    def message(self) -> str:
        """One JSON text: the data, and under ``blob`` the arrays, deflated (zlib) and in base64."""
        return json.dumps({**self.data, "blob": packed(self.blob)}, separators=(",", ":"), allow_nan=False)


def view_of(
    program: Program,
    *,
    title: str = "",
    source: Sequence[tuple[str, str]] = (),
    form: Form | None = None,
    animation: Animation | None = None,
) -> View:
    """The view of a Program; without a form its numbers never change.

    Args:
        program: compiled for a shipped model.
        title: of the page.
        source: names and texts of the files that it was compiled from.
        form: of the scene that it was compiled from.
        animation: of that scene.

    Raises:
        ProgramError: it was compiled for other weights, or no page can draw its model.
    """
    manifest, store = load_manifest(program.model), Store()
    if manifest.renderer not in ("framed", "solid"):
        raise ProgramError(f"model `{manifest.name}` draws whole pictures, which no page does")
    if manifest.lifting != "exact":
        raise ProgramError(f"model `{manifest.name}` has learned transformations, which no page draws")
    network, digest = load_arrays(program.model, program.weights)
    program.check_weights(digest)
    elements = (*form.shapes, *form.paints) if form else program.elements
    albedo = network.material_codes @ network.albedo[:-1] + network.albedo[-1]
    geometries = [{"name": name, "kind": "learned"} for name in manifest.geometries]
    data: dict[str, Any] = {
        "format": FORMAT,
        "title": title,
        "canvas": program.canvas,
        "dimension": manifest.dimension,
        "model": {
            "name": manifest.name,
            "summary": manifest.summary,
            "weights": digest,
            "measured": _measured(manifest),
        },
        "shapes": [*geometries, *shapes_of(elements, store)],
        "materials": [
            {"name": name, "albedo": row[:3].tolist(), "medium": float(row[3]) if len(row) > 3 else 0.0}
            for name, row in zip(manifest.materials, albedo.astype(np.float64), strict=True)
        ],
        "paints": paints_of(elements, store),
        "program": {
            "rows": rows_of(program, manifest, network.codes, network.material_codes),
            "stage": program.stage and stage_of(program.stage),
            "background": program.background,
        },
        "form": form and form.data,
        "params": form.params if form else [],
        "fixed": form.fixed if form else [],
        "animation": form and animation and {**animation.model_dump(), "frames": animation.frames},
        "source": [{"name": name, "text": text} for name, text in source],
        "licences": [
            {"name": element.name, "text": credit} for element in elements if (credit := credit_of([element]))
        ],
    }
    if isinstance(network, FramedArrays):
        data |= plane.shader(network, store)
    elif isinstance(network, SolidArrays):
        data |= solid.shader(network, store)
    data["alt"] = alternative(data)
    return View(data, store.bytes())


def _measured(manifest: Manifest) -> dict[str, Any]:
    """How far the model is from the exact picture on the scenes of its own set."""
    figures = manifest.measured.get("sets", {}).get(manifest.set)
    if figures is None:
        return {}
    cap = manifest.measured.get("psnr_cap_db")
    return {"cap": cap, **{key: figures[key] for key in ("scenes", "psnr", "flip")}}
