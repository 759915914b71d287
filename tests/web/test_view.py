"""Rows are the objects of a Program: points go to the leaf as its frames take them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.program import Program
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.neural.frames import Frames
from scenelang.drawing.solid.passes import read_solid_frame
from scenelang.web.export import view_of

EXAMPLES = sorted(Path(__file__).parents[2].joinpath("examples").glob("*.nsg"))


def carried(steps: list[list[float]], p: np.ndarray) -> np.ndarray:
    """Points (d, M) behind a row's steps, as the page takes them, in float64."""
    for kind, *n in steps:
        if kind == "map":
            rows = np.reshape(n, (len(p), -1))
            p = rows[:, :-1] @ p + rows[:, -1:]
        else:
            i, j = (0, 2) if kind == "twist" else (0, 1)
            turn = n[0] * (p[1] if kind == "twist" else np.linalg.norm(p, axis=0))
            a = turn + sum(b * x for b, x in zip(n[1:], p, strict=False))
            p = p.copy()
            p[i], p[j] = np.cos(a) * p[i] + np.sin(a) * p[j], np.cos(a) * p[j] - np.sin(a) * p[i]
    return p


def leaves(program: Program, points: np.ndarray) -> list[np.ndarray]:
    """Points in each object's leaf, by the renderers' frames."""
    if program.stage is None:
        frames = Frames(program.vectors)
        each = [np.full(points.shape[1], i) for i in range(len(program))]
        return [frames.local(NUMPY, which, points.astype(np.float32)) for which in each]
    found = [read_solid_frame(v) for v in program.vectors]
    return [f.local(NUMPY, f.outer(NUMPY, points.astype(np.float32))) for f in found]


@pytest.mark.parametrize("path", EXAMPLES[::2], ids=lambda path: path.stem)
def test_rows_lead_points_as_frames_do(path: Path) -> None:
    program = nsg.compile(nsg.load(path))
    view = view_of(program, title=path.name)
    rows = view.data["program"]["rows"]
    assert [row["token"] for row in rows] == program.tokens.tolist()
    assert [row["object"] for row in rows] == list(program.numbers)
    d = 2 if program.stage is None else 3
    points = np.random.default_rng(1).uniform(-1, 1, (d, 20))
    for row, there in zip(rows, leaves(program, points), strict=True):
        np.testing.assert_allclose(carried(row["steps"], points), there, rtol=2e-4, atol=2e-4)
    assert json.loads(view.message())["program"]["rows"] == json.loads(json.dumps(rows))
