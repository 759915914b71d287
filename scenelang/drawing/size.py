"""Scenes at the size of the usual view: lengths of drawing are for it, whatever a scene's unit is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scenelang.compiler.graph import Fold, Leaf, Move, Node
from scenelang.compiler.groups import OPERATOR, widths_of
from scenelang.compiler.lifting import LAYOUTS
from scenelang.compiler.program import Program
from scenelang.compiler.spaces import EXTINCTION, Stage
from scenelang.compiler.steps import Affine
from scenelang.language.nodes import DENSEST


def sized(program: Program) -> Program:
    """The same picture of a Program of solids whose view is as large as the usual one."""
    layout = LAYOUTS[3]
    if program.stage is None or (by := program.stage.growth) == 1.0:
        return program
    vectors, places = program.vectors.astype(np.float64), layout.places
    parts = layout.unpack(vectors)
    vectors[:, places.frame].reshape(-1, 3, 4)[:, :, :3] /= by
    vectors[:, places.width] = by * widths_of(program.tokens.astype(np.intp) & OPERATOR, parts.width)
    density = np.where(parts.density > 0, parts.density, EXTINCTION) / by
    vectors[:, places.density] = np.minimum(density, DENSEST)
    return replace(program, vectors=vectors.astype(np.float32), stage=program.stage.scaled(by))


def sized_root(root: Fold, stage: Stage) -> tuple[Fold, Stage, float]:
    """The root of a graph and its stage as of `sized`, and by how much it grows."""
    by = stage.growth

    def scaled(node: Node, moves: tuple[Move, ...] = ()) -> Node:
        if isinstance(node, Leaf):
            density = (node.look.density or EXTINCTION) / by
            return node.changed(replace(node.look, density=density), (*node.moves, *moves))
        links = [replace(link, node=scaled(link.node), k=link.width * by) for link in node.links]
        return replace(node, links=tuple(links), moves=(*node.moves, *moves))

    if by == 1.0:
        return root, stage, by
    result = scaled(root, (Move(Affine((by, 0, 0, 0, 0, by, 0, 0, 0, 0, by, 0))),))
    assert isinstance(result, Fold)
    return result, stage.scaled(by), by
