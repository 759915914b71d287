"""Benchmarks count what they say they count."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from lab.bench.counted import counting
from lab.bench.floor import here, network, programs
from lab.frontier.outlines import outlines
from lab.sets.scenes import scenes_of
from scenelang.backend.neural import open_model
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.graph.lower import lower
from scenelang.measure.metrics import psnr
from scenelang.measure.plan import reference_of
from scenelang.models.framed import load_arrays
from scenelang.models.manifest import load_manifest


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


@pytest.mark.oracle
@pytest.mark.parametrize("index", range(4))
def test_skia_paints_the_polygons_of_unions_as_the_definition_does(index: int) -> None:
    """Of finer and finer samples the exact picture comes nearer to Skia's coverage."""
    unions = pytest.importorskip("lab.bench.unions", reason="the extra `oracles` is not installed")
    manifest = load_manifest("shapes2d")
    scene = scenes_of(open_model("shapes2d"), "unions", 5)(index)
    graph = lower(scene.model_copy(update={"model": "shapes2d"}), manifest, None, Diagnostics())
    drawn = unions.by_skia(outlines(graph), scene.canvas)
    four, many = (psnr(drawn, reference_of(scene, manifest, per_side=side), 100.0) for side in (2, 8))
    assert four > 38
    assert many > max(45, four)


def test_solids_are_compared_with_their_own_converged_picture_and_the_definition(tmp_path: Path) -> None:
    pytest.importorskip("mitsuba")
    from lab.bench import solids

    scene = scenes_of(open_model("solids3d"), "diffuse", 1, 24)(0)
    renderers: solids.Renderers = {"ours": partial(solids.ours, solids.nets([]))}
    rows = solids.one_scene(renderers, scene, 0, tmp_path)
    again = solids.one_scene(renderers, scene, 0, tmp_path)
    assert len(list(tmp_path.glob("ours-*.npy"))) == 1
    assert all(rows[way]["flip"] == again[way]["flip"] for way in rows)
    assert rows["reference, 4 spp"]["flip_defined"] == 0 < rows["reference, 4 spp"]["flip"]
    assert rows["formulas, four"]["flip_defined"] < rows["formulas, one"]["flip_defined"]
    told = solids.summary(
        [{**rows["network, one"], "ms": ms} for ms in (30.0, 10.0, 20.0)], [10.0, 10.0, 10.0]
    )
    assert (told["ms"]["median"], told["times"]["mean"], told["scenes"]) == (20, 2, 3)
