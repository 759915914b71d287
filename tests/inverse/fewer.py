"""Elements of solids made soon."""

from __future__ import annotations

import pytest

from scenelang.inverse import grids, sandbox

POINTS = 10_000


def settle_by_fewer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Settle grids of solids on a twentieth of the points, also in the process that reads files."""
    monkeypatch.setitem(grids.SETTLED, 3, POINTS)
    more = f"from scenelang.inverse import grids\ngrids.SETTLED[3] = {POINTS}\nsandbox.serve"
    monkeypatch.setattr(sandbox, "_CODE", sandbox._CODE.replace("sandbox.serve", more))
