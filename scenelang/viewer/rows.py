"""Programs as rows: what the viewer's shader draws of each object, in stream order.

The page's own evaluator (``web/graph.js``) makes rows of a scene; rows of a Program never change.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from scenelang.graph.stage import Stage
from scenelang.lifting.vector import LAYOUTS, Layout
from scenelang.models.manifest import Manifest
from scenelang.program.groups import OPERATOR, widths_of
from scenelang.program.program import Program, ProgramError
from scenelang.renderers.frames import Frames
from scenelang.renderers.solid.frames import read_solid_frame

Row = dict[str, Any]
Step = list[Any]


def rows_of(program: Program, manifest: Manifest, codes: np.ndarray, material_codes: np.ndarray) -> list[Row]:
    """Rows of a Program as JSON data, see docs/architecture.md.

    Args:
        program: compiled for the manifest's model.
        codes: (geometries, C) of its weights.
        material_codes: (materials, .) likewise.

    Raises:
        ProgramError: a vector is not one that a scene compiles to.
    """
    layout = LAYOUTS[manifest.dimension]
    parts = layout.unpack(program.vectors)
    forms = [at for at, element in enumerate(program.elements) if not element.material]
    paints = [element for element in program.elements if element.material]
    scales = _scales(program, layout)
    widths = widths_of(program.tokens.astype(np.intp) & OPERATOR, parts.width).tolist()
    rows = []
    for i, (v, worn, form) in enumerate(zip(program.vectors, program.worn, program.forms, strict=True)):  # type: ignore[arg-type]
        row = {
            "token": int(program.tokens[i]),
            "shape": _index(codes, parts.code[i]) if form < 0 else len(codes) + forms.index(form),
            "material": _index(material_codes, parts.material[i]),
            "steps": _steps(v.astype(np.float64), layout),
            "scale": scales[i],
            "colour": parts.rgb[i].tolist(),
            "paint": -1,
            "amount": 0.0,
            "frequency": 0.0,
            "blend": widths[i],
            "object": program.numbers[i],
        }
        if layout.dimension == 3:
            row["amount"], row["frequency"] = parts.bulge[i].tolist()
        if worn >= 0:
            paint = program.palette[worn]
            row |= {"paint": paints.index(paint.element), "paintSteps": paint.steps}
            row["place"] = parts.texture[i].tolist()
        rows.append(row)
    return rows


def stage_of(stage: Stage) -> dict[str, Any]:
    """A stage as JSON data, with the camera's axes."""
    camera, light, ground = stage.camera, stage.light, stage.ground
    return {
        "eye": camera.eye,
        "axes": camera.axes(),
        "target": camera.target,
        "fov": camera.fov_rad,
        "light": light.position,
        "power": light.power,
        "lightRgb": light.rgb,
        "ground": ground and {"y": ground.y, "rgb": ground.rgb},
        "horizon": stage.horizon,
        "zenith": stage.zenith,
        "transparent": stage.transparent,
    }


def _index(known: np.ndarray, code: np.ndarray) -> int:
    found = np.flatnonzero((known.astype(np.float32) == code).all(1))
    if not len(found):
        raise ProgramError("codes that are not the model's")
    return int(found[0])


def _scales(program: Program, layout: Layout) -> list[float]:
    """World distances per leaf distance."""
    if layout.dimension == 2:
        return list(Frames(program.vectors, layout).scale.tolist())
    return [read_solid_frame(vector, layout).scale for vector in program.vectors]


def _steps(v: np.ndarray, layout: Layout) -> list[Step]:
    """The way of a world point to the leaf, outermost first."""
    steps: list[Step] = []
    for frame, warps in layout.ways:
        if tuple(v[frame]) != layout.identity:
            steps.append(["map", *v[frame].tolist()])
        for a, b, c in v[warps].reshape(-1, 3).tolist():
            if layout.dimension == 2:
                steps += [["turn", a, b, c]] if a or b or c else []
            else:
                steps += [["turn", a, b]] if a or b else []
                steps += [["twist", c]] if c else []
    return steps
