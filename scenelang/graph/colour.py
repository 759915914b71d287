"""The colour chain of a `flat` material, folded to one constant.

A flat texture is constant white, so moving it changes nothing and every colour operation acts on one
colour, in the space it was written in.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import floor, tau

from scenelang.scene.schema import Color, Grayscale, Hue, MaterialOp

Triple = tuple[float, float, float]
WHITE: Triple = (1.0, 1.0, 1.0)
LUMA: Triple = (0.2126, 0.7152, 0.0722)


def flat_colour(ops: Iterable[MaterialOp]) -> Triple:
    """The constant that a white texture becomes, each operation clamped to [0, 1].

    Args:
        ops: texture and colour operations in order.

    Returns:
        (r, g, b) in [0, 1], as written.
    """
    rgb = WHITE
    for op in ops:
        if isinstance(op, Color):
            rgb = _clamped(rgb[0] * op.rgb[0], rgb[1] * op.rgb[1], rgb[2] * op.rgb[2])
        elif isinstance(op, Grayscale):
            y = rgb[0] * LUMA[0] + rgb[1] * LUMA[1] + rgb[2] * LUMA[2]
            a = op.amount
            rgb = _clamped(*(v + a * (y - v) for v in rgb))
        elif isinstance(op, Hue):
            rgb = _clamped(*_shifted(rgb, op.angle / tau))
    return rgb


def _clamped(r: float, g: float, b: float) -> Triple:
    return min(max(r, 0.0), 1.0), min(max(g, 0.0), 1.0), min(max(b, 0.0), 1.0)


def _shifted(rgb: Triple, turns: float) -> Triple:
    """Shift H of HSV by ``turns``, keep S and V."""
    value, low = max(rgb), min(rgb)
    chroma = value - low
    if chroma == 0.0:
        return rgb
    r, g, b = rgb
    if value == r:
        sixth = (g - b) / chroma
    elif value == g:
        sixth = 2.0 + (b - r) / chroma
    else:
        sixth = 4.0 + (r - g) / chroma
    sixth += 6.0 * turns
    # Each channel is the value less chroma times a trapezoid of the hue, shifted by 5, 3 and 1 sixths.
    return (
        value - chroma * _trapezoid(sixth + 5.0),
        value - chroma * _trapezoid(sixth + 3.0),
        value - chroma * _trapezoid(sixth + 1.0),
    )


def _trapezoid(sixth: float) -> float:
    k = sixth - 6.0 * floor(sixth / 6.0)
    return max(0.0, min(k, 4.0 - k, 1.0))
