"""A chain of steps sorted into the four levels that a model's exact lifting holds.

A leaf is carried into the world by ``inner`` warps, one ``middle`` affine map, ``outer`` warps and one
last ``affine`` map, any of which may be absent. Both tuples of warps are nearest the leaf first, so a
world point goes back through ``affine``, then ``outer`` from its last to its first, then ``middle``,
then ``inner`` from its last to its first.
"""

from __future__ import annotations

from dataclasses import dataclass

from scenelang.graph.steps import IDENTITY, Rows, Warp


@dataclass(frozen=True, slots=True)
class Levels:
    """A chain of steps as a model's lifting takes it.

    Args:
        inner: warps next to the leaf, nearest the leaf first.
        middle: the affine map between the two groups of warps; `IDENTITY` where there is none.
        outer: warps after ``middle``, nearest the leaf first.
        affine: the last map, into the world; `IDENTITY` where there is none.
    """

    inner: tuple[Warp, ...] = ()
    middle: Rows = IDENTITY
    outer: tuple[Warp, ...] = ()
    affine: Rows = IDENTITY
