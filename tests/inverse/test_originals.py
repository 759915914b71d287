"""The exact picture of elements, drawn from the files that they were made from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("igl")
pytest.importorskip("svgelements")
trimesh = pytest.importorskip("trimesh")

import scenelang as nsg
from scenelang.assets.zoo import load_zoo, zoo_bytes
from scenelang.drawing.exact.mesh import mesh_of
from scenelang.drawing.exact.originals import FOLDER
from scenelang.drawing.exact.picture import reference_image
from scenelang.drawing.render import exact_graph
from scenelang.inverse.learn import LearnOptions, learn_files
from tests.pictures import psnr_db

CUBE = 3**-0.5  # half a side of the one in the unit ball
SQUARE = '<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0H10V10H0Z"/></svg>'


class Cube:
    """The cube by its formula."""

    def distances(self, p: np.ndarray) -> np.ndarray:
        q = abs(p) - CUBE
        return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(1), 0)

    def slopes(self, p: np.ndarray) -> np.ndarray:
        steps = 1e-7 * np.eye(3)
        return np.stack([(self.distances(p + e) - self.distances(p - e)) / 2e-7 for e in steps], 1)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    trimesh.creation.box((2, 2, 2)).export(tmp_path / "cube.obj")
    (tmp_path / "tile.svg").write_text(SQUARE)
    learn_files(
        [tmp_path / "cube.obj", tmp_path / "tile.svg"], tmp_path / "zoo.safetensors", LearnOptions(steps=1)
    )
    return tmp_path


def scene(folder: Path, text: str) -> nsg.Scene:
    (folder / "s.nsg").write_text(f'import "zoo.safetensors" as zoo; canvas(40, 40); {text}')
    return nsg.load(folder / "s.nsg")


def slow_nearest(p: np.ndarray, corners: np.ndarray) -> float:
    """Distance of a point to triangles (F, 3, 3): the plane's where its foot is inside, else the edges'."""
    best = np.inf
    for a, b, c in corners:
        n = np.cross(b - a, c - a)
        n /= np.linalg.norm(n)
        foot = p - n * (n @ (p - a))
        edges = [(a, b), (b, c), (c, a)]
        if all(n @ np.cross(v - u, foot - u) >= 0 for u, v in edges):
            best = min(best, abs(n @ (p - a)))
        for u, v in edges:
            share = np.clip((p - u) @ (v - u) / ((v - u) @ (v - u)), 0, 1)
            best = min(best, float(np.linalg.norm(u + share * (v - u) - p)))
    return best


def winding(p: np.ndarray, corners: np.ndarray) -> float:
    """How often triangles go round a point: their solid angles (van Oosterom and Strackee 1983)."""
    a, b, c = (corners - p).swapaxes(0, 1)
    x, y, z = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    below = x * y * z + (a * b).sum(1) * z + (b * c).sum(1) * x + (c * a).sum(1) * y
    return float(np.arctan2((a * np.cross(b, c)).sum(1), below).sum() / (2 * np.pi))


def test_distances_and_slopes_of_a_mesh() -> None:
    for sign in ("winding", "closed"):
        torus = trimesh.creation.torus(0.7, 0.3, major_sections=9, minor_sections=5)
        mesh = mesh_of(np.asarray(torus.vertices), np.asarray(torus.faces), sign)  # type: ignore[arg-type]
        p = np.random.default_rng(0).uniform(-1, 1, (60, 3))
        corners = mesh.vertices[mesh.triangles]
        slow = np.array([slow_nearest(q, corners) * (-1 if winding(q, corners) > 0.5 else 1) for q in p])
        np.testing.assert_allclose(mesh.distances(p), slow, atol=1e-12)
        steps = 1e-6 * np.eye(3)
        slopes = np.stack([(mesh.distances(p + e) - mesh.distances(p - e)) / 2e-6 for e in steps], 1)
        np.testing.assert_allclose(mesh.slopes(p), slopes, atol=1e-5)
        middle, across = corners.mean(1), np.cross(*(corners[:, i] - corners[:, 0] for i in (1, 2)))
        across /= np.linalg.norm(across, axis=1)[:, None]
        for off in (1e-7, -1e-7):  # where differences of points say nothing
            np.testing.assert_allclose(mesh.slopes(middle + off * across), across, atol=1e-6)


@pytest.mark.parametrize(
    "text",
    [
        "zoo.cube { scale(0.9, 0.7, 0.5); rotate(1rad, axis = X + Y); material diffuse { color(#c96); } } "
        "sphere { scale(0.4); translate(0.7, 0.4, 0.6); }",
        "chain { sphere { scale(0.8); material volumetric; } smooth zoo.cube { twirl(0.5); scale(0.6);"
        "  translate(0.4, 0.3, 0); material diffuse { color(#69c); } } subtract torus { scale(0.7); } }",
        "zoo.cube { displace(0.05, 8); twist(0.8); scale(0.7); material volumetric { color(#9c6); } }",
    ],
)
def test_a_cube_is_drawn_as_by_its_formula(folder: Path, text: str) -> None:
    shown = scene(folder, text)
    graph = exact_graph(shown)[0]
    exact = reference_image(graph, brought={"zoo.cube": Cube()})
    assert psnr_db(np.asarray(nsg.render(shown, backend="reference")), np.asarray(exact)) > 60
    nsg.render_outputs(shown, ["depth", "alpha"], backend="reference")


def test_an_outline_is_drawn_as_the_shape_that_it_is(folder: Path) -> None:
    moves = "{ twirl(0.7); scale(0.6, 0.4); rotate(20deg); material flat { color(#333); } }"
    drawn, exact = (
        nsg.render(
            scene(folder, f"chain {{ pentagon {{ scale(0.5); }} smooth {name} {moves} }}"),
            backend="reference",
        )
        for name in ("zoo.tile", "square")
    )
    assert psnr_db(np.asarray(drawn), np.asarray(exact)) > 55


def changed(folder: Path, **about: str | None) -> None:
    """The zoo with other words of the cube."""
    path = folder / "zoo.safetensors"
    cube = load_zoo(path).geometries["cube"]
    said = {key: value for key, value in {**cube.about, **about}.items() if value is not None}
    path.write_bytes(zoo_bytes([replace(cube, about=said)]))


def test_what_an_element_was_made_from_is_looked_for(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(words: str) -> None:
        with pytest.raises(nsg.RenderError, match=words):
            nsg.render(scene(folder, "zoo.cube { }"), backend="reference")

    other = folder / "other"
    other.mkdir()
    data = (folder / "cube.obj").read_bytes()
    (folder / "cube.obj").rename(other / "cube.obj")
    refused(rf"`zoo\.cube` was made from `cube\.obj`, which is not in `{folder}`; `--originals FOLDER` .*is$")
    monkeypatch.setenv(FOLDER, str(other))
    nsg.render(scene(folder, "zoo.cube { }"), backend="reference")
    (other / "cube.obj").write_bytes(data + b"\n")
    refused(r"another file of that name")
    changed(folder, original="../other/cube.obj")
    refused(r"which is not in")
    changed(folder, original=None)
    refused(r"does not say what it was made from")
