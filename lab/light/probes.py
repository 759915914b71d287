"""Scenes of which one thing grows hard to draw, as text."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np

WHITE = "material diffuse { color([0.85, 0.85, 0.85]); }"
INSIDE = "camera([0, 0, 1.2], [0, 0, 0], 70deg);\nlight(none);\nsky(2);\nground(none);\n"
BALL = f"sphere {{ scale(0.3); translate(0.3, -0.6, -0.4); {WHITE} }}\n"


def room(wall: float, hole: str) -> str:
    """A room of 3 units a side around the eye."""
    outer, inner = (f"box {{ scale({side * math.sqrt(3) / 2:.6g}); }}" for side in (3 + 2 * wall, 3))
    return INSIDE + f"subtract {{ {outer} {inner} {hole} {WHITE} }}\n" + BALL


def pinhole(wide: float) -> str:
    half = wide * math.sqrt(3) / 2
    return room(0.1, f"box {{ scale({half:.6g}, 1, {half:.6g}); translate(0, 1.6, 0); }}")


def wall(thick: float) -> str:
    return room(thick, "")


def lamp(radius: float) -> str:
    """A lamp in a ball of mist."""
    lit = f"light([0.2, 0.1, 0], 2, #fff, {radius:g});\nsky(0.1);\n"
    mist = "sphere { material volumetric { color([0.9, 0.9, 0.9]); density(2); } }\n"
    return lit + mist + f"box {{ scale(0.4); translate(1.4, -0.6, 0.3); {WHITE} }}\n"


def crowd(count: float) -> str:
    rng, text = np.random.default_rng(5), "light([2.5, 4, 3], 20, #fff, 0.4);\nsky(0.6);\n"
    for at in rng.uniform((-1.6, -0.9, -1.6), (1.6, 1.2, 1.6), (int(count), 3)):
        colour = ", ".join(f"{c:.3f}" for c in rng.uniform(0.3, 0.95, 3))
        size, place = 0.9 / count ** (1 / 3), ", ".join(f"{x:.4f}" for x in at)
        look = f"material diffuse {{ color([{colour}]); }}"
        leaf = ("sphere", "box", "cylinder")[int(rng.integers(3))]
        text += f"{leaf} {{ scale({size:.4f}); translate({place}); {look} }}\n"
    return text


def cave(deep: float) -> str:
    """A bright tunnel with one end, of width 1.6, seen into and lit from its mouth."""
    half = math.sqrt(3) / 2
    sizes = (2.0, 1.1), (1.6, 1.3)  # across, and where the middle is of one without depth
    outer, inner = (
        f"box {{ scale({half * wide:.5g}, {half * wide:.5g}, {half * (deep + 0.2):.5g}); "
        f"translate(0, 0, {at - deep / 2:.5g}); }}"
        for wide, at in sizes
    )
    lit = "camera([0, 0, 4], [0, 0, 0], 32deg);\nlight(none);\nsky(1);\nground(none);\n"
    return lit + f"subtract {{ {outer} {inner} {WHITE} }}\n"


PROBES: Final[dict[str, tuple[Callable[[float], str], tuple[float, ...]]]] = {
    "pinhole": (pinhole, (1.6, 0.8, 0.4, 0.2, 0.1)),
    "wall": (wall, (0.4, 0.2, 0.1, 0.05, 0.02)),
    "lamp": (lamp, (0.3, 0.1, 0.03, 0.01, 0.003)),
    "objects": (crowd, (10, 30, 100, 200)),
    "cave": (cave, (1, 2, 4, 8)),
}
