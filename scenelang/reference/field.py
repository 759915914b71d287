"""The exact field: points of the world to distance and colour, through the chains and folds of a graph.

Works on numpy arrays and torch tensors alike: only names that both offer are used, so that training makes its
data on any device by the formulas of the reference image. Points are one array (d, …), or a sequence of its d
coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache, reduce
from operator import add, mul
from typing import Any

import numpy as np
import numpy.typing as npt

from scenelang.graph.geometries import GEOMETRIES, namespace
from scenelang.graph.nodes import Leaf, Node
from scenelang.graph.steps import Affine, Step, Warp
from scenelang.reference.textures import colour_at
from scenelang.words import BLEND, TOKENS

Array = Any  # numpy array or torch tensor

Brought = Mapping[str, Any]
"""True shapes of elements by geometry: each answers points (M, d) of the leaf's own space with signed
``distances`` (M,), and in space with their gradients ``slopes`` (M, 3)."""


def leaf_distance(geometry: str, p: Array, brought: Brought | None = None) -> Array:
    """Exact Euclidean signed distance of a leaf in its own space; raises KeyError if unknown.

    Args:
        p: points in leaf units, (d, …).
        brought: shapes of elements, whose points are (d, M).
    """
    if brought and geometry in brought:
        return brought[geometry].distances(np.transpose(p))
    return GEOMETRIES[geometry].distance(p)


def fold(
    distances: Iterable[Array], colours: Iterable[Array], tokens: Iterable[Array]
) -> Iterator[tuple[Array, Array]]:
    """Yield (D, C) after each object.

    Args:
        distances: world distances d of the objects, each of shape S.
        colours: colours c, each of a shape that broadcasts against (*S, 3).
        tokens: each a number, or an array that broadcasts against S.
    """
    big_d = c_now = None
    for d, c, token in zip(distances, colours, tokens, strict=True):
        if big_d is None:
            big_d, c_now = d, c
        else:
            big_d, c_now = combine(big_d, c_now, d, c, token)
        yield big_d, c_now


def combine(
    big_d: Array, big_c: Array, d: Array, c: Array, token: Array, k: float = 0.0
) -> tuple[Array, Array]:
    """One step of the fold; see `fold` for shapes. k is the width of a blend, 0 for the usual one."""
    xp = namespace(d)
    if isinstance(token, int):
        return _STEPS[token](xp, big_d, big_c, d, c, k)
    out_d, out_c = big_d, big_c
    for value, step in enumerate(_STEPS):
        new_d, new_c = step(xp, big_d, big_c, d, c, k)
        chosen = token == value
        out_d = xp.where(chosen, new_d, out_d)
        out_c = xp.where(chosen[..., None], new_c, out_c)
    return out_d, out_c


def _union(xp: Any, big_d: Array, big_c: Array, d: Array, c: Array, k: float) -> tuple[Array, Array]:
    over = d < xp.clip(big_d, 0.0, None)
    return xp.minimum(big_d, d), xp.where(over[..., None], c, big_c)


def _smooth(xp: Any, big_d: Array, big_c: Array, d: Array, c: Array, k: float) -> tuple[Array, Array]:
    k = k or BLEND
    h = xp.clip(0.5 + 0.5 * (big_d - d) / k, 0.0, 1.0)
    mixed = big_c + (c - big_c) * h[..., None]
    # each side by its own share: a difference of the two would swallow the nearer one's digits
    return big_d * (1 - h) + d * h - k * h * (1 - h), mixed


def _subtract(xp: Any, big_d: Array, big_c: Array, d: Array, c: Array, k: float) -> tuple[Array, Array]:
    return _cut(xp, big_d, -d, k), big_c


def _intersect(xp: Any, big_d: Array, big_c: Array, d: Array, c: Array, k: float) -> tuple[Array, Array]:
    return _cut(xp, big_d, d, k), big_c


def _cut(xp: Any, big_d: Array, d: Array, k: float) -> Array:
    if not k:
        return xp.maximum(big_d, d)
    h = xp.clip(0.5 - 0.5 * (d - big_d) / k, 0.0, 1.0)  # the share of what is cut
    return d + (big_d - d) * h + k * h * (1 - h)


_STEPS = (_union, _smooth, _subtract, _intersect)


Floats = npt.NDArray[np.float64]


def map_back(frame: Array, p: Array) -> list[Array]:
    """Points (d, …) through the inverse of an affine map, as d rows of d factors and a shift."""
    return [reduce(add, map(mul, row, p)) + row[-1] for row in frame]


def warp_back(twirl: Array, bend: Sequence[Array], p: Array) -> list[Array]:
    """``p -> R(twirl |p| + bend . p) p`` with ``R(a) p = (cos a x + sin a y, -sin a x + cos a y, …)``."""
    x, y, *others = p
    xp = namespace(x)
    angle = reduce(add, map(mul, bend, p), twirl * xp.sqrt(reduce(add, (c * c for c in p))))
    cos, sin = xp.cos(angle), xp.sin(angle)
    return [cos * x + sin * y, cos * y - sin * x, *others]


def carry_back(steps: Sequence[Step], p: Array) -> Array:
    """World points (d, M) to leaf coordinates: from the last step to the first."""
    for step in reversed(steps):
        if isinstance(step, Affine):
            p = map_back(frame_back(step, len(p)), p)
        elif isinstance(step, Warp):
            p = warp_back(step.twirl, step.bend, p)
    return p


@lru_cache(maxsize=1 << 12)
def frame_back(step: Affine, dimension: int) -> Floats:
    """The inverse of an affine map, as d rows of d factors and a shift."""
    inverse = np.linalg.inv(_linear(step, dimension))
    shift = -inverse @ np.reshape(step.rows, (3, 4))[:dimension, 3]
    return np.column_stack([inverse, shift])


def _linear(step: Affine, dimension: int) -> Floats:
    return np.reshape(step.rows, (3, 4))[:dimension, :dimension]


@lru_cache(maxsize=1 << 12)
def distance_scale(steps: tuple[Step, ...], dimension: int = 2) -> float:
    """The smallest singular value of the linear part of the affine steps composed in order."""
    linear = np.eye(dimension)
    for step in steps:
        if isinstance(step, Affine):
            linear = _linear(step, dimension) @ linear
    return float(np.linalg.svd(linear, compute_uv=False)[-1])


def evaluate(
    node: Node,
    p: Array,
    outer: tuple[Step, ...] = (),
    *,
    owners: bool = False,
    brought: Brought | None = None,
) -> tuple[Any, Any]:
    """Distance D (M,) and colour C (M, 3) of a node at world points.

    Args:
        p: world points (d, M), float64.
        outer: steps of the folds around it, nearest first.
        owners: in place of the colour the number (M, 1) of the object that paints; in a blend the nearer one.
        brought: shapes of elements.
    """
    steps = (*(move.step for move in node.moves), *outer)
    if isinstance(node, Leaf):
        q = carry_back(steps, p)
        d = leaf_distance(node.geometry, q, brought) * distance_scale(steps, len(p))
        if node.look.element is not None and not owners:
            return d, colour_at(node.look, carry_back(node.look.texture, q[: node.look.element.dimension]))
        paint = np.asarray((node.number,) if owners else node.look.colour(), np.float64)
        return d, np.broadcast_to(paint, (*d.shape, len(paint)))
    big_d, big_c = np.full(p[0].shape, np.inf), np.zeros((*p[0].shape, 1 if owners else 3))
    for index, link in enumerate(node.links):
        d, c = evaluate(link.node, p, steps, owners=owners, brought=brought)
        if index == 0:
            big_d, big_c = d, c
        else:
            # nothing blends with the empty set, which is infinitely far from everywhere
            empty = np.isinf(big_d).all() or np.isinf(d).all()
            token = TOKENS["union" if empty and link.op == "smooth" else link.op]
            width = 0.0 if empty else link.width
            with np.errstate(invalid="ignore"):
                if owners:
                    big_d, share = combine(big_d, 0.0 * c, d, 0.0 * c + 1.0, token, width)
                    big_c = np.where(share > 0.5, c, big_c)
                else:
                    big_d, big_c = combine(big_d, big_c, d, c, token, width)
    return big_d, big_c
