"""Materials of users in Programs: texture coordinates, colour steps, kinds of models."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import scenelang as nsg
from scenelang.assets.element_file import ElementFile
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.graph import Graph
from scenelang.compiler.lifting import LAYOUTS
from scenelang.compiler.program import Paint, Program, parse_program, program_bytes
from scenelang.drawing.exact.picture import reference_image
from scenelang.language.diagnostics import Diagnostics
from tests.assets.shapes import noise

BARK, STONE, HIDE = noise(4, 6), noise(3, 3, name="stone", seed=1), noise(3, 3, 3, name="hide")
ZOO = nsg.Elements.of("zoo", "zoo.safetensors", ElementFile.of([BARK, STONE, HIDE]))


def compiled(*materials: nsg.Material, geometry: str = "square", **scene: Any) -> Program:
    nodes = [nsg.Object(geometry, nsg.Scale(0.5 - 0.1 * at), one) for at, one in enumerate(materials)]
    return compile_scene(nsg.Scene(elements=ZOO, nodes=nodes, **scene))


def frame_of(program: Program) -> np.ndarray:
    return LAYOUTS[2 if program.stage is None else 3].unpack(program.vectors).texture[0].reshape(2, 3)


_number = st.floats(-2, 2).map(lambda v: round(v, 2))
_factor = _number.filter(lambda v: abs(v) > 0.2)
_move = st.one_of(
    st.tuples(_number, _number).map(lambda by: nsg.Translate(*by)),
    _number.map(lambda angle: nsg.Rotate(angle=angle)),
    st.tuples(_factor, _factor).map(lambda by: nsg.Scale(*by)),
    st.tuples(st.sampled_from(["xy", "yx"]), _number).map(lambda given: nsg.Shear(*given)),
    st.just(nsg.Flip()),
)


def back(move: Any, x: float, y: float) -> tuple[float, float]:
    """The point that a move brings to (x, y), as the language defines each of them."""
    match move.kind:
        case "translate":
            return x - move.x, y - move.y
        case "rotate":
            c, s = math.cos(-move.angle), math.sin(-move.angle)
            return c * x - s * y, s * x + c * y
        case "scale":
            return x / move.x, y / move.y
        case "shear":
            return (x - move.k * y, y) if move.axes == "xy" else (x, y - move.k * x)
        case _:
            return -x, y


@settings(deadline=None)
@given(st.lists(_move, max_size=7), st.sampled_from(["square", "torus"]))
def test_a_point_goes_back_through_the_moves_last_to_first(moves: list[Any], geometry: str) -> None:
    program = compiled(nsg.Material("zoo.bark", (*moves, nsg.Grayscale(0.5))), geometry=geometry)
    frame = frame_of(program)
    for x, y in ((0.0, 0.0), (0.7, -0.2), (-0.4, 0.9)):
        expected = x, y
        for move in reversed(moves):
            expected = back(move, *expected)
        found = frame @ [x, y, 1]
        assert found == pytest.approx(expected, rel=1e-5, abs=1e-4 * max(1.0, float(abs(frame).max())))


_axis = st.tuples(_number, _number, _factor)
_solid_move = st.one_of(
    st.tuples(_number, _number, _number).map(lambda by: nsg.Translate(*by)),
    st.tuples(_number, _axis).map(lambda by: nsg.Rotate(angle=by[0], axis=by[1])),
    st.tuples(_factor, _factor, _factor).map(lambda by: nsg.Scale(*by)),
    st.tuples(st.sampled_from(["xz", "yz", "zx", "zy"]), _number).map(lambda given: nsg.Shear(*given)),
    _move,
)
QUARTER = nsg.Rotate(angle=math.pi / 2, axis=(1, 0, 0))


def back_in_space(move: Any, p: np.ndarray) -> np.ndarray:
    """The point that a move brings to p, as the language defines each of them for geometry."""
    match move.kind:
        case "translate":
            return p - (move.x, move.y, move.z)
        case "rotate":
            axis = np.array(move.axis) / np.linalg.norm(move.axis)
            c, s = math.cos(-move.angle), math.sin(-move.angle)
            return np.asarray(c * p + s * np.cross(axis, p) + (1 - c) * (axis @ p) * axis)
        case "scale":
            return p / (move.x, move.y, move.z)
        case "shear":
            i, j = map("xyz".index, move.axes)
            return p - move.k * p[j] * np.eye(3)[i]
        case _:
            return p * (-1, 1, 1)


@settings(deadline=None)
@given(st.lists(_solid_move, max_size=7))
def test_points_of_solids_go_back_through_moves_of_space(moves: list[Any]) -> None:
    program = compiled(nsg.Material("zoo.bark", moves), geometry="torus")
    (paint,) = program.palette
    frame = np.insert(frame_of(program), 2, paint.tilt, 1)
    for p in ((0.0, 0.0, 0.0), (0.7, -0.2, 0.3), (-0.4, 0.9, -0.8)):
        expected = np.array(p)
        for move in reversed(moves):
            expected = back_in_space(move, expected)
        near = 1e-4 * max(1.0, float(abs(frame).max()))
        assert frame @ [*p, 1] == pytest.approx(expected[:2], rel=1e-5, abs=near)
    assert parse_program(program_bytes(program)).digest() == program.digest()


def test_what_happens_along_z_alone_leaves_programs_as_they_were() -> None:
    alone = nsg.Scale(2, 2), nsg.Rotate(angle=0.3)
    along = (
        nsg.Scale(2),
        nsg.Translate(0, 0, 3),
        nsg.Rotate(angle=0.3),
        nsg.Shear("zx", 2),
        nsg.Scale(1, 1, 1e-20),
    )
    flat, more = (compiled(nsg.Material("zoo.bark", moves), geometry="torus") for moves in (alone, along))
    assert program_bytes(flat) == program_bytes(more)
    assert b"tilts" not in program_bytes(flat)
    assert b'\\"format\\":3' in program_bytes(flat)
    tilted = compiled(nsg.Material("zoo.bark", (*alone, QUARTER)), geometry="torus")
    assert b'\\"format\\":6' in program_bytes(tilted)
    assert tilted.palette[0].tilt == pytest.approx((math.sin(0.3) / 2, math.cos(0.3) / 2))


def test_colour_steps_are_as_written_and_linear_in_space() -> None:
    ops = (
        nsg.Color((0.5, 0.25, 1)),
        nsg.Flip(),
        nsg.Color((0.5, 1, 1)),
        nsg.Hue.degrees(90),
        nsg.Grayscale(0.25),
    )
    (flat,) = compiled(nsg.Material("zoo.bark", ops)).palette
    assert flat == Paint(BARK, (("color", 0.25, 0.25, 1.0), ("hue", 0.25), ("grayscale", 0.25)))
    (solid,) = compiled(nsg.Material("zoo.bark", ops), geometry="torus").palette
    half, quarter = (((v + 0.055) / 1.055) ** 2.4 for v in (0.5, 0.25))
    assert solid.steps[0][1:] == pytest.approx((half * half, quarter, 1.0))
    assert solid.steps[1:] == flat.steps[1:]


def test_equal_paints_are_one() -> None:
    red, same = (nsg.Material("zoo.bark", (nsg.Color("#f00"), move)) for move in (nsg.Flip(), nsg.Scale(2)))
    program = compiled(red, nsg.Material("zoo.stone"), same, nsg.Material("flat", nsg.Color("#f00")))
    assert [paint and paint.element.name for paint in program.paints()] == ["bark", "stone", "bark", None]
    assert len(program.palette) == 2
    assert program.elements == (BARK, STONE)
    again = parse_program(program_bytes(program))
    assert program_bytes(again) == program_bytes(
        compiled(red, nsg.Material("zoo.stone"), same, nsg.Material("flat", nsg.Color("#f00")))
    )


def test_a_program_without_paints_is_of_the_old_format() -> None:
    plain = compiled(nsg.Material("flat", (nsg.Scale(2), nsg.Color("#f00"))))
    data = program_bytes(plain)
    assert b'\\"format\\":1' in data
    assert b"worn" not in data
    np.testing.assert_array_equal(frame_of(plain), [[1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize("shading", [None, "diffuse", "volumetric"])
def test_a_texture_is_lit_as_its_shading_says(shading: str | None) -> None:
    textured = compiled(nsg.Material("zoo.bark", shading=shading), geometry="sphere")
    plain = compiled(nsg.Material(shading or "diffuse"), geometry="sphere")
    np.testing.assert_array_equal(textured.vectors, plain.vectors)
    assert textured.digest() != plain.digest()


def test_hidden_objects_go_under_a_texture() -> None:
    below, above = nsg.Object("square", nsg.Scale(0.2)), nsg.Object("square", (), nsg.Material("zoo.bark"))
    program = compile_scene(nsg.Scene(elements=ZOO, nodes=[below, above]))
    assert program.numbers == (2,)


def test_refusals() -> None:
    hues = (nsg.Hue.degrees(9), nsg.Grayscale(0.5)) * 501
    for geometry, code, words, *material in (
        ("square", "E0502", "does not draw `zoo.hide`, a colouring of space", "zoo.hide"),
        ("square", "E0502", "no file of elements has a material `zoo.none`", "zoo.none"),
        ("square", "E0502", "no material `mist`", "zoo.bark", (), "mist"),
        ("square", "E0502", "`flat` is not a texture", "flat", (), "flat"),
        ("torus", "E0504", "`flip` moves a texture, and `zoo.hide` is a", "zoo.hide", nsg.Flip()),
        ("square", "E0312", "`scale` is singular in float32", "zoo.bark", nsg.Scale(1e-31)),
        ("square", "E0406", "compose to a singular one", "zoo.bark", (nsg.Scale(1e-20),) * 2),
        ("square", "E0505", "leaves the plane", "zoo.bark", nsg.Translate(0, 0, 1)),
        ("square", "E0505", "leaves the plane", "zoo.bark", nsg.Rotate(angle=1, axis=(1, 0, 0))),
        ("square", "E0505", "leaves the plane", "zoo.bark", nsg.Shear("yz", 1)),
        ("torus", "E0312", "`scale` is singular", "zoo.bark", nsg.Scale(1, 1e-13)),
        ("torus", "E0406", "compose to a singular one", "zoo.bark", (nsg.Scale(1, 1e-7, 1e-7), QUARTER) * 2),
        ("square", "E0320", "more than 1,000 operations", "zoo.bark", hues),
    ):
        model, found = "shapes2d" if geometry == "square" else "solids3d", Diagnostics()
        shown = nsg.Object(geometry, (), nsg.Material(*material))
        with pytest.raises(nsg.SceneError):
            compile_scene(nsg.Scene(elements=ZOO, nodes=shown), model=model, diagnostics=found)
        assert [d.code for d in found] == [code]
        assert words in found.items[0].message


@pytest.mark.parametrize(
    ("geometry", "scale", "size", "texels"),
    [
        ("square", nsg.Scale(0.5), 64, 6 / (0.5 * 2 * 32)),  # six texels over 2 units of the texture
        ("square", nsg.Scale(0.5, 0.13), 64, 6 / (0.13 * 2 * 32)),
        ("sphere", nsg.Scale(0.5, 0.5, 0.1), 64, 6 / (0.5 * 2 * 32) * 37.44**0.5 / 3),  # the eye's distance
    ],
)
@pytest.mark.parametrize("repeats", [1, 100])
def test_textures_that_are_drawn_small(
    geometry: str, scale: nsg.Scale, size: int, texels: float, repeats: int
) -> None:
    shown = nsg.Object(geometry, scale, nsg.Material("zoo.bark", nsg.Scale(1 / repeats)))
    found = Diagnostics()
    compile_scene(nsg.Scene(elements=ZOO, nodes=shown, canvas=(size, size + 8)), diagnostics=found)
    said = [d.message for d in found if d.code == "W0511"]
    value = f"a texture of {texels * repeats:.3g} texels to a pixel on `{geometry}` is outside"
    assert [message.startswith(value) for message in said] == [True] * (repeats > 1)


@pytest.mark.parametrize("geometries", [("square", "star"), ("sphere", "torus")])
def test_passes_keep_the_exact_picture(geometries: tuple[str, str]) -> None:
    out = (0.2, 0.1) if geometries[0] == "sphere" else (0.0, 0.0)
    moves = (
        nsg.Rotate(angle=0.4, axis=(*out, 1)),
        nsg.Scale(0.7, -0.4),
        nsg.Shear("yx", 0.5),
        nsg.Translate(0.3, 0.1, out[0]),
        nsg.Flip(),
    )
    colours = nsg.Hue.degrees(50), nsg.Hue.degrees(90), nsg.Color((1, 0.5, 0.8)), nsg.Color((0.5, 1, 0.9))
    ops = [op for pair in zip(moves, (*colours, nsg.Grayscale(0.3)), strict=True) for op in pair]
    one, other = (nsg.Material(name, ops) for name in ("zoo.bark", "zoo.stone"))
    below = nsg.Object(geometries[0], (nsg.Scale(0.8), nsg.Rotate(angle=0.2)), one)
    above = nsg.Object(geometries[1], (nsg.Twirl(0.6), nsg.Scale(0.6)), other)
    group = nsg.Group([below, above], nsg.Translate(0.1, 0.1))
    graphs: dict[str, Graph] = {}
    compile_scene(nsg.Scene(elements=ZOO, nodes=group, canvas=(24, 20)), after=graphs.__setitem__)
    drawn = {name: np.asarray(reference_image(graph)) for name, graph in graphs.items()}
    assert len(np.unique(drawn["lower"].reshape(-1, 3).round(3), axis=0)) > 50
    for name, picture in drawn.items():
        np.testing.assert_allclose(picture, drawn["lower"], atol=2e-6, err_msg=name)


def test_models_of_the_paper_draw_no_textures() -> None:
    with pytest.raises(nsg.SceneError, match=r"does not draw `zoo\.bark`, a texture"):
        compiled(nsg.Material("zoo.bark"), model="shapes2d-reading")
