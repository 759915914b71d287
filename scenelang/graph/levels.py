"""A chain of steps sorted into the four levels that a model's exact lifting holds.

A leaf is displaced and then carried into the world by ``inner`` turns, one ``middle`` affine map, ``outer``
turns and one last ``affine`` map, any of which may be absent. Both tuples of turns are nearest the leaf
first, so a world point goes back through ``affine``, then ``outer`` from its last to its first, then
``middle``, then ``inner`` from its last to its first.

A lifting has room for turns in slots of three strengths: in the plane a warp's twirl and bend; in space a
warp's twirl and its bend along x, then the twist after it on the way back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from scenelang.graph.space import Space
from scenelang.graph.spaces import PLANE
from scenelang.graph.steps import IDENTITY, Affine, Displace, Rows, Step, Turn, Twist
from scenelang.records import Record


class Levels(Record):
    """A chain of steps as a model's lifting takes it.

    Args:
        inner: turns next to the leaf, nearest the leaf first.
        middle: the affine map between the two groups of turns; `IDENTITY` where there is none.
        outer: turns after ``middle``, nearest the leaf first.
        affine: the last map, into the world; `IDENTITY` where there is none.
        bulge: the displacement of the leaf itself.
    """

    inner: tuple[Turn, ...] = ()
    middle: Rows = IDENTITY
    outer: tuple[Turn, ...] = ()
    affine: Rows = IDENTITY
    bulge: Displace = Displace(0.0, 0.0)


class LevelsError(ValueError):
    """Raised where a chain of steps needs more levels than a model's lifting holds."""


def slots(turns: Sequence[Turn], dimension: int) -> list[tuple[float, float, float]]:
    """The strengths of the slots that a run of turns, nearest the leaf first, takes."""
    out: list[tuple[float, float, float]] = []
    for turn in turns:
        if isinstance(turn, Twist):
            out.append((0.0, 0.0, turn.twist))
        elif dimension == 2:
            out.append((turn.twirl, *turn.bend))
        elif out and out[-1][:2] == (0.0, 0.0):
            out[-1] = (turn.twirl, turn.bend[0], out[-1][2])
        else:
            out.append((turn.twirl, turn.bend[0], 0.0))
    return out


def split_levels(steps: Sequence[Step], limits: Mapping[str, int], space: Space = PLANE) -> Levels:
    """Sort a chain into the levels of a lifting.

    A single run of turns fills ``inner`` first and then ``outer``, with no middle map between. Turns that
    the normal form brought before the first map go back behind it where ``inner`` has no room.

    Args:
        steps: nearest the leaf first, normalised (no two affine maps are neighbours; see `fold_warps`).
        limits: a manifest's ``limits``; reads ``inner_warps`` and ``outer_warps``.
        space: the model's.

    Raises:
        LevelsError: the chain does not fit.
    """
    most_inner, most_outer = limits.get("inner_warps", 0), limits.get("outer_warps", 0)

    def taken(turns: Sequence[Turn]) -> int:
        return len(slots(turns, space.dimension))

    bulge = Levels().bulge
    runs: list[list[Turn]] = [[]]
    maps: list[Rows] = []
    for at, step in enumerate(steps):
        if isinstance(step, Turn):
            runs[-1].append(step)
        elif isinstance(step, Affine):
            maps.append(step.rows)
            runs.append([])
        elif at:
            raise LevelsError("a `displace` that does not stand first")
        else:
            bulge = step
    # w… | w… A | w… A w… | w… A w… A, where the first run may be empty and the last one is if A is last.
    first = runs[0]
    if len(maps) == 0 or (len(maps) == 1 and not runs[1]):
        if taken(first) > most_inner + most_outer:
            raise LevelsError(f"{len(first)} deformations in a row, at most {most_inner + most_outer} fit")
        inside = next(n for n in range(len(first), -1, -1) if taken(first[:n]) <= most_inner)
        last = maps[0] if maps else IDENTITY
        return Levels(tuple(first[:inside]), IDENTITY, tuple(first[inside:]), last, bulge)
    second = runs[1]
    if len(maps) > 2 or (len(maps) == 2 and runs[2]):
        raise LevelsError(
            f"{len(maps)} affine maps with deformations between them, at most one between and one after fit"
        )
    while taken(first) > most_inner and (turn := space.after(maps[0], first[-1])) is not None:
        second.insert(0, turn)
        first.pop()
    if taken(first) > most_inner:
        raise LevelsError(f"{len(first)} deformations before an affine map, at most {most_inner} fit")
    if taken(second) > most_outer:
        raise LevelsError(f"{len(second)} deformations after an affine map, at most {most_outer} fit")
    return Levels(tuple(first), maps[0], tuple(second), maps[1] if len(maps) == 2 else IDENTITY, bulge)
