"""What an object looks like: a material, moves of its texture and operations on its colour.

A constant material is white everywhere, so moving it changes nothing and every operation acts on one colour,
in the space it was written in: such a look folds to a colour. The operations of a texture act on each of its
colours, clamped after each; they are kept in order, as no matrix clamps or turns a hue.
"""

from __future__ import annotations

from collections.abc import Iterable
from colorsys import hsv_to_rgb, rgb_to_hsv
from math import tau

from scenelang.elements.element import Element
from scenelang.graph.affine import composed
from scenelang.graph.steps import Affine, Rows
from scenelang.records import Record
from scenelang.scene.schema import Color, Grayscale, Hue, MaterialOp

Triple = tuple[float, float, float]
WHITE: Triple = (1.0, 1.0, 1.0)
LUMA: Triple = (0.2126, 0.7152, 0.0722)
MOST_STEPS = 1_000  # operations on the colours of a texture, in their normal form

ColourStep = tuple[str, *tuple[float, ...]]
"""``("color", r, g, b)``, ``("grayscale", amount)`` or ``("hue", turns)``."""


class Look(Record):
    """A material as an object wears it.

    Args:
        material: how it is lit: flat, diffuse or volumetric.
        colours: operations on its colour, the first written first.
        rgb: what the operations start from, in [0, 1], as written (sRGB in 2D): white, or what they came to
            where the look has been folded.
        element: of a texture, whose colours the operations start from instead.
        texture: moves of the texture over the leaf's x and y, the first written first.
    """

    material: str
    colours: tuple[ColourStep, ...] = ()
    rgb: Triple = WHITE
    element: Element | None = None
    texture: tuple[Affine, ...] = ()

    def colour(self) -> Triple:
        """The colour of a constant material; of a texture, what white would become."""
        return coloured(self.colours, self.rgb)

    def folded(self) -> Look:
        """The same look in its normal form: of a constant material one colour."""
        if self.element is None:
            return Look(self.material, rgb=self.colour()) if self.texture or self.colours else self
        colours, moved = normal(self.colours), composed(self.texture)
        texture = (Affine(moved),) if self.texture else ()
        if (colours, texture) == (self.colours, self.texture):
            return self
        return Look(self.material, colours, self.rgb, self.element, texture)

    @property
    def moved(self) -> Rows:
        """The map that its texture is moved by."""
        return composed(self.texture)


def colour_steps(ops: Iterable[MaterialOp]) -> tuple[ColourStep, ...]:
    """The operations on a colour among those of a material."""
    found: list[ColourStep] = []
    for op in ops:
        if isinstance(op, Color):
            found.append(("color", *op.rgb))
        elif isinstance(op, Grayscale):
            found.append(("grayscale", op.amount))
        elif isinstance(op, Hue):
            found.append(("hue", op.angle / tau))
    return tuple(found)


def normal(steps: Iterable[ColourStep]) -> tuple[ColourStep, ...]:
    """The same operations, fewer: neighbours of a kind join where nothing is clamped between them.

    What multiplies by shares, or mixes with the luma by a share, stays in [0, 1]; a hue has a period of 1.
    """
    found: list[ColourStep] = []
    for step in steps:
        joined: ColourStep | None = step
        if found and found[-1][0] == step[0] and (step[0] == "hue" or _shares(found[-1])):
            joined = _joined(found.pop(), step)
        elif step[0] == "hue":
            joined = _joined(("hue", 0.0), step)
        if joined is not None and joined not in _IDLE:
            found.append(joined)
    return tuple(found)


_IDLE: frozenset[ColourStep] = frozenset((("color", 1.0, 1.0, 1.0), ("grayscale", 0.0), ("hue", 0.0)))


def _shares(step: ColourStep) -> bool:
    return all(0.0 <= number <= 1.0 for number in step[1:])


def _joined(one: ColourStep, other: ColourStep) -> ColourStep:
    kind, *a = one
    _, *b = other
    if kind == "hue":
        return kind, (a[0] + b[0]) % 1.0
    if kind == "grayscale":
        return kind, a[0] + b[0] - a[0] * b[0]
    return kind, *[p * q for p, q in zip(a, b, strict=True)]


def coloured(steps: Iterable[ColourStep], rgb: Triple = WHITE) -> Triple:
    """What a colour (r, g, b) in [0, 1] becomes, each operation clamped."""
    for kind, *numbers in steps:
        r, g, b = rgb
        if kind == "color":
            rgb = _clamped(r * numbers[0], g * numbers[1], b * numbers[2])
        elif kind == "grayscale":
            y = r * LUMA[0] + g * LUMA[1] + b * LUMA[2]
            rgb = _clamped(*(v + numbers[0] * (y - v) for v in rgb))
        else:
            h, s, v = rgb_to_hsv(r, g, b)
            rgb = _clamped(*hsv_to_rgb((h + numbers[0]) % 1.0, s, v))
    return rgb


def _clamped(r: float, g: float, b: float) -> Triple:
    return min(max(r, 0.0), 1.0), min(max(g, 0.0), 1.0), min(max(b, 0.0), 1.0)
