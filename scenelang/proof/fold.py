"""Intervals through the exact fold: what regions of the plane show for certain, whoever draws them.

The formulas are those of `scenelang.reference.field`. The state is monotonic in both distances, so the ends
of its interval come of theirs.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.renderers.meetings import Index, Meetings
from scenelang.words import TOKENS

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
UNION, SMOOTH, SUBTRACT, INTERSECT = (TOKENS[word] for word in ("union", "smooth", "subtract", "intersect"))
NOTHING = 1e200  # world units: the distance before the first object, beyond all blends


class Enclosure(NamedTuple):
    """Numbers from ``low`` to ``high``."""

    low: Floats
    high: Floats


class Enclosed(NamedTuple):
    """What is certain of regions.

    Args:
        shown: channels (K, B).
        left: (P,) objects that may change what is shown.
    """

    shown: Enclosure
    left: Mask


def enclosed(
    meetings: Meetings, distance: Enclosure, colour: Enclosure, tokens: Index, widths: Floats, behind: Floats
) -> Enclosed:
    """Fold the enclosed distances of the objects that regions meet.

    Args:
        distance: world distances of the pairs (P,), wherever in the region.
        colour: of the pairs (3, P).
        tokens, widths: of the pairs (P,), the latter of blends.
        behind: (K,) what is shown where nothing is: a background, or four zeros.
    """
    count = len(meetings.columns)
    low, high = np.full((2, count), NOTHING)
    first, last = np.zeros((2, 3, count))
    shut, opened = np.empty((2, len(tokens)), bool)
    blended = _blended(meetings, tokens)
    for part in meetings.slots():
        n, token = part.stop - part.start, tokens[part]
        k, d, e = widths[part], distance.low[part], distance.high[part]
        a, b = low[:n].copy(), high[:n].copy()
        free = ~blended[part]  # no blend follows: what is outside, and how deep inside the rest, is all one
        union = token == UNION
        # the object's share of the colour; of a union all or none
        some = union & ((e < np.maximum(a, 0.0)) | (free & (a >= 0.0)))
        most = union & (some | ((d < np.maximum(b, 0.0)) & ~(free & (d >= 0.0))))
        shares: tuple[Floats, Floats] = some.astype(float), most.astype(float)
        ends = np.minimum(a, d), np.minimum(b, e)
        closed, wide = d >= np.where(free, 0.0, np.maximum(b, 0.0)), e < np.where(free, 0.0, a)
        if (which := token == SMOOTH).any():
            blend = _blend(a, e, k)[0], _blend(b, d, k)[0]
            shares = _chosen(which, blend, shares)
            ends = _chosen(which, (_blend(a, d, k)[1], _blend(b, e, k)[1]), ends)
            closed, wide = _chosen(which, (blend[1] <= 0, blend[0] >= 1), (closed, wide))
        for operator, (near, far) in ((SUBTRACT, (-e, -d)), (INTERSECT, (d, e))):
            if (which := token == operator).any():
                ends = _chosen(which, (np.maximum(a, near), np.maximum(b, far)), ends)
                closed = np.where(which, (far <= a) | (free & (far < 0.0)), closed)
                wide &= ~which
        low[:n], high[:n] = ends
        shut[part], opened[part] = closed, wide
        for side, choose, own in ((first, np.minimum, colour.low), (last, np.maximum, colour.high)):
            more = own[:, part] - side[:, :n]
            side[:, :n] += choose(shares[0] * more, shares[1] * more)
    if len(behind) > 3:
        first, last = (np.vstack([c, np.ones(count)]) for c in (first, last))
    back = behind[:, None]
    shown = Enclosure(
        np.where(high < 0, first, np.where(low < 0, np.minimum(first, back), back)),
        np.where(high < 0, last, np.where(low < 0, np.maximum(last, back), back)),
    )
    hidden = np.zeros(count, bool)
    for part in reversed(meetings.slots()):
        n = part.stop - part.start
        shut[part] |= hidden[:n]
        hidden[:n] |= opened[part]
    return Enclosed(shown, ~shut)


def _chosen(which: Mask, new: tuple[Any, Any], old: tuple[Any, Any]) -> tuple[Any, Any]:
    return np.where(which, new[0], old[0]), np.where(which, new[1], old[1])


def _blended(meetings: Meetings, tokens: Index) -> Mask:
    """After which pairs (P,) a blend follows in their region."""
    found, seen = np.empty(len(tokens), bool), np.zeros(len(meetings.columns), bool)
    for part in reversed(meetings.slots()):
        n = part.stop - part.start
        found[part] = seen[:n]
        seen[:n] |= tokens[part] == SMOOTH
    return found


def _blend(big: Floats, d: Floats, k: Floats) -> tuple[Floats, Floats]:
    """The share of the object's colour, and the state behind a smooth union."""
    with np.errstate(over="ignore"):
        h = np.clip(0.5 + 0.5 * (big - d) / k, 0.0, 1.0)
    return h, big * (1 - h) + d * h - k * h * (1 - h)
