"""What an object looks like: a material, moves of its texture and operations on its colour.

A constant texture is white everywhere, so moving it changes nothing and every operation acts on one colour,
in the space it was written in: such a look folds to a colour.
"""

from __future__ import annotations

from collections.abc import Iterable
from colorsys import hsv_to_rgb, rgb_to_hsv
from math import tau
from typing import Final

from scenelang.records import Record
from scenelang.scene.schema import Color, Flip, Grayscale, Hue, MaterialOp, Rotate, Scale, Shear, Translate

Triple = tuple[float, float, float]
WHITE: Triple = (1.0, 1.0, 1.0)
LUMA: Triple = (0.2126, 0.7152, 0.0722)

ColourOp = Color | Grayscale | Hue
TextureMove = Translate | Rotate | Scale | Shear | Flip

CONSTANT: Final = frozenset({"flat", "diffuse", "volumetric"})
"""Materials whose texture is white everywhere; see docs/language.md."""


class Look(Record):
    """A material as an object wears it.

    Args:
        texture: moves of its texture, the first written first.
        colours: operations on its colour, the first written first.
        rgb: what the operations start from, in [0, 1], as written (sRGB in 2D): white, or what they came to
            where the look has been folded.
    """

    material: str
    texture: tuple[TextureMove, ...] = ()
    colours: tuple[ColourOp, ...] = ()
    rgb: Triple = WHITE

    @staticmethod
    def of(material: str, ops: Iterable[MaterialOp]) -> Look:
        """The look of a material with its operations."""
        ops = tuple(ops)
        moves = tuple([op for op in ops if not isinstance(op, ColourOp)])
        return Look(material, moves, tuple([op for op in ops if isinstance(op, ColourOp)]))

    def colour(self) -> Triple:
        """The colour of a constant material."""
        return coloured(self.colours, self.rgb)

    def folded(self) -> Look:
        """The same look as one colour, where the material is constant."""
        if self.material not in CONSTANT or not (self.texture or self.colours):
            return self
        return Look(self.material, rgb=self.colour())


def coloured(ops: Iterable[MaterialOp], rgb: Triple = WHITE) -> Triple:
    """What a colour (r, g, b) in [0, 1] becomes, each operation clamped; moves of the texture do nothing."""
    for op in ops:
        if isinstance(op, Color):
            rgb = _clamped(rgb[0] * op.rgb[0], rgb[1] * op.rgb[1], rgb[2] * op.rgb[2])
        elif isinstance(op, Grayscale):
            y = rgb[0] * LUMA[0] + rgb[1] * LUMA[1] + rgb[2] * LUMA[2]
            a = op.amount
            rgb = _clamped(*(v + a * (y - v) for v in rgb))
        elif isinstance(op, Hue):
            h, s, v = rgb_to_hsv(*rgb)
            rgb = _clamped(*hsv_to_rgb((h + op.angle / tau) % 1.0, s, v))
    return rgb


def _clamped(r: float, g: float, b: float) -> Triple:
    return min(max(r, 0.0), 1.0), min(max(g, 0.0), 1.0), min(max(b, 0.0), 1.0)
