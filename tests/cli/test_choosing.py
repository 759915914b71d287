"""The choice by the frontier in `scenelang render`."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import scenelang as nsg
from lab.frontier.record import FrameErrors, Frontier
from scenelang.cli import inputs
from scenelang.compiler.compile import compile_scene
from scenelang.drawing.work import LIGHT_MS, load_of
from scenelang.output import frontier as frontier_file
from scenelang.output.frontier import Cost
from tests.cli.conftest import Folder
from tests.output.test_frontier import frontier, point

EXACT = replace(
    point("exact reference, 4 spp", 80, 0.0, backend="reference", model=None, renderer="reference"),
    flip=FrameErrors(0.0, 0.0, 0.0, 0.0),
)


def ladder() -> Frontier:
    """Three ways of the shipped model, one of a model that is not there, and the reference."""
    return frontier(
        point("shapes2d, one sample", 10, 0.02, samples="one"),
        point("shapes2d", 16, 0.003),
        point("shapes2d, four samples", 30, 0.0029, samples="four"),
        point("gone", 1, 0.001, model="gone"),
        point("shapes2d, idle", 2, 0.02, offered=False, why_not="no use", cost=None),
        EXACT,
    )


@pytest.fixture
def shipped(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> Folder:
    """A folder to work in, and the ladder in place of the shipped frontier; this machine is as fast."""
    path = folder.path / "shipped.json"
    path.write_text(ladder().to_json(), "utf-8")
    monkeypatch.setattr(frontier_file, "frontier_path", lambda model: path)
    monkeypatch.setattr("scenelang.output.frontier.yardstick", lambda: 1.0)
    return folder


SMALL = "canvas(16, 16); square { scale(0.5); }\n"


def said(folder: Folder, options: str, text: str = "square { scale(0.5); }\nstar { scale(0.3); }\n") -> str:
    name = folder.write("a.nsg", text)
    return folder.run("render", name, "-o", "a.png", "-v", *options.split(), code=0).stderr


def test_the_choice_is_told(shipped: Folder) -> None:
    for options, name in (
        ("--max-ms 12", "shapes2d, one sample: 10 ms"),
        ("--max-ms 1000", "exact reference, 4 spp: 80 ms"),
        ("--max-flip 0.01", "shapes2d: 16 ms"),
        ("--max-flip 0.01 --max-ms 50", "shapes2d: 16 ms"),
        ("--max-ms 1000 --model shapes2d", "shapes2d, four samples: 30 ms"),
        ("--max-flip 0.01 --size 128x128", "shapes2d: 16 ms and FLIP 0.006"),
        ("--max-flip 0.005 --size 128x128", "exact reference, 4 spp"),
    ):
        text = said(shipped, options)
        assert f"chosen by the frontier: {name}" in text, options
        assert "runner-up: " in text
        assert "not in question: gone: not installed" in text or "--model" in options
        assert "idle" not in text


def test_what_is_chosen_is_what_is_drawn(shipped: Folder) -> None:
    """Frames of animations, by --frame, too."""
    name = shipped.write("a.nsg", "animate(1, 4); star { scale(0.2 + u); material flat { color(#d33); } }\n")
    pictures = []
    for limit, way in (
        ("--max-ms 12", "--samples one --device cpu"),
        ("--max-ms 20", "--samples adaptive --device cpu"),
        ("--max-flip 0", "--backend reference"),
    ):
        for options in (limit, way):
            arguments = ("--frame", "1", "--threads", "1", *options.split())
            shipped.run("render", name, "-o", "b.png", *arguments, code=0)
            with Image.open("b.png") as image:
                pictures.append(np.asarray(image))
        np.testing.assert_array_equal(*pictures[-2:])
    assert (pictures[0] != pictures[2]).any()


def test_each_scene_is_chosen_for(shipped: Folder) -> None:
    """Scenes that nothing draws as well are reported, and the others drawn."""
    names = shipped.write("small.nsg", "canvas(64, 64); square { scale(0.5); }\n"), shipped.write("large.nsg")
    flip = ("--max-flip", "0.01")
    both = shipped.run("render", *names, "-o", "out/", *flip, "-v", code=0).stderr
    assert both.count("chosen by the frontier: exact reference") == 1
    assert both.count("chosen by the frontier: shapes2d: ") == 1
    shipped.run("render", *names, "-o", "new/", *flip, "--model", "shapes2d", code=2)
    assert os.listdir("new") == ["large.png"]
    none = shipped.run("render", names[1], "-o", "a.png", "--max-ms", "2", code=2).stderr
    assert "large.nsg: nothing draws this scene within 2 ms; the fastest is shapes2d, one sample" in none
    assert not Path("a.png").exists()


def test_compiled_programs_take_their_own_model(shipped: Folder) -> None:
    shipped.run("compile", shipped.write("a.nsg"), "-o", "a.safetensors", code=0)
    result = shipped.run("render", "a.safetensors", "-o", "a.png", "--max-ms", "20", "-v")
    assert "chosen by the frontier: shapes2d: 16 ms" in result.stderr
    assert "a compiled program keeps only what the network needs" in result.stderr


def test_a_missing_or_damaged_frontier(shipped: Folder) -> None:
    path, arguments = shipped.path / "shipped.json", ("-o", "a.png", "--max-ms", "20")
    path.write_text("{}", "utf-8")
    result = shipped.run("render", shipped.write("a.nsg"), *arguments, code=2)
    assert "the frontier of `shapes2d` is damaged: not a frontier of format 1" in result.stderr
    path.unlink()
    result = shipped.run("render", "a.nsg", *arguments, code=2)
    assert "model `shapes2d` ships no frontier to choose from" in result.stderr


def test_another_model_of_the_set_may_draw(shipped: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiled again for it; refused where it warns or errs and the scene's own model does not."""
    other = "shapes2d-reading"
    points = [point(other, 5, 0.02, model=other), point("shapes2d", 16, 0.003)]
    (shipped.path / "shipped.json").write_text(frontier(*points).to_json(), "utf-8")
    text = said(shipped, "--max-flip 0.9", SMALL)
    assert f"chosen by the frontier: {other}: 5.0 ms" in text
    assert f"model {other} (chosen by the frontier)" in text
    assert other in said(shipped, "--max-flip 0.9", f'model "shapes2d"; {SMALL}')

    def warns(scene: object, **options: object) -> object:
        made = compile_scene(scene, **options)  # type: ignore[arg-type]
        if options.get("model") == other:
            options["diagnostics"].add("W0501", "4 objects, trained on 3", None)  # type: ignore[attr-defined]
        return made

    monkeypatch.setattr(inputs, "compile_scene", warns)
    text = said(shipped, "--max-flip 0.9", SMALL)
    assert "chosen by the frontier: shapes2d: 16 ms" in text
    assert f"not in question: {other}: 4 objects, trained on 3" in text


def test_solids_are_chosen_for(shipped: Folder) -> None:
    """And drawn without torch, as when their times were taken; a cost grows with what the scene shows."""
    points = [
        point(f"solids3d, {way}", ms, flip, model="solids3d", renderer="solid", samples=way)
        for way, ms, flip in (("draft", 3, 0.015), ("quick", 9, 0.003), ("adaptive", 14, 0.002))
    ]
    ball = "sphere { scale(0.5); }\n"
    each = 1e6 / load_of(nsg.compile(nsg.loads(ball))).meetings
    points[1] = replace(points[1], cost=Cost(0.0, 0.0, 0.0, 9 * each, 0.0, 1.0))
    path = shipped.path / "shipped.json"
    path.write_text(replace(frontier(*points), set="mixed").to_json(), "utf-8")
    for options, samples in (("--max-ms 12", "quick"), ("--max-flip 0.02", "draft")):
        text = said(shipped, options, ball)
        assert f"chosen by the frontier: solids3d, {samples}: " in text
        assert " by the kernel\n" in text
    mist = shipped.write("mist.nsg", "sphere { scale(1.5); material volumetric; }\n")
    shipped.run("render", mist, "-o", "a.png", "--max-ms", "12", "--max-flip", "0.005", code=2)


def test_a_sky_is_in_what_is_promised(shipped: Folder) -> None:
    """Its light takes as long however fast a way draws, and no errors of it were measured."""
    draft = point("solids3d, draft", 3, 0.015, model="solids3d", renderer="solid", samples="draft")
    exact = replace(EXACT, cost=Cost(1.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    (shipped.path / "shipped.json").write_text(
        replace(frontier(draft, exact), set="mixed").to_json(), "utf-8"
    )
    scene = "canvas(24, 24); sky();\nsphere { scale(0.5); }\n"
    light = LIGHT_MS * load_of(nsg.compile(nsg.loads(scene))).light
    name = shipped.write("sky.nsg", scene)
    for limit in ("--max-ms", f"{light:g}"), ("--max-flip", "0.9"):
        result = shipped.run("render", name, "-o", "a.png", *limit, code=2)
        assert re.search(r"solids3d, draft: \d+ ms at most, no error promised", result.stderr)
        assert not (shipped.path / "a.png").exists()
    text = said(shipped, f"--max-ms {2 * light + 99:g}", scene)
    assert "chosen by the frontier: solids3d, draft" in text
    assert "ms of work for the network were foretold" in text
    assert (
        "not in question: exact reference, 4 spp: its paths under a sky take longer than was measured" in text
    )


def test_the_reference_is_not_chosen_where_originals_are_missing(
    shipped: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    draft = point("solids3d, draft", 3, 0.015, model="solids3d", renderer="solid", samples="draft")
    path = shipped.path / "shipped.json"
    path.write_text(replace(frontier(draft, EXACT), set="mixed").to_json(), "utf-8")
    monkeypatch.delenv("SCENELANG_ORIGINALS", raising=False)
    scene = 'nsg 1; canvas(24, 24); import "std/meshes" as m; m.monkey { scale(0.5); }\n'
    name = shipped.write("m.nsg", scene)
    result = shipped.run("render", name, "-o", "a.png", "--max-flip", "0.0001", code=2)
    assert "within FLIP 0.0001; the most exact is solids3d, draft" in result.stderr
    text = said(shipped, "--max-flip 0.9", scene)
    assert "exact reference, 4 spp: `m.monkey` was made from `monkey.obj`, which is not in" in text
    assert "scenes like those of the set `mixed`, which have no elements" in text
