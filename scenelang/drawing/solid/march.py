"""Rays through the solids' field, as the kernel and torch answer: what they met, and settings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from scenelang.drawing.arrays import Array

INF = float("inf")
STEPS = 800  # of all rays at most
HALVINGS = 16  # of the interval in which a medium gives way to a solid


@dataclass(slots=True)
class Work:
    """Counts of the work of drawing."""

    rays: int = 0  # from the eye
    lights: int = 0  # rays from the light
    near: int = 0  # rays of both kinds that came near an object; the others took no step
    steps: int = 0  # points of space on them at which the field was asked
    met: int = 0  # (object, point) pairs that went through the network
    refined: int = 0  # pixels that were sampled four times
    lost: int = 0  # rays that took all the steps there are without coming to an end

    def __add__(self, other: Work) -> Work:
        return Work(*(getattr(self, name) + getattr(other, name) for name in Work.__slots__))


class Pieces(NamedTuple):
    """Ways of rays through media (P,), those of a ray in order, each of one density and colour."""

    ray: Array  # its number
    begin: Array
    end: Array
    before: Array  # length of a medium of this density that takes as much as the pieces before it
    sigma: Array  # extinction per world unit


class Trail(NamedTuple):
    """Surfaces and media that M rays met."""

    hit: Array  # (M,) how far the first opaque surface is, inf where there is none
    length: Array  # (M,) world units in media before that or before the ray's end
    soft: Array  # (M,) 1 where a surface ends a medium, 0 elsewhere: the distance is not 0 there
    depth: Array  # (M,) optical depth of those media
    pieces: Pieces
    work: Work


class MarchSettings(NamedTuple):
    """Trade-offs between speed and accuracy where solids are drawn."""

    gap: float = 0.009  # world units by which steps may pass what is certain, and what is thinner
    nodes: int = 3  # points on a ray's way through a medium at which the light is asked for
    contrast: float = 0.04  # sRGB: pixels that differ more from their neighbours are sampled four times


CAREFUL = MarchSettings()
MARCH_SETTINGS = {
    **{"four": CAREFUL, "adaptive": CAREFUL},
    **{"quick": MarchSettings(0.04, 2, 0.15), "one": MarchSettings(0.04, 2)},
}
"""Settings of each way to sample solids."""
