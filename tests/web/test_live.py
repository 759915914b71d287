"""A scene that runs in a page is the one that the compiler compiles, for any params and in any frame."""

from __future__ import annotations

import math
import random
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.sets.plane import SETS
from lab.sets.plane import random_scene as random_set_scene
from lab.sets.solids import SOLID_SETS, random_solid
from scenelang.language.diagnostics import SourceFile
from scenelang.language.reports import SceneError
from scenelang.language.scene import Camera, Scene
from tests.compiler.random_scenes import blob_scene, full_scene, random_scene
from tests.web.live import (
    check_picture,
    check_rows,
    compiled,
    defined,
    drawable,
    moved,
    pictures,
    sources,
)

pytestmark = pytest.mark.browser
ROOT = Path(__file__).parents[2]
EXAMPLES = [path for path in sorted(ROOT.glob("examples/**/*.nsg")) if path.name != "still.nsg"]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_every_param_and_frame_of_the_examples(path: Path, viewer_page: Any) -> None:
    source = SourceFile(str(path), path.read_text())
    first = compiled(source, path)
    form, frames = first.form(), first.evaluation.frames
    assert not form.fixed
    cases = [({}, frame) for frame in sorted({0, 1 % frames, frames // 3, frames - 1})]
    pick = random.Random(path.name)
    for param in form.params:
        cases += [({param["name"]: value}, pick.randrange(frames)) for value in moved(param)]
    params = {param["name"]: param for param in form.params}
    inputs = [{"params": values, "frame": frame} for values, frame in cases]
    shown = pictures(viewer_page, [(form, inputs)])[0]
    for (values, frame), picture in zip(cases, shown, strict=True):
        given = {name: defined(params[name], value) for name, value in values.items()}
        try:
            expected = compiled(source, path, params=given, frame=frame, model=first.manifest.name)
        except SceneError:
            assert isinstance(picture, str), (values, frame)
            continue
        assert isinstance(picture, dict), (picture, values, frame)
        check_picture(picture, expected, form)
        if not values and not frame:
            check_rows(picture["rows"], expected.program)


def agree(page: Any, scenes: Iterable[SourceFile], **inputs: Any) -> tuple[int, int]:
    """Hold a page's pictures of scenes against the compiler's; how many it has, and how many it refuses."""
    listed = [(source, found) for source in scenes if (found := drawable(source, **inputs)) is not None]
    shown = pictures(page, [(form, [{}]) for _, (form, _) in listed])
    for (source, (form, expected)), (picture,) in zip(listed, shown, strict=True):
        assert isinstance(picture, str if expected is None else dict), (source.name, source.text, picture)
        if expected is not None:
            check_picture(picture, expected, form)
    good = sum(expected is not None for _, (_, expected) in listed)
    return good, len(listed) - good


def test_scenes_of_documentation_and_conformance_suite(viewer_page: Any) -> None:
    good, refused = agree(viewer_page, sources(ROOT), root=ROOT / "examples")
    assert good > 150
    assert refused >= 5  # by passes, not by the evaluator


def any_scene(seed: int) -> Scene:
    """A tree with groups in groups, and blends of several widths."""
    return random_set_scene(np.random.default_rng(seed), SETS["trees"])


def test_random_trees_of_the_plane(viewer_page: Any) -> None:
    makers = (random_scene, full_scene, blob_scene, any_scene)
    scenes = [(f"{make.__name__}({n})", make(n).to_nsg()) for make in makers for n in range(60)]
    good, refused = agree(viewer_page, (SourceFile(*scene) for scene in scenes), model="shapes2d")
    assert good > 200
    assert refused >= 5  # as the model lacks room


def test_random_solids(viewer_page: Any) -> None:
    """With eyes inside what is opaque, in holes, in mist, and outside."""
    scenes = []
    for n in range(120):
        rng = np.random.default_rng(n)
        scene = random_solid(rng, SOLID_SETS[("trees", "mixed", "trees", "deformed")[n % 4]])
        eye = tuple(rng.uniform(-0.7, 0.7, 3).tolist())
        scene = scene.model_copy(update={"camera": Camera(eye, (9.0, 0.5, 0.0))})
        scenes.append(SourceFile(str(n), scene.to_nsg()))
    good, refused = agree(viewer_page, scenes)
    assert good > 50
    assert refused >= 5


DEEP = "module m(n) { intersect { square; union { if (n > 1) { m(n - 1); } triangle; star; } } } m(n);"
MISTAKES = [
    ("for (i in 1..n) { square; }", 1e9, "20000 objects"),
    ("for (i in 1..n) { for (j in 1..n) { let v = i * j; } }", 1e9, "takes too long"),
    ("fn f(n) = n < 1 ? 0 : 1 + f(n - 1); square { scale(1 + f(n)); }", 1000, "calls nested deeper"),
    ("fn f(v, n) = n < 1 ? len(v) : f([v, v, v, v], n - 1); square { scale(f([1], n)); }", 15, "1,000,000"),
    ("module m(n) { group { if (n > 0) { m(n - 1); m(n - 1); } square; } } m(n);", 150, "20000 objects"),
    ("square { scale(n - 3); }", 3, "scale by 0"),
    ("square { scale(1 / (n - 3)); }", 3, "not a finite number"),
    (DEEP, 16, "deeper than 15"),
    ("subtract(k = n) { square; star; }", 0, "not above 0"),
    ("square { if (n > 1) { material flat; } material flat; }", 2, "a second material"),
    ("group { square; if (n > 1) { scale(2); } star; }", 2, "a child after a transform"),
    ("chain { if (n < 2) { square; } subtract star; }", 2, "nothing before it"),
    ('square { rotate(n > 1 ? "no" : 0); }', 2, "expected an angle, found a string"),
    ("param k = 1 in 0..n; square { scale(k); }", 0.5, "`k` is outside its range"),
    ("square { twirl(1); for (i in 1..n) { scale(1, 2); bend(1); } }", 4, "deformations"),
]


@pytest.mark.parametrize(("text", "bad", "why"), MISTAKES)
def test_what_would_be_a_mistake_is_refused_in_words(
    text: str, bad: float, why: str, viewer_page: Any
) -> None:
    form = compiled(SourceFile("", f"param n = 1; {text}")).form()
    before, answer, after = pictures(viewer_page, [(form, [{}, {"params": {"n": bad}}, {}])])[0]
    assert why in str(answer)
    assert isinstance(before, dict)
    assert before == after  # a run that ends early leaves nothing behind


@pytest.mark.parametrize(
    ("written", "data"),
    [
        ("0.6 in 0..1;  // how far ", {"low": 0, "high": 1, "label": "how far"}),
        ("1 in 0..<4", {"low": 0, "high": 4, "exclusive": True}),
        ("1 in 0..<4 step 1", {"low": 0, "high": 3, "step": 1}),
        ("7 in 10..0 step -3", {"low": 1, "high": 10, "step": 3}),
        ("0.3 in 0..1 step 0.3", {"low": 0, "high": pytest.approx(0.9), "step": 0.3}),
        ("0.25turn in 0deg..180deg", {"kind": "angle", "unit": "turn", "high": pytest.approx(math.pi)}),
        ("40ms in 0s..1s", {"kind": "time", "unit": "ms", "value": 0.04, "high": 1}),
        ('"a" in ["a", "b;"];  // which', {"kind": "string", "choices": ["a", "b;"], "label": "which"}),
        ("rgb(1, 0, 0.5)", {"kind": "color", "value": [1, 0, 0.5]}),
        ("[[1, 2], [3]]", {"kind": "vector", "value": [[1, 2], [3]]}),
        ("true", {"kind": "bool", "value": True}),
    ],
)
def test_params_tell_what_a_page_has_to_know(written: str, data: dict[str, Any]) -> None:
    end = "" if ";  //" in written else ";"
    text = f"param p = {written}{end}\nlet used = p; let v = [used]; square {{ scale(len(v)); }}"
    (param,) = compiled(SourceFile("", text)).form().params
    assert param == {**param, **data}


def test_names_of_params_mean_nothing_to_the_page(viewer_page: Any) -> None:
    names = ("constructor", "toString", "hasOwnProperty", "eval", "window", "g", "sin_")
    text = "".join(f"param {name} = {at}; " for at, name in enumerate(names, 1))
    form = compiled(SourceFile("", text + f"square {{ scale({' + '.join(names)}); }}")).form()
    answers = pictures(viewer_page, [(form, [{}, {"params": {"toString": 3}}])])[0]
    assert [answer["rows"][0]["scale"] for answer in answers] == [28, 29]


def test_what_the_canvas_and_the_length_hang_on_is_fixed() -> None:
    text = """param w = 200; param speed = 2; param k = 0.5 in 0..1;  // how far
        param unused = 1; fn wide(n) = n * w; let side = wide(1); canvas(side, 100);
        animate(4 / speed, 10); square { scale(k + t); }"""
    form = compiled(SourceFile("", text)).form()
    assert {one["name"]: one["reason"].split()[1] for one in form.fixed} == {"w": "size", "speed": "length"}
    assert [param["name"] for param in form.params] == ["w", "speed", "k"]
    assert form.params[2]["label"] == "how far"
    assert "wide" not in str(form.data)
