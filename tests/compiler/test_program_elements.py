"""Programs with elements, paints and solids: what is lifted, and damaged files of them."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.assets.element import Element, Gradient
from scenelang.assets.element_file import ElementFile
from scenelang.assets.tensors import read_tensors
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.emit import emit
from scenelang.compiler.graph import Fold, Graph, Leaf, Link, Look, Move
from scenelang.compiler.lifting import LAYOUTS
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.passes import PASSES
from scenelang.compiler.program import Paint, Program, ProgramError, parse_program, program_bytes
from scenelang.compiler.rewrites import Context
from scenelang.compiler.spaces import PLANE, SPACES, Camera, Ground, Light, Stage, read_stage, stage_data
from scenelang.compiler.steps import Displace, Twist, Warp
from scenelang.compiler.weights import load_codes
from scenelang.drawing.exact.solid import ExactBody
from scenelang.language.diagnostics import Diagnostics
from tests.assets.scenes import changed
from tests.assets.shapes import ball, element, noise, square, torus
from tests.drawing.solids import MIXED, Object, graph, moved, network, scaled, turned, vector


def compiled() -> Program:
    zoo = nsg.Elements.of("zoo", "z", ElementFile.of([element(torus, "ring", levels=2)]))
    objects = [nsg.Object("zoo.ring"), nsg.Object("sphere", nsg.Translate(1, 1))]
    return compile_scene(nsg.Scene(elements=zoo, nodes=objects))


Damage = tuple[Callable[[dict[str, Any], dict[str, Any]], object], str]


def refused(data: bytes, damages: list[Damage]) -> None:
    parse_program(changed(data, lambda header, tensors: None))
    for change, words in damages:
        with pytest.raises(ProgramError, match=words):
            parse_program(changed(data, change))


def test_damaged_files() -> None:
    refused(program_bytes(compiled()), [
        (lambda h, t: h.update(format=1), "elements in a file of format 1"),
        (lambda h, t: h.update(format=3), "other tensors than a program of format 3"),
        (lambda h, t: h.update(format=7), "not of format 1 or 2 or 3 or 4 or 5 or 6"),
        (lambda h, t: h.pop("elements"), "list of elements is damaged"),
        (lambda h, t: h.update(elements=[["ring"]]), "list of elements is damaged"),
        (lambda h, t: h.update(elements=[]), "other tensors"),
        (lambda h, t: t.pop("element.0"), "has no bytes"),
        (lambda h, t: t.pop("forms"), "other tensors"),
        (lambda h, t: t.update(forms=np.array([1, -1], np.int32)), "not listed"),
        (lambda h, t: t.update(forms=np.array([0, -2], np.int32)), "not listed"),
        (lambda h, t: t.update(forms=np.array([0.0, 1.0], np.float32)), "`forms` is F32"),
        (lambda h, t: t.update({"element.0": np.zeros(9, np.uint8)}), "damaged"),
        (lambda h, t: h["elements"][0][1].update(levels=5), "does not hold"),
    ])  # fmt: skip


def test_elements_are_checked_and_in_the_digest() -> None:
    program = compiled()
    with pytest.raises(ProgramError, match="not of dimension 3"):
        replace(program, elements=(element(ball, d=2, levels=2),))
    assert replace(program, elements=(element(ball, levels=2),)).digest() != program.digest()


BARK, STONE = noise(5, 7), noise(3, 3, name="stone", seed=1)
STEPS = (("color", 0.5, 1.0, 0.25), ("hue", 0.125), ("grayscale", 0.75))


def painted(*palette: Paint, worn: list[int], **fields: Any) -> Program:
    objects = [nsg.Object("square"), nsg.Object("star", nsg.Scale(0.5))]
    plain = compile_scene(nsg.Scene(nodes=objects, model="shapes2d"))
    given = {"elements": (BARK, STONE), "worn": np.array(worn, np.int32), **fields}
    return replace(plain, palette=palette, **given)


PAINTED = painted(Paint(STONE, STEPS), Paint(BARK), worn=[0, 1])


def test_paints_come_back() -> None:
    made = PAINTED
    found = parse_program(program_bytes(made))
    assert found.paints() == made.paints() == [Paint(STONE, STEPS), Paint(BARK)]
    assert found.digest() == made.digest()
    assert program_bytes(found) == program_bytes(made)


def test_the_digest_is_that_of_what_is_worn() -> None:
    stone, bark = Paint(STONE, STEPS), Paint(BARK)
    made = [
        painted(stone, bark, worn=[0, 1]),
        painted(stone, bark, worn=[1, 0]),
        painted(stone, bark, worn=[0, -1]),
        painted(stone._replace(steps=STEPS[::-1]), bark, worn=[0, 1]),
        painted(stone, Paint(noise(5, 7, seed=2)), worn=[0, 1], elements=(STONE, noise(5, 7, seed=2))),
    ]
    assert len({one.digest() for one in made}) == len(made)
    assert made[0].digest() == painted(bark, stone, worn=[1, 0]).digest()


def test_damaged_paints() -> None:
    refused(program_bytes(PAINTED), [
        (lambda h, t: h.update(format=2), "other tensors than a program of format 2"),
        (lambda h, t: t.pop("worn"), "other tensors than a program of format 3"),
        (lambda h, t: t.pop("steps"), "other tensors than a program of format 3"),
        (lambda h, t: t.update(worn=np.array([0, 2], np.int32)), "a paint that is not listed"),
        (lambda h, t: t.update(worn=np.array([0, -2], np.int32)), "a paint that is not listed"),
        (lambda h, t: t.update(worn=np.array([0], np.int32)), "tensor `worn` is I32"),
        (lambda h, t: t.update(forms=np.array([0, -1], np.int32)), "geometry is a material"),
        (lambda h, t: t.update(paints=np.array([[2, 3], [0, 0]], np.int32)), "not listed"),
        (lambda h, t: t.update(paints=np.array([[1, 4], [0, 0]], np.int32)), "not listed"),
        (lambda h, t: t.update(paints=np.array([[1, 2], [0, 0]], np.int32)), "steps that no paint has"),
        (lambda h, t: t.update(paints=np.array([[1, -1], [0, 4]], np.int32)), "not listed"),
        (lambda h, t: t.update(paints=np.array([1, 3], np.int32)), "tensor `paints` is I32"),
        (lambda h, t: t.update(steps=t["steps"] + np.float32(0.5)), "step that this version"),
        (lambda h, t: t.update(steps=t["steps"] + np.float32(2)), "step that this version"),
        (lambda h, t: t.update(steps=np.full((3, 4), np.nan, np.float32)), "not finite"),
    ])  # fmt: skip


def solid(*palette: Paint, **fields: Any) -> Program:
    plain = compile_scene(nsg.Scene(nodes=[nsg.Object("sphere"), nsg.Object("torus")]))
    given = {"elements": (BARK, STONE), "worn": np.array([0, 1], np.int32), **fields}
    return replace(plain, palette=palette, **given)


TILTED = solid(Paint(STONE, STEPS, (0.5, -1.0)), Paint(BARK))


def test_tilts_come_back() -> None:
    found = parse_program(program_bytes(TILTED))
    assert found.paints() == TILTED.paints() == [Paint(STONE, STEPS, (0.5, -1.0)), Paint(BARK)]
    assert program_bytes(found) == program_bytes(TILTED)
    flat = solid(Paint(STONE, STEPS), Paint(BARK))
    others = TILTED, flat, solid(Paint(STONE, STEPS, (0.5, 1.0)), Paint(BARK))
    assert len({one.digest() for one in others}) == 3
    assert b"tilts" not in program_bytes(flat)


def test_damaged_tilts() -> None:
    refused(program_bytes(TILTED), [
        (lambda h, t: h.update(format=5), "other tensors than a program of format 5"),
        (lambda h, t: t.pop("tilts"), "other tensors than a program of format 6"),
        (lambda h, t: t.update(tilts=t["tilts"][:1]), "tilts of other paints"),
        (lambda h, t: t.update(tilts=np.ones((2, 3), np.float32)), "tensor `tilts` is F32"),
        (lambda h, t: t.update(tilts=t["tilts"].astype(np.float64)), "tensor `tilts` is F64"),
        (lambda h, t: t.update(tilts=np.full((2, 2), np.nan, np.float32)), "not finite"),
    ])  # fmt: skip
    with pytest.raises(ProgramError, match="a tilt of a paint of `stone`"):
        painted(Paint(STONE, (), (0.0, 1.0)), worn=[0, -1])


SUNSET = Gradient("radial", ((0.0, 1.0, 0.5, 0.0), (0.5, 0.0, 0.0, 0.25), (0.5, 1.0, 1.0, 1.0)))
GRADED = painted(Paint(SUNSET, STEPS), Paint(Gradient("linear", SUNSET.stops[:2])), worn=[1, 0], elements=())


@pytest.mark.parametrize("elements", [(), (BARK,)])
def test_gradients_come_back(elements: tuple[Element, ...]) -> None:
    palette = (*GRADED.palette, *[Paint(element) for element in elements])
    made = painted(*palette, worn=[len(palette) - 1, 0], elements=elements)
    found = parse_program(program_bytes(made))
    assert found.paints() == made.paints()
    assert found.elements == elements
    assert found.digest() == made.digest() != PAINTED.digest()
    assert program_bytes(found) == program_bytes(made)
    assert read_tensors(program_bytes(made), 1 << 20, (5,)).header["format"] == 5


def test_damaged_gradients() -> None:
    refused(program_bytes(GRADED), [
        (lambda h, t: h.update(format=4), "other tensors than a program of format 4"),
        (lambda h, t: t.pop("worn"), "other tensors than a program of format 5"),
        (lambda h, t: t.pop("stops"), "no stop"),
        (lambda h, t: t.update(stops=t["stops"][:4]), "one stop"),
        (lambda h, t: t.update(stops=t["stops"][:, :4]), "tensor `stops` is F32"),
        (lambda h, t: t.update(paints=np.array([[-3, 3], [-1, 0]], np.int32)), "not listed"),
        (lambda h, t: t.update(stops=t["stops"] + np.array([1, 0, 0, 0, 0], np.float32)), "no gradient has"),
        (lambda h, t: t.update(stops=t["stops"] * np.array([1, 3, 1, 1, 1], np.float32)), "outside 0..1"),
        (lambda h, t: t.update(stops=t["stops"] * np.array([1, -1, 1, 1, 1], np.float32)), "outside 0..1"),
        (lambda h, t: t.update(stops=t["stops"] * np.array([1, 1, 2, 1, 1], np.float32)), "outside 0..1"),
        (lambda h, t: t.update(stops=t["stops"] * np.array([1, np.nan, 1, 1, 1], np.float32)), "not finite"),
    ])  # fmt: skip


def test_paints_that_are_none() -> None:
    for paint, words in (
        (Paint(noise(4, 4)), "not a material that is listed"),
        (Paint(element(square, d=2)), "not a material that is listed"),
        (Paint(noise(2, 2, 2)), "dimension 3 in the plane"),
        (Paint(BARK, (("twirl", 1.0),)), "a step of a paint"),
        (Paint(BARK, (("hue", 1.0, 1.0),)), "a step of a paint"),
        (Paint(BARK, (("hue", float("inf")),)), "a step of a paint"),
        (Paint(BARK, (("hue", 0.5),) * 1001), "1,001 steps, at most 1,000"),
    ):
        listed = (BARK, STONE, *[e for e in [paint.element] if words.startswith("dimension")])
        with pytest.raises(ProgramError, match=words):
            painted(paint, worn=[0, -1], elements=listed)


STAGE = Stage(Camera((1.0, 2.0, 5.0)), (Light(power=3.0),), None, (0.1, 0.2, 0.3), (0.4, 0.5, 0.6), True)
SOLIDS, CODES = load_manifest("solids3d"), load_codes("solids3d")


def program(root: Fold, stage: Stage = STAGE) -> Program:
    stream, context = Graph(root, (64, 48), None, SPACES[3], stage), Context(SOLIDS, Diagnostics())
    for step in PASSES:
        stream = step.run(stream, context)
    assert not context.diagnostics.errors
    return emit(stream, SOLIDS, CODES)


APART = MIXED[0]._replace(steps=(Displace(0.05, 6.0), Warp(0.5, (0.0, 0.0)), Twist(0.8), turned(1.0)))


def test_vectors_are_those_lifted_by_hand() -> None:
    """Chains in which nothing trades places or shares a slot; blends of the usual width leave 0."""
    for o in (APART, *MIXED[1:]):
        found = program(graph([o._replace(token="union")])).vectors[0]
        wanted = vector(o._replace(k=0.0), network())
        wanted[44:50] = 1, 0, 0, 0, 1, 0  # the texture's frame
        assert found == pytest.approx(wanted, abs=1e-6)


def test_balls_hold_what_a_row_changes() -> None:
    made = program(graph([*MIXED, *MIXED]))
    *centre, radius = made.bounds[0].tolist()
    leaf = Leaf("torus", Look("diffuse"), tuple(map(Move, MIXED[0].steps)))
    p = np.random.default_rng(1).uniform(-4, 4, (3, 20000))
    near = ExactBody(leaf, leaf.steps, 9.0).distance(p)[0] < 0.6  # the k of the two blends
    assert (np.linalg.norm(p.T - centre, axis=1) <= radius)[near].all()
    assert radius < 4
    around = np.linalg.norm(made.bounds[:3, :3], axis=1) + made.bounds[:3, 3]
    assert made.bounds[3, 3] >= around.max()


def test_widths_stand_in_the_vectors() -> None:
    solid = [Object("sphere"), Object("sphere", (moved(1, 0, 0),), token="smooth", k=0.3)]
    assert program(graph(solid)).vectors[:, LAYOUTS[3].places.width].tolist() == [0.0, np.float32(0.3)]
    links = [Link(op, Leaf("square", Look("flat")), k) for op, k in (("union", 0.3), ("smooth", 0.3))]
    flat = Graph(Fold("scene", tuple(links)), (64, 64), None, PLANE)
    wide = emit(flat, load_manifest("shapes2d"), load_codes("shapes2d")).vectors
    assert wide[:, LAYOUTS[2].places.width].tolist() == [0.0, np.float32(0.3)]


def test_files_keep_the_stage() -> None:
    made = program(graph(MIXED))
    again = parse_program(program_bytes(made))
    assert again.stage == STAGE
    assert again.digest() == made.digest()
    assert program_bytes(again) == program_bytes(made)
    assert program(graph(MIXED), Stage()).digest() != made.digest()


def test_damaged_stages() -> None:
    wrong: dict[str, dict[str, Any]] = {
        "": {"more": 1, "camera": None, "transparent": 1, "zenith": [1, 2], "horizon": ["1", 0, 0]},
        "camera": {"eye": [float("inf"), 0, 0], "fov_rad": [1.0]},
        "light": {"power": float("nan"), "intensity": 1},
        "ground": {"y": "0"},
    }
    data = json.dumps(stage_data(replace(STAGE, ground=Ground())))
    read_stage(json.loads(data))
    cases: list[object] = [None, [], {}]
    for part, fields in wrong.items():
        for name, value in fields.items():
            case = json.loads(data)
            (case[part] if part else case)[name] = value
            cases.append(case)
    for case in [*cases, {**json.loads(data), "ground": {"y": 0}}]:
        with pytest.raises(ValueError, match=r"\w"):
            read_stage(case)


def test_stages_that_draw_nothing_are_refused() -> None:
    with pytest.raises(ProgramError, match="negative"):
        program(graph(MIXED), Stage(lights=(Light(power=-1.0),)))


def test_chains_that_do_not_fit_are_refused() -> None:
    steps = (Warp(0.5, (0.0, 0.0)), scaled(1, 2, 3), Twist(1.0), turned(1.0), Twist(1.0), moved(1, 1, 1))
    for chain in (steps, (scaled(1, 2, 3), Displace(0.1, 2.0))):
        context = Context(SOLIDS, Diagnostics())
        stream = Graph(graph([Object("sphere", chain)]), (64, 48), None, SPACES[3], STAGE)
        for step in PASSES:
            stream = step.run(stream, context)
        assert [d.code for d in context.diagnostics] == ["E0506"]
