"""The picture of a Scene by the letter of docs/language.md, slowly: no matrix is ever composed ahead.

A tree is evaluated as it stands: a leaf's distance at world points, booleans and groups folded from the left
over their children's (distance, colour). `stream_picture` does the same for the rows that the compiler
made. Neither shares code with scenelang.compiler.
"""

from __future__ import annotations

import numpy as np

from scenelang.compiler.graph import Graph
from scenelang.compiler.steps import Affine
from scenelang.language import scene as schema

K = 0.15


def corners(name: str) -> np.ndarray:
    """Corners (n, 2) of a leaf, counter-clockwise."""
    if name == "square":
        h = 1 / np.sqrt(2)
        return np.array([[h, h], [-h, h], [-h, -h], [h, -h]])
    count = {"triangle": 3, "pentagon": 5, "star": 10}[name]
    turn = np.pi / 2 + 2 * np.pi * np.arange(count) / count
    radius = np.where(np.arange(count) % 2, 0.381966, 1.0) if name == "star" else np.ones(count)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)


def polygon_distance(points: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Signed distance (P,) of points (P, 2) to a closed ring, negative inside (even-odd rule)."""
    nearest = np.full(len(points), np.inf)
    inside = np.zeros(len(points), dtype=bool)
    for (ax, ay), (bx, by) in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        t = ((points[:, 0] - ax) * (bx - ax) + (points[:, 1] - ay) * (by - ay)) / (
            (bx - ax) ** 2 + (by - ay) ** 2
        )
        t = np.clip(t, 0, 1)
        gap = np.hypot(points[:, 0] - ax - t * (bx - ax), points[:, 1] - ay - t * (by - ay))
        nearest = np.minimum(nearest, gap)
        if ay != by:
            crosses = (ay > points[:, 1]) != (by > points[:, 1])
            inside ^= crosses & (points[:, 0] < ax + (points[:, 1] - ay) * (bx - ax) / (by - ay))
    return np.where(inside, -nearest, nearest)


def turn_back(points: np.ndarray, twirl: float, bend: tuple[float, float]) -> np.ndarray:
    """p -> R(twirl |p| + bend . p) p."""
    angle = twirl * np.hypot(points[:, 0], points[:, 1]) + bend[0] * points[:, 0] + bend[1] * points[:, 1]
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * points[:, 0] + s * points[:, 1], -s * points[:, 0] + c * points[:, 1]], axis=1)


def linear(transform: schema.Transform) -> tuple[np.ndarray, np.ndarray] | None:
    """(2 x 2 block, shift) of an affine transform in the plane, None for a deformation."""
    block, shift = np.eye(2), np.zeros(2)
    if isinstance(transform, schema.Translate):
        shift = np.array([transform.x, transform.y])
    elif isinstance(transform, schema.Rotate):
        a = transform.angle * np.sign(transform.axis[2])
        block = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    elif isinstance(transform, schema.Scale):
        block = np.diag([transform.x, transform.y])
    elif isinstance(transform, schema.Shear):
        block["xy".index(transform.axes[0]), "xy".index(transform.axes[1])] = transform.k
    elif isinstance(transform, schema.Matrix):
        rows = np.array(transform.rows)
        block, shift = rows[:2, :2], rows[:2, 3]
    else:
        return None
    return block, shift


def chain_distance(points: np.ndarray, geometry: str, transforms: list[schema.Transform]) -> np.ndarray:
    """World distance (P,) of a leaf; transforms nearest the leaf first."""
    product = np.eye(2)
    for transform in transforms:
        map_ = linear(transform)
        if map_ is not None:
            product = map_[0] @ product
    for transform in reversed(transforms):
        map_ = linear(transform)
        if map_ is not None:
            points = np.linalg.solve(map_[0], (points - map_[1]).T).T
        elif isinstance(transform, schema.Twirl):
            points = turn_back(points, transform.k, (0.0, 0.0))
        else:
            assert isinstance(transform, schema.Bend)
            points = turn_back(points, 0.0, (transform.k, 0.0))
    scale = np.linalg.svd(product, compute_uv=False)[-1]
    return polygon_distance(points, corners(geometry)) * scale


def combine(op, distance, colour, d, c, k=None):
    """One step of the fold: (D, C) and (d, c) to (D, C)."""
    if op == "union":
        later = d < np.maximum(distance, 0)
        return np.minimum(distance, d), np.where(later[:, None], c, colour)
    if op == "subtract":
        d = -d
    if op != "smooth":
        return np.maximum(distance, d) if not k else -blended(-distance, -d, k)[0], colour
    distance, h = blended(distance, d, k or K)
    h = h[:, None]
    return distance, colour * (1 - h) + c * h


def blended(distance, d, k):
    """D behind a blend, and the share of the later operand."""
    with np.errstate(invalid="ignore"):
        h = np.clip(0.5 + 0.5 * (distance - d) / k, 0, 1)
        # An empty operand is at infinity, where the mix has no value but the limit does.
        h = np.where(np.isnan(h), 0.5, h)
        found = distance + (d - distance) * h - k * h * (1 - h)
    return np.where(h == 1, d, np.where(h == 0, distance, found)), h


def colour_of(material: schema.Material | None) -> np.ndarray:
    """Constant colour of a material that only multiplies."""
    rgb = np.ones(3)
    for op in material.ops if material else ():
        rgb = np.clip(rgb * np.array(op.rgb), 0, 1)
    return rgb


def tree_picture(scene: schema.Scene, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """D (P,) and C (P, 3) of a scene at world points (P, 2)."""
    links = [("union", node, None) for node in scene.nodes]
    return _fold(links, points, [], None)


def _fold(links, points, outer, material):
    state = np.full(len(points), np.inf), np.ones((len(points), 3))
    for index, (op, node, k) in enumerate(links):
        value = _node(node, points, outer, material)
        state = value if index == 0 else combine(op, *state, *value, k)
    return state


def _node(node, points, outer, material):
    material = node.material or material
    transforms = [*node.transforms, *outer]
    if isinstance(node, schema.Object):
        d = chain_distance(points, node.geometry, transforms)
        return d, np.broadcast_to(colour_of(material), (len(points), 3))
    if isinstance(node, schema.Chain):
        links = [(link.op, link.node, link.k) for link in node.children]
    else:
        op, k = (node.op, node.k) if isinstance(node, schema.Boolean) else ("union", None)
        links = [(op, child, k) for child in node.children]
    return _fold(links, points, transforms, material)


def moved_back(points: np.ndarray, moves) -> np.ndarray:
    """World points (P, 2) in the leaf's space, through compiled moves."""
    for move in reversed(moves):
        step = move.step
        if isinstance(step, Affine):
            rows = np.array(step.rows).reshape(3, 4)
            points = np.linalg.solve(rows[:2, :2], (points - rows[:2, 3]).T).T
        else:
            points = turn_back(points, step.twirl, step.bend)
    return points


def moved_distance(points: np.ndarray, geometry: str, moves) -> np.ndarray:
    """World distance (P,) of a leaf with compiled moves."""
    product = np.eye(2)
    for move in moves:
        if isinstance(move.step, Affine):
            product = np.array(move.step.rows).reshape(3, 4)[:2, :2] @ product
    scale = np.linalg.svd(product, compute_uv=False)[-1]
    return polygon_distance(moved_back(points, moves), corners(geometry)) * scale


def stream_picture(graph: Graph, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """D (P,) and C (P, 3) of a compiled stream at world points (P, 2), with a stack of states."""
    nothing = np.full(len(points), np.inf), np.ones((len(points), 3))
    stack, waiting = [nothing], []
    for index, row in enumerate(graph.rows()):
        leaf = row.leaf
        colours = np.tile(leaf.look.colour(), (len(points), 1))
        value = moved_distance(points, leaf.geometry, leaf.moves), colours
        if row.begins:
            waiting.append((row.op, row.k))
            stack.append(value)
        else:
            stack[-1] = value if index == 0 else combine(row.op, *stack[-1], *value, row.k)
        for _ in range(row.ends):
            inner = stack.pop()
            op, k = waiting.pop()
            stack[-1] = combine(op, *stack[-1], *inner, k)
    (state,) = stack
    return state


def assert_same_picture(first, second, edge: float = 1e-9, tolerance: float = 1e-7) -> int:
    """Compare two (D, C) where neither is within ``edge`` of an edge; returns how many points are covered."""
    (d, c), (e, f) = first, second
    clear = (np.abs(d) > edge) & (np.abs(e) > edge)
    assert ((d < 0) == (e < 0))[clear].all(), "coverage differs"
    covered = clear & (d < 0)
    assert np.abs(c - f)[covered].max(initial=0.0) < tolerance, "colour differs"
    return int(covered.sum())
