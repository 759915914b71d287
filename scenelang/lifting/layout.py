"""Where the numbers of an object's vector lie, so that lifting and frames are one code for every dimension.

A geometry vector g holds the way from the world back to the leaf:

    code | the constant 1 | frame of the last affine map | outer warps | middle frame | inner warps

and a material vector m what it looks like:

    texture frame | colour matrix, 3 x 4, row by row | the material's code

A frame is the rows of the inverse of an affine map, d of d + 1 numbers. A warp is its strengths; the
outermost of a group comes first. Every slot is a function of the scene alone, and each transformation acts
on them linearly (`scenelang.lifting.exact`). Both vectors together are 64 numbers; how they are shared out is
the layout's, which a model's manifest names.
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
        strengths: of a warp: the turn by the length of a point, then by its coordinates.
        outer, inner: warps of the two groups.
        texture: of a texture's frame, those kept free included.
        material: of a material's code.
    """

    dimension: int
    code: int
    strengths: int
    outer: int
    inner: int
    texture: int
    material: int

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
        return self.code + 1 + 2 * self.frame_size + (self.outer + self.inner) * self.strengths

    @property
    def colour(self) -> slice:
        """The colour matrix, in m."""
        return slice(self.texture, self.texture + 12)

    @property
    def material_code(self) -> slice:
        """The material's code, in m."""
        return slice(self.colour.stop, self.colour.stop + self.material)


PLANE_LAYOUT: Final = Layout(dimension=2, code=4, strengths=3, outer=3, inner=2, texture=8, material=12)
LAYOUTS: Final = {"plane": PLANE_LAYOUT}  # layouts by the names that manifests use
