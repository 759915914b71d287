"""Programs with elements: what damaged and hostile files of them get."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.assets.zoo import Zoo
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Program, ProgramError, parse_program, program_bytes
from tests.assets.scenes import changed
from tests.assets.shapes import ball, element, torus


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
