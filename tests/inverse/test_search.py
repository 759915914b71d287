"""The search on residuals in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from scenelang.inverse import search
from scenelang.inverse.search import Axis, Found, Knob, SearchBox


def box(*wraps: bool) -> SearchBox:
    axes = tuple(Axis(f"p{at}", wraps=one) for at, one in enumerate(wraps))
    return SearchBox([Knob(None, 0.0, axes, True)])  # type: ignore[arg-type]


def narrow(u: np.ndarray) -> np.ndarray:
    """A bent valley whose floor hardly falls."""
    return np.array([30 * (u[1] - u[0] ** 2), 0.02 * (u[0] - 0.8)])


def two_things(u: np.ndarray) -> np.ndarray:
    """Two things in one picture, each with a valley at 0.2 that is not the one at 0.8."""
    each = np.where(u < 0.5, 0.1 + abs(u - 0.2), abs(u - 0.8))
    return np.append(each, 0.0)


def test_central_differences_are_those_of_a_closed_form() -> None:
    u = np.array([0.3, 0.9])
    exact = [[-60 * 0.3, 30], [0.02, 0]]
    assert search.central(narrow, box(False, False), u, 0.05, np.array([True, True])) == pytest.approx(
        np.array(exact), abs=1e-9
    )
    off = search.slopes(narrow, box(False, False), u, narrow(u), 0.05, np.array([True, True])) - exact
    assert abs(off).max() > 1


def test_a_fine_descent_ends_where_a_coarse_one_is_drawn_aside() -> None:
    """What never comes to nothing draws forward differences aside, here by as much as half a step."""

    def residuals(u: np.ndarray) -> np.ndarray:
        return np.array([0.1 * (u[0] - 0.8), 0.3 + 2 * (u[0] - 0.8) ** 2])

    def worst(fine: bool) -> float:
        starts = (np.array([u]) for u in (0.2, 0.3, 0.4, 0.5, 0.6, 0.7))
        ends = (search.descend(residuals, box(False), u, step=0.05, fine=fine) for u in starts)
        return max(abs(end.point[0] - 0.8) for end in ends if end is not None)

    assert worst(fine=True) < 0.004 < 0.015 < worst(fine=False)


def test_a_scan_names_the_other_valley_of_each_axis() -> None:
    for wraps in (False, True):
        known = Found(np.array([0.8, 0.2]), 0.01)
        found = search.scanned(two_things, box(wraps, wraps), known)
        best = min(found, key=lambda one: one.cost)
        assert best.point == pytest.approx([0.8, 0.8], abs=1 / search.SCANS)
        assert all(np.count_nonzero(one.point != known.point) == 1 for one in found)
