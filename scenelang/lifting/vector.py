"""The vector of an object, 64 numbers: where its parts lie, and how they are put in and taken out.

The parts of the way from the world back to the leaf are first:

    code | the constant 1 | frame of the last affine map | outer warps | middle frame | inner warps

A frame is the rows of the inverse of an affine map, d of d + 1 numbers. A warp is its strengths: the turn by
the length of a point, then by its coordinates x and y (in space the turn by y is one about the y axis, after
the other); the outermost of a group comes first. Behind them lie, in the order of each dimension, the amount
and frequency of a displacement (in space), the width of a blend (0 where it is the usual one, or none), the
frame of the texture, the colour and the code of the material. The colour is the diagonal of a 3 x 4 matrix,
row by row, whose other nine places, `OTHERS`, are free.

Every part is a function of the scene alone, and each transformation acts on the vector linearly
(`scenelang.lifting.exact`). A vector of a learned lifting has none of these parts.
"""

from __future__ import annotations

from itertools import accumulate
from typing import Any, Final, NamedTuple

import numpy as np

WIDTH: Final = 64  # numbers of an object
STRENGTHS: Final = 3  # of a warp
OTHERS: Final = 1, 2, 3, 4, 6, 7, 8, 9, 11
"""Places of the colour's matrix off its diagonal. Parts to come take them, one each: 0 means not written."""

Array = Any  # numpy array or torch tensor


class Parts(NamedTuple):
    """Parts of vectors (…, 64), each (…, its size) but ``width`` (…,)."""

    code: Array
    one: Array
    frame: Array
    outer: Array
    middle: Array
    inner: Array
    bulge: Array  # amount and frequency of a displacement; (…, 0) in the plane
    width: Array  # of the blend by which it joins
    texture: Array
    rgb: Array
    material: Array


class Layout:
    """The places of the parts in the vectors of a dimension.

    Args:
        dimension: d.
        sizes: of all parts, in their order; those of ``colour`` are of its matrix, ``free`` is none.

    Attributes:
        places: of each part, a slice or an index.
        geometry: how many numbers, from the first, say the way to the leaf and the displacement.
        outer, inner: how many warps the two groups have room for.
        identity: the frame of no map.
    """

    def __init__(self, dimension: int, **sizes: int) -> None:
        ends = [*accumulate(sizes.values())]
        at = {name: slice(end - size, end) for (name, size), end in zip(sizes.items(), ends, strict=True)}
        assert ends[-1] == WIDTH
        colour = at.pop("colour").start
        at.pop("free", None)
        one, width = at.pop("one").start, at.pop("width").start
        self.places = Parts(**at, one=one, width=width, rgb=slice(colour, colour + 12, 5))
        self.dimension, self.geometry = dimension, int(self.places.bulge.stop)
        self.outer, self.inner = sizes["outer"] // STRENGTHS, sizes["inner"] // STRENGTHS
        rows = range(dimension)
        self.identity = tuple([float(i == j) for i in rows for j in range(dimension + 1)])

    def unpack(self, vectors: Array) -> Parts:
        """The parts of vectors (…, 64), as views."""
        return Parts(*[vectors[..., at] for at in self.places])

    def pack(self, count: int, **parts: Any) -> np.ndarray:
        """Vectors (count, 64) in float64 of the parts that are given, 0 elsewhere."""
        out = np.zeros((count, WIDTH))
        for name, values in parts.items():
            out[:, getattr(self.places, name)] = values
        return out

    @property
    def ways(self) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
        """Places of a frame and of the warps behind it, on the way from the world to the leaf."""
        at = self.places
        return (at.frame, at.outer), (at.middle, at.inner)


_PLANE: Final = {"code": 4, "one": 1, "frame": 6, "outer": 9, "middle": 6, "inner": 6, "bulge": 0}
_SOLID: Final = {"code": 4, "one": 1, "frame": 12, "outer": 6, "middle": 12, "inner": 6, "bulge": 2}
PLANE_LAYOUT: Final = Layout(2, **_PLANE, texture=6, width=1, free=1, colour=12, material=12)
SOLID_LAYOUT: Final = Layout(3, **_SOLID, width=1, texture=6, colour=12, material=2)
LAYOUTS: Final = {2: PLANE_LAYOUT, 3: SOLID_LAYOUT}
