"""The stability suite: its measures, its scenes, recorded bounds, and ranges out of its curves."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.probes import PROBES, TEXTURES, rng_of
from lab.solid_probes import SOLIDS
from lab.stability import (
    OPTIONAL,
    arithmetic,
    compare,
    exact_picture,
    flicker,
    kit_of,
    measured_ranges,
    order_of_disjoint,
    picture_of,
    run_stability,
    scene_of,
    unfolded,
)
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.weights import replaced
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.image import Image
from scenelang.drawing.metrics import psnr
from scenelang.drawing.neural.frames import Frames
from scenelang.drawing.neural.load import Model, load_model
from scenelang.language.scene import Object, Scale, Scene, Translate

RESULTS = Path(__file__).parents[2] / "docs/results"
RECORDED = {
    name: json.loads((RESULTS / file).read_text("utf-8"))
    for name, file in (("shapes2d", "stability.json"), ("solids3d", "stability-solids3d.json"))
    if (RESULTS / file).exists()
}
MOST = {(model, name): 16 for model in RECORDED for name in ("objects", "blends")}
MOST |= {("shapes2d", "canvas"): 256, ("solids3d", "canvas"): 128, ("solids3d", "deep"): 2}
EVERY = [(model, name) for model in RECORDED for name in RECORDED[model]["probes"]]


@pytest.fixture(scope="module")
def model() -> Model:
    return load_model("shapes2d")


@pytest.fixture(scope="module")
def solids() -> Model:
    return load_model("solids3d")


def test_edges_and_cover_of_a_square(model: Model) -> None:
    # a white canvas with a white square: it covers pixels, and its outline is an edge all the same
    square = Object(geometry="square", transforms=(Scale.uniform(2**0.5 / 2),))
    picture, covered, edge = exact_picture(Scene(model="shapes2d", canvas=(16, 16), nodes=(square,)), model)
    assert picture.shape == (16, 16, 3)
    assert covered.sum() == 8 * 8
    # pixels on either side of the outline
    assert edge.sum() == (8 * 8 - 6 * 6) + 4 * 8
    wrong = picture.copy()
    wrong[0, 0] = 0.0
    errors = compare(wrong.astype(np.float32).view(Image), (picture, covered, edge))
    assert errors.per_edge == pytest.approx(1 / edge.sum())
    assert errors.per_covered == pytest.approx(1 / 64)


def test_solids_cover_what_is_not_as_without_them(solids: Model) -> None:
    """A ball far above the view is in no pixel, but for its shadow."""
    above = Object(geometry="sphere", transforms=(Translate(1.25, 2.5, 1.5),))
    scene = Scene(model="solids3d", canvas=(16, 16), nodes=(above,))
    picture, covered, _ = exact_picture(scene, solids)
    assert 0 < covered.sum() < 128
    assert (
        picture[covered] < exact_picture(scene.model_copy(update={"nodes": ()}), solids)[0][covered]
    ).all()


def test_lifting_one_map_after_the_other_gives_the_same_chain(model: Model, solids: Model) -> None:
    scene = scene_of(PROBES["affine"], 16, 0, 5, model)
    program = compile_scene(scene, model="shapes2d", without=OPTIONAL)
    p = np.random.default_rng(1).uniform(-1, 1, (2, 50, len(program))).astype(np.float32)
    # merged deformations and single ones are other numbers for the same map
    ways = [
        Frames(vectors[:, :32]).local(NUMPY, np.arange(len(program)), p)
        for vectors in (unfolded(scene, program, model).vectors, program.vectors)
    ]
    np.testing.assert_allclose(*ways, rtol=1e-3, atol=1e-3)
    scene = scene_of(SOLIDS.probes["affine"], 16, 0, 5, solids)
    program = compile_scene(scene, without=OPTIONAL)
    np.testing.assert_allclose(
        unfolded(scene, program, solids).vectors, program.vectors, rtol=1e-3, atol=1e-4
    )


def test_probes_vary_one_thing() -> None:
    for of, name in [("shapes2d", n) for n in TEXTURES.probes] + [("solids3d", n) for n in SOLIDS.probes]:
        probe = kit_of(load_manifest(of)).probes[name]
        assert probe.healthy in probe.values
        first, again = (probe.make(rng_of(1, 2), probe.values[-1]) for _ in range(2))
        assert first == again
        assert probe.make(rng_of(1, 2), probe.values[0]) != first
        for value in (probe.values[0], probe.values[-1]):
            compile_scene(probe.make(rng_of(1, 3), value), model=of)  # raises where it is refused


def test_what_holds_of_any_scene(model: Model, solids: Model) -> None:
    assert order_of_disjoint(model, 1, 4)["largest_difference"] < 1 / 255
    small = dataclasses.replace(solids, manifest=dataclasses.replace(solids.manifest, sizes=((16, 16),)))
    assert order_of_disjoint(small, 1, 4)["largest_difference"] < 1 / 255
    assert arithmetic(small, 1, 4)["threads"] < 1 / 255
    assert 0 < flicker(small, 1, 4)["mean"] < 0.5  # few pixels, each of one sample


@pytest.mark.parametrize(("of", "name"), EVERY)
def test_recorded_bounds_hold(of: str, name: str, request: pytest.FixtureRequest) -> None:
    """The first scene of the recorded suite at both ends of every probe is no worse than recorded."""
    model, recorded = request.getfixturevalue("model" if of == "shapes2d" else "solids"), RECORDED[of]
    known = recorded["weights"] in (model.digest, replaced(recorded["weights"]))
    assert known, f"run `python -m lab stability {of}` again"
    probe, rows = kit_of(model.manifest).probes[name], recorded["probes"][name]["rows"]
    assert [row["value"] for row in rows] == list(probe.values)
    rows = [row for row in rows if row["value"] <= MOST.get((of, name), math.inf)]  # others take long
    for row in (rows[0], rows[-1]):
        scene = scene_of(probe, row["value"], 0, recorded["seed"], model)
        program = compile_scene(scene, model=of, without=OPTIONAL)
        if not probe.folded:
            program = unfolded(scene, program, model)
        found = psnr(picture_of(model, program), exact_picture(scene, model)[0])
        assert found >= row["psnr"]["worst"] - 0.5, row["value"]


def test_recorded_invariants_hold() -> None:
    for of in [of for of in RECORDED if RECORDED[of]["invariants"]]:
        invariants = RECORDED[of]["invariants"]
        assert invariants["order_of_disjoint"]["largest_difference"] < 1 / 255
        assert all(change < 1 / 255 for change in invariants["arithmetic"].values() if change != "skipping")


def test_what_is_known_is_not_measured_again(model: Model) -> None:
    first = run_stability(model, 2, 9, ("shear", "arithmetic"))
    for row in first["probes"]["shear"]["rows"]:
        assert 0 <= row["worst_scene"] < 2
    told = dict(first["probes"]["shear"], rows=first["probes"]["shear"]["rows"][1:])
    told["rows"][0]["psnr"] = {"mean": 7.0, "worst": 7.0}  # as no model draws
    few = {"thin": {"scenes": 1, "rows": [{"value": 1}]}}
    again = run_stability(model, 2, 9, ("shear",), known=[{**first, "probes": {"shear": told, **few}}])
    assert again["probes"]["thin"] == few["thin"]  # not asked for
    assert again["probes"]["shear"]["rows"] == [first["probes"]["shear"]["rows"][0], *told["rows"]]
    assert again["invariants"] == first["invariants"]
    with pytest.raises(ValueError, match="another seed"):
        run_stability(model, 2, 10, ("shear",), known=[first])


def probe(healthy: float, **psnr: float) -> dict[str, Any]:
    rows = [
        {"value": float(value[1:].replace("_", ".")), "psnr": {"mean": mean, "p5": mean, "worst": mean - 1}}
        for value, mean in psnr.items()
    ]
    return {"healthy": healthy, "rows": rows}


def test_a_range_ends_where_the_error_begins_to_show() -> None:
    """Where nothing is lost there is none; a model of larger error is compared with itself."""
    for probes, ranges, lines in (
        ({"objects": probe(4, v1=50, v4=50, v16=40.1, v32=39.9, v64=50)}, {"objects": [1, 16]},
         {"objects": "32: 39.9 dB (worst 38.9), 64: 50.0 dB (worst 49.0)"}),
        ({"objects": probe(4, v1=50, v4=50, v64=49.6), "thin": probe(3, v1=50, v3=50, v300=45.7)}, {}, {}),
        ({"blends": probe(4, v1=50, v4=47, v64=41.2)}, {}, {}),
        ({"size": probe(1, v0_1=50, v1=50, v4=50)}, {}, {}),
        ({"blends": probe(2, v1=20.5, v2=20, v4=19.2, v8=18.9)}, {"smooth": [0, 4]},
         {"smooth": "8: 18.9 dB (worst 17.9)"}),
        ({"size": probe(1, v0_1=39, v0_5=50, v1=50, v2=50, v4=30),
          "warp": probe(1, v0_5=50, v1=50, v2=50, v3=30)},
         {"scale": [0.1, 1.1], "twirl": [-1.6, 1.6], "bend": [-1.6, 1.6]},
         {"scale": "0.02: 39.0 dB (worst 38.0), 2.2: 30.0 dB (worst 29.0)",
          "twirl": "2.4: 30.0 dB (worst 29.0)", "bend": "2.4: 30.0 dB (worst 29.0)"}),
    ):  # fmt: skip
        assert measured_ranges({"probes": probes}) == (ranges, lines)
