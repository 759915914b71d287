"""Outputs of a Program: of solids, or in the plane which object paints a pixel and how much is covered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scenelang.outputs import Outputs
from scenelang.program.program import Program
from scenelang.renderers.coverage import Coverage
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
    image = draw(network, replace(program, background=None)).image
    field = Field(network, program.vectors, program.tokens, program.brought())
    coverage = Coverage(field, prove=False)
    height, rows = program.canvas[1], max(1, TILE // program.canvas[0])
    found = [
        coverage.owners(program.canvas, range(top, min(top + rows, height))) for top in range(0, height, rows)
    ]
    return Outputs(object=np.concatenate(found), alpha=np.asarray(image)[..., 3])
