"""Programs with elements: what damaged and hostile files of them get."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.assets.zoo import Zoo
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Paint, Program, ProgramError, parse_program, program_bytes
from tests.assets.scenes import changed
from tests.assets.shapes import ball, element, noise, square, torus


def compiled() -> Program:
    zoo = nsg.Elements.of("zoo", "z", Zoo.of([element(torus, "ring", levels=2)]))
    objects = [nsg.Object("zoo.ring"), nsg.Object("sphere", nsg.Translate(1, 1))]
    return compile_scene(nsg.Scene(elements=zoo, nodes=objects))


def test_nothing_changed() -> None:
    assert (
        parse_program(changed(program_bytes(compiled()), lambda header, tensors: None)).digest()
        == compiled().digest()
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda h, t: h.update(format=1), "elements in a file of format 1"),
        (lambda h, t: h.update(format=3), "other tensors than a program of format 3"),
        (lambda h, t: h.update(format=5), "not of format 1 or 2 or 3 or 4"),
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
    ],
)
def test_damaged_files(change: Callable[[dict[str, Any], dict[str, Any]], object], words: str) -> None:
    with pytest.raises(ProgramError, match=words):
        parse_program(changed(program_bytes(compiled()), change))


def test_an_element_of_the_plane_is_not_drawn_in_space() -> None:
    program = compiled()
    fields = {name: getattr(program, name) for name in Program.__dataclass_fields__}
    with pytest.raises(ProgramError, match="not of dimension 3"):
        Program(**{**fields, "elements": (element(ball, d=2, levels=2),)})


def test_the_digest_is_that_of_the_shapes() -> None:
    program = compiled()
    fields = {name: getattr(program, name) for name in Program.__dataclass_fields__}
    other = Program(**{**fields, "elements": (element(ball, levels=2),)})
    assert other.digest() != program.digest()


BARK, STONE = noise(5, 7), noise(3, 3, name="stone", seed=1)
STEPS = (("color", 0.5, 1.0, 0.25), ("hue", 0.125), ("grayscale", 0.75))


def painted(*palette: Paint, worn: list[int], **fields: Any) -> Program:
    objects = [nsg.Object("square"), nsg.Object("star", nsg.Scale(0.5))]
    plain = compile_scene(nsg.Scene(nodes=objects, model="shapes2d"))
    given = {name: getattr(plain, name) for name in Program.__dataclass_fields__}
    given |= {"elements": (BARK, STONE), "palette": palette, "worn": np.array(worn, np.int32)}
    return Program(**given | fields)


def painted_program() -> Program:
    return painted(Paint(STONE, STEPS), Paint(BARK), worn=[0, 1])


def test_paints_come_back() -> None:
    made = painted_program()
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


@pytest.mark.parametrize(
    ("change", "words"),
    [
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
    ],
)
def test_damaged_paints(change: Callable[[dict[str, Any], dict[str, Any]], object], words: str) -> None:
    with pytest.raises(ProgramError, match=words):
        parse_program(changed(program_bytes(painted_program()), change))


@pytest.mark.parametrize(
    ("paint", "words"),
    [
        (Paint(noise(4, 4)), "not a material that is listed"),
        (Paint(element(square, d=2)), "not a material that is listed"),
        (Paint(noise(2, 2, 2)), "dimension 3 in the plane"),
        (Paint(BARK, (("twirl", 1.0),)), "a step of a paint"),
        (Paint(BARK, (("hue", 1.0, 1.0),)), "a step of a paint"),
        (Paint(BARK, (("hue", float("inf")),)), "a step of a paint"),
        (Paint(BARK, (("hue", 0.5),) * 1001), "1,001 steps, at most 1,000"),
    ],
)
def test_paints_that_are_none(paint: Paint, words: str) -> None:
    listed = (BARK, STONE, *[e for e in [paint.element] if words.startswith("dimension")])
    with pytest.raises(ProgramError, match=words):
        painted(paint, worn=[0, -1], elements=listed)
