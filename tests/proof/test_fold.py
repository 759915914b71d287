"""Intervals through the exact fold: no sample of the distances leaves them, whatever is dropped."""

from __future__ import annotations

import numpy as np
import pytest

from scenelang.proof.fold import Enclosure, enclosed
from scenelang.reference.field import fold
from scenelang.renderers.meetings import Pairs, meetings_of
from tests.pictures import Array

K = 0.15


def folded(d: list[Array], c: list[Array], tokens: list[int], behind: Array) -> Array:
    """What samples (M,) of a region show (M, K), by the reference."""
    shown = behind
    for state, colour in fold(d, c, tokens):
        whole = np.concatenate([colour, np.ones((len(colour), len(behind) - 3))], 1)
        shown = np.where((state < 0)[:, None], whole, behind)
    return shown


@pytest.mark.parametrize("behind", [np.zeros(4), np.array([0.2, 0.9, 0.5])])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("most", [1, 3])
def test_no_sample_leaves_its_interval(seed: int, most: int, behind: Array) -> None:
    """Streams of all tokens, also without blends, where outside of everything only signs matter."""
    rng, blocks = np.random.default_rng(seed), 250
    block = np.repeat(np.arange(blocks), rng.integers(1, 7, blocks))
    tokens = rng.choice([0, 0, 1, 2, 3] if most == 3 else [0, 2, 3], len(block))
    tokens[np.flatnonzero(np.diff(block, prepend=-1))] = 0
    middle = rng.normal(0, 0.3, len(block)) * rng.choice([0.1, 1], len(block))
    rise = rng.choice([0, 1e-3, 0.05, 0.4], len(block))
    colours = rng.choice(2, (3, len(block))).astype(float)
    never = np.zeros(len(block), bool)
    meetings, source = meetings_of(Pairs(block, np.arange(len(block)), never, never, rise))
    some = Enclosure((middle - rise)[source], (middle + rise)[source])
    told = enclosed(
        meetings,
        some,
        Enclosure(colours[:, source], colours[:, source]),
        tokens[source],
        np.full(len(block), K),
        behind,
    )
    left = np.empty(len(block), bool)
    left[source] = told.left
    sure, far = 0, np.full(60, 100.0)
    for column, number in enumerate(meetings.columns):
        pairs = np.flatnonzero(block == number)
        share = rng.uniform(-1, 1, (len(pairs), 60)) ** rng.choice([1, 0], (1, 60), p=[0.7, 0.3])
        d = middle[pairs, None] + rise[pairs, None] * share * rng.choice([-1, 1], share.shape)
        c = [np.tile(colours[:, pair], (60, 1)) for pair in pairs]
        shown = folded(list(d), c, tokens[pairs].tolist(), behind)
        assert (shown - told.shown.high[:, column]).max() < 1e-9
        assert (told.shown.low[:, column] - shown).max() < 1e-9
        # what is left shows the same where nothing was
        kept = left[pairs]
        alone = folded(
            [far, *d[kept]], [c[0], *np.array(c)[kept]], [0, *tokens[pairs[kept]].tolist()], behind
        )
        np.testing.assert_allclose(alone, shown, atol=1e-9)
        sure += bool((told.shown.high - told.shown.low)[:, column].max() < 1e-9)
    assert sure > 0.4 * blocks
