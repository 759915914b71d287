"""Benchmarks count what they say they count."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.counted import counting
from benchmarks.floor import here, network, programs
from scenelang.models.framed import load_arrays


@pytest.mark.parametrize("library", ["numpy", "exact"])
def test_calls_are_counted_by_part(library: str) -> None:
    draw = here(network(library, "shapes2d"), programs("many", 1))
    plain = draw(0)
    with counting() as calls:
        counted = draw(0)
    assert np.array_equal(plain.picture, counted.picture)
    spent = {call.part: 0 for call in calls}
    for call in calls:
        spent[call.part] += call.operations
        assert call.moved >= 0 < call.seconds
    assert {"frames", "decoder", "cell", "bounds", "gather, scatter", "lists of pairs"} == spent.keys()
    each = sum(2 * w[0].size for w in load_arrays("shapes2d").network.decoder_w)
    products = counted.pairs * each
    assert (spent["decoder"] >= products) == (library == "numpy")
    assert spent["decoder"] < 1.4 * products  # units, biases, and points to make blocks even
    assert spent["gather, scatter"] == 0
    before = len(calls)
    draw(0)
    assert len(calls) == before
