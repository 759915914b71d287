"""A scene made in Python instead of text: ``python examples/spiral.py spiral.png``."""

from __future__ import annotations

import colorsys
import math
import sys

import scenelang as nsg


def blade(i: int, count: int) -> nsg.Object:
    """One star of the spiral, the farther out the larger."""
    share = i / count
    angle = 6 * math.pi * math.sqrt(share)
    radius = 0.85 * math.sqrt(share)
    colour = nsg.Color(colorsys.hsv_to_rgb(0.6 + 0.4 * share, 0.6, 0.95))
    return nsg.Object(
        "star",
        transforms=(
            nsg.Twirl(0.8),
            nsg.Scale(0.03 + 0.07 * share),
            nsg.Rotate(angle=angle),
            nsg.Translate(radius * math.cos(angle), radius * math.sin(angle)),
        ),
        material=nsg.Material("flat", colour),
    )


def spiral(count: int = 60) -> nsg.Scene:
    """The whole scene; `nsg.Scene.to_nsg` prints it as text."""
    nodes = tuple(blade(i, count) for i in range(1, count))
    return nsg.Scene(canvas=(320, 320), background=(0.06, 0.06, 0.1), nodes=nodes)


if __name__ == "__main__":
    target = sys.argv[1] if len(sys.argv) > 1 else "spiral.png"
    nsg.render(nsg.compile(spiral())).save(target)
    print(f"wrote {target}")
