"""The boolean fold of the exact image: (distance D, colour C) over a stream of objects."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from scenelang.graph.nodes import BLEND
from scenelang.reference.leaves import Array, namespace


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
    big_d: Array, big_c: Array, d: Array, c: Array, token: Array, k: float = BLEND
) -> tuple[Array, Array]:
    """One step of the fold; see `fold` for shapes. k is the width of a blend."""
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
    h = xp.clip(0.5 + 0.5 * (big_d - d) / k, 0.0, 1.0)
    mixed = big_c + (c - big_c) * h[..., None]
    return big_d + (d - big_d) * h - k * h * (1 - h), mixed


def _subtract(xp: Any, big_d: Array, big_c: Array, d: Array, c: Array, k: float) -> tuple[Array, Array]:
    return xp.maximum(big_d, -d), big_c


def _intersect(xp: Any, big_d: Array, big_c: Array, d: Array, c: Array, k: float) -> tuple[Array, Array]:
    return xp.maximum(big_d, d), big_c


_STEPS = (_union, _smooth, _subtract, _intersect)
