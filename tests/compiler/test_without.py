"""Passes that only save work can be left out; the others cannot."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.passes import OPTIONAL, PASSES

SCENE = "square { scale(2); } star { scale(0.2); } pentagon { scale(0.1); translate(5, 0); }"


def test_what_is_left_out_is_known() -> None:
    assert {step.name for step in PASSES} >= OPTIONAL


def test_rows_stay_one_to_one_without_dropping() -> None:
    scene = nsg.loads(SCENE + "square { scale(3); }")
    assert compile_scene(scene).objects == ("square",)
    whole = compile_scene(scene, without=OPTIONAL)
    assert whole.objects == ("square", "star", "pentagon", "square")
    few = nsg.render(compile_scene(scene))
    # a network's answer to what is hidden is nearly, not wholly, nothing
    np.testing.assert_allclose(np.asarray(nsg.render(whole)), np.asarray(few), atol=1 / 255)


def test_a_needed_pass_cannot_be_left_out() -> None:
    with pytest.raises(ValueError, match="flatten"):
        compile_scene(nsg.loads(SCENE), without={"flatten"})
