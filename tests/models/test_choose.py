"""Which model draws a scene that names none, among models of different speed and error."""

from __future__ import annotations

from dataclasses import replace

import pytest

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.graph.lower import lower
from scenelang.models.choose import best_of_sets, choose_model
from scenelang.models.manifest import Manifest, load_manifest
from scenelang.scene.schema import Object, Scene

BASE = load_manifest("shapes2d")


def like(name: str, flip: float | None, **changes: object) -> Manifest:
    measured = {} if flip is None else {"sets": {"shapes2d": {"flip": flip}}}
    return replace(BASE, name=name, measured=measured, **changes)  # type: ignore[arg-type]


EXACT, ROUGH, UNKNOWN = like("m", 0.001), like("a", 0.1), like("b", None)
FIXED = like("c", 0.0001, sizes=((64, 64),), white=True)
STAR = Object(geometry="star")


def test_the_least_error_wins_not_the_first_name() -> None:
    scene = Scene(nodes=(STAR,))
    assert choose_model(scene, [ROUGH, UNKNOWN, EXACT]) is EXACT
    assert choose_model(scene, [UNKNOWN, ROUGH]) is ROUGH


def test_a_model_of_another_canvas_or_background_does_not_fit() -> None:
    models = [EXACT, FIXED]
    assert choose_model(Scene(canvas=(64, 64), nodes=(STAR,)), models) is FIXED
    assert choose_model(Scene(canvas=(65, 64), nodes=(STAR,)), models) is EXACT
    assert choose_model(Scene(canvas=(64, 64), background=None, nodes=(STAR,)), models) is EXACT
    assert choose_model(Scene(canvas=(64, 64), background=(1, 1, 0.5), nodes=(STAR,)), models) is EXACT


@pytest.mark.parametrize(
    ("scene", "codes"),
    [
        (Scene(canvas=(64, 64), nodes=(STAR,)), []),
        (Scene(canvas=(64, 32), nodes=(STAR,)), ["E0509"]),
        (Scene(canvas=(64, 64), background=None, nodes=(STAR,)), ["E0510"]),
    ],
)
def test_what_a_model_cannot_paint_is_said(scene: Scene, codes: list[str]) -> None:
    found = Diagnostics()
    lower(scene, FIXED, None, found)
    assert [d.code for d in found] == codes


def test_one_model_a_set_says_what_is_lacking() -> None:
    other = replace(BASE, name="z", set="others", measured={})
    assert best_of_sets([UNKNOWN, other, EXACT, ROUGH]) == [EXACT, other]
