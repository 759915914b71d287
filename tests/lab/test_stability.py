"""The stability suite: its measures on pictures of known error, its scenes, and the recorded bounds."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

from lab.probes import PROBES, TEXTURES, apart, rng_of, union_of
from lab.solid_probes import SOLIDS
from lab.stability import (
    OPTIONAL,
    arithmetic,
    compare,
    exact_picture,
    flicker,
    kit_of,
    order_of_disjoint,
    picture_of,
    run_probe,
    run_stability,
    scene_of,
    unfolded,
)
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.image import Image
from scenelang.drawing.metrics import psnr
from scenelang.drawing.neural.frames import Frames
from scenelang.drawing.neural.load import Model, load_model
from scenelang.language.scene import Chain, Object, Scale, Scene, Translate

RESULTS = Path(__file__).parents[2] / "docs/results"
RECORDED = {
    name: json.loads((RESULTS / file).read_text("utf-8"))
    for name, file in (("shapes2d", "stability.json"), ("solids3d", "stability-solids3d.json"))
    if (RESULTS / file).exists()
}
MOST = {("shapes2d", "canvas"): 256, ("solids3d", "canvas"): 128, ("solids3d", "objects"): 16}
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


def test_lifting_one_map_after_the_other_gives_the_same_chain(model: Model) -> None:
    scene = scene_of(PROBES["affine"], 16, 0, 5, model)
    program = compile_scene(scene, model="shapes2d", without=OPTIONAL)
    p = np.random.default_rng(1).uniform(-1, 1, (2, 50, len(program))).astype(np.float32)
    # merged deformations and single ones are other numbers for the same map
    ways = [
        Frames(vectors[:, :32]).local(NUMPY, np.arange(len(program)), p)
        for vectors in (unfolded(scene, program, model).vectors, program.vectors)
    ]
    np.testing.assert_allclose(*ways, rtol=1e-3, atol=1e-3)


def test_lifting_solids_one_map_after_the_other_gives_the_same_chain(solids: Model) -> None:
    scene = scene_of(SOLIDS.probes["affine"], 16, 0, 5, solids)
    program = compile_scene(scene, without=OPTIONAL)
    apart = unfolded(scene, program, solids).vectors
    assert (apart != program.vectors).any()
    np.testing.assert_allclose(apart, program.vectors, rtol=1e-3, atol=1e-4)


def test_probes_vary_one_thing() -> None:
    for of, name in [("shapes2d", n) for n in TEXTURES.probes] + [("solids3d", n) for n in SOLIDS.probes]:
        probe = kit_of(load_manifest(of)).probes[name]
        assert probe.healthy in probe.values
        first, again = (probe.make(rng_of(1, 2), probe.values[-1]) for _ in range(2))
        assert first == again
        assert probe.make(rng_of(1, 2), probe.values[0]) != first
        for value in (probe.values[0], probe.values[-1]):
            compile_scene(probe.make(rng_of(1, 3), value), model=of)  # raises where it is refused


def test_textures_drawn_small_flicker() -> None:
    """Against many samples: of few texels to a pixel hardly any change is wrong, of many most of it."""
    model = load_model("shapes2d")
    probe = kit_of(model.manifest).probes["texels"]
    small = dataclasses.replace(probe, values=(1.0, 16.0))
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(kit_of(model.manifest).probes, "texels", small)
        few, many = run_probe(model, "texels", 1, 3)["rows"]
    assert few["psnr"]["mean"] > 45 > 35 > many["psnr"]["mean"]
    assert few["flicker"]["mean"] < 0.25
    assert many["flicker"]["mean"] > 0.5


def test_objects_apart_do_not_overlap(model: Model) -> None:
    for index in range(5):
        nodes = apart(rng_of(3, index))
        covers = [exact_picture(union_of([node]), model)[1] for node in nodes]
        assert np.sum(covers, 0).max() == 1


def test_order_makes_no_difference_to_what_is_apart(model: Model) -> None:
    assert order_of_disjoint(model, 1, 4)["largest_difference"] < 1 / 255


def test_what_holds_of_any_scene_holds_of_solids(solids: Model) -> None:
    small = dataclasses.replace(solids, manifest=dataclasses.replace(solids.manifest, sizes=((32, 32),)))
    assert order_of_disjoint(small, 1, 4)["largest_difference"] < 1 / 255
    assert arithmetic(small, 1, 4)["threads"] < 1 / 255
    assert 0 < flicker(small, 1, 4)["mean"] < 0.5  # few pixels, each of one sample


def test_a_picture_of_another_scene_is_told(model: Model) -> None:
    """A model that draws something else is measured as wrong."""
    chain = PROBES["objects"].make(rng_of(1, 1), 2)
    (links,) = chain.nodes
    assert isinstance(links, Chain)
    reference = exact_picture(chain, model)
    moved = union_of([Object(geometry="star", transforms=(Translate(x=0.5, y=0.0),))])
    assert compare(exact_picture(moved, model)[0].astype(np.float32).view(Image), reference).psnr < 20


@pytest.mark.parametrize(("of", "name"), EVERY)
def test_recorded_bounds_hold(of: str, name: str, request: pytest.FixtureRequest) -> None:
    """The first scene of the recorded suite at both ends of every probe is no worse than recorded."""
    model, recorded = request.getfixturevalue("model" if of == "shapes2d" else "solids"), RECORDED[of]
    assert recorded["weights"] == model.digest, f"run `python -m lab stability {of}` again"
    probe, rows = kit_of(model.manifest).probes[name], recorded["probes"][name]["rows"]
    assert [row["value"] for row in rows] == list(probe.values)
    for row in (rows[0], rows[-1]):
        if row["value"] > MOST.get((of, name), math.inf):
            continue  # it takes long
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
