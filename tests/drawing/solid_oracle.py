"""A slow, independent drawing of 3D scenes: plain Python floats, one sample at a time, in fixed small steps.

It shares nothing with the package but the values that it reads (a graph's nodes, a stage); its formulas are
those of docs/language.md. Gradients are differences, singular values come from powers of a matrix.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

SIGMA = 3.0
REACH = 1.8  # nothing stands further from the origin
STEP = 0.006

V = tuple[float, float, float]


def dot(a: V, b: V) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def plus(a: V, b: V, t: float = 1.0) -> V:
    return a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]


def unit(a: V) -> V:
    n = math.sqrt(dot(a, a))
    return a[0] / n, a[1] / n, a[2] / n


def cross(a: V, b: V) -> V:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def undone(rows: Any, p: V) -> V:
    """The q that the affine map sends to p, by Cramer's rule."""
    columns = [(rows[i], rows[4 + i], rows[8 + i]) for i in range(4)]
    x, y, z, shift = columns
    b = plus(p, shift, -1.0)
    whole = dot(x, cross(y, z))
    return dot(b, cross(y, z)) / whole, dot(x, cross(b, z)) / whole, dot(x, cross(y, b)) / whole


def smallest_singular_value(m: list[list[float]]) -> float:
    """One over the largest of the inverse, which many products of the inverse's Gram matrix single out."""
    rows = [*m[0], 0.0, *m[1], 0.0, *m[2], 0.0]
    inverse = [undone(rows, tuple(float(i == j) for i in range(3))) for j in range(3)]  # its columns
    gram = [[dot(a, b) for b in inverse] for a in inverse]
    power = 0.0
    for _ in range(60):  # the 2^60th power
        size = max(abs(v) for row in gram for v in row)
        power = 2.0 * (power + math.log(size))
        gram = [[v / size for v in row] for row in gram]
        gram = [[sum(gram[i][k] * gram[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    return math.exp(-0.5 * power / 2.0**60)


def leaf_distance(leaf: Any, steps: list[Any]) -> Callable[[V], float]:
    """World distance to a leaf by point."""
    own, total = [], [[float(i == j) for j in range(3)] for i in range(3)]
    back: list[Any] = []
    for step in steps:
        kind = type(step).__name__
        if kind == "Affine":
            r = step.rows
            total = [[sum(r[4 * i + k] * total[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
            shift = undone(r, (0.0, 0.0, 0.0))
            columns = [plus(undone(r, tuple(float(i == j) for i in range(3))), shift, -1.0) for j in range(3)]
            back.insert(0, (kind, *columns, shift))
        elif kind in ("Displace", "Grow", "Shell"):
            own.append(step)
        else:
            back.insert(0, (kind, step))
    scale, ball = smallest_singular_value(total), leaf.geometry == "sphere"
    sin, cos, sqrt = math.sin, math.cos, math.sqrt

    def distance(p: V) -> float:
        x, y, z = p
        for kind, *rest in back:
            if kind == "Affine":
                (a, d, g), (b, e, h), (c, f, i), (s, t, u) = rest
                x, y, z = a * x + b * y + c * z + s, d * x + e * y + f * z + t, g * x + h * y + i * z + u
            elif kind == "Warp":
                (step,) = rest
                a = step.twirl * sqrt(x * x + y * y + z * z) + step.bend[0] * x + step.bend[1] * y
                x, y = cos(a) * x + sin(a) * y, -sin(a) * x + cos(a) * y
            else:
                a = rest[0].twist * y
                x, z = cos(a) * x + sin(a) * z, -sin(a) * x + cos(a) * z
        if ball:
            d = sqrt(x * x + y * y + z * z) - 1.0
        else:
            d = sqrt((sqrt(x * x + z * z) - 0.7) ** 2 + y * y) - 0.3
        for step in own:
            if hasattr(step, "r"):
                d -= step.r
            elif hasattr(step, "w"):
                d = max(d, -d) - 0.5 * step.w
            else:
                f = step.frequency
                d += step.amount * sin(f * x) * sin(f * y) * sin(f * z)
        return scale * d

    return distance


State = tuple[float, V, bool]  # D, C and whether the material is a medium


def field(node: Any, outer: list[Any]) -> Callable[[V], State]:
    """What a node answers by point."""
    steps = [*(move.step for move in node.moves), *outer]
    if hasattr(node, "geometry"):
        medium, c, distance = (
            node.look.material == "volumetric",
            node.look.colour(),
            leaf_distance(node, steps),
        )
        return lambda p: (distance(p), c, medium)
    parts = [(link.op, link.width, field(link.node, steps)) for link in node.links]

    def folded(p: V) -> State:
        big_d, big_c, big_medium = parts[0][2](p) if parts else (math.inf, (0.0, 0.0, 0.0), False)
        for op, k, part in parts[1:]:
            d, c, medium = part(p)
            if op == "union":
                if d < max(big_d, 0.0):
                    big_c, big_medium = c, medium
                big_d = min(big_d, d)
            elif op == "smooth":
                h = min(1.0, max(0.0, 0.5 + 0.5 * (big_d - d) / k))
                big_d = big_d + (d - big_d) * h - k * h * (1.0 - h)
                big_c = plus(big_c, plus(c, big_c, -1.0), h)
                big_medium = medium if h > 0.5 else big_medium
            else:
                cut = -d if op == "subtract" else d
                h = min(1.0, max(0.0, 0.5 + 0.5 * (cut - big_d) / k)) if k else float(cut > big_d)
                big_d = big_d + (cut - big_d) * h + k * h * (1.0 - h)
        return big_d, big_c, big_medium

    return folded


class Scene:
    """A graph's root with a stage."""

    def __init__(self, root: Any, stage: Any) -> None:
        self.at, self.stage = field(root, []), stage

    def kind(self, p: V) -> str:
        d, _, medium = self.at(p)
        return "out" if d >= 0.0 else "medium" if medium else "opaque"

    def stretches(self, o: V, d: V, end: float, step: float = STEP) -> Iterator[tuple[str, float, float]]:
        """Kinds along a ray from 0 to ``end``, each with where it begins and ends."""
        b = dot(o, d)
        near = b * b - dot(o, o) + REACH * REACH
        first = last = 0.0
        if near > 0.0:
            first, last = max(0.0, -b - math.sqrt(near)), min(end, -b + math.sqrt(near))
        begin, t, kind = 0.0, first, self.kind(o) if first == 0.0 else "out"
        while t < last:
            following = min(t + step, last)
            new = self.kind(plus(o, d, following))
            if new != kind:
                low, high = t, following
                for _ in range(40):
                    middle = (low + high) / 2.0
                    if self.kind(plus(o, d, middle)) == kind:
                        low = middle
                    else:
                        high = middle
                yield kind, begin, high
                begin, kind = high, new
            t = following
        yield kind, begin, end

    def visible(self, p: V, step: float = STEP) -> float:
        """Transmittance from a point to the light."""
        way = plus(self.stage.lights[0].position, p, -1.0)
        r = math.sqrt(dot(way, way))
        inside = 0.0
        for kind, begin, end in self.stretches(p, unit(way), r, step):
            if kind == "opaque":
                return 0.0
            inside += (end - begin) * (kind == "medium")
        return math.exp(-SIGMA * inside)

    def received(self, p: V, n: V) -> V:
        light = self.stage.lights[0]
        way = plus(light.position, p, -1.0)
        r = max(1e-3, math.sqrt(dot(way, way)))
        direct = light.power * max(0.0, dot(n, way) / r) / r**2
        if direct:
            direct *= self.visible(plus(p, n, 1e-4))
        return tuple(direct * c + 0.12 + 0.06 * n[1] for c in light.rgb)

    def solid(self, p: V, d: V) -> V:
        h = 1e-5
        inside = plus(p, d, 1e-7)
        axes = ((h, 0.0, 0.0), (0.0, h, 0.0), (0.0, 0.0, h))
        n = unit(tuple(self.at(plus(inside, e))[0] - self.at(plus(inside, e, -1.0))[0] for e in axes))
        if dot(n, d) > 0.0:
            n = (-n[0], -n[1], -n[2])
        return tuple(c * e for c, e in zip(self.at(inside)[1], self.received(p, n), strict=True))

    def ground(self, p: V) -> V:
        fade = math.exp(-(p[0] ** 2 + p[2] ** 2) / 64.0)
        shade = zip(self.stage.ground.rgb, self.received(p, (0.0, 1.0, 0.0)), self.stage.horizon, strict=True)
        return tuple(fade * c * e + (1.0 - fade) * horizon for c, e, horizon in shade)

    def sky(self, d: V) -> V:
        up = min(1.0, max(0.0, d[1] / 0.5))
        return tuple(a + (b - a) * up for a, b in zip(self.stage.horizon, self.stage.zenith, strict=True))

    def seen(self, d: V, media_steps: int) -> tuple[V, float]:
        """Light from a direction, premultiplied, and its alpha."""
        o, stage = self.stage.camera.eye, self.stage
        end, behind = math.inf, (0.0, 0.0, 0.0) if stage.transparent else self.sky(d)
        alpha = 0.0 if stage.transparent else 1.0
        on_ground = stage.ground is not None and d[1] < 0.0 and o[1] > stage.ground.y
        if on_ground:
            end = (stage.ground.y - o[1]) / d[1]
        through, total = 1.0, (0.0, 0.0, 0.0)
        for kind, begin, finish in self.stretches(o, d, end):
            if kind == "opaque":
                behind, alpha, on_ground = self.solid(plus(o, d, begin), d), 1.0, False
                break
            if kind == "medium":
                total = plus(total, self.scattered(d, begin, finish, media_steps), through)
                through *= math.exp(-SIGMA * (finish - begin))
        if on_ground:
            behind, alpha = self.ground(plus(o, d, end)), 1.0
        return plus(total, behind, through), 1.0 - (1.0 - alpha) * through

    def scattered(self, d: V, begin: float, end: float, steps: int) -> V:
        total, dt = (0.0, 0.0, 0.0), (end - begin) / steps
        light = self.stage.lights[0]
        for i in range(steps):
            t = begin + (i + 0.5) * dt
            p = plus(self.stage.camera.eye, d, t)
            way = plus(light.position, p, -1.0)
            direct = light.power / (4.0 * max(1e-6, dot(way, way))) * self.visible(p, 4.0 * STEP)
            weight = math.exp(-SIGMA * (t - begin)) * SIGMA * dt
            c = self.at(p)[1]
            lit = tuple(a * (b * direct + 0.12) for a, b in zip(c, light.rgb, strict=True))
            total = plus(total, lit, weight)
        return total


def encode(v: float) -> float:
    v = min(1.0, max(0.0, v))
    return 12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055


def draw(root: Any, stage: Any, canvas: tuple[int, int], media_steps: int = 60) -> list[list[list[float]]]:
    """The picture, rows from the top; four numbers a pixel where the stage is transparent."""
    scene, camera = Scene(root, stage), stage.camera
    forward = unit(plus(camera.target, camera.eye, -1.0))
    right = unit(cross(forward, (0.0, 1.0, 0.0)))
    up = cross(right, forward)
    width, height = canvas
    half, ahead = min(width, height) / 2, 1.0 / math.tan(camera.fov_rad / 2.0)
    picture = []
    for row in range(height):
        line = []
        for column in range(width):
            total, coverage = (0.0, 0.0, 0.0), 0.0
            for oy in (-0.25, 0.25):
                for ox in (-0.25, 0.25):
                    x, y = (column + 0.5 + ox - width / 2) / half, (height / 2 - row - 0.5 - oy) / half
                    way = plus(plus((0.0, 0.0, 0.0), forward, ahead), right, x)
                    light, alpha = scene.seen(unit(plus(way, up, y)), media_steps)
                    total, coverage = plus(total, light, 0.25), coverage + alpha / 4.0
            if stage.transparent:
                line.append([*(encode(v / coverage if coverage else 0.0) for v in total), coverage])
            else:
                line.append([encode(v) for v in total])
        picture.append(line)
    return picture
