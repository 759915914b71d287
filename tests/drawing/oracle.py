"""A slow, independent drawing of 2D scenes: plain Python floats, one sample at a time, polygons as edges.

It shares nothing with the package but the Scene it reads. Formulas are those of docs/language.md.
"""

from __future__ import annotations

import colorsys
import math
from typing import Any

K = 0.15


def outline(geometry: str) -> list[tuple[float, float]]:
    if geometry == "star":
        radii, count, first = [1.0, 0.381966] * 5, 10, 90.0
    else:
        count = {"square": 4, "triangle": 3, "pentagon": 5, "hexagon": 6}[geometry]
        radii, first = [1.0] * count, 45.0 if geometry == "square" else 90.0
    angles = [math.radians(first + 360.0 * i / count) for i in range(count)]
    return [(r * math.cos(a), r * math.sin(a)) for r, a in zip(radii, angles, strict=True)]


def polygon_distance(corners: list[tuple[float, float]], x: float, y: float) -> float:
    """Signed Euclidean distance by visiting every edge; inside by crossings of a ray."""
    best, inside = math.inf, False
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
        ex, ey = bx - ax, by - ay
        t = min(1.0, max(0.0, ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)))
        best = min(best, math.hypot(x - ax - t * ex, y - ay - t * ey))
        if (ay > y) != (by > y) and x < ex * (y - ay) / ey + ax:
            inside = not inside
    return -best if inside else best


def linear_and_shift(move: Any) -> tuple[list[list[float]], tuple[float, float]] | None:
    """The plane's affine map of a transform, or None for a deformation."""
    if move.kind == "translate":
        return [[1, 0], [0, 1]], (move.x, move.y)
    if move.kind == "rotate":
        a = move.angle * (1 if move.axis[2] > 0 else -1)
        return [[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]], (0, 0)
    if move.kind == "scale":
        return [[move.x, 0], [0, move.y]], (0, 0)
    if move.kind == "shear":
        return ([[1, move.k], [0, 1]] if move.axes == "xy" else [[1, 0], [move.k, 1]]), (0, 0)
    if move.kind == "matrix":
        r = move.rows
        return [[r[0][0], r[0][1]], [r[1][0], r[1][1]]], (r[0][3], r[1][3])
    return None


def smallest_singular_value(m: list[list[float]]) -> float:
    (a, b), (c, d) = m
    s, t = a * a + b * b + c * c + d * d, (a * d - b * c) ** 2
    return math.sqrt(max(0.0, (s - math.sqrt(max(0.0, s * s - 4 * t))) / 2))


def carry_back(moves: list[Any], x: float, y: float) -> tuple[float, float]:
    for move in reversed(moves):
        if move.kind in ("grow", "shell"):
            continue
        affine = linear_and_shift(move)
        if affine is None:
            angle = move.k * (math.hypot(x, y) if move.kind == "twirl" else x)
            c, s = math.cos(angle), math.sin(angle)
            x, y = c * x + s * y, -s * x + c * y
        else:
            ((a, b), (c, d)), (u, v) = affine
            det, x, y = a * d - b * c, x - u, y - v
            x, y = (d * x - b * y) / det, (a * y - c * x) / det
    return x, y


def scale_of(moves: list[Any]) -> float:
    total = [[1.0, 0.0], [0.0, 1.0]]
    for move in moves:
        affine = linear_and_shift(move)
        if affine is not None:
            m = affine[0]
            total = [[sum(m[i][k] * total[k][j] for k in range(2)) for j in range(2)] for i in range(2)]
    return smallest_singular_value(total)


def colour_of(material: Any) -> tuple[float, float, float]:
    rgb = (1.0, 1.0, 1.0)
    for op in material.ops if material is not None else ():
        if op.kind == "color":
            rgb = tuple(v * w for v, w in zip(rgb, op.rgb, strict=True))
        elif op.kind == "grayscale":
            luma = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
            rgb = tuple(v + (luma - v) * op.amount for v in rgb)
        elif op.kind == "hue":
            h, s, v = colorsys.rgb_to_hsv(*rgb)
            rgb = colorsys.hsv_to_rgb((h + op.angle / math.tau) % 1.0, s, v)
        rgb = tuple(min(1.0, max(0.0, v)) for v in rgb)
    return rgb


def step(state: tuple[float, Any], d: float, c: Any, op: str) -> tuple[float, Any]:
    big_d, big_c = state
    if op == "union":
        return min(big_d, d), (c if d < max(big_d, 0.0) else big_c)
    if op == "smooth":
        if math.isinf(d):
            return state
        h = min(1.0, max(0.0, 0.5 + 0.5 * (big_d - d) / K)) if not math.isinf(big_d) else 1.0
        if math.isinf(big_d):
            return d, c
        mixed = tuple(a + (b - a) * h for a, b in zip(big_c, c, strict=True))
        return big_d + (d - big_d) * h - K * h * (1 - h), mixed
    return max(big_d, -d if op == "subtract" else d), big_c


def sample(node: Any, x: float, y: float, outer: list[Any], material: Any) -> tuple[float, Any]:
    """(D, C) of a Scene node at a world point."""
    moves = [*node.transforms, *outer]
    material = node.material or material
    if node.kind == "object":
        qx, qy = carry_back(moves, x, y)
        is_round = node.geometry == "disc"
        d = math.hypot(qx, qy) - 1 if is_round else polygon_distance(outline(node.geometry), qx, qy)
        for move in moves:
            d = d - move.r if move.kind == "grow" else abs(d) - move.w / 2 if move.kind == "shell" else d
        return d * scale_of(moves), colour_of(material)
    if node.kind == "chain":
        links = [(link.op, link.node) for link in node.children]
    else:
        links = [(node.op if node.kind == "boolean" else "union", child) for child in node.children]
    state: tuple[float, Any] = (math.inf, (0.0, 0.0, 0.0))
    for index, (op, child) in enumerate(links):
        d, c = sample(child, x, y, moves, material)
        state = (d, c) if index == 0 else step(state, d, c, op)
    return state


def draw(scene: Any) -> list[list[tuple[float, float, float]]]:
    """The whole picture over its background, rows from the top."""
    width, height = scene.canvas
    unit = min(width, height) / 2
    background = (1.0, 1.0, 1.0) if scene.background == "default" else scene.background
    picture = []
    for row in range(height):
        line = []
        for column in range(width):
            total = [0.0, 0.0, 0.0]
            for oy in (-0.25, 0.25):
                for ox in (-0.25, 0.25):
                    x, y = (column + 0.5 + ox - width / 2) / unit, (height / 2 - row - 0.5 - oy) / unit
                    state: tuple[float, Any] = (math.inf, background)
                    for index, node in enumerate(scene.nodes):
                        d, c = sample(node, x, y, [], None)
                        state = (d, c) if index == 0 else step(state, d, c, "union")
                    shown = state[1] if state[0] < 0 else background
                    total = [t + v / 4 for t, v in zip(total, shown, strict=True)]
            line.append(tuple(total))
        picture.append(line)
    return picture
