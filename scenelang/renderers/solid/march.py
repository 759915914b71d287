"""Rays through the solids' field: the first surface, and the ways through media before it."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from operator import add
from typing import NamedTuple

from scenelang.renderers.arrays import Array
from scenelang.renderers.solid.field import SolidField
from scenelang.renderers.solid.passes import INF, placed
from scenelang.renderers.solid.rays import STEPS, Rays, Trail
from scenelang.renderers.solid.segments import known, lengths

HALVINGS = 16  # of the interval in which a medium gives way to a solid


class Pace(NamedTuple):
    """What is saved where solids are drawn, and what it costs.

    Args:
        gap: world units by which steps may go beyond what is certain; what is thinner may be passed.
        nodes: points on a ray's way through a medium at which the light is asked for.
        contrast: pixels that differ more from their neighbours, in sRGB, are sampled four times.
    """

    gap: float = 0.009
    nodes: int = 3
    contrast: float = 0.04


CAREFUL = Pace()


@dataclass(frozen=True, slots=True)
class Work:
    """What drawing took.

    Args:
        rays: from the eye.
        lights: rays from the light.
        near: rays of both kinds that came near an object; the others took no step.
        steps: points of space on them at which the field was asked.
        met: (object, point) pairs that went through the network.
        refined: pixels that were sampled four times.
        lost: rays that took all the steps there are without coming to an end.
    """

    rays: int = 0
    lights: int = 0
    near: int = 0
    steps: int = 0
    met: int = 0
    refined: int = 0
    lost: int = 0

    def __add__(self, other: Work) -> Work:
        return Work(*map(add, astuple(self), astuple(other)))


def march(
    solids: SolidField,
    origin: Array,
    way: Array,
    limit: Array,
    halvings: int = HALVINGS,
    gap: float = CAREFUL.gap,
    whole: bool = False,
    steps: int = STEPS,
) -> Trail:
    """Follow rays.

    Args:
        solids: the field.
        origin: of all rays (3,).
        way: unit directions (3, M).
        limit: how far to go (M,).
        halvings: of the interval in which a medium gives way to a solid; none where only that it does counts.
        gap: as of `Pace`.
        whole: whether nobody asks where media begin and end, so that `segments.py` may answer.
        steps: of all rays at most.
    """
    xp = solids.xp
    hit, length, soft = (xp.full((way.shape[1],), value, way) for value in (INF, 0.0, 0.0))
    ids, passes = solids.passes(origin, way, limit, tight=not (whole and solids.answered))
    trail = Trail(hit, length, soft, placed(xp, ids, xp.whole(length)), passes, near=len(ids))
    if whole and solids.segments and len(ids):
        sure = known(solids, passes)
        some, rest = xp.where(sure), xp.where(~sure)
        if len(some):
            answers, trail.met = lengths(solids, passes.at(xp, some))
            xp.put(length, xp.take(ids, some), answers)
        ids, passes = xp.take(ids, rest), passes.at(xp, rest)
    if len(ids):
        Rays(solids, trail, ids, passes, gap).run(halvings, steps)
    return trail
