"""The field of solids as tables of numbers, and what asks it, compiled by numba.

`world_of` writes a graph down: the way back from the world to each leaf as
`scenelang.drawing.exact.solid.ExactBody` has it, the fold in postfix order, looks, lamps, ground and sky.
An element is its own grid of distances, linear between nodes; a texture is a picture of its colours.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numba
import numpy as np
import numpy.typing as npt

from scenelang.assets.pyramid import unpacked
from scenelang.compiler.graph import Fold, Graph, Leaf, Node
from scenelang.compiler.groups import SMOOTH, SUBTRACT, UNION
from scenelang.compiler.spaces import EXTINCTION
from scenelang.compiler.steps import Displace, Grow
from scenelang.drawing.exact.field import colour_at
from scenelang.drawing.exact.solid import FAR, ExactBody, ExactField, ExactMap
from scenelang.language.words import TOKENS

Array = npt.NDArray[Any]
Run = TypeVar("Run", bound=Callable[..., Any])

OUT, MEDIUM, OPAQUE = range(3)
DIFFUSE, VOLUMETRIC, GLOSSY, METAL = range(4)
SOLIDS = "sphere", "torus", "box", "cylinder", "cone", "capsule", "octahedron"
TEXELS = 256  # along a side of a texture's picture
_GROW, _SHELL, _DISPLACE = 1.0, 2.0, 3.0
_LEAST = 1e-12
_SLOPE = 1e-5  # world units from a point to those whose distances tell its gradient


def compiled(run: Run) -> Run:
    """The function as machine code, kept from run to run, that leaves other threads alone."""
    made: Run = numba.njit(run, nogil=True, cache=True, error_model="numpy", fastmath={"contract", "arcp"})
    return made


class Field(NamedTuple):
    """N objects and their fold.

    Args:
        rows: (N, 35), by column: 0 map of world points into the object's first frame, 12 its largest stretch;
            13 world distance of a unit of the leaf's, how fast it changes at most, how far around a point
            that holds; 16 whether there are turns; 17 centre and radius, in the first frame, of what can
            matter; 21 index into `SOLIDS`, or behind them into ``grids``; 22 its rows of ``back``, from and
            to; 24 what changes the leaf's distance, three times kind and two numbers, 0 for nothing; 33 kind
            of material; 34 extinction, 0 of what is opaque.
        back: (K, 14) maps and turns of objects behind their first map.
        grids: (G, n, n, n) distances of elements.
        code: (I,) the fold: an object's index, or -1 - operator; ``width`` (I,) of the operator's blend.
        mixed: whether a material may give way to another inside.
    """

    rows: Array
    back: Array
    grids: Array
    code: Array
    width: Array
    mixed: bool


class World(NamedTuple):
    """All that is asked while light is traced; colours are linear.

    Args:
        look: (N, 7) colour, glow, roughness.
        worn: (N, 7) index into ``pictures`` (T, h, w, 3) or -1, and the map of leaf points to it.
        media: whether there is one.
        lamps: (L, 8) position, power times colour, radius, and whether it lies in or near a medium.
        ground: height (-inf for none), colour; ``seen`` horizon and zenith of the eye, with alpha behind;
            ``sky`` of light, times its power.
        glowing: (N, 4) centres and radii of balls around objects that glow; others have radius 0.
        bounds: the like around all that is diffuse, a medium, or glows.
        shining: (M, 14) points of what glows, or if ``all_send`` of all in ``bounds``: place, normal (0 in a
            medium), light that is sent, the odds of each by area or volume, those of objects' (N,)
            ``shares``, extinction or 1, and colour; a tracer finds them.
    """

    field: Field
    look: Array
    worn: Array
    pictures: Array
    media: bool
    lamps: Array
    ground: Array
    seen: Array
    sky: Array
    glowing: Array
    bounds: Array
    shining: Array
    shares: Array
    all_send: bool


def world_of(graph: Graph) -> World:
    """The tables of a lowered graph of solids; elements have one size of grid.

    Raises:
        ValueError: the stage has no sky, or a colour varies in all three dimensions.
    """
    stage = graph.stage
    if stage is None or stage.sky is None:
        raise ValueError("a scene without a sky has no light that goes on")
    bodies = ExactField(graph.root).bodies
    count = len(bodies)
    shapes = [*SOLIDS, *sorted({body.geometry for body in bodies} - set(SOLIDS))]
    grids = [unpacked(graph.elements[name]) for name in shapes[len(SOLIDS) :]]
    rows, look, worn = np.zeros((count, 35)), np.zeros((count, 7)), np.zeros((count, 7))
    back, pictures = list[list[float]](), list[Array]()
    for i, (body, row) in enumerate(zip(bodies, rows, strict=True)):
        material, first = body.look, body.first
        row[:13] = *np.hstack([first.inverse, first.shift]).ravel(), first.grows
        row[13:17] = body.scale, body.rate, min(body.reach, FAR), bool(body.back)
        row[17:23] = *body.centre[:, 0], body.radius, shapes.index(body.geometry), len(back)
        back += [_numbers(step) for step in body.back]
        row[23:33] = len(back), *np.pad(np.ravel([_own(step) for step in body.own]), (0, 9))[:9]
        rough = material.roughness
        row[33] = VOLUMETRIC if body.medium else DIFFUSE if not rough else GLOSSY if rough > 0.0 else METAL
        row[34] = (material.density or EXTINCTION) * (body.medium > 0)
        look[i] = *material.colour(), *material.glow, abs(rough)
        worn[i] = -1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0
        if material.element is not None:
            if material.element.dimension != 2:
                raise ValueError("a colour that varies in all three dimensions")
            worn[i, 0] = len(pictures)
            inverse = np.linalg.inv(np.vstack([np.reshape(material.moved, (3, 4)), (0, 0, 0, 1)]))
            worn[i, 1:] = inverse[:2, [0, 1, 3]].ravel()
            pictures.append(_pictured(material))
    code, width = _postfix(graph.root)
    ground, sky = stage.ground, stage.sky
    lamps = [
        (*at.position, *(at.power * c for c in at.rgb), at.radius, _near(bodies, at.position))
        for at in stage.lights
        if at.power
    ]
    return World(
        Field(
            rows,
            np.array(back).reshape(-1, 14),
            np.array(grids, np.float64) if grids else np.zeros((0, 2, 2, 2)),
            code,
            width,
            len(np.unique(rows[:, 34])) > 1,
        ),
        look,
        worn,
        np.array(pictures).reshape(-1, TEXELS, TEXELS, 3),
        bool(rows[:, 34].any()),
        np.array(lamps, np.float64).reshape(-1, 8),
        np.array([-math.inf, 0, 0, 0] if ground is None else [ground.y, *ground.rgb]),
        np.array([*stage.horizon, *stage.zenith, 0.0 if stage.transparent else 1.0]),
        sky.power * np.array([*sky.horizon, *sky.zenith]),
        _balls(bodies, lambda look: max(look.glow) > 0.0, False),
        _balls(bodies, lambda look: not look.roughness or max(look.glow) > 0.0, True),
        np.zeros((0, 14)),
        np.zeros(count),
        False,
    )


def _numbers(step: Any) -> list[float]:
    """A map or a turn: 0, its rows and stretch; or the index of the other axis, twirl and slope."""
    if isinstance(step, ExactMap):
        return [0.0, *np.hstack([step.inverse, step.shift]).ravel(), step.grows]
    return [float(step.other), step.twirl, *step.slope, *[0.0] * 9]


def _own(step: Any) -> tuple[float, float, float]:
    if isinstance(step, Displace):
        return _DISPLACE, step.amount, step.frequency
    return (_GROW, step.r, 0.0) if isinstance(step, Grow) else (_SHELL, step.w / 2, 0.0)


def _near(bodies: Sequence[ExactBody], at: Sequence[float]) -> bool:
    """Whether a point lies in or near a medium, so that rays pass it there."""
    balls = [
        (body.first(np.reshape(at, (3, 1))) - body.centre, body.radius) for body in bodies if body.medium
    ]
    return any(float(np.linalg.norm(way)) < 1.2 * radius for way, radius in balls)


def _balls(bodies: Sequence[ExactBody], wanted: Callable[[Any], bool], media: bool) -> Array:
    """Balls (N, 4) around the objects of wanted looks, of radius 0 around others."""
    balls = np.zeros((len(bodies), 4))
    for body, ball in zip(bodies, balls, strict=True):
        if wanted(body.look) and (media or not body.medium):
            back = np.linalg.inv(body.first.inverse)
            ball[:3] = (back @ (body.centre - body.first.shift))[:, 0]
            ball[3] = body.radius * np.linalg.norm(back, 2)
    return balls


def _pictured(look: Any) -> Array:
    """Linear colours of a texture at the centres of texels over [-1, 1]², first row at the bottom."""
    side = (np.arange(TEXELS) + 0.5) / TEXELS * 2.0 - 1.0
    v, u = np.meshgrid(side, side, indexing="ij")
    return np.asarray(colour_at(look, [u.ravel(), v.ravel()], light=True)).reshape(TEXELS, TEXELS, 3)


def _postfix(root: Fold) -> tuple[Array, Array]:
    """The fold as a stack machine's code, and widths of blends."""
    code, width, count = list[int](), list[float](), 0

    def visit(node: Node) -> None:
        nonlocal count
        if isinstance(node, Leaf):
            code.append(count)
            width.append(0.0)
            count += 1
        elif not node.links and node is not root:
            raise ValueError("a group of nothing")
        else:
            for at, link in enumerate(node.links):
                visit(link.node)
                if at:
                    code.append(-1 - TOKENS[link.op])
                    width.append(link.width)

    visit(root)
    return np.array(code, np.int64), np.array(width)


@compiled
def _corner(a: float, b: float, c: float) -> float:
    """Distance to where three levels of orthogonal planes are all below zero."""
    p, q, r = max(a, 0.0), max(b, 0.0), max(c, 0.0)
    return math.sqrt(p * p + q * q + r * r) + min(max(a, max(b, c)), 0.0)


_BOX, _CAN, _LEAN = 1 / math.sqrt(3), 1 / math.sqrt(2), math.sqrt(3) / 2


@compiled
def leaf_distance(leaf: int, x: float, y: float, z: float, grids: Array) -> float:
    """Signed distance of a leaf at a point of its own space."""
    if leaf == 0:
        return math.sqrt(x * x + y * y + z * z) - 1.0
    if leaf == 2:
        return _corner(abs(x) - _BOX, abs(y) - _BOX, abs(z) - _BOX)
    if leaf == 6:
        return _octahedron(abs(x), abs(y), abs(z))
    if leaf > 6:
        return _grid(grids[leaf - 7], x, y, z)
    rho = math.sqrt(x * x + z * z)
    if leaf == 1:
        return math.sqrt((rho - 0.7) * (rho - 0.7) + y * y) - 0.3
    if leaf == 3:
        return _corner(rho - _CAN, abs(y) - _CAN, -FAR)
    if leaf == 5:
        y = max(abs(y) - 0.5, 0.0)
        return math.sqrt(rho * rho + y * y) - 0.5
    side = _corner(_LEAN * rho + y / 2 - 0.5, abs(rho / 2 - _LEAN * y) - _LEAN, -FAR)
    return max(side, _corner(-y - 0.5, rho - _LEAN, -FAR))


@compiled
def _octahedron(a: float, b: float, c: float) -> float:
    above, most, least = a + b + c - 1.0, max(a, max(b, c)), min(a, min(b, c))
    if above <= 0.0:
        return above / math.sqrt(3)
    way = max(max(most - 1.0, (above - least) / 2), above / 3)
    a, b, c = min(a, way), min(b, way), min(c, way)
    return math.sqrt(a * a + b * b + c * c)


@compiled
def _grid(grid: Array, x: float, y: float, z: float) -> float:
    """Distance between the nodes of a grid over [-1, 1]³; beyond it no more than there is."""
    size = grid.shape[0] - 1
    a, b, c = min(max(x, -1.0), 1.0), min(max(y, -1.0), 1.0), min(max(z, -1.0), 1.0)
    u, v, w = (a + 1) / 2 * size, (b + 1) / 2 * size, (c + 1) / 2 * size
    i, j, k = min(int(u), size - 1), min(int(v), size - 1), min(int(w), size - 1)
    u, v, w = u - i, v - j, w - k
    total = 0.0
    for at in range(8):
        p, q, r = at & 1, at >> 1 & 1, at >> 2
        share = (u if p else 1 - u) * (v if q else 1 - v) * (w if r else 1 - w)
        total += share * grid[i + p, j + q, k + r]
    away = (x - a) * (x - a) + (y - b) * (y - b) + (z - c) * (z - c)
    return math.sqrt(total * total + away) if away > 0.0 else total


@compiled
def own_point(
    rows: Array, back: Array, i: int, x: float, y: float, z: float
) -> tuple[float, float, float, float, float]:
    """A world point in an object's own space, how fast its distance changes, and how far that holds."""
    x, y, z = (
        rows[i, 0] * x + rows[i, 1] * y + rows[i, 2] * z + rows[i, 3],
        rows[i, 4] * x + rows[i, 5] * y + rows[i, 6] * z + rows[i, 7],
        rows[i, 8] * x + rows[i, 9] * y + rows[i, 10] * z + rows[i, 11],
    )
    rate, reach = rows[i, 14], rows[i, 15]
    if rows[i, 16] == 0.0:
        return x, y, z, rate, reach
    far = reach * rows[i, 12]
    for at in range(int(rows[i, 22]), int(rows[i, 23])):
        if back[at, 0] == 0.0:
            x, y, z = (
                back[at, 1] * x + back[at, 2] * y + back[at, 3] * z + back[at, 4],
                back[at, 5] * x + back[at, 6] * y + back[at, 7] * z + back[at, 8],
                back[at, 9] * x + back[at, 10] * y + back[at, 11] * z + back[at, 12],
            )
            stretch = back[at, 13]
        else:  # as `ExactTurn`
            twirl, a, b, c = back[at, 1], back[at, 2], back[at, 3], back[at, 4]
            size = math.sqrt(x * x + y * y + z * z)
            upright = back[at, 0] == 1.0
            m = (size + far) * (abs(twirl) + math.sqrt(a * a + b * b + c * c))
            across = (size + far) * math.sqrt(a * a + (b * b if upright else c * c))
            stretch = (m + math.sqrt(m * m + 4.0 + 4.0 * across)) / 2.0
            angle = twirl * size + a * x + b * y + c * z
            cos, sin = math.cos(angle), math.sin(angle)
            if upright:
                x, y = cos * x + sin * y, cos * y - sin * x
            else:
                x, z = cos * x + sin * z, cos * z - sin * x
        rate, far = rate * stretch, far * stretch
    return x, y, z, rate, reach


@compiled
def body_distance(
    rows: Array, back: Array, grids: Array, i: int, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """World distance of an object at a world point, how fast it changes, and how far that holds."""
    x, y, z, rate, reach = own_point(rows, back, i, x, y, z)
    d = leaf_distance(int(rows[i, 21]), x, y, z, grids)
    at = 24
    while at < 33 and rows[i, at] > 0.0:
        kind, a, b = rows[i, at], rows[i, at + 1], rows[i, at + 2]
        if kind == _GROW:
            d -= a
        elif kind == _SHELL:
            d = abs(d) - a
        else:
            d += a * math.sin(b * x) * math.sin(b * y) * math.sin(b * z)
        at += 3
    return d * rows[i, 13], rate, reach


@compiled
def blend(op: int, k: float, a: float, b: float) -> tuple[float, float]:
    """Distance behind an operand of distance ``b``, and the share of its colour."""
    if op == UNION:
        return min(a, b), 1.0 if b < max(a, 0.0) else 0.0
    if op == SMOOTH:
        h = min(max(0.5 + 0.5 * (a - b) / k, 0.0), 1.0)
        return a * (1 - h) + b * h - k * h * (1 - h), h
    b = -b if op == SUBTRACT else b
    if k == 0.0:
        return max(a, b), 0.0
    h = min(max(0.5 + 0.5 * (b - a) / k, 0.0), 1.0)
    return a * (1 - h) + b * h + k * h * (1 - h), 0.0


@compiled
def folded(code: Array, width: Array, d: Array, stack: Array) -> tuple[float, float, int]:
    """Distance, how near another material may be inside, and whose material holds, by distances (N,)."""
    top = -1
    for at in range(len(code)):
        i = code[at]
        if i >= 0:
            top += 1
            stack[top, 0], stack[top, 1], stack[top, 2] = d[i], abs(d[i]), i
            continue
        a, b = stack[top - 1, 0], stack[top, 0]
        near = min(stack[top - 1, 1], stack[top, 1])
        value, share = blend(-1 - i, width[at], a, b)
        if -1 - i == SMOOTH:
            near = min(near, abs(a - b) / 2)
        stack[top - 1, 0], stack[top - 1, 1] = value, near
        if share > 0.5:
            stack[top - 1, 2] = stack[top, 2]
        top -= 1
    if top < 0:
        return FAR, FAR, 0
    return stack[0, 0], stack[0, 1], int(stack[0, 2])


@compiled
def distances(field: Field, x: float, y: float, z: float, d: Array) -> None:
    """Write the distances (N,) of all objects at a world point; of those that cannot matter `FAR`."""
    rows = field.rows
    for i in range(len(d)):
        a = rows[i, 0] * x + rows[i, 1] * y + rows[i, 2] * z + rows[i, 3] - rows[i, 17]
        b = rows[i, 4] * x + rows[i, 5] * y + rows[i, 6] * z + rows[i, 7] - rows[i, 18]
        c = rows[i, 8] * x + rows[i, 9] * y + rows[i, 10] * z + rows[i, 11] - rows[i, 19]
        d[i] = FAR
        if a * a + b * b + c * c < rows[i, 20] * rows[i, 20]:
            d[i] = body_distance(rows, field.back, field.grids, i, x, y, z)[0]


@compiled
def slope(
    field: Field, who: int, x: float, y: float, z: float, d: Array, stack: Array
) -> tuple[float, float, float]:
    """The unit normal at a world point, by differences; of an element's surface over a cell of its grid."""
    grid = field.rows[who, 21] >= len(SOLIDS)
    step = field.rows[who, 13] / (field.grids.shape[1] - 1) if grid else _SLOPE
    g = (0.0, 0.0, 0.0)
    for axis in range(3):
        a, b, c = step * (axis == 0), step * (axis == 1), step * (axis == 2)
        distances(field, x + a, y + b, z + c, d)
        high = folded(field.code, field.width, d, stack)[0]
        distances(field, x - a, y - b, z - c, d)
        rise = high - folded(field.code, field.width, d, stack)[0]
        if axis == 0:
            g = (rise, 0.0, 0.0)
        elif axis == 1:
            g = (g[0], rise, 0.0)
        else:
            g = (g[0], g[1], rise)
    size = max(math.sqrt(g[0] ** 2 + g[1] ** 2 + g[2] ** 2), 1e-300)
    return g[0] / size, g[1] / size, g[2] / size


@compiled
def colours(w: World, x: float, y: float, z: float, d: Array, stack: Array, out: Array) -> int:
    """Write colour and glow (6,) at a world point; return whose material holds."""
    distances(w.field, x, y, z, d)
    code, width, look, top = w.field.code, w.field.width, w.look, -1
    for at in range(len(code)):
        i = code[at]
        if i >= 0:
            top += 1
            stack[top, 0], stack[top, 2] = d[i], i
            for c in range(6):
                stack[top, 3 + c] = look[i, c]
            if w.worn[i, 0] >= 0.0 and d[i] < FAR:
                _textured(w, i, x, y, z, stack[top])
            continue
        stack[top - 1, 0], share = blend(-1 - i, width[at], stack[top - 1, 0], stack[top, 0])
        if share > 0.5:
            stack[top - 1, 2] = stack[top, 2]
        for c in range(3, 9):
            stack[top - 1, c] += share * (stack[top, c] - stack[top - 1, c])
        top -= 1
    for c in range(6):
        out[c] = stack[0, 3 + c]
    return int(stack[0, 2])


@compiled
def _textured(w: World, i: int, x: float, y: float, z: float, row: Array) -> None:
    """Write an object's colour at a world point, bilinear between texels of period 2."""
    x, y, z, _, _ = own_point(w.field.rows, w.field.back, i, x, y, z)
    m = w.worn[i]
    picture = w.pictures[int(m[0])]
    size = picture.shape[0]
    u = ((m[1] * x + m[2] * y + m[3] + 1) / 2 * size - 0.5) % size
    v = ((m[4] * x + m[5] * y + m[6] + 1) / 2 * size - 0.5) % size
    i, j = int(u), int(v)
    u, v = u - i, v - j
    for c in range(3):
        low = picture[j % size, i % size, c] * (1 - u) + picture[j % size, (i + 1) % size, c] * u
        high = picture[(j + 1) % size, i % size, c] * (1 - u) + picture[(j + 1) % size, (i + 1) % size, c] * u
        row[3 + c] = low * (1 - v) + high * v


def scratch(w: World) -> tuple[Array, Array, Array]:
    """Room for one thread: distances (N,), the stack of a fold, spans (3, N) of a ray in objects' balls."""
    count = len(w.look)
    return np.empty(count), np.empty((count + 1, 9)), np.empty((3, count))


def asked(w: World, points: Sequence[Sequence[float]] | Array) -> tuple[Array, Array, Array]:
    """Distance (M,), whose material holds (M,), colour and glow (M, 6) at world points (M, 3)."""
    d, stack, _ = scratch(w)
    distance, who, rgb = np.empty(len(points)), np.empty(len(points), np.int64), np.empty((len(points), 6))
    for at, (x, y, z) in enumerate(np.asarray(points, np.float64)):
        who[at] = colours(w, x, y, z, d, stack, rgb[at])
        distance[at] = folded(w.field.code, w.field.width, d, stack)[0]
    return distance, who, rgb
