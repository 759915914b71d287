"""The fold of many streams at once, whose objects join by tokens of their own; numpy arrays or tensors."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from scenelang.compiler.geometries import namespace
from scenelang.drawing.exact.field import Array, combine
from scenelang.language.words import TOKENS


def fold(
    distances: Iterable[Array], colours: Iterable[Array], tokens: Iterable[Array]
) -> Iterator[tuple[Array, Array]]:
    """Yield (D, C) after each object, of distances of shape S; colours broadcast against (*S, 3)."""
    big_d = c_now = None
    for d, c, token in zip(distances, colours, tokens, strict=True):
        if big_d is None:
            big_d, c_now = d, c
        else:
            big_d, c_now = _combined(big_d, c_now, d, c, token)
        yield big_d, c_now


def _combined(big_d: Array, big_c: Array, d: Array, c: Array, token: Array) -> tuple[Array, Array]:
    xp, out_d, out_c = namespace(d), big_d, big_c
    for value in TOKENS.values():
        new_d, new_c = combine(big_d, big_c, d, c, value)
        chosen = token == value
        out_d = xp.where(chosen, new_d, out_d)
        out_c = xp.where(chosen[..., None], new_c, out_c)
    return out_d, out_c
