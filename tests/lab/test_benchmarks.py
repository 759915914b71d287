"""Benchmarks count what they say they count."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from lab.sets.scenes import scenes_of
from scenelang.drawing.torch_backend import open_model


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
