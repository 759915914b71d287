"""A chain of steps sorted into the four levels that a model's exact lifting holds.

A leaf is carried into the world by ``inner`` warps, one ``middle`` affine map, ``outer`` warps and one
last ``affine`` map, any of which may be absent. Both tuples of warps are nearest the leaf first, so a
world point goes back through ``affine``, then ``outer`` from its last to its first, then ``middle``,
then ``inner`` from its last to its first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from scenelang.graph.steps import IDENTITY, Affine, Rows, Step, Warp
from scenelang.records import Record


class Levels(Record):
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


class LevelsError(ValueError):
    """Raised where a chain of steps needs more levels than a model's lifting holds."""


def split_levels(steps: Sequence[Step], limits: Mapping[str, int]) -> Levels:
    """Sort a chain into the levels of a lifting.

    A single run of warps fills ``inner`` first and then ``outer``, with no middle map between.

    Args:
        steps: nearest the leaf first, normalised (no two affine maps are neighbours; see `fold_warps`).
        limits: a manifest's ``limits``; reads ``inner_warps`` and ``outer_warps``.

    Raises:
        LevelsError: the chain does not fit.
    """
    most_inner, most_outer = limits.get("inner_warps", 0), limits.get("outer_warps", 0)
    runs: list[list[Warp]] = [[]]
    maps: list[Rows] = []
    for step in steps:
        if isinstance(step, Warp):
            runs[-1].append(step)
        elif isinstance(step, Affine):
            maps.append(step.rows)
            runs.append([])
        else:
            raise LevelsError(f"a {type(step).__name__.lower()} does not fit")
    # w… | w… A | w… A w… | w… A w… A, where the first run may be empty and the last one is if A is last.
    first = runs[0]
    if len(maps) == 0 or (len(maps) == 1 and not runs[1]):
        if len(first) > most_inner + most_outer:
            raise LevelsError(f"{len(first)} deformations in a row, at most {most_inner + most_outer} fit")
        last = maps[0] if maps else IDENTITY
        return Levels(tuple(first[:most_inner]), IDENTITY, tuple(first[most_inner:]), last)
    second = runs[1]
    if len(maps) > 2 or (len(maps) == 2 and runs[2]):
        raise LevelsError(
            f"{len(maps)} affine maps with deformations between them, at most one between and one after fit"
        )
    if len(first) > most_inner:
        raise LevelsError(f"{len(first)} deformations before an affine map, at most {most_inner} fit")
    if len(second) > most_outer:
        raise LevelsError(f"{len(second)} deformations after an affine map, at most {most_outer} fit")
    return Levels(tuple(first), maps[0], tuple(second), maps[1] if len(maps) == 2 else IDENTITY)
