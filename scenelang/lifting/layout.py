"""Where the numbers of an object's vector lie, so that lifting and frames are one code for every dimension.

A geometry vector g holds the way from the world back to the leaf:

    code | the constant 1 | frame of the last affine map | outer warps | middle frame | inner warps | extras

and a material vector m what it looks like:

    texture frame | width of a blend, in the plane | colour matrix, 3 x 4, row by row | the material's code

A frame is the rows of the inverse of an affine map, d of d + 1 numbers. A warp is its strengths; the
outermost of a group comes first. The extras of solids are the amount and frequency of their displacement and
the width of a blend. That is k where a `smooth` of another k than usual takes the object in, else 0. Every
slot is a function of the scene alone, and each transformation acts on them linearly
(`scenelang.lifting.exact`). Both vectors together are 64 numbers; how they are shared out is the layout's,
which a model's manifest names.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

WIDTH: Final = 64  # numbers of an object


@dataclass(frozen=True, slots=True)
class Layout:
    """The shares of the numbers.

    Args:
        dimension: d.
        code: of a leaf's code.
        strengths: of a warp: the turn by the length of a point, then by its coordinates x and y. In space
            the turn by y is one about the y axis, after the other.
        outer, inner: warps of the two groups.
        texture: of a texture's frame, those kept free included.
        material: of a material's code.
        extras: behind the inner warps.
    """

    dimension: int
    code: int
    strengths: int
    outer: int
    inner: int
    texture: int
    material: int
    extras: int = 0

    @property
    def identity(self) -> tuple[float, ...]:
        """The frame of no map."""
        d = self.dimension
        return tuple([float(row == column) for row in range(d) for column in range(d + 1)])

    @property
    def frame_size(self) -> int:
        """Numbers of a frame."""
        return self.dimension * (self.dimension + 1)

    @property
    def one(self) -> int:
        """Place of the constant 1."""
        return self.code

    @property
    def frame(self) -> slice:
        """The frame of the last affine map."""
        return slice(self.one + 1, self.one + 1 + self.frame_size)

    @property
    def outer_warps(self) -> slice:
        """The group of warps between the two frames."""
        return slice(self.frame.stop, self.frame.stop + self.outer * self.strengths)

    @property
    def middle(self) -> slice:
        """The frame of the middle affine map."""
        return slice(self.outer_warps.stop, self.outer_warps.stop + self.frame_size)

    @property
    def inner_warps(self) -> slice:
        """The group of warps next to the leaf."""
        return slice(self.middle.stop, self.middle.stop + self.inner * self.strengths)

    @property
    def geometry(self) -> int:
        """Length of g, which m follows."""
        return int(self.inner_warps.stop) + self.extras

    @property
    def blend(self) -> int:
        """Place of a blend's width, in both vectors together."""
        return self.geometry - 1 if self.extras else self.geometry + self.texture - 2

    @property
    def colour(self) -> slice:
        """The colour matrix, in m."""
        return slice(self.texture, self.texture + 12)

    @property
    def material_code(self) -> slice:
        """The material's code, in m."""
        return slice(self.colour.stop, self.colour.stop + self.material)


PLANE_LAYOUT: Final = Layout(dimension=2, code=4, strengths=3, outer=3, inner=2, texture=8, material=12)
SOLID_LAYOUT: Final = Layout(
    dimension=3, code=4, strengths=3, outer=2, inner=2, texture=6, material=2, extras=3
)
LAYOUTS: Final = {"plane": PLANE_LAYOUT, "solid": SOLID_LAYOUT}  # layouts by the names that manifests use
