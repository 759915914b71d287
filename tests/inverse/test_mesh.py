"""Meshes: what is read, how it is put into the ball, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("igl")
trimesh = pytest.importorskip("trimesh")

from scenelang.drawing.exact.mesh import FitError, Sign, mesh_of, read_solids, whole


def arrays(mesh: Any) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)


def box(*sides: float) -> Any:
    return trimesh.creation.box(sides)


def box_distance(p: np.ndarray, half: np.ndarray) -> np.ndarray:
    q = abs(p) - half
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(1), 0)


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl", "glb"])
def test_each_format_gives_the_solid_in_the_unit_ball(suffix: str, tmp_path: Path) -> None:
    made = box(4, 2, 1)
    made.apply_translation([100, 20, -3])
    made.export(tmp_path / f"box.{suffix}")
    mesh = whole(read_solids((tmp_path / f"box.{suffix}").read_bytes(), f".{suffix}")[0])
    size = np.linalg.norm([2, 1, 0.5])
    assert mesh.centre == pytest.approx((100, 20, -3))
    assert mesh.size == pytest.approx(size)
    p = np.random.default_rng(0).uniform(-1, 1, (500, 3))
    np.testing.assert_allclose(mesh.distances(p), box_distance(p, np.array([2, 1, 0.5]) / size), atol=1e-6)


@pytest.mark.parametrize("sign", ["closed", "winding", "auto"])
@pytest.mark.parametrize("inside_out", [False, True])
def test_inside_out_is_turned(sign: Sign, inside_out: bool) -> None:
    made = box(1, 1, 1)
    if inside_out:
        made.invert()
    mesh = mesh_of(*arrays(made), sign)
    points, normals, _ = mesh.surface(300)
    assert (mesh.distances(points * 0.9) < 0).all()
    assert (mesh.distances(points * 1.1) > 0).all()
    assert ((points * normals).sum(1) > 0).all()


def test_of_solids_that_overlap_the_outside_counts() -> None:
    one, two = trimesh.creation.icosphere(3), trimesh.creation.icosphere(3)
    two.apply_translation([0.9, 0, 0])
    mesh = mesh_of(*arrays(trimesh.util.concatenate([one, two])))
    assert not mesh.closed
    assert mesh.distances(np.zeros((1, 3)))[0] < 0
    points, *_ = mesh.surface(2000)
    ball = np.linalg.norm(points * mesh.size + [0.45, 0, 0], axis=1)
    assert (ball > 0.98).all()  # none inside the other


def test_an_open_surface_closes_itself() -> None:
    ball = trimesh.creation.icosphere(3)
    ball.update_faces(ball.triangles_center[:, 2] < 0.8)
    mesh = mesh_of(*arrays(ball))
    assert mesh.distances(np.array([[0, 0, 0.0], [0, 0, 0.97]])) == pytest.approx([-0.95, 0.3], abs=0.35)
    with pytest.raises(FitError, match="not closed"):
        mesh_of(*arrays(ball), "closed")


def test_what_is_there_many_times_counts_once() -> None:
    """Where many triangles lie at one place, each of them is asked for every point near it."""
    vertices, triangles = arrays(box(1, 1, 1))
    turned = [np.roll(triangles, k, 1) for k in range(3)] * 20
    mesh = mesh_of(vertices, np.concatenate([*turned, triangles[:, ::-1]]))
    assert len(mesh.triangles) == 24
    assert any(note.startswith("708 repeated triangles left out") for note in mesh.notes)


SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])


def test_what_is_no_solid() -> None:
    for vertices, triangles, words in (
        (SQUARE, [], "no triangles"),
        (SQUARE * np.nan, [[0, 1, 2]], "not finite"),
        (SQUARE, [[0, 1, 4]], "corner that it does not hold"),
        (SQUARE, [[0, 1, -1]], "corner that it does not hold"),
        (SQUARE * 1e200, [[0, 1, 2]], "not finite"),
        (SQUARE * 0 + 7, [[0, 1, 2]], "at one point"),
        (SQUARE, [[0, 1, 1]], "flat"),
        (SQUARE, [[0, 1, 2], [0, 2, 3]], "encloses no solid"),
        (*arrays(box(2, 2, 1e-4)), "encloses no solid"),
    ):
        with pytest.raises(FitError, match=words):
            mesh_of(vertices, np.asarray(triangles, np.int64).reshape(-1, 3)).surface(100)


def test_damaged_files() -> None:
    for suffix, data, words in (
        (".obj", b"", "no triangles|damaged"),
        (".obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "damaged"),
        (".stl", bytes(200), "no triangles|damaged"),
        (".glb", b"glTF" + b"\xff" * 100, "damaged"),
        (
            ".ply",
            b"ply\nformat ascii 1.0\nelement vertex 1000000000\nproperty float x\nend_header\n",
            "damaged",
        ),
    ):
        with pytest.raises(FitError, match=words):
            whole(read_solids(data, suffix)[0])
