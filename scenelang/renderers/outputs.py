"""Outputs of a Program: of solids, or in the plane which object paints a pixel and how much is covered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scenelang.outputs import Outputs
from scenelang.program.program import Program
from scenelang.renderers.coverage import Coverage, PixelRows
from scenelang.renderers.draw import TILE, draw
from scenelang.renderers.field import Field
from scenelang.renderers.network import FramedNetwork
from scenelang.renderers.solid.field import SolidField
from scenelang.renderers.solid.network import SolidNetwork
from scenelang.renderers.solid.outputs import solid_outputs


def program_outputs(network: FramedNetwork | SolidNetwork, program: Program, *, threads: int = 1) -> Outputs:
    """All outputs that a Program has, its objects numbered as in the scene.

    Raises:
        ProgramError: no compiled scene has such numbers.
    """
    if program.stage is not None:
        solids = SolidField(network, program.vectors, program.tokens, program.brought())  # type: ignore[arg-type]
        found = solid_outputs(solids, program.stage, program.canvas, threads=threads)
    else:
        found = _plane(network, program)  # type: ignore[arg-type]
    assert found.object is not None
    return replace(found, object=np.array((0, *program.numbers), np.int32)[found.object])


def _plane(network: FramedNetwork, program: Program) -> Outputs:
    width, height = program.canvas
    image = draw(network, replace(program, background=None)).image
    coverage = Coverage(Field(network, program.vectors, program.tokens, program.brought()))
    rows, px = max(1, TILE // width), 2 / min(width, height)
    x = (np.arange(width) + 0.5 - width / 2) * px
    found = np.zeros((height, width), np.int32)
    for top in range(0, height, rows):
        y = (height / 2 - 0.5 - np.arange(top, min(top + rows, height))) * px
        centres = np.stack(np.broadcast_arrays(x, y[:, None])).reshape(2, -1).astype(np.float32)
        found[top : top + rows] = _owners(coverage, centres).reshape(-1, width)
    return Outputs(object=found, alpha=np.asarray(image)[..., 3])


def _owners(coverage: Coverage, p: np.ndarray) -> np.ndarray:
    """Numbers (M,), from 1, of the objects that paint points (2, M) in rows, 0 where none does.

    The gate by which the cell takes in a colour tells: behind a register of 0, a colour of 1 shows it.
    """
    field, state, rows = coverage.field, coverage.field.network.config.state, PixelRows(-p[1])
    memory, owner = field.empty(p.shape[1]), np.zeros(p.shape[1], np.int32)
    touched = np.zeros(p.shape[1], bool)
    with field.xp.inference():
        for number, row in enumerate(field.rows, 1):
            index, q, radius = coverage.meeting(row, p, touched, 0.0, rows)
            index = np.arange(p.shape[1]) if index is None else index
            if not len(index):
                continue
            before = memory[:, index]
            before[state:] = 0.0
            after, _ = field.meet(replace(row, colour=np.ones_like(row.colour)), q, radius, before)
            memory[:, index] = after
            owner[index] = np.where(after[state] > 0.5, number, owner[index])
        return np.where(field.picture(memory)[3] > 0.5, owner, 0)
