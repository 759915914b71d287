"""What becomes of a mesh: the smallest pyramid that is as near as asked."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("igl")
trimesh = pytest.importorskip("trimesh")

from scenelang.drawing.exact.mesh import Mesh, mesh_of
from scenelang.inverse import grids
from scenelang.inverse.grids import fit, measured
from tests.assets.shapes import element, torus


@pytest.fixture(scope="module")
def ring() -> Mesh:
    made = trimesh.creation.torus(0.7, 0.3, major_sections=96, minor_sections=48)  # about z
    vertices = np.asarray(made.vertices)[:, [1, 2, 0]]
    return mesh_of(vertices, np.asarray(made.faces, np.int64))


def test_errors_are_those_of_the_shape(ring: Mesh) -> None:
    """A true torus lies as far from the mesh of one as chords lie from arcs."""
    rung = measured(element(torus, levels=5), *ring.surface(5000))
    assert 0.0001 < rung.error < 0.0006
    larger = measured(element(lambda *p: torus(*p) - 0.01, levels=5), *ring.surface(5000))
    assert larger.error == pytest.approx(0.01, abs=0.001)


def test_the_first_that_is_near_enough_is_kept(ring: Mesh) -> None:
    loose, tried = fit(ring, "ring", max_error=2e-3)
    near, more = fit(ring, "ring", max_error=5e-4)
    assert near.about["error"] <= 5e-4 < loose.about["error"] <= 2e-3  # type: ignore[operator]
    assert len(loose.data) < len(near.data) < 6000
    assert [rung.side for rung in more[: len(tried)]] == [rung.side for rung in tried]
    assert more == sorted(more, key=lambda rung: rung.side)


def test_the_same_steps_give_the_same_bytes(ring: Mesh) -> None:
    made = [fit(ring, "ring", max_error=1e-9, steps=3, budget_s=b)[0] for b in (1e-9, 1e9)]
    assert made[0].data == made[1].data
    assert made[0].about["steps"] == 3


def test_what_would_take_too_long_is_not_begun(ring: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was reached till then is kept; steps that are asked for are tried all the same."""
    monkeypatch.setattr(grids, "LONG_S", 0.0)
    ended = [fit(ring, "ring", max_error=1e-9, **asked) for asked in ({}, {"steps": 2})]
    assert [element.about["ended"] for element, _ in ended] == ["time", "steps"]
    assert len(ended[0][1]) == 1


def test_only_what_is_lost_is_too_thin() -> None:
    """Edges are rounded by less than a cell; fins fall between nodes, or have no inside to ask for."""
    box, ball = trimesh.creation.box((1, 1, 1)), trimesh.creation.icosphere(3, 0.5)
    solids = [(box, False), (ball, False)]
    for thick in (0.001, 0.006):
        fin = trimesh.creation.box((2, thick, 0.4))
        fin.apply_transform(trimesh.transformations.rotation_matrix(0.4, (1, 0, 2)))
        solids.append((trimesh.util.concatenate([ball, fin]), True))
    for solid, lost in solids:
        mesh = mesh_of(np.asarray(solid.vertices, float), np.asarray(solid.faces, np.int64))
        thin = fit(mesh, "x", max_error=1e-9, steps=5)[1][-1].thin
        assert thin > grids.THIN if lost else thin < 0.001
