"""The choice by the frontier in `scenelang render`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import scenelang as nsg
from lab.frontier.record import Errors, Frontier
from scenelang.cli import choosing
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import available
from scenelang.drawing.small import load_of
from scenelang.output import frontier as frontier_file
from scenelang.output.frontier import Cost
from tests.cli.conftest import Folder
from tests.output.test_frontier import frontier, point


def ladder() -> Frontier:
    """Three ways of the shipped model, one of a model that is not there, and the reference."""
    exact = point("exact reference, 4 spp", 80, 0.0, backend="reference", model=None, renderer="reference")
    return frontier(
        point("shapes2d, one sample", 10, 0.02, samples="one"),
        point("shapes2d", 16, 0.003),
        point("shapes2d, four samples", 30, 0.0029, samples="four"),
        point("gone", 1, 0.001, model="gone"),
        point("shapes2d, idle", 2, 0.02, offered=False, why_not="no use", cost=None),
        replace(exact, flip=Errors(0.0, 0.0, 0.0, 0.0)),
    )


@pytest.fixture
def shipped(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> Folder:
    """A folder to work in, and the ladder in place of the shipped frontier; this machine is as fast."""
    path = folder.path / "shipped.json"
    path.write_text(ladder().to_json(), "utf-8")
    monkeypatch.setattr(frontier_file, "frontier_path", lambda model: path)
    monkeypatch.setattr("scenelang.cli.choosing.yardstick", lambda: 1.0)
    return folder


def said(folder: Folder, *options: str) -> str:
    result = folder.run("render", folder.write("a.nsg"), "-o", "a.png", "-v", *options)
    assert result.exit_code == 0, result.output
    return result.stderr


@pytest.mark.parametrize(
    ("options", "name"),
    [
        (("--max-ms", "12"), "shapes2d, one sample: 10 ms"),
        (("--max-ms", "20"), "shapes2d: 16 ms"),
        (("--max-ms", "1000"), "exact reference, 4 spp: 80 ms"),
        (("--max-flip", "0.02"), "shapes2d, one sample: 10 ms"),
        (("--max-flip", "0.01"), "shapes2d: 16 ms"),
        (("--max-flip", "0"), "exact reference, 4 spp: 80 ms"),
        (("--max-flip", "0.01", "--max-ms", "50"), "shapes2d: 16 ms"),
        (("--max-ms", "1000", "--model", "shapes2d"), "shapes2d, four samples: 30 ms"),
        (("--max-flip", "0.01", "--size", "128x128"), "shapes2d: 16 ms and FLIP 0.006"),
        (("--max-flip", "0.005", "--size", "128x128"), "exact reference, 4 spp"),
    ],
)
def test_the_choice_is_told(shipped: Folder, options: tuple[str, ...], name: str) -> None:
    text = said(shipped, *options)
    assert f"chosen by the frontier: {name}" in text
    assert "runner-up: " in text
    assert "not in question: gone: not installed" in text or "--model" in options
    assert "idle" not in text


def test_what_is_chosen_is_what_is_drawn(shipped: Folder) -> None:
    name = shipped.write("a.nsg")

    def drawn(*options: str) -> np.ndarray:
        assert shipped.run("render", name, "-o", "b.png", *options).exit_code == 0
        with Image.open("b.png") as image:
            return np.asarray(image)

    for limit, way in (
        (("--max-ms", "12"), ("--samples", "one")),
        (("--max-ms", "20"), ()),
        (("--max-flip", "0"), ("--backend", "reference")),
    ):
        np.testing.assert_array_equal(drawn(*limit, "--threads", "1"), drawn(*way, "--threads", "1"))
    assert (drawn("--max-ms", "12") != drawn("--max-ms", "20")).any()


def test_nothing_that_suffices_is_an_error(shipped: Folder) -> None:
    result = shipped.run("render", shipped.write("a.nsg"), "-o", "a.png", "--max-ms", "2")
    assert result.exit_code == 2
    assert "a.nsg: nothing draws this scene within 2 ms; the fastest is shapes2d, one sample" in result.stderr
    assert not Path("a.png").exists()


def test_each_scene_is_chosen_for(shipped: Folder) -> None:
    small = shipped.write("small.nsg", "canvas(64, 64); square { scale(0.5); }\n")
    large = shipped.write("large.nsg")
    result = shipped.run("render", small, large, "-o", "out/", "--max-flip", "0.002", "--model", "shapes2d")
    assert result.exit_code == 2
    result = shipped.run("render", small, large, "-o", "out/", "--max-flip", "0.01", "-v")
    assert result.exit_code == 0
    assert result.stderr.count("chosen by the frontier: exact reference") == 1
    assert result.stderr.count("chosen by the frontier: shapes2d: ") == 1
    one = shipped.run("render", small, large, "-o", "new/", "--max-flip", "0.01", "--model", "shapes2d")
    assert one.exit_code == 2
    assert [p.name for p in Path("new").iterdir()] == ["large.png"]


def test_compiled_programs_take_their_own_model(shipped: Folder) -> None:
    assert shipped.run("compile", shipped.write("a.nsg"), "-o", "a.safetensors").exit_code == 0
    result = shipped.run("render", "a.safetensors", "-o", "a.png", "--max-ms", "20", "-v")
    assert "chosen by the frontier: shapes2d: 16 ms" in result.stderr
    assert "a compiled program keeps only what the network needs" in result.stderr


def test_frames_are_chosen_for(shipped: Folder) -> None:
    name = shipped.write("a.nsg", "animate(1, 4); square { scale(0.2 + 0.1 * u); }\n")
    assert shipped.run("render", name, "-o", "a.png", "--frame", "1", "--max-ms", "20").exit_code == 0


def test_a_missing_or_damaged_frontier(shipped: Folder) -> None:
    path = shipped.path / "shipped.json"
    path.write_text("{}", "utf-8")
    result = shipped.run("render", shipped.write("a.nsg"), "-o", "a.png", "--max-ms", "20")
    assert result.exit_code == 2
    assert "the frontier of `shapes2d` is damaged: not a frontier of format 1" in result.stderr
    path.unlink()
    result = shipped.run("render", "a.nsg", "-o", "a.png", "--max-ms", "20")
    assert result.exit_code == 2
    assert "model `shapes2d` ships no frontier to choose from" in result.stderr


def test_another_model_of_the_set_may_draw(shipped: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiled again for it; refused where it warns or errs and the scene's own model does not."""
    other = "shapes2d-w8"
    if other not in available():
        pytest.skip("no second model ships")
    points = [point(other, 5, 0.02, model=other), point("shapes2d", 16, 0.003)]
    (shipped.path / "shipped.json").write_text(frontier(*points).to_json(), "utf-8")
    text = said(shipped, "--max-flip", "0.05")
    assert f"chosen by the frontier: {other}: 5.0 ms" in text
    assert f"model {other} (chosen by the frontier)" in text
    name = shipped.write("named.nsg", 'model "shapes2d"; square { scale(0.5); }\n')
    assert other in shipped.run("render", name, "-o", "a.png", "--max-flip", "0.05", "-v").stderr

    def warns(scene: object, **options: object) -> object:
        made = compile_scene(scene, **options)  # type: ignore[arg-type]
        if options.get("model") == other:
            options["diagnostics"].add("W0501", "4 objects, trained on 3", None)  # type: ignore[attr-defined]
        return made

    monkeypatch.setattr(choosing, "compile_scene", warns)
    text = said(shipped, "--max-flip", "0.05")
    assert "chosen by the frontier: shapes2d: 16 ms" in text
    assert f"not in question: {other}: 4 objects, trained on 3" in text


@pytest.mark.parametrize(
    ("limit", "samples"), [(("--max-ms", "12"), "quick"), (("--max-flip", "0.02"), "draft")]
)
def test_solids_are_chosen_for(
    folder: Folder, monkeypatch: pytest.MonkeyPatch, limit: tuple[str, str], samples: str
) -> None:
    """And drawn by numpy, by which their times were taken; a cost grows with what the scene shows."""
    found = [
        point(f"solids3d, {way}", ms, flip, model="solids3d", renderer="solid", samples=way)
        for way, ms, flip in (("draft", 3, 0.015), ("quick", 9, 0.003), ("adaptive", 14, 0.002))
    ]
    ball = "sphere { scale(0.5); }\n"
    each = 1e6 / load_of(nsg.compile(nsg.loads(ball))).meetings
    found[1] = replace(found[1], cost=Cost(0.0, 0.0, 0.0, 9 * each, 0.0, 1.0))
    path = folder.path / "solids.json"
    path.write_text(replace(frontier(*found), set="mixed").to_json(), "utf-8")
    monkeypatch.setattr(frontier_file, "frontier_path", lambda model: path)
    monkeypatch.setattr("scenelang.cli.choosing.yardstick", lambda: 1.0)
    result = folder.run("render", folder.write("ball.nsg", ball), "-o", "a.png", "-v", *limit)
    assert result.exit_code == 0, result.output
    assert f"chosen by the frontier: solids3d, {samples}: " in result.stderr
    assert "drawn by numpy on one core" in result.stderr
    mist = folder.write("mist.nsg", "sphere { scale(1.5); material volumetric; }\n")
    assert folder.run("render", mist, "-o", "a.png", "--max-ms", "12", "--max-flip", "0.005").exit_code == 2


def test_the_reference_is_not_chosen_where_it_lacks_what_elements_were_made_from(
    folder: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    draft = point("solids3d, draft", 3, 0.015, model="solids3d", renderer="solid", samples="draft")
    exact = point("exact", 60, 0.0, renderer="reference", backend="reference", model=None)
    path = folder.path / "solids.json"
    path.write_text(replace(frontier(draft, exact), set="mixed").to_json(), "utf-8")
    monkeypatch.setattr(frontier_file, "frontier_path", lambda model: path)
    monkeypatch.delenv("SCENELANG_ORIGINALS", raising=False)
    name = folder.write(
        "m.nsg", 'nsg 1; canvas(24, 24); import "std/meshes" as m; m.monkey { scale(0.5); }\n'
    )
    result = folder.run("render", name, "-o", "a.png", "--max-flip", "0.0001")
    assert result.exit_code == 2
    assert "within FLIP 0.0001; the most exact is solids3d, draft" in result.stderr
    result = folder.run("render", name, "-o", "a.png", "--max-flip", "0.9", "-v")
    assert result.exit_code == 0, result.output
    assert "not in question: exact: `m.monkey` was made from `monkey.obj`, which is not in" in result.stderr
    assert "scenes like those of the set `mixed`, which have no elements" in result.stderr
