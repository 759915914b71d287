"""Programs with materials of users: what comes back, and what damaged files of them get."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Paint, Program, ProgramError, parse_program, program_bytes
from tests.assets.scenes import changed
from tests.assets.shapes import element, noise, square

BARK, STONE = noise(5, 7), noise(3, 3, name="stone", seed=1)
STEPS = (("color", 0.5, 1.0, 0.25), ("hue", 0.125), ("grayscale", 0.75))


def program(*palette: Paint, worn: list[int], **fields: Any) -> Program:
    objects = [nsg.Object("square"), nsg.Object("star", nsg.Scale(0.5))]
    plain = compile_scene(nsg.Scene(nodes=objects, model="shapes2d"))
    given = {name: getattr(plain, name) for name in Program.__dataclass_fields__}
    given |= {"elements": (BARK, STONE), "palette": palette, "worn": np.array(worn, np.int32)}
    return Program(**given | fields)


def painted_program() -> Program:
    return program(Paint(STONE, STEPS), Paint(BARK), worn=[0, 1])


def test_paints_come_back() -> None:
    made = painted_program()
    found = parse_program(program_bytes(made))
    assert found.paints() == made.paints() == [Paint(STONE, STEPS), Paint(BARK)]
    assert found.digest() == made.digest()
    assert program_bytes(found) == program_bytes(made)


def test_the_digest_is_that_of_what_is_worn() -> None:
    stone, bark = Paint(STONE, STEPS), Paint(BARK)
    made = [
        program(stone, bark, worn=[0, 1]),
        program(stone, bark, worn=[1, 0]),
        program(stone, bark, worn=[0, -1]),
        program(stone._replace(steps=STEPS[::-1]), bark, worn=[0, 1]),
        program(stone, Paint(noise(5, 7, seed=2)), worn=[0, 1], elements=(STONE, noise(5, 7, seed=2))),
    ]
    assert len({one.digest() for one in made}) == len(made)
    assert made[0].digest() == program(bark, stone, worn=[1, 0]).digest()


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
def test_damaged_files(change: Callable[[dict[str, Any], dict[str, Any]], object], words: str) -> None:
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
        program(paint, worn=[0, -1], elements=listed)
