"""Draw the sixteen textures that ship, and write them as elements.

python -m lab docs textures               writes scenelang/assets/textures.safetensors
python -m lab docs textures --sheet OUT   draws all of them, one beside another

Bytes are the same again with the same numpy and Pillow; texels are with others too.

Each is a function of points of a unit square, x to the right and y down, that repeats with period 1, drawn
at 16 points a texel and averaged. Random numbers are seeded by the texture's name.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from PIL import Image as Pillow

from scenelang.assets.element_file import TEXTURES_FILE, element_file_bytes
from scenelang.assets.files import write_whole
from scenelang.assets.picture import painted

ABOUT: dict[str, str | float] = {"license": "MIT", "source": "docs/make_textures.py of scenelang"}
SIDE = 256  # texels
FINE = 4  # points along a side of one
Array = npt.NDArray[np.float64]
Rng = np.random.Generator
INK, CREAM, CLAY, RUST = "#22313f", "#f4ecd8", "#c8553d", "#8c3b2e"
GOLD, TEAL, SAGE, SKY = "#e3ae45", "#2a7f7c", "#93b18b", "#86b5d3"
ROSE, PLUM, SAND, LEAF = "#dd9a92", "#5b3f66", "#d9c19b", "#3f7d4f"


def rgb(*words: str) -> Array:
    """Colours (K, 3) in [0, 1], of one word (3,)."""
    result = np.array([[int(word[k : k + 2], 16) / 255 for k in (1, 3, 5)] for word in words])
    return result if len(words) > 1 else result[0]


def over(below: Array, mask: Array, colour: Array | str) -> Array:
    """A colour, or one a point, where a mask holds."""
    return np.where(mask[..., None], rgb(colour) if isinstance(colour, str) else colour, below)


def plain(x: Array, colour: str) -> Array:
    return np.broadcast_to(rgb(colour), (*x.shape, 3))


def cells(x: Array, y: Array, across: int, down: int) -> tuple[Array, Array, npt.NDArray[np.int64]]:
    """Coordinates in [0, 1) within cells of a grid, and the index of the cell."""
    x, y = x % 1 * across, y % 1 * down
    return x % 1, y % 1, (np.floor(y) * across + np.floor(x)).astype(np.int64)


def noise(rng: Rng, x: Array, y: Array, across: int, down: int, octaves: int = 4) -> Array:
    """Value noise in about ±1, each octave of twice the cells and half the height."""
    total = np.zeros_like(x)
    for octave in range(octaves):
        n, m = across << octave, down << octave
        lattice = rng.uniform(-1, 1, (m, n))
        i, j = np.floor(x * n).astype(int), np.floor(y * m).astype(int)
        s, t = x * n - i, y * m - j
        s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)
        i, j, i1, j1 = i % n, j % m, (i + 1) % n, (j + 1) % m
        top = lattice[j, i] * (1 - s) + lattice[j, i1] * s
        low = lattice[j1, i] * (1 - s) + lattice[j1, i1] * s
        total += (top * (1 - t) + low * t) / 2**octave
    return total


def bands(value: Array, colours: Array) -> Array:
    """Colours of even steps of a value from 0 to 1."""
    return colours[np.clip((value * len(colours)).astype(int), 0, len(colours) - 1)]


def tinted(rng: Rng, index: npt.NDArray[np.int64], colours: Array, spread: float) -> Array:
    """One of the colours for each index, a little lighter or darker."""
    count = int(index.max()) + 1
    each = colours[rng.integers(len(colours), size=count)] * rng.uniform(1 - spread, 1 + spread, (count, 1))
    return np.clip(each, 0, 1)[index]


def nearest(x: Array, y: Array, points: Array) -> tuple[Array, Array, npt.NDArray[np.int64]]:
    """Distances to the nearest of points (K, 2) and of the others, repeated, and which that is."""
    first, second = np.full(x.shape, np.inf), np.full(x.shape, np.inf)
    which = np.zeros(x.shape, np.int64)
    for k, (px, py) in enumerate(points):
        away = np.hypot((x - px + 0.5) % 1 - 0.5, (y - py + 0.5) % 1 - 0.5)
        second = np.minimum(second, np.maximum(first, away))
        which = np.where(away < first, k, which)
        first = np.minimum(first, away)
    return first, second, which


def scattered(rng: Rng, count: int, tries: int = 40) -> Array:
    """Points (K, 2) that keep away from each other: of several tries each the farthest from the others."""
    points = [rng.random(2)]
    for _ in range(count - 1):
        some = rng.random((tries, 2))
        off = abs(some[:, None] - np.array(points))
        off = np.minimum(off, 1 - off)
        points.append(some[np.hypot(off[..., 0], off[..., 1]).min(1).argmax()])
    return np.array(points)


def segment(x: Array, y: Array, ax: float, ay: float, bx: float, by: float) -> Array:
    """Distances to a segment."""
    dx, dy = bx - ax, by - ay
    t = np.clip(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy), 0, 1)
    return np.hypot(x - ax - t * dx, y - ay - t * dy)


def checker(rng: Rng, x: Array, y: Array) -> Array:
    even = (np.floor(4 * x) + np.floor(4 * y)) % 2 == 0
    return over(plain(x, CREAM), even, TEAL)


def bricks(rng: Rng, x: Array, y: Array) -> Array:
    row = np.floor(8 * y)
    u, v, brick = cells(x + 0.125 * (row % 2), y, 4, 8)
    joint = (abs(u - 0.5) > 0.465) | (abs(v - 0.5) > 0.43)
    return over(tinted(rng, brick, rgb(CLAY, "#b84a36", RUST, "#d0694a"), 0.06), joint, "#d8cdbb")


def dots(rng: Rng, x: Array, y: Array) -> Array:
    row = np.floor(8 * y)
    u, v, dot = cells(x + 0.0625 * (row % 2), y, 8, 8)
    return over(
        plain(x, "#f2d9c9"), np.hypot(u - 0.5, v - 0.5) < 0.33, tinted(rng, dot, rgb(CLAY, PLUM, GOLD), 0)
    )


def stripes(rng: Rng, x: Array, y: Array) -> Array:
    at = (2 * x + y) % 1 * 20
    edges = np.array([0, 6, 7, 10, 11, 12, 17, 18, 20])
    colours = rgb(TEAL, CREAM, GOLD, CREAM, INK, SKY, CREAM, ROSE)
    return colours[np.clip(np.searchsorted(edges, at, "right") - 1, 0, 7)]


def wood(rng: Rng, x: Array, y: Array) -> Array:
    plank = np.floor(4 * y)
    shift = np.array([0.15, 0.6, 0.35, 0.85])[plank.astype(int) % 4]
    bend = 0.12 * noise(rng, x, y, 2, 8, 2)
    knot_x, knot_y = (x - shift + 0.5) % 1 - 0.5, (4 * y) % 1 - 0.5
    pull = 0.5 * np.exp(-30 * knot_x**2 - 8 * (knot_y - 0.1) ** 2)
    rings = (7 * (knot_y + bend) + 3 * pull + 0.4 * noise(rng, x, y, 4, 64, 1)) % 1
    board = bands(abs(2 * rings - 1), rgb("#a8744a", "#b27e52", "#bb885b", "#c39264", "#c99a6c"))
    board = board * np.array([1.0, 0.93, 1.04, 0.97])[plank.astype(int) % 4][..., None]
    gap = ((4 * y) % 1 < 0.03) | (abs(knot_x + 0.45) < 0.003)
    return over(np.clip(board, 0, 1), gap, "#5e3d27")


def noise_bands(rng: Rng, x: Array, y: Array) -> Array:
    height = noise(rng, x, y, 3, 3, 4)
    low, high = height.min(), height.max()
    return bands((height - low) / (high - low), rgb(INK, "#2b5a6b", TEAL, SAGE, "#cfd6ac", CREAM, SAND))


LETTERS = {
    "R": [(0, 0, 0, 4), (0, 0, 2, 0), (2, 0, 2, 2), (2, 2, 0, 2), (0.7, 2, 2, 4)],
    "G": [(2, 0, 0, 0), (0, 0, 0, 4), (0, 4, 2, 4), (2, 4, 2, 2.2), (2, 2.2, 1.1, 2.2)],
    "F": [(0, 0, 0, 4), (0, 0, 2, 0), (0, 2, 1.5, 2)],
    "S": [(2, 0, 0, 0), (0, 0, 0, 2), (0, 2, 2, 2), (2, 2, 2, 4), (2, 4, 0, 4)],
    "N": [(0, 4, 0, 0), (0, 0, 2, 4), (2, 4, 2, 0)],
    "K": [(0, 0, 0, 4), (2, 0, 0, 2.2), (0.6, 1.8, 2, 4)],
    "J": [(2, 0, 2, 4), (2, 4, 0, 4), (0, 4, 0, 3)],
    "Q": [(0, 0, 2, 0), (2, 0, 2, 4), (2, 4, 0, 4), (0, 4, 0, 0), (1.2, 3.0, 2.5, 4.6)],
    "E": [(2, 0, 0, 0), (0, 0, 0, 4), (0, 4, 2, 4), (0, 2, 1.6, 2)],
}
"""Strokes of letters, from one point to another, on a grid of 2 by 4."""


def letters(rng: Rng, x: Array, y: Array) -> Array:
    u, v, cell = cells(x, y, 3, 3)
    out = rgb(CREAM, "#e8dcc0")[cell % 2]
    for k, strokes in enumerate(LETTERS.values()):
        ink = rgb(INK, CLAY, TEAL)[(k + k // 3) % 3]
        px, py = (u - 0.5) * 6 + 1, (v - 0.5) * 6 + 2
        away = np.min([segment(px, py, *stroke) for stroke in strokes], 0)
        out = over(out, (cell == k) & (away < 0.36), ink)
    return out


def tiles(rng: Rng, x: Array, y: Array) -> Array:
    u, v, cell = cells(x, y, 6, 6)
    turn = rng.integers(2, size=36)[cell] == 1
    u = np.where(turn, 1 - u, u)
    arc = np.minimum(abs(np.hypot(u, v) - 0.5), abs(np.hypot(1 - u, 1 - v) - 0.5))
    out = over(plain(x, "#17496b"), arc < 0.17, "#f0e6d2")
    return over(out, arc < 0.07, GOLD)


def waves(rng: Rng, x: Array, y: Array) -> Array:
    out = plain(x, SKY)
    for row in range(-1, 20):  # fans, lower rows over higher ones
        middle_y = row / 8 + 0.0625
        middle_x = (np.floor(4 * x - row % 2 / 2) + 0.5 + row % 2 / 2) / 4
        away = np.hypot(x - middle_x, 1.0 * (y - middle_y)) * 8
        fan = bands(np.minimum(away, 0.999), rgb(SKY, CREAM, "#2d5d86", CREAM, "#2d5d86"))
        out = over(out, away < 1, fan)
    return out


def zigzag(rng: Rng, x: Array, y: Array) -> Array:
    at = (y + 0.5 * abs((4 * x) % 1 - 0.5) * 0.5) % 1 * 8
    return rgb(PLUM, CREAM, ROSE, CREAM, GOLD, CREAM, CLAY, CREAM)[np.floor(at).astype(int) % 8]


def arrows(rng: Rng, x: Array, y: Array) -> Array:
    row = np.floor(4 * y)
    u, v, cell = cells(x + 0.125 * (row % 2), y, 4, 4)
    shaft = (abs(v - 0.5) < 0.09) & (u > 0.12) & (u < 0.6)
    head = (u > 0.52) & (u < 0.9) & (abs(v - 0.5) < (0.9 - u) * 0.85)
    return over(plain(x, "#f3efe6"), shaft | head, tinted(rng, cell, rgb(LEAF, TEAL, GOLD, CLAY), 0))


def leaves(rng: Rng, x: Array, y: Array) -> Array:
    out = plain(x, "#eef0df")
    middles = scattered(rng, 26)
    for (px, py), turn, kind in zip(
        middles, rng.uniform(0, 6.2832, 26), rng.integers(4, size=26), strict=True
    ):
        dx, dy = (x - px + 0.5) % 1 - 0.5, (y - py + 0.5) % 1 - 0.5
        u, v = np.cos(turn) * dx + np.sin(turn) * dy, np.cos(turn) * dy - np.sin(turn) * dx
        inside = (abs(u) < 0.1) & (abs(v) < 0.42 * (0.1 - u) * (u + 0.1) / 0.1 * (1 - 2.5 * u))
        out = over(out, inside, rgb(LEAF, "#6a9a58", SAGE, "#c9a24a")[kind])
        vein = (abs(v) < 0.0028) & (abs(u + 0.02) < 0.1)
        out = over(out, vein, "#2c5a3c")
    return out


def terrazzo(rng: Rng, x: Array, y: Array) -> Array:
    out = plain(x, "#efe8dc")
    colours = rgb(CLAY, INK, SAGE, ROSE, GOLD, "#a9a49b", "#6f8fa3")
    for px, py in scattered(rng, 70):
        size, colour = rng.uniform(0.016, 0.052), colours[rng.integers(len(colours))]
        dx, dy = (x - px + 0.5) % 1 - 0.5, (y - py + 0.5) % 1 - 0.5
        turns = (
            rng.uniform(0, 1.5708) + np.array([0, 1.2566, 2.5133, 3.7699, 5.0265]) + rng.uniform(-0.4, 0.4, 5)
        )
        sides = [
            np.cos(a) * dx + np.sin(a) * dy < size * r
            for a, r in zip(turns, rng.uniform(0.6, 1.1, 5), strict=True)
        ]
        out = over(out, np.all(sides, 0), colour)
    return out


def plaid(rng: Rng, x: Array, y: Array) -> Array:
    edges = np.array([0, 9, 11, 13, 15, 24, 25, 31, 32])
    threads = rgb("#7d2b34", INK, "#7d2b34", INK, "#7d2b34", GOLD, LEAF, CREAM)
    warp, weft = (threads[np.searchsorted(edges, at % 1 * 64 % 32, "right") - 1] for at in (x, y))
    over_under = (np.floor(64 * x) + np.floor(64 * y)) % 4 < 2
    return np.where(over_under[..., None], warp, weft)


def hexagons(rng: Rng, x: Array, y: Array) -> Array:
    rows, across = 6, 5
    points = [((i + 0.5 * (j % 2)) / across, j / rows) for j in range(rows) for i in range(across)]
    colours = np.array(
        [
            rgb(TEAL, "#3c938f", CREAM, "#1f5f66", GOLD)[rng.choice(5, p=(0.3, 0.25, 0.2, 0.15, 0.1))]
            for _ in points
        ]
    )
    first, second, which = nearest(x, y, np.array(points))
    return over(colours[which], second - first < 0.014, "#f7f3e8")


def cobbles(rng: Rng, x: Array, y: Array) -> Array:
    points = scattered(rng, 60)
    first, second, which = nearest(x, y, points)
    shades = rng.uniform(0.82, 1.1, len(points))
    stone = (
        rgb("#8f979c", "#a39f96", "#7f8b96", "#b0a99b")[rng.integers(4, size=len(points))] * shades[:, None]
    )
    lit = ((x - points[which, 0] + 0.5) % 1 - 0.5 + (y - points[which, 1] + 0.5) % 1 - 0.5) < -0.5 * (
        second - first
    )
    out = np.clip(stone[which] * np.where(lit, 1.07, 1.0)[..., None], 0, 1)
    return over(out, second - first < 0.02, "#4a4e50")


TEXTURES: dict[str, Callable[[Rng, Array, Array], Array]] = {
    "arrows": arrows,
    "bricks": bricks,
    "checker": checker,
    "cobbles": cobbles,
    "dots": dots,
    "hexagons": hexagons,
    "leaves": leaves,
    "letters": letters,
    "noise": noise_bands,
    "plaid": plaid,
    "stripes": stripes,
    "terrazzo": terrazzo,
    "tiles": tiles,
    "waves": waves,
    "wood": wood,
    "zigzag": zigzag,
}


def drawn(name: str) -> npt.NDArray[np.uint8]:
    """The picture (SIDE, SIDE, 3) of a texture."""
    at = (np.arange(SIDE * FINE) + 0.5) / (SIDE * FINE)
    x, y = np.meshgrid(at, at)
    fine = TEXTURES[name](np.random.default_rng(list(name.encode())), x, y)
    mean = fine.reshape(SIDE, FINE, SIDE, FINE, 3).mean((1, 3))
    return np.floor(255 * mean + 0.5).astype(np.uint8)


def sheet() -> Pillow.Image:
    """All textures, four in a row, each once and a half so that seams show."""
    rows = [
        [np.tile(drawn(name), (2, 2, 1))[:320, :320] for name in list(TEXTURES)[k : k + 4]]
        for k in range(0, 16, 4)
    ]
    padded = [[np.pad(p, ((4, 4), (4, 4), (0, 0)), constant_values=255) for p in row] for row in rows]
    return Pillow.fromarray(np.concatenate([np.concatenate(row, 1) for row in padded], 0))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--sheet"]:
        sheet().save(sys.argv[2])
    else:
        made = [painted(name, drawn(name), ABOUT) for name in TEXTURES]
        write_whole(TEXTURES_FILE, element_file_bytes(made))
