"""Colours of meshes: what files say of them, looked up and brought into grids."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("igl")
trimesh = pytest.importorskip("trimesh")

from scenelang.assets.colours import unpacked
from scenelang.assets.picture import texels
from scenelang.drawing.exact.mesh import Look, Mesh, mesh_of, read_solids, white, whole
from scenelang.drawing.image import decoded, encoded
from scenelang.inverse.colours import fit_colours

PICTURE = np.random.default_rng(3).integers(0, 256, (3, 5, 3), np.uint8)
ONE = np.zeros(1, int)


def by_hand(picture: np.ndarray, u: float, v: float) -> np.ndarray:
    """A colour of a texture, v up, repeated."""
    high, wide = picture.shape[:2]
    x, y = u * wide - 0.5, (1 - v) * high - 0.5
    total = np.zeros(3)
    for row in range(-3 * high, 4 * high):
        for column in range(-3 * wide, 4 * wide):
            weight = max(0, 1 - abs(x - column)) * max(0, 1 - abs(y - row))
            total += weight * picture[row % high, column % wide]
    return total / 255


@pytest.mark.parametrize("uv", [(0.3, 0.6), (0.01, 0.99), (1.7, -0.4), (-1.2, 2.9)])
@pytest.mark.parametrize("linear", [False, True])
def test_textures_are_repeated_and_multiplied(uv: tuple[float, float], linear: bool) -> None:
    tint = np.full((1, 3, 3), 0.5, np.float32)
    corners = np.tile(np.array(uv, np.float32), (1, 3, 1))
    look = Look(tint, np.array([linear]), corners, np.zeros(1, np.int32), (PICTURE,))
    expected = by_hand(PICTURE, *uv)
    expected = encoded(0.5 * decoded(expected)) if linear else 0.5 * expected
    assert look.at(ONE, np.full((1, 3), 1 / 3))[0] == pytest.approx(expected, abs=1e-5)


def made(kind: str) -> Any:
    """A box in colours of a kind, and what the colour at its corner (½, ½, ½) is."""
    box = trimesh.creation.box()
    random = np.random.default_rng(0)
    if kind == "vertex":
        box.visual.vertex_colors = random.integers(0, 256, (8, 3), np.uint8)
    elif kind == "face":
        box.visual.face_colors = random.integers(0, 256, (12, 3), np.uint8)
    else:
        uv = box.vertices[:, :2] + 0.5
        texture = Image.fromarray(PICTURE) if kind == "texture" else None
        material = trimesh.visual.material.PBRMaterial(
            baseColorTexture=texture, baseColorFactor=None if texture else [0.5, 0.25, 0, 1]
        )
        box.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    return box


def test_what_files_say_is_what_the_surface_shows() -> None:
    for kind, suffix in (("vertex", ".ply"), ("vertex", ".glb"), ("face", ".ply"), ("texture", ".glb")):
        box = made(kind)
        solids, _ = read_solids(box.export(file_type=suffix[1:]), suffix, {})
        mesh = whole(solids)
        shares = np.random.default_rng(1).dirichlet((1, 1, 1), len(box.faces))
        points = (box.triangles * shares[..., None]).sum(1)
        found = mesh.look.at(*mesh.touched(points / mesh.size))  # type: ignore[union-attr]
        for face, (share, colour) in enumerate(zip(shares, found, strict=True)):
            if kind == "vertex":
                expected = share @ box.visual.vertex_colors[box.faces[face], :3] / 255
                expected = encoded(expected) if suffix == ".glb" else expected
            elif kind == "face":
                expected = box.visual.face_colors[face, :3] / 255
            else:
                expected = by_hand(PICTURE, *(share @ box.visual.uv[box.faces[face]]))
            assert colour == pytest.approx(expected, abs=0.01)


def test_factors_of_gltf_are_linear() -> None:
    solids, _ = read_solids(made("factor").export(file_type="glb"), ".glb", {})
    assert whole(solids).look.plain == pytest.approx(encoded(np.array([0.5, 0.25, 0])), abs=0.005)  # type: ignore[union-attr]


def striped(subdivisions: int = 4) -> Mesh:
    """A ball, red where x > 0 and else green, in smooth transition, with vertex colours."""
    ball = trimesh.creation.icosphere(subdivisions)
    red = 0.5 + 0.5 * np.tanh(3 * ball.vertices[:, 0])
    corner = np.stack([red, 1 - red, 0.2 + 0 * red], 1).astype(np.float32)
    faces = np.asarray(ball.faces, np.int64)
    look = white(len(faces))
    look = Look(corner[faces], look.linear, look.uv, look.image)
    return mesh_of(np.asarray(ball.vertices, float), faces, look=look)


def test_the_smallest_grid_that_is_near_enough_is_kept() -> None:
    tried: list[tuple[int, int, float]] = []
    element = fit_colours(striped(), "ball", max_error=0.01, report=lambda *grid: tried.append(grid))
    assert [error <= 0.01 for _, _, error in tried] == [*[False] * (len(tried) - 1), True]
    assert (element.sizes[0], len(element.data)) == tried[-1][:2]
    side = element.sizes[0]
    axis = np.linspace(-1, 1, side)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    beside = abs(np.sqrt(x * x + y * y + z * z) - 1) < 1 / side
    red = 0.5 + 0.5 * np.tanh(3 * x / np.sqrt(x * x + y * y + z * z + 1e-9))
    assert abs(unpacked(element)[0] - red)[beside].mean() < 0.02
    inside = texels(element)[side // 2, side // 2, side // 2]
    assert inside.sum() == pytest.approx(1.2, abs=0.2)  # filled from the surface, not black


def test_steps_bound_what_is_tried_and_give_the_same_bytes() -> None:
    made = [fit_colours(striped(3), "ball", max_error=1e-6, steps=2) for _ in range(2)]
    assert made[0] == made[1]
    assert made[0].sizes == (25, 255)
    late = fit_colours(striped(3), "ball", max_error=1e-6, budget_s=0)
    assert late.sizes[0] == 17


def test_textures_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scenelang.drawing.exact.mesh.MOST_PIXELS", 10)
    with pytest.raises(ValueError, match="a texture of more than 10 pixels"):
        read_solids(made("texture").export(file_type="glb"), ".glb", {})
    monkeypatch.undo()
    monkeypatch.setattr("scenelang.drawing.exact.mesh.FINEST", 2)
    solids, _ = read_solids(made("texture").export(file_type="glb"), ".glb", {})
    assert max(solids[0].look.images[0].shape) == 3  # type: ignore[union-attr]
