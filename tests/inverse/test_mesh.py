"""Meshes: what is read and refused, their colours, and exact pictures of what was made from them."""

from __future__ import annotations

import io
import json
import os
import struct
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import scenelang as nsg
from scenelang.assets.element_file import element_file_bytes, load_element_file
from scenelang.assets.picture import texels
from scenelang.assets.pyramid import unpacked_colours
from scenelang.drawing.exact.mesh import FitError, Mesh, Tints, mesh_of, read_solids, white, whole
from scenelang.drawing.exact.originals import FOLDER
from scenelang.drawing.exact.outline import read_outline, read_picture
from scenelang.drawing.exact.picture import reference_image
from scenelang.drawing.image import decoded, encoded
from scenelang.drawing.render import exact_graph
from scenelang.inverse import sandbox
from scenelang.inverse.grids import fit_colours
from scenelang.inverse.learn import LearnOptions, learn_files
from scenelang.inverse.sandbox import files_beside
from tests.pictures import psnr_db

pytest.importorskip("igl")
pytest.importorskip("svgelements")
trimesh = pytest.importorskip("trimesh")


def arrays(mesh: Any) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)


def box(*sides: float) -> Any:
    return trimesh.creation.box(sides)


def test_each_format_gives_the_solid_in_the_unit_ball(tmp_path: Path) -> None:
    made, size = box(4, 2, 1), np.linalg.norm([2, 1, 0.5])
    made.apply_translation([100, 20, -3])
    for suffix in ("obj", "ply", "stl", "glb"):
        made.export(tmp_path / f"box.{suffix}")
        mesh = whole(read_solids((tmp_path / f"box.{suffix}").read_bytes(), f".{suffix}")[0])
        assert mesh.centre == pytest.approx((100, 20, -3))
        assert mesh.size == pytest.approx(size)
        p = np.random.default_rng(0).uniform(-1, 1, (500, 3))
        q = abs(p) - np.array([2, 1, 0.5]) / size
        distances = np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(1), 0)
        np.testing.assert_allclose(mesh.distances(p), distances, atol=1e-6)


def test_inside_out_is_turned() -> None:
    made, signs = box(1, 1, 1), ("closed", "winding", "auto")
    for _ in range(2):
        for sign in signs:
            mesh = mesh_of(*arrays(made), sign)  # type: ignore[arg-type]
            points, normals, _ = mesh.surface(300)
            assert (mesh.distances(points * 0.9) < 0).all()
            assert (mesh.distances(points * 1.1) > 0).all()
            assert ((points * normals).sum(1) > 0).all()
        made.invert()


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


SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])


def test_what_is_not_a_solid() -> None:
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


def test_textures_are_repeated_and_multiplied() -> None:
    tint = np.full((1, 3, 3), 0.5, np.float32)
    for u, v, linear in ((0.3, 0.6, False), (0.01, 0.99, True), (1.7, -0.4, False), (-1.2, 2.9, True)):
        corners = np.tile(np.array((u, v), np.float32), (1, 3, 1))
        look = Tints(tint, np.array([linear]), corners, np.zeros(1, np.int32), (PICTURE,))
        expected = by_hand(PICTURE, u, v)
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
    look = Tints(corner[faces], look.linear, look.uv, look.image)
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
    assert abs(unpacked_colours(element)[0] - red)[beside].mean() < 0.02
    inside = texels(element)[side // 2, side // 2, side // 2]
    assert inside.sum() == pytest.approx(1.2, abs=0.2)  # filled from the surface, not black


POINTS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
FACES = "usemtl red\nf 1/1 3/1 2/1\nf 1/1 2/1 4/1\nusemtl tex\nf 2/1 3/1 4/1\nf 1/1 4/1 3/1\n"
MATERIALS = "newmtl red\nKd 1 0.2 0\nnewmtl tex\nKd 0.5 0.5 0.5\nmap_Kd t/pic.png\n"
TEXT = f"mtllib a.mtl\n{POINTS}vt 0.3 0.6\n{FACES}"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "below/t").mkdir(parents=True)
    for place in (tmp_path, tmp_path / "below"):
        (place / "a.mtl").write_text(MATERIALS)
    Image.fromarray(PICTURE).save(tmp_path / "below/t/pic.png")
    return tmp_path / "below"


def read(folder: Path, text: str | bytes, suffix: str = ".obj") -> tuple[Any, list[str]]:
    """The look of a file, and what is said of it."""
    data = text.encode() if isinstance(text, str) else text
    solids, notes = read_solids(data, suffix, files_beside(data, suffix, folder))
    return whole(solids).look, notes


def test_materials_of_obj_lie_beside_it(folder: Path) -> None:
    for name in ("a.mtl", "./a.mtl", "/a.mtl", "t\\..\\a.mtl", "  a.mtl \r"):
        look, notes = read(folder, TEXT.replace("a.mtl", name))
        found = {tuple(np.round(look.at(ONE + k, np.eye(3)[:1])[0], 3)) for k in range(4)}
        assert found == {(1, 0.2, 0), tuple(np.round(by_hand(PICTURE, 0.3, 0.6), 3))}
        assert notes == []
    assert read_solids(TEXT.encode(), ".obj")[0][0].look is None


@pytest.mark.skipif(sys.platform == "win32", reason="has no such files")
def test_what_is_elsewhere_or_no_file_is_not_read(folder: Path) -> None:
    (folder / "link.mtl").symlink_to("../a.mtl")
    (folder / "loop.mtl").symlink_to("loop.mtl")
    os.mkfifo(folder / "pipe.mtl")
    other = ("../a.mtl", "t/../../a.mtl", "link.mtl", "loop.mtl", "pipe.mtl", "t", "b.mtl", "a\0.mtl")
    for name in other:
        shown = name.replace("\0", "")
        assert read(folder, TEXT.replace("a.mtl", name)) == (None, [f"`{shown}` not found beside it"])


def test_textures_of_ply_and_of_gltf(folder: Path) -> None:
    box = made("texture")
    Image.fromarray(PICTURE).save(folder / 'ü "pic".png')
    uv = "property float s\nproperty float t\n"
    head = "ply\nformat ascii 1.0\ncomment TextureFile t/pic.png\nelement vertex 4\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz") + uv
    head += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    rows = "0 0 0 0.3 0.6\n1 0 0 0.3 0.6\n0 1 0 0.3 0.6\n0 0 1 0.3 0.6\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"
    look, notes = read(folder, head + rows, ".ply")
    assert (len(look.images), notes) == (1, [])

    data = box.export(file_type="glb")
    length = int.from_bytes(data[12:16], "little")
    header = json.loads(data[20 : 20 + length])
    (image,) = header["images"]
    del image["bufferView"]
    for uri, found in (('ü "pic".png', []), ("../a.mtl", ["`../a.mtl` not found beside it"])):
        image["uri"] = uri
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % 4)
        sizes = (len(data) - length + len(text)).to_bytes(4, "little") + len(text).to_bytes(4, "little")
        look, notes = read(folder, data[:8] + sizes + data[16:20] + text + data[20 + length :], ".glb")
        assert notes == found
        assert len(look.images) == (not found)


def test_sizes_are_bounded(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    size = (folder / "a.mtl").stat().st_size
    picture = (folder / "t/pic.png").stat().st_size
    data = TEXT.encode()
    for name, most, left in (
        ("MOST_BYTES", max(size, picture), {"a.mtl", "t/pic.png"}),
        ("MOST_BYTES", size - 1, set()),
        ("MOST_TOGETHER", size + picture, {"a.mtl", "t/pic.png"}),
        ("MOST_TOGETHER", size + picture - 1, {"a.mtl"}),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(sandbox, name, most)
            assert files_beside(data, ".obj", folder).keys() == left
    many = "".join(f"map_Kd {k}.png\n" for k in range(2000))
    (folder / "a.mtl").write_text(many + "map_Kd t/pic.png")
    assert files_beside(data, ".obj", folder).keys() == {"a.mtl"}


PLAIN = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def glb(**said: Any) -> bytes:
    text = json.dumps({"asset": {"version": "2.0"}, **said}).encode()
    text += b" " * (-len(text) % 4)
    return b"glTF" + struct.pack("<IIII", 2, 20 + len(text), len(text), 0x4E4F534A) + text


def svg(body: str) -> bytes:
    return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">{body}</svg>'.encode()


def uses(deep: int, wide: int) -> str:
    """Each group so many times what the one before is."""
    groups = '<rect id="a0" width="3" height="3"/>'
    for k in range(1, deep):
        inner = "".join(f'<use href="#a{k - 1}" x="{x}"/>' for x in range(wide))
        groups += f'<g id="a{k}">{inner}</g>'
    return f'<defs>{groups}</defs><use href="#a{deep - 1}"/>'


def test_what_is_refused_before_it_is_read() -> None:
    rows: list[tuple[str | bytes, str, str]] = [
        (POINTS + "f" + " 1 2 3" * 400, ".obj", "a face of more than 1,000 corners"),
        (POINTS + "usemtl a\nusemtl b\n" * 5_001 + PLAIN, ".obj", "changes of material"),
        (POINTS + "o a\nf 1 3 2\n" * 10_001, ".obj", "more than 10,000 objects"),
        (glb(accessors=[{"count": 200_000_000, "sparse": {}}]), ".glb", "accessors of more than 40,000,000"),
        (glb(nodes=[{}] * 10_001), ".glb", "more than 10,000 nodes and primitives"),
        (glb(meshes=[{"primitives": [{}] * 10_001}]), ".glb", "more than 10,000 nodes and primitives"),
        (glb(nodes=[{"children": [k + 1]} for k in range(200)]), ".glb", "more than 100 deep"),
        (glb(nodes=[{"children": [0]}]), ".glb", "more than 100 deep"),
        (svg(uses(14, 3)), ".svg", "more than 50,000 elements"),
        (svg(uses(3000, 1)), ".svg", "more than 50,000 elements"),
        (svg('<g id="a"><use href="#a"/></g>'), ".svg", "more than 50,000 elements"),
        (svg(f"<style>{'.a{fill:red}' * 9000}</style>"), ".svg", "style sheets of more than 100,000 letters"),
        (svg(f'<path d="M0 0{"l1 0 0 1z" * 120_000}"/>'), ".svg", "more than 1,000,000 letters"),
    ]
    for text, suffix, words in rows:
        data = text.encode() if isinstance(text, str) else text
        started = time.process_time()
        with pytest.raises(FitError, match=words):
            read_outline(data, suffix) if suffix == ".svg" else read_solids(data, suffix)
        assert time.process_time() - started < 5, words
    assert read_outline(svg(uses(4, 3)), ".svg").notes[0].startswith("27 areas")


def test_a_jpeg_of_many_scans() -> None:
    """Each goes over all of its pixels again."""
    file = io.BytesIO()
    Image.new("RGB", (4000, 4000)).save(file, "JPEG", progressive=True)
    data = file.getvalue()
    last = data.rfind(b"\xff\xda")
    assert read_picture(data, 8).colours.shape == (8, 8, 3)
    with pytest.raises(FitError, match=r"a picture of 1.. scans"):
        read_picture(data[:last] + data[last:-2] * 100 + data[-2:])


CUBE = 3**-0.5  # half a side of the one in the unit ball
TILE = '<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0H10V10H0Z"/></svg>'


class Cube:
    """The cube by its formula."""

    def distances(self, p: np.ndarray) -> np.ndarray:
        q = abs(p) - CUBE
        return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(1), 0)

    def slopes(self, p: np.ndarray) -> np.ndarray:
        steps = 1e-7 * np.eye(3)
        return np.stack([(self.distances(p + e) - self.distances(p - e)) / 2e-7 for e in steps], 1)


@pytest.fixture
def learned(tmp_path: Path) -> Path:
    trimesh.creation.box((2, 2, 2)).export(tmp_path / "cube.obj")
    (tmp_path / "tile.svg").write_text(TILE)
    learn_files(
        [tmp_path / "cube.obj", tmp_path / "tile.svg"], tmp_path / "zoo.safetensors", LearnOptions(steps=1)
    )
    return tmp_path


def scene(learned: Path, text: str) -> nsg.Scene:
    (learned / "s.nsg").write_text(f'import "zoo.safetensors" as zoo; canvas(40, 40); {text}')
    return nsg.load(learned / "s.nsg")


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


def test_a_cube_is_drawn_as_by_its_formula(learned: Path) -> None:
    for text in (
        "zoo.cube { scale(0.9, 0.7, 0.5); rotate(1rad, axis = X + Y); material diffuse { color(#c96); } } "
        "sphere { scale(0.4); translate(0.7, 0.4, 0.6); }",
        "chain { sphere { scale(0.8); material volumetric; } smooth zoo.cube { twirl(0.5); scale(0.6);"
        "  translate(0.4, 0.3, 0); material diffuse { color(#69c); } } subtract torus { scale(0.7); } }",
        "zoo.cube { displace(0.05, 8); twist(0.8); scale(0.7); material volumetric { color(#9c6); } }",
    ):
        shown = scene(learned, text).sized((24, 24))
        graph = exact_graph(shown)[0]
        exact = reference_image(graph, brought={"zoo.cube": Cube()})
        assert psnr_db(np.asarray(nsg.render(shown, backend="reference")), np.asarray(exact)) > 60
    nsg.render_outputs(shown, ["depth", "alpha"], backend="reference")


def changed(learned: Path, **about: str | None) -> None:
    """The zoo with other words of the cube."""
    path = learned / "zoo.safetensors"
    cube = load_element_file(path).geometries["cube"]
    said = {key: value for key, value in {**cube.about, **about}.items() if value is not None}
    path.write_bytes(element_file_bytes([replace(cube, about=said)]))


def test_what_an_element_was_made_from_is_looked_for(learned: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(words: str) -> None:
        with pytest.raises(nsg.RenderError, match=words):
            nsg.render(scene(learned, "zoo.cube { }"), backend="reference")

    other = learned / "other"
    other.mkdir()
    data = (learned / "cube.obj").read_bytes()
    (learned / "cube.obj").rename(other / "cube.obj")
    refused(rf"`zoo\.cube` was made from `cube\.obj`, which is not in `{learned}`; `--originals FOLDER`")
    monkeypatch.setenv(FOLDER, str(other))
    nsg.render(scene(learned, "zoo.cube { }"), backend="reference")
    (other / "cube.obj").write_bytes(data + b"\n")
    refused(r"another file of that name")
    changed(learned, original="../other/cube.obj")
    refused(r"which is not in")
    changed(learned, original=None)
    refused(r"does not say what it was made from")


def test_an_outline_is_drawn_as_the_shape_that_it_is(learned: Path) -> None:
    moves = "{ twirl(0.7); scale(0.6, 0.4); rotate(20deg); material flat { color(#333); } }"
    chain = f"chain {{ pentagon {{ scale(0.5); }} smooth NAME {moves} }}"
    scenes = (scene(learned, chain.replace("NAME", name)) for name in ("zoo.tile", "square"))
    drawn, exact = (np.asarray(nsg.render(shown, backend="reference")) for shown in scenes)
    assert psnr_db(drawn, exact) > 55


def test_soup_is_refused_before_all_of_it_is_asked() -> None:
    """Triangles across all of the ball leave winding numbers nothing to sum up: a point took 70 ms."""
    corners = np.random.default_rng(0).uniform(-1, 1, (300_000, 3))
    mesh = mesh_of(corners, np.arange(300_000).reshape(-1, 3))
    started = time.process_time()
    with pytest.raises(FitError, match=r"overlap so much|encloses no solid"):
        mesh.surface(200_000)
    assert time.process_time() - started < 30
