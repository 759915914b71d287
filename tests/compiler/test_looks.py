"""Looks of textures: their normal form changes no colour and no place."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenelang.compiler import steps as affine
from scenelang.compiler.graph import ColourStep, Look, coloured, normal
from scenelang.compiler.steps import Affine
from tests.assets.shapes import noise

_share = st.floats(0, 1).map(lambda v: round(v, 3))
_wild = st.one_of(_share, st.sampled_from([0.0, 1.0, -0.5, 1.5, 3.0]))
_step = st.one_of(
    st.tuples(st.just("color"), _wild, _wild, _wild),
    st.tuples(st.just("grayscale"), _wild),
    st.tuples(st.just("hue"), st.floats(-2, 2).map(lambda v: round(v, 3))),
)


@given(st.lists(_step, max_size=8), st.tuples(_share, _share, _share))
def test_the_normal_form_gives_the_same_colours(
    steps: list[ColourStep], rgb: tuple[float, float, float]
) -> None:
    found = normal(steps)
    assert len(found) <= len(steps)
    assert normal(found) == found
    assert coloured(found, rgb) == pytest.approx(coloured(steps, rgb), abs=1e-6)


@pytest.mark.parametrize(
    ("steps", "found"),
    [
        ([("color", 0.5, 0.5, 1.0), ("color", 0.5, 4.0, 1.0)], (("color", 0.25, 2.0, 1.0),)),
        ([("color", 2.0, 1.0, 1.0), ("color", 0.5, 1.0, 1.0)], None),  # clamped between
        ([("grayscale", 0.5), ("grayscale", 0.5)], (("grayscale", 0.75),)),
        ([("grayscale", 3.0), ("grayscale", 0.5)], None),
        ([("hue", 0.75), ("hue", 0.5)], (("hue", 0.25),)),
        ([("hue", -1.0), ("grayscale", 0.0), ("color", 1.0, 1.0, 1.0)], ()),
        (
            [("color", 0.5, 1.0, 1.0), ("hue", 0.5), ("hue", 0.5), ("color", 1.0, 0.5, 1.0)],
            (("color", 0.5, 0.5, 1.0),),
        ),
    ],
)
def test_what_joins(steps: list[ColourStep], found: tuple[ColourStep, ...] | None) -> None:
    assert normal(steps) == (tuple(steps) if found is None else found)


def test_a_texture_folds_to_one_move_and_stays_a_texture() -> None:
    moves = (Affine(affine.rotation(0.3)), Affine(affine.translation(0.2, 0.1)))
    look = Look("flat", (("hue", 0.5), ("hue", 0.25)), element=noise(2, 2), texture=moves)
    folded = look.folded()
    assert (folded.element, folded.colours) == (look.element, (("hue", 0.75),))
    assert folded.texture == (Affine(affine.compose(moves[1].rows, moves[0].rows)),)
    assert folded.folded() is folded
    np.testing.assert_allclose(folded.moved, look.moved)
