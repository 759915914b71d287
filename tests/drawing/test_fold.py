"""Intervals through the exact fold: no sample of the distances leaves them, whatever is dropped."""

from __future__ import annotations

import numpy as np
import pytest

from scenelang.compiler.groups import OPERATOR, felt, read_groups, widths_of
from scenelang.drawing.neural.meetings import Interval, Pairs, meetings_of, nesting
from scenelang.drawing.proof import Joins, blended, enclosed
from tests.groups import State, folded, random_tokens
from tests.pictures import Array


def shown_by(state: State, behind: Array) -> Array:
    """What samples (M,) of a region show (M, K)."""
    if state is None:
        return behind
    whole = np.concatenate([state[1], np.ones((len(state[1]), len(behind) - 3))], 1)
    return np.where((state[0] < 0)[:, None], whole, behind)


@pytest.mark.parametrize("behind", [np.zeros(4), np.array([0.2, 0.9, 0.5])])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["blends", "sharp", "rounded", "groups", "sharp groups"])
def test_no_sample_leaves_its_interval(seed: int, kind: str, behind: Array) -> None:
    """Streams of all tokens, also without blends, where outside of everything only signs matter."""
    rng, blocks = np.random.default_rng(seed), 250
    counts = rng.integers(1, 7, blocks)
    block = np.repeat(np.arange(blocks), counts)
    deepest = 3 if "groups" in kind else 0
    whole = [random_tokens(rng, int(count), deepest) for count in counts]
    tokens = np.array([token for part in whole for token in part])
    if "sharp" in kind:
        tokens = np.where((tokens & OPERATOR) == 1, tokens - 1, tokens)
    rounds = "sharp" not in kind and kind != "blends"
    given = rng.choice([0.0, 0.2], len(tokens)) * rounds
    widths = widths_of(tokens & OPERATOR, given)
    free, parts = [], np.split(np.arange(len(tokens)), counts.cumsum()[:-1])
    for part in parts:
        seen = felt(read_groups(tokens[part].astype(np.int8)), widths[part])
        free.append(~seen.inside & (seen.blends == 0))
    groups = read_groups(tokens.astype(np.int8))
    middle = rng.normal(0, 0.3, len(block)) * rng.choice([0.1, 1], len(block))
    rise = rng.choice([0, 1e-3, 0.05, 0.4], len(block))
    colours = rng.choice(2, (3, len(block))).astype(float)
    never = np.zeros(len(block), bool)
    meetings, source = meetings_of(Pairs(block, np.arange(len(block)), never, never, rise))
    some = Interval((middle - rise)[source], (middle + rise)[source])
    own = np.where(groups.first, 0.0, widths)
    joins, first = Joins(groups.tokens, own, np.concatenate(free)).some(source), groups.rows
    nest = nesting(meetings, groups) if deepest else None
    if not deepest:
        joins = joins._replace(free=~blended(meetings, (widths > 0)[source]))
    shown, changing = enclosed(
        meetings,
        some,
        Interval(colours[:, source], colours[:, source]),
        joins,
        behind,
        nest,
        Joins(groups.joins, widths[first], np.concatenate(free)[first]),
    )
    left = np.empty(len(block), bool)
    left[source] = changing
    sure = 0
    for column, number in enumerate(meetings.columns):
        pairs = np.flatnonzero(block == number)
        share = rng.uniform(-1, 1, (len(pairs), 60)) ** rng.choice([1, 0], (1, 60), p=[0.7, 0.3])
        d = middle[pairs, None] + rise[pairs, None] * share * rng.choice([-1, 1], share.shape)
        c = [np.tile(colours[:, pair], (60, 1)) for pair in pairs]
        rows = list(d), c, tokens[pairs].tolist(), widths[pairs].tolist()
        seen = shown_by(folded(*rows), behind)
        assert (seen - shown.high[:, column]).max() < 1e-9
        assert (shown.low[:, column] - seen).max() < 1e-9
        # what is left shows the same where nothing was
        alone = shown_by(folded(*rows, left[pairs].tolist()), behind)
        np.testing.assert_allclose(np.broadcast_to(alone, seen.shape), seen, atol=1e-9)
        sure += bool((shown.high - shown.low)[:, column].max() < 1e-9)
    assert sure > 0.4 * blocks
