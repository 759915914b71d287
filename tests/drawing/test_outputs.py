"""Depth, normals, objects and alpha: closed forms, both backends, and the files of them."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as pillow

import scenelang as nsg
from scenelang.compiler.program import parse_program, program_bytes
from scenelang.drawing.how import RenderError
from scenelang.drawing.image import save_outputs

BACKENDS = pytest.mark.parametrize("backend", ["neural", "reference"])
ALL = ("depth", "normal", "object", "alpha")
SIZE = 96
SPHERE = f"canvas({SIZE}, {SIZE}); camera(eye = [1, 2, 5]); ground(none); "
MIXED = """canvas(80, 60);
let mist = material volumetric { color(#58f); };
chain {
  sphere { scale(0.5); translate(-1.2, -0.3, 0.5); }
  smooth torus { scale(0.4); translate(-1.4, -0.6, 0.6); }
  subtract sphere { scale(0.3); translate(-1.2, -0.2, 1); }
}
sphere { scale(0.6); translate(0, 0.6, 0); }
torus { scale(1.2, 1.2, 0.4); rotate(70deg, axis = X); mist; }
sphere { scale(0.4); translate(1.1, 0.4, 0); mist; }
"""


def rays(scene: nsg.Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eye (3,), forward (3,) and unit directions (3, H, W) through the pixels' centres, by the contract."""
    eye = np.array(scene.camera.eye, float)
    forward = -eye / np.linalg.norm(eye)
    right = np.cross(forward, (0, 1, 0))
    right /= np.linalg.norm(right)
    width, height = scene.canvas
    side = min(width, height) / 2
    x = (np.arange(width) + 0.5 - width / 2) / side
    y = (height / 2 - np.arange(height)[:, None] - 0.5) / side
    way = np.multiply.outer(3 * forward, 1 + 0 * x + 0 * y) + np.multiply.outer(right, x + 0 * y)
    way += np.multiply.outer(np.cross(right, forward), y + 0 * x)
    return eye, forward, way / np.linalg.norm(way, axis=0)


def chord(scene: nsg.Scene, centre: tuple[float, ...], radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Where rays through the pixels' centres enter a sphere, and the square of half their way in it."""
    eye, _, way = rays(scene)
    to = np.array(centre) - eye
    along = np.tensordot(to, way, 1)
    half = radius**2 - to @ to + along**2
    return along - np.sqrt(np.maximum(half, 0)), half


@BACKENDS
def test_a_sphere_has_the_depth_and_normals_of_its_equation(backend) -> None:
    scene = nsg.loads(SPHERE + "sphere { scale(0.8); translate(0.2, 0.1, -0.3); }")
    found = nsg.render_outputs(scene, ALL, backend=backend)
    eye, forward, way = rays(scene)
    t, half = chord(scene, (0.2, 0.1, -0.3), 0.8)
    inside, outside = half > 0.02, half < -0.02  # the rim itself is a pixel's matter of rounding
    point = eye[:, None, None] + t * way
    normal = np.moveaxis(point - np.reshape((0.2, 0.1, -0.3), (3, 1, 1)), 0, 2) / 0.8
    assert abs(found.depth - t * np.tensordot(forward, way, 1))[inside].max() < 1e-3
    assert np.isinf(found.depth[outside]).all()
    assert abs(found.normal - normal)[inside].max() < 0.01
    assert not found.normal[outside].any()
    assert (found.object[inside] == 1).all()
    assert not found.object[outside].any()
    # A cone around the sphere's centre, cut by the picture's plane, covers an ellipse.
    c = np.array([0.2, 0.1, -0.3]) - eye
    cos = 1 - 0.64 / (c @ c)  # the square of the cosine of the cone's half angle
    m = np.multiply.outer(c, c) / (c @ c) - cos * np.eye(3)
    right = np.cross(forward, (0, 1, 0)) / np.linalg.norm(np.cross(forward, (0, 1, 0)))
    axes = np.stack([right, np.cross(right, forward), 3 * forward])
    q = axes @ m @ axes.T
    area = np.pi * np.linalg.det(q) / np.linalg.det(q[:2, :2]) ** 1.5
    assert found.alpha.sum() * (2 / SIZE) ** 2 == pytest.approx(abs(area), rel=2e-3)


@BACKENDS
def test_the_ground_has_depth_and_a_normal_but_is_no_object(backend) -> None:
    scene = nsg.loads("canvas(64, 48); camera(eye = [1, 2, 5]); sphere { scale(0.2); translate(0, -9, 0); }")
    found = nsg.render_outputs(scene, ALL, backend=backend)
    _, forward, way = rays(scene)
    down = way[1] < -1e-3
    assert np.allclose(found.depth[down], (-3 * np.tensordot(forward, way, 1) / way[1])[down], rtol=1e-5)
    assert np.array_equal(found.normal[down], np.broadcast_to([0, 1, 0], (down.sum(), 3)))
    assert not found.alpha.any()
    assert found.objects == {}


@BACKENDS
def test_mist_covers_as_much_as_it_takes_of_light_and_has_no_depth(backend) -> None:
    scene = nsg.loads(SPHERE + "sphere { scale(0.4); material volumetric; }")
    found = nsg.render_outputs(scene, ALL, backend=backend)
    _, half = chord(scene, (0, 0, 0), 0.4)
    inside = half > 0.06  # alpha is of four samples, and nearly flat there
    expected = 1 - np.exp(-3 * 2 * np.sqrt(np.maximum(half, 0)))
    assert abs(found.alpha - expected)[inside].max() < 5e-3
    assert (found.object == 1)[inside].all()
    assert np.isinf(found.depth).all()
    assert not found.normal.any()


def test_edges_of_what_is_carved_have_normals() -> None:
    """Asked once more a little further on, past the rim there is nothing: it was a line of dark dashes."""
    bowl = """canvas(160, 160); camera(eye = [0, 2, 3.4], target = [0, 0, 0], fov = 32deg);
    chain { sphere { scale(0.8, 1, 0.8); } subtract sphere { scale(0.72, 0.92, 0.72); }
      subtract sphere { scale(2); translate(0, 2.2, 0); } }"""
    found = nsg.render_outputs(nsg.loads(bowl), ["depth", "normal"], threads=1)
    assert found.depth is not None
    assert found.normal is not None
    seen = np.isfinite(found.depth) & (found.depth > 0)
    assert np.linalg.norm(found.normal[seen], axis=-1).min() > 0.9


def test_the_network_tells_what_the_reference_does() -> None:
    scene = nsg.loads(MIXED)
    ours, exact = (nsg.render_outputs(scene, ALL, backend=b) for b in ("neural", "reference"))
    assert (ours.object != exact.object).mean() < 2e-3
    assert set(ours.objects) == set(exact.objects) == {1, 2, 4, 5, 6}  # the third is taken away
    assert abs(ours.alpha - exact.alpha).mean() < 2e-4
    both = np.isfinite(ours.depth) & np.isfinite(exact.depth)
    assert (np.isfinite(ours.depth) == np.isfinite(exact.depth)).mean() > 0.999
    assert np.percentile(abs(ours.depth[both] - exact.depth[both]), 99) < 1e-3
    assert np.percentile(abs(ours.normal - exact.normal), 99) < 0.02


def test_objects_keep_their_numbers_where_the_compiler_leaves_some_out() -> None:
    text = "canvas(40, 30); for (i in 0..4) { sphere { scale(0.3); translate(i - 2, i == 1 ? -9 : 0, 0); } }"
    scene = nsg.loads(text)
    program = nsg.compile(scene)
    assert program.numbers == (1, 3, 4, 5)
    assert parse_program(program_bytes(program)).numbers == program.numbers
    ours, exact = (nsg.render_outputs(scene, ["object"], backend=b) for b in ("neural", "reference"))
    assert list(ours.objects) == list(exact.objects) == [1, 3, 4, 5]
    assert (ours.object != exact.object).mean() < 0.01
    with pytest.raises(nsg.ProgramError, match="numbers"):
        program.__class__(**{n: getattr(program, n) for n in program.__slots__} | {"numbers": (1, 2, 3, 0)})


@BACKENDS
def test_the_plane_has_objects_and_alpha(backend) -> None:
    text = """canvas(60, 40); background(none);
    chain { square { scale(0.8); } subtract square { scale(0.3); translate(0.2, 0); } }
    square { scale(0.4); translate(0.4, 0.3); }"""
    scene = nsg.loads(text)
    found = nsg.render_outputs(scene, ("object", "alpha"), backend=backend)
    x, y = (np.arange(60) - 29.5) / 20, (19.5 - np.arange(40)[:, None]) / 20

    def square(side: float, cx: float, cy: float) -> np.ndarray:
        return np.maximum(abs(x - cx), abs(y - cy)) < side / 2**0.5

    expected = np.where(square(0.8, 0, 0) & ~square(0.3, 0.2, 0), 1, 0)
    expected = np.where(square(0.4, 0.4, 0.3), 3, expected)
    assert np.array_equal(found.object, expected)
    assert abs(found.alpha - np.asarray(nsg.render(scene, backend=backend))[..., 3]).max() < 1e-6
    with pytest.raises(RenderError, match="2D picture has no depth; it has object and alpha"):
        nsg.render_outputs(scene, ("depth",), backend=backend)


def test_what_cannot_be_is_refused() -> None:
    scene = nsg.loads("square { }")
    with pytest.raises(ValueError, match="unknown output `z`"):
        nsg.render_outputs(scene, ("z",))
    with pytest.raises(RenderError, match="keeps only"):
        nsg.render_outputs(nsg.compile(scene), ("alpha",), backend="reference")
    with pytest.raises(RenderError, match="draws colours only"):
        nsg.render_outputs(nsg.loads('model "shapes2d-reading"; square { }'), ("alpha",))
    inside = nsg.loads("camera(eye = [0, 0, 0.5]); sphere { }")
    with pytest.raises(RenderError, match="inside"):
        nsg.render_outputs(inside, ("depth",), backend="reference")


def test_pngs_hold_the_numbers_and_say_what_they_are() -> None:
    scene = nsg.loads(MIXED)
    found = nsg.render_outputs(scene, ALL, size=(40, 30))
    read, said = {}, {}
    for name in ALL:
        with pillow.open(io.BytesIO(found.png(name))) as picture:
            read[name], said[name] = np.asarray(picture), json.loads(picture.text["scenelang"])
            assert picture.size == (40, 30)
    near = said["depth"]["near"]
    assert near == found.depth.min()
    seen = np.isfinite(found.depth)
    assert abs(read["depth"][seen] / 65535 - near / found.depth[seen]).max() < 1e-5
    assert not read["depth"][~seen].any()
    assert np.array_equal(read["object"], found.object)
    assert abs(read["alpha"] / 65535 - found.alpha).max() < 1e-5
    assert abs(read["normal"] / 127.5 - 1 - found.normal).max() < 1 / 127  # Pillow keeps 8 of its 16 bits
    assert said["object"]["objects"][3] == {"index": 5, "geometry": "torus"}


def test_exrs_hold_linear_light_and_every_output(tmp_path: Path) -> None:
    openexr = pytest.importorskip("OpenEXR")
    scene = nsg.loads("background(none); " + MIXED)
    picture, found = nsg.render(scene), nsg.render_outputs(scene, ALL)
    assert save_outputs(picture, found, tmp_path / "a.exr") == [tmp_path / "a.exr"] * 4
    with openexr.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        layers = {name: channel.pixels for name, channel in file.channels().items()}
        said = json.loads(file.header()["scenelang"])
    assert np.array_equal(layers["depth.Z"], found.depth)
    assert np.array_equal(layers["object.id"], found.object)
    assert np.array_equal(layers["normal.Y"], found.normal[..., 1])
    assert np.array_equal(layers["alpha.A"], found.alpha)
    straight = layers["G"] / np.maximum(layers["A"], 1e-9)
    encoded = np.where(straight < 0.0031308, 12.92 * straight, 1.055 * straight ** (1 / 2.4) - 0.055)
    assert abs(encoded - picture[..., 1]).max() < 1e-5
    assert [entry["output"] for entry in said] == list(ALL)
    nsg.render(nsg.loads("square { }")).save(tmp_path / "b.exr")
    with openexr.File(str(tmp_path / "b.exr"), separate_channels=True) as file:
        assert sorted(file.channels()) == ["B", "G", "R"]


def test_outputs_save_what_a_picture_saves_beside_it(tmp_path: Path) -> None:
    scene = nsg.loads(MIXED)
    found = nsg.render_outputs(scene, ALL)
    beside = save_outputs(nsg.render(scene), found, tmp_path / "a.png")
    files = found.save(tmp_path / "b.png")
    assert [file.name for file in files] == [f"b.{name}.png" for name in ALL]
    assert [file.read_bytes() for file in files] == [file.read_bytes() for file in beside]
    assert not (tmp_path / "b.png").exists()
    with pytest.raises(ValueError, match=r"outputs go with .png or .exr pictures, not `b.jpg`"):
        found.save(tmp_path / "b.jpg")
