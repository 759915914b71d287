"""Families of random scenes under a sky, as text: each is what one kind of light asks of a renderer."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from lab.light.probes import PROBES
from scenelang.compiler.spaces import encoded

Rng = np.random.Generator
LEAVES: Final = "sphere", "torus", "box", "cylinder", "cone", "capsule", "octahedron"
MESHES: Final = "bunny", "teapot", "monkey"


def _n(*values: float) -> str:
    return ", ".join(f"{value:.4g}" for value in values)


def _in(rng: Rng, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def colour(rng: Rng, low: float = 0.05, high: float = 0.9) -> str:
    """A colour whose linear channels lie in a range."""
    r, g, b = encoded(tuple(rng.uniform(low, high, 3).tolist()))
    return f"[{_n(r, g, b)}]"


def diffuse(rng: Rng) -> str:
    return f"material diffuse {{ color({colour(rng)}); }}"


def _bright(rng: Rng) -> str:
    return f"material diffuse {{ color({colour(rng, *((0.5, 0.9), (0.9, 0.98))[int(rng.integers(2))])}); }}"


def mist_of(rng: Rng, most: float = 12.0) -> str:
    high = 1.0 - 10 ** _in(rng, -2.0, -0.4)  # an albedo of 0.6 to 0.99
    tint = colour(rng, max(high - 0.3, 0.0), high)
    return f"material volumetric {{ color({tint}); density({_n(math.exp(_in(rng, 0.0, math.log(most))))}); }}"


def _glow(rng: Rng, power: float) -> str:
    return f"material diffuse {{ color({colour(rng)}); glow({colour(rng, 0.2, 1.0)}, {_n(power)}); }}"


def _shiny(rng: Rng) -> str:
    kind, low = (("glossy", 0.05), ("metal", 0.4))[int(rng.integers(2))]
    return f"material {kind} {{ color({colour(rng, low, 0.95)}); roughness({_n(_in(rng, 0.1, 0.8))}); }}"


def _turn(rng: Rng) -> str:
    return f"rotate({_n(_in(rng, 0, 360))}deg, axis = [{_n(*rng.normal(size=3))}]);"


def _moves(rng: Rng, size: float = 1.0, spread: float = 1.0) -> str:
    sides = size * rng.uniform(0.35, 0.85, 3)
    at = spread * rng.uniform((-1.2, -0.5, -1.2), (1.2, 0.9, 1.2))
    return f"scale({_n(*sides)}); {_turn(rng)} translate({_n(*at)});"


def solid(rng: Rng, material: str, size: float = 1.0, spread: float = 1.0) -> str:
    return f"{LEAVES[int(rng.integers(len(LEAVES)))]} {{ {_moves(rng, size, spread)} {material} }}\n"


def _solids(rng: Rng, low: int, high: int, look: Callable[[Rng], str] = diffuse, size: float = 1.0) -> str:
    return "".join(solid(rng, look(rng), size) for _ in range(int(rng.integers(low, high + 1))))


def lamp(rng: Rng, power: float, radius: float, at: tuple[float, ...] | None = None) -> str:
    turn, far = _in(rng, 0, math.tau), _in(rng, 2.0, 4.5)
    place = at or (far * math.cos(turn), _in(rng, 2.0, 5.0), far * math.sin(turn))
    return f"light([{_n(*place)}], {_n(power)}, {colour(rng, 0.6, 1.0)}, {_n(radius)});\n"


def sky_of(rng: Rng, low: float, high: float) -> str:
    own = f", {colour(rng, 0.2, 1.0)}, {colour(rng, 0.05, 1.0)}" if rng.random() < 0.4 else ""
    return f"sky({_n(_in(rng, low, high))}{own});\n"


def _staged(rng: Rng) -> str:
    turn, high = _in(rng, -math.pi, math.pi), _in(rng, 0.4, 3.0)
    eye = f"[{_n(5.8 * math.sin(turn), high, 5.8 * math.cos(turn))}]"
    camera = f"camera({eye}, [{_n(*rng.uniform(-0.2, 0.2, 3))}], {_n(_in(rng, 30, 45))}deg);\n"
    ground = f"ground({_n(_in(rng, -1.2, -0.8))}, {colour(rng, 0.1, 0.8)});\n"
    return camera + (ground if rng.random() < 0.6 else "")


def sky(rng: Rng) -> str:
    return "light(none);\n" + sky_of(rng, 0.5, 1.3) + _solids(rng, 2, 5)


def soft(rng: Rng) -> str:
    return lamp(rng, _in(rng, 12, 35), _in(rng, 0.2, 0.9)) + sky_of(rng, 0.1, 0.8) + _solids(rng, 2, 5)


def several(rng: Rng) -> str:
    count = int(rng.integers(2, 6))
    lamps = [lamp(rng, _in(rng, 20, 60) / count, max(_in(rng, -0.2, 0.6), 0.0)) for _ in range(count)]
    return "".join(lamps) + sky_of(rng, 0.05, 0.6) + _solids(rng, 2, 5)


def mist(rng: Rng) -> str:
    lit = lamp(rng, _in(rng, 12, 30), _in(rng, 0.0, 0.6)) + sky_of(rng, 0.2, 1.0)
    return lit + _solids(rng, 1, 3, mist_of) + _solids(rng, 0, 2)


def inside(rng: Rng) -> str:
    """Lamps in mist, or behind the openings of something hollow."""
    at = tuple(rng.uniform((-0.4, -0.2, -0.4), (0.4, 0.4, 0.4)).tolist())
    text = lamp(rng, _in(rng, 0.5, 3.0), _in(rng, 0.08, 0.25), at) + sky_of(rng, 0.02, 0.3)
    scale, move = _n(_in(rng, 0.7, 0.95)), f"translate({_n(*at)});"
    if rng.random() < 0.6:
        text += f"sphere {{ scale({scale}); {move} {mist_of(rng, 5.0)} }}\n"
    else:
        holes = "".join(
            f"capsule {{ scale(0.3, 2, 0.3); {_turn(rng)} }}\n" for _ in range(int(rng.integers(2, 5)))
        )
        shell = f"sphere {{ shell({_n(_in(rng, 0.06, 0.2))}); }}\n"
        text += f"subtract {{ {shell}{holes} scale({scale}); {move} {_bright(rng)} }}\n"
    return text + _solids(rng, 1, 3, diffuse, 0.6)


def glow(rng: Rng) -> str:
    text = "light(none);\n" + sky_of(rng, 0.02, 0.3)
    for _ in range(int(rng.integers(1, 4))):
        wide = math.exp(_in(rng, math.log(0.02), math.log(0.3)))  # of the tube
        power = _in(rng, 1.0, 3.0) / max(wide, 0.05) ** 0.7
        size = _in(rng, 0.5, 0.9)
        at = _n(*rng.uniform((-1.0, -0.4, -1.0), (1.0, 0.9, 1.0)))
        tube = f"torus {{ grow({_n(wide / 2 / size - 0.3)});" if wide < 0.25 else "sphere { grow(0);"
        bar = f"capsule {{ scale({_n(wide / size)}, 1, {_n(wide / size)});"
        form = (tube, bar)[int(rng.integers(2))]
        text += f"{form} scale({_n(size)}); {_turn(rng)} translate({at}); {_glow(rng, power)} }}\n"
    return text + _solids(rng, 2, 3)


def meshes(rng: Rng) -> str:
    text = (
        'import "std/meshes" as m;\n'
        + lamp(rng, _in(rng, 12, 30), _in(rng, 0.0, 0.6))
        + sky_of(rng, 0.2, 1.0)
    )
    for _ in range(int(rng.integers(1, 4))):
        at, size = _n(*rng.uniform((-1.1, -0.4, -1.1), (1.1, 0.6, 1.1))), _n(_in(rng, 0.6, 1.0))
        look = mist_of(rng, 8.0) if rng.random() < 0.2 else diffuse(rng)
        text += (
            f"m.{MESHES[int(rng.integers(3))]} {{ scale({size}); {_turn(rng)} translate({at}); {look} }}\n"
        )
    return text


def white(rng: Rng) -> str:
    lit = ("sky();\n", "sky(0.6);\n", "light(none);\nsky();\n")[int(rng.integers(3))]
    return lit + "".join(solid(rng, "") for _ in range(int(rng.integers(1, 6))))


def caves(rng: Rng) -> str:
    """Bright hollows open to the eye, lit through the opening, by a second one, or by what is in them."""
    look, wall = _bright(rng), _in(rng, 0.06, 0.2)
    hollow = (f"box {{ shell({_n(wall)}); }}", f"sphere {{ shell({_n(wall)}); }}")[int(rng.integers(2))]
    mouth = f"box {{ scale({_n(_in(rng, 0.5, 0.8), _in(rng, 0.5, 0.8))}, 1); translate(0, 0, 0.8); }}"
    wide = _n(_in(rng, 0.2, 0.5), 1.0, _in(rng, 0.2, 0.5))
    hole = f"cylinder {{ scale({wide}); translate(0.2, 0.7, 0); }}"
    turn = f"rotate({_n(_in(rng, -35, 35))}deg, axis = Y); scale({_n(_in(rng, 1.2, 1.5))});"
    text = f"subtract {{ {hollow} {mouth} {hole if rng.random() < 0.6 else ''} {turn} {look} }}\n"
    kind, at = int(rng.integers(3)), tuple(rng.uniform(-0.3, 0.3, 3).tolist())
    lit = (
        lamp(rng, _in(rng, 12, 35), _in(rng, 0.1, 0.6)),
        lamp(rng, _in(rng, 0.5, 2.0), 0.08, at),
        f"light(none);\nsphere {{ scale(0.15); translate({_n(*at)}); {_glow(rng, _in(rng, 4, 12))} }}\n",
    )[kind]
    small = "".join(solid(rng, _bright(rng), 0.4, 0.4) for _ in range(int(rng.integers(1, 3))))
    return lit + sky_of(rng, 0.3, 1.2) + text + small


def glossy(rng: Rng) -> str:
    lit = lamp(rng, _in(rng, 8, 25), _in(rng, 0.2, 0.8)) + sky_of(rng, 0.3, 1.0)
    return lit + _solids(rng, 1, 3, _shiny) + _solids(rng, 1, 2)


def mixed(rng: Rng) -> str:
    """All kinds of material but those that mirror, booleans within each other, and deformations."""

    def leaf(depth: int) -> str:
        if depth and rng.random() < 0.35:
            return tree(depth - 1)
        warps: tuple[str, ...] = (
            f"twirl({_n(_in(rng, -0.8, 0.8))});",
            f"bend({_n(_in(rng, -0.8, 0.8))});",
            "",
            "",
        )
        warps += f"twist({_n(_in(rng, -0.8, 0.8))});", f"grow({_n(_in(rng, -0.1, 0.2))});", "shell(0.12);"
        look = (diffuse, _bright, mist_of, lambda rng: _glow(rng, 1.5))[
            int(rng.choice(4, p=(0.5, 0.2, 0.2, 0.1)))
        ]
        name = LEAVES[int(rng.integers(len(LEAVES)))]
        return f"{name} {{ {warps[int(rng.integers(7))]} {_moves(rng, 0.9, 0.5)} {look(rng)} }}\n"

    def tree(depth: int) -> str:
        word = ("union", "smooth", "subtract", "intersect")[int(rng.choice(4, p=(0.3, 0.3, 0.25, 0.15)))]
        return f"{word} {{\n{''.join(leaf(depth) for _ in range(int(rng.integers(2, 4))))}}}\n"

    lamps = "".join(lamp(rng, _in(rng, 8, 25), _in(rng, 0.0, 0.6)) for _ in range(int(rng.integers(1, 3))))
    return lamps + sky_of(rng, 0.2, 1.0) + tree(2) + (_solids(rng, 1, 1) if rng.random() < 0.5 else "")


FAMILIES: Final[dict[str, Callable[[Rng], str]]] = {
    each.__name__: each
    for each in (sky, soft, several, mist, caves, glow, mixed, white, inside, meshes, glossy)
}


def scene_text(family: str, seed: int, index: int, size: int = 128) -> str:
    """The text of a scene of a family, or of a probe, of a square canvas with a side in pixels."""
    if family in PROBES:
        text_of, values = PROBES[family]
        return f"nsg 1;\ncanvas({size}, {size});\n{text_of(values[index])}"
    rng = np.random.default_rng([seed, index, list(FAMILIES).index(family)])
    stage = _staged(rng) if rng.random() < 0.5 and family != "caves" else ""
    return f"nsg 1;\ncanvas({size}, {size});\n{stage}{FAMILIES[family](rng)}"
