"""Canvases and backgrounds that a model refuses."""

from __future__ import annotations

from dataclasses import replace

import pytest

from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.scene import Object, Scene

BASE = load_manifest("shapes2d")


FIXED = replace(BASE, sizes=((64, 64),), white=True)
STAR = Object(geometry="star")


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
