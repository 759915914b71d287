"""A scene that runs in a page is the one that the compiler compiles, for any params and in any frame."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from lab.sets.plane import SETS
from lab.sets.plane import random_scene as random_set_scene
from lab.sets.solids import SOLID_SETS, random_solid
from scenelang.assets.element_file import element_file_bytes
from scenelang.compiler.compile import compile_scene, find_model
from scenelang.compiler.manifest import Manifest, load_manifest
from scenelang.compiler.passes import OPTIONAL
from scenelang.compiler.program import Program
from scenelang.compiler.spaces import stage_data
from scenelang.drawing.neural.files import load_arrays
from scenelang.language import tree as nodes
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Evaluation, Source
from scenelang.language.parser import parse
from scenelang.language.reports import SceneError
from scenelang.language.scene import Camera
from scenelang.language.values import POISON, Angle, RangeValue, Time, Vec
from scenelang.language.words import FUNCTIONS
from scenelang.web.arrays import rows_of, worn_of
from scenelang.web.export import beyond_pages
from scenelang.web.form import PageProgram, PageScope, Writer, form_of
from tests.assets.scenes import IMPORT
from tests.assets.shapes import element, square
from tests.compiler.random_scenes import blob_scene, full_scene
from tests.language.test_elements import garage

pytestmark = pytest.mark.browser
WORDS = ("token", "material", "object")
NUMBERS = ("colour", "opacity", "scale", "opacity", "blend", "amount", "frequency")
POINTS = np.random.default_rng(0).uniform(-1.5, 1.5, (3, 50))


class Compiled(NamedTuple):
    """A scene by the compiler."""

    evaluation: Evaluation
    manifest: Manifest
    program: Program

    def form(self) -> PageProgram:
        """The same for a page."""
        return form_of(self.evaluation, self.manifest, worn_of(self.program))


def compiled(source: SourceFile, path: Path | None = None, frame: int = 0, **inputs: Any) -> Compiled:
    """Compile a scene without passes that only save work; raises SceneError."""
    found = Diagnostics()
    evaluation = Source(path, source, **inputs).evaluation(found, frame=frame)
    scene, _ = evaluation.run(frame)
    if scene is None:
        raise SceneError(found)
    program = compile_scene(scene, diagnostics=found, model=inputs.get("model"), without=OPTIONAL)
    return Compiled(evaluation, load_manifest(program.model), program)


def moved(param: dict[str, Any]) -> list[Any]:
    """Values over a param's range, or among its choices."""
    if "low" in param:
        low, high, step = param["low"], param["high"], param.get("step")
        values = [low + (high - low) * share for share in (0.0, 0.37, 1.0)]
        return values if step is None else [low + round((v - low) / step) * step for v in values]
    if "choices" in param:
        return list(param["choices"])
    others = {"color": [[0.2, 0.7, 0.4]], "bool": [not param["value"]], "string": [], "vector": []}
    return others[param["kind"]] if param["kind"] in others else [0.9 * param["value"]]


def carried(steps: list[list[float]], p: np.ndarray) -> np.ndarray:
    """Points (d, M) behind a row's steps, as the page takes them, in float64."""
    for kind, *n in steps:
        if kind == "map":
            rows = np.reshape(n, (len(p), -1))
            p = rows[:, :-1] @ p + rows[:, -1:]
        else:
            i, j = (0, 2) if kind == "twist" else (0, 1)
            turn = n[0] * (p[1] if kind == "twist" else np.linalg.norm(p, axis=0))
            a = turn + sum(b * x for b, x in zip(n[1:], p, strict=False))
            p = p.copy()
            p[i], p[j] = np.cos(a) * p[i] + np.sin(a) * p[j], np.cos(a) * p[j] - np.sin(a) * p[i]
    return p


def check_picture(picture: dict[str, Any], expected: Compiled, form: PageProgram) -> None:
    """Hold what a page's evaluator says against the rows and the stage of the Program."""
    program, manifest = expected.program, expected.manifest
    network, _ = load_arrays(program.model)
    rows = rows_of(program, manifest, network.codes, network.material_codes)
    shapes = [element for element in program.elements if not element.material]
    paints = [element for element in worn_of(program) if element.material]
    assert len(picture["rows"]) == len(rows)
    for row, own in zip(picture["rows"], rows, strict=True):
        assert [row[key] for key in WORDS] == [own[key] for key in WORDS]
        mine, theirs = [*manifest.geometries, *form.shapes], [*manifest.geometries, *shapes]
        assert mine[row["shape"]] == theirs[own["shape"]]
        assert [*form.paints, None][row["paint"]] == [*paints, None][own["paint"]]
        for name in ("glow", "density", "tilt"):
            np.testing.assert_allclose(row.get(name) or 0, own.get(name, 0), rtol=1e-5)
        np.testing.assert_allclose(row.get("stops") or [], own.get("stops", []), atol=1e-6)
        inks, own_inks = row.get("paintSteps") or [], own.get("paintSteps", [])
        assert [step[0] for step in inks] == [step[0] for step in own_inks]
        numbers = [*NUMBERS, *["place"][: row["paint"] >= 0]]
        for one, other in [*((row[key], own[key]) for key in numbers), *zip(inks, own_inks, strict=True)]:
            np.testing.assert_allclose(_numbers(one), _numbers(other), rtol=1e-5, atol=1e-6)
        here, there = (carried(one["steps"], POINTS[: manifest.dimension]) for one in (row, own))
        np.testing.assert_allclose(here, there, rtol=2e-4, atol=2e-4)
    stage = None if program.stage is None else stage_data(program.stage)
    assert _flat(picture["stage"]).keys() == _flat(stage).keys()
    for name, number in _flat(stage).items():
        np.testing.assert_allclose(_flat(picture["stage"])[name], number, atol=1e-9, err_msg=name)
    assert picture["samples"] == program.samples
    assert picture["background"] == (None if program.background is None else list(program.background))


def _numbers(data: Any) -> Any:
    return data[1:] if isinstance(data, list | tuple) and isinstance(data[0], str) else data


def _flat(data: Any, name: str = "") -> dict[str, Any]:
    """Numbers of nested data by their places; what is not a number is told by its place."""
    if isinstance(data, dict):
        return {k: v for key, value in data.items() for k, v in _flat(value, f"{name}.{key}").items()}
    if isinstance(data, list | tuple):
        return {k: v for at, value in enumerate(data) for k, v in _flat(value, f"{name}.{at}").items()}
    return {f"{name} {data}": 0.0} if data is None or isinstance(data, bool) else {name: data}


RUN = """(jobs) => jobs.map(([form, all]) => all.map((inputs) => {
  try {
    return evaluateForm(form, inputs);
  } catch (error) {
    if (error instanceof NotLive) return error.message;
    throw error;
  }
}))"""


def pictures(page: Any, jobs: list[tuple[PageProgram, list[dict[str, Any]]]]) -> list[list[Any]]:
    """What a page says of forms for inputs: a picture, or why there is none."""
    found: list[list[Any]] = page.evaluate(RUN, [[form.data, inputs] for form, inputs in jobs])
    return found


def drawable(source: SourceFile, **inputs: Any) -> tuple[PageProgram, Compiled | None] | None:
    """A scene's form, and what the compiler makes of it, if it does; nothing where no page draws it."""
    found = Diagnostics()
    evaluation = Source(text=source, **inputs).evaluation(found)
    scene, _ = evaluation.run(0)
    if scene is None or found.errors:
        return None
    if (manifest := find_model(scene, found)) is None or not manifest.framed:
        return None
    try:
        expected = compiled(source, **inputs)
    except SceneError:
        return form_of(evaluation, manifest), None
    if beyond_pages(expected.program):
        return None
    return expected.form(), expected


def sources(root: Path) -> Iterator[SourceFile]:
    """Scenes of the documentation and the conformance suite."""
    for page in sorted([*root.glob("docs/*.md"), *root.glob("scenelang/language/pages/*.md")]):
        texts = re.findall(r"^```nsg[^\n]*\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)
        yield from (SourceFile(f"{page.stem}-{at}", text) for at, text in enumerate(texts))
    for path in sorted(root.glob("tests/conformance/cases/*.nsg")):
        yield SourceFile(path.stem, path.read_text())


ROOT = Path(__file__).parents[2]
EXAMPLES = [path for path in sorted(ROOT.glob("examples/**/*.nsg")) if path.name != "still.nsg"]


def check_cases(
    page: Any, source: SourceFile, cases: list[tuple[dict[str, Any], int]], path: Path | None = None
) -> int:
    """Hold a page's pictures of params and frames against the compiler's; return how many there are."""
    first = compiled(source, path)
    form, model = first.form(), first.manifest.name
    units = {param["name"]: {"angle": "rad", "time": "s"}.get(param["kind"]) for param in form.params}
    (shown,) = pictures(page, [(form, [{"params": values, "frame": frame} for values, frame in cases])])
    for (values, frame), picture in zip(cases, shown, strict=True):
        said = source.name, values, frame, picture
        given = {name: f"{v!r}{unit}" if (unit := units.get(name)) else v for name, v in values.items()}
        try:
            expected = compiled(source, path, params=given, frame=frame, model=model)
        except SceneError:
            assert isinstance(picture, str), said
            continue
        assert isinstance(picture, dict), said
        check_picture(picture, expected, form)
    return sum(isinstance(picture, dict) for picture in shown)


def test_params_and_frames_of_the_examples(viewer_page: Any) -> None:
    for path in EXAMPLES:
        source, pick = SourceFile(str(path), path.read_text()), random.Random(path.name)
        first = compiled(source, path)
        if beyond_pages(first.program):
            continue
        form, frames = first.form(), first.evaluation.frames
        assert not form.fixed
        cases: list[tuple[dict[str, Any], int]] = [({}, 0), ({}, frames // 3), ({}, frames - 1)]
        for param in form.params:
            cases += [({param["name"]: value}, pick.randrange(frames)) for value in moved(param)]
        check_cases(viewer_page, source, cases, path)


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


def test_random_scenes(viewer_page: Any) -> None:
    """Groups in groups, blends of several widths; eyes inside what is opaque, in holes, in mist."""
    flat, solid = [], []
    for n in range(60):
        rng = np.random.default_rng(n)
        scene = random_solid(rng, SOLID_SETS[("trees", "mixed", "trees", "deformed")[n % 4]])
        eye = tuple(rng.uniform(-0.7, 0.7, 3).tolist())
        solid.append(scene.model_copy(update={"camera": Camera(eye, (9.0, 0.5, 0.0))}))
        tree = random_set_scene(np.random.default_rng(n), SETS["trees"])
        flat += [full_scene(n), blob_scene(n), tree]
    for scenes, least, inputs in ((flat, 120, {"model": "shapes2d"}), (solid, 25, {})):
        texts = (SourceFile(str(n), scene.to_nsg()) for n, scene in enumerate(scenes))
        good, refused = agree(viewer_page, texts, **inputs)
        assert good > least
        assert refused >= 2  # as the model lacks room


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
    ("star { material flat { opacity(n); } }", 2, "opacity of 2 is outside"),
    ("sphere { material volumetric { density(5e5 * n); } }", 3, "density of 1500000"),
    ("sphere { material diffuse { glow(#f00, 1 - n); } }", 2, "power of -1"),
    ("square { material checker { rotate(30deg, axis = [0, n - 1, 1]); } }", 2, "leaves its plane"),
    ("square { material checker { translate(0, 0, n - 1); } }", 2, "leaves its plane"),
    ("sphere { material checker { scale(1, 10 ^ (1 - n)); } }", 14, "texture is singular"),
    ("light(n > 1 ? none : [1, 2, 3]); light(); sphere;", 2, "beside another light"),
    ("star { material flat { opacity(0.5); if (n > 1) { opacity(0.6); } } }", 2, "given twice"),
    ("samples(n > 1 ? 9 : 16); star;", 2, "9 samples"),
    ("param k = 1 in 0..n; square { scale(k); }", 0.5, "`k` is outside its range"),
    ("square { twirl(1); for (i in 1..n) { scale(1, 2); bend(1); } }", 4, "deformations"),
]


def test_what_would_be_a_mistake_is_refused_in_words(viewer_page: Any) -> None:
    forms = [compiled(SourceFile("", f"param n = 1; {text}")).form() for text, _, _ in MISTAKES]
    inputs = [[{}, {"params": {"n": bad}}, {}] for _, bad, _ in MISTAKES]
    shown = pictures(viewer_page, [*zip(forms, inputs, strict=True)])
    for (text, _, why), (before, answer, after) in zip(MISTAKES, shown, strict=True):
        assert why in str(answer), text
        assert isinstance(before, dict), text
        assert before == after, text  # a run that ends early leaves nothing behind


def test_params_tell_what_a_page_has_to_know() -> None:
    for written, data in (
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
    ):
        end = "" if ";  //" in written else ";"
        text = f"param p = {written}{end}\nlet used = p; let v = [used]; square {{ scale(len(v)); }}"
        (param,) = compiled(SourceFile("", text)).form().params
        assert param == {**param, **data}, written


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


__all__ = ["garage"]  # a fixture

TEXTS = Path(__file__).with_name("corners.nsgs").read_text().split("--- ")[1:]
SCENES = dict(text.split("\n", 1) for text in TEXTS)


def test_corners(viewer_page: Any) -> None:
    for name, text in SCENES.items():
        source = SourceFile(name, f"nsg 1;\nparam n = 3 in -5..9;\n{text}")
        last = compiled(source).evaluation.frames - 1
        cases = [({"n": n}, frame) for n in (3, 0.5, 0, 7, -2) for frame in {0, last}]
        assert check_cases(viewer_page, source, cases) >= 2, name


ELEMENTS = [
    "zoo.car() { rotate(30deg, axis = X); } zoo.ring(); sphere { translate(3, 0, 0); }",
    "chain { zoo.ball; smooth zoo.ring { twist(0.3); } subtract zoo.ring() { scale(0.4); } }",
    """let m = material volumetric zoo.hide { hue(0.2turn); color(#d33); color(#3d3); }; zoo.ball { m; }
       sphere { m { grayscale(0.5); grayscale(0.2); } translate(3, 0, 0); } zoo.ring();""",
    "zoo.logo() { scale(0.3); } square { translate(1, 0); }",
    'import "zoo.safetensors" as again; again.ball { material again.hide; } zoo.ring { translate(2, 0, 0); }',
    'import "lib.nsg" as lib; lib.two(0.5) { material flat; } square { scale(lib.k + lib.f(1)); lib.red; }',
    "param n = 0; if (n > 0) { zoo.car(); } else { sphere; }",
]


def test_elements_and_imports(garage: Path, viewer_page: Any) -> None:
    lib = "param k = 0.3; fn f(x) = k * x; module two(s) { zoo.tile { scale(s); } square { scale(f(s)); } }"
    red = "let red = material flat { color([k, 0, 0]); }; square; background(#000);"
    (garage / "lib.nsg").write_text(f"{IMPORT} {lib} {red}")
    for text in ELEMENTS:
        changes = {"lib.k": 0.7} if "lib" in text else {"n": 1} if "param" in text else {}
        source = SourceFile("scene.nsg", IMPORT + text)
        assert check_cases(viewer_page, source, [({}, 0), (changes, 0)], garage / "scene.nsg") == 2, text


def test_sizes_and_centres_of_elements(garage: Path, viewer_page: Any) -> None:
    tile = replace(element(square, "tile", d=2, levels=3), about={"size": 0.5, "x": 0.25, "y": -0.1})
    (garage / "sized.safetensors").write_bytes(element_file_bytes([tile]))
    text = "z.tile { scale(z.tile_size); translate(z.tile_centre); scale(z.tile_centre.x); }"
    source = SourceFile("scene.nsg", f'import "sized.safetensors" as z; {text}')
    assert check_cases(viewer_page, source, [({}, 0)], garage / "scene.nsg") == 1


def test_letters_and_their_marks(viewer_page: Any) -> None:
    text = 'import "std/letters" as abc; abc.text("e\u0301A\u030a"); disc { scale(abc.width("xu\u0308")); }'
    assert check_cases(viewer_page, SourceFile("scene.nsg", text), [({}, 0)]) == 1


def test_texts_that_a_scene_puts_together(viewer_page: Any) -> None:
    text = """import "std/letters" as abc; param v = 0.5; param n = 7 in 0..9; let mark = "\u0301";
    abc.text("v = " + str(v, digits = 2) + ", " + str(n > 3) + " e" + mark);
    disc { scale(abc.width(str(v))); }"""
    cases: list[Any] = [({}, 0), ({"v": -1.2345678e-9, "n": 2}, 0), ({"v": 4e21}, 0)]
    assert check_cases(viewer_page, SourceFile("scene.nsg", text), cases) == 3
    long = (
        'param n = 2; fn twice(s, n) = n == 0 ? s : twice(s + s, n - 1); disc { scale(len(twice("ab", n))); }'
    )
    assert check_cases(viewer_page, SourceFile("scene.nsg", long), [({}, 0), ({"n": 13}, 0)]) == 1


OUTLINES = """param n = 1 in 0..3; let kite = [[3, 0], [4, 1], [3, 3], [2, 1], [2, 1]];
module twice(points) { polygon(points) { grow(n); scale(0.2); } spline(points) { shell(3); rotate(30deg); } }
group { twice(kite); polygon([[-1, -1], [1, -1], [0, 1]]) { twirl(n); material checker { scale(n + 1); } } }
for (i in 0..<3) { spline([[i, 0], [i + 1, 2], [0, 3]]) { translate(n, 0); material radial {
  stop(0, #fff); stop(1, #000); translate(2, 0); } } }"""


def test_polygons_and_splines(viewer_page: Any) -> None:
    source = SourceFile("scene.nsg", OUTLINES)
    assert check_cases(viewer_page, source, [({}, 0), ({"n": 2.5}, 0)]) == 2
    moving = drawable(SourceFile("scene.nsg", "param n = 1; polygon([[n, 0], [2, 0], [1, 1]]);"))
    assert moving is not None
    [[same, other]] = pictures(viewer_page, [(moving[0], [{}, {"params": {"n": 0.5}}])])
    assert len(same["rows"]) == 1
    assert "points" in other


TILTED = """param a = 90deg in 0deg..180deg; param n = 1 in 0..2;
box { material checker { scale(n, 2, 3); rotate(a, axis = X); translate(0, n, n); scale(0.5); } }
sphere { translate(2, 0, 0); material volumetric radial { stop(0, #f00); stop(n / 2, #0f0);
  scale(1, 1, 1e-20); rotate(a, axis = [1, n, 0]); shear(yz = n); } }
torus { translate(-2, 0, 0); material bricks { scale(2); translate(0, 0, n); rotate(a); } }"""


def test_textures_of_space(viewer_page: Any) -> None:
    """Params turn them out of x and y and back."""
    cases: list[Any] = [({"a": a, "n": n}, 0) for a in (0.0, 1.0, math.pi) for n in (0.6, 1, 2)]
    assert check_cases(viewer_page, SourceFile("scene.nsg", TILTED), cases) == len(cases)
    assert check_cases(viewer_page, SourceFile("scene.nsg", TILTED), [({}, 0), ({"n": 0.0}, 0)]) == 1


MODEL = load_manifest("shapes2d")
LITERALS = """0 1 2 3 0.5 -1 -2.5 7 1e-3 10 0.1 -0 1e200 255 30deg -45deg 0.5rad 0.25turn 0deg 2s 40ms -1s 0s
    [1,2] [0,1,0.5] X #d33 #7a5c3e [] [1,[2,3]] [10deg,20deg] [-1,0.5] true false "a" "day" "ä😀" none PI TAU
    t u frame frames (0..3) (0..<4step(0.5)) (0deg..90deg/**/step/**/30deg) (5..1)
    (5..1/**/step-2) (0s..2s)"""
VALUES = """(expressions) => {
  const told = (value) => {
    if (value instanceof Vec) return value.items.map(told);
    if (value instanceof Angle) return { angle: value.size };
    if (value instanceof Time) return { time: value.size };
    if (!(value instanceof Progression)) return value;
    return { range: [value.start, value.stop, value.exclusive, value.unit] };
  };
  return expressions.map((expression) => {
    const run = new SceneRun({ body: [], slots: 0, calls: [] });
    Object.assign(run, { work: 0, animated: [0, 0, 0, 1] });
    try {
      return { value: told(prepared(expression, run)()) };
    } catch (error) {
      if (error instanceof NotLive) return { refused: error.message };
      throw error;
    }
  });
}"""


def evaluated(text: str) -> tuple[Any, Any] | None:
    """The value and the form of an expression; None where it does not parse."""
    found = Diagnostics()
    tree = parse(SourceFile("", f"let v = {text};"), found)
    if found.errors:
        return None
    evaluation = Source(tree=tree).evaluation(found)
    evaluation.run(0)
    context, stmt = evaluation.context, tree.statements[0]
    assert isinstance(stmt, nodes.Let)
    form = Writer(context, MODEL, ()).expression(stmt.value, PageScope())
    return context.env[context.scope.names["v"].slot], form


def told(value: Any) -> Any:
    """A value as the page tells it."""
    if isinstance(value, Vec):
        return [told(item) for item in value.items]
    if isinstance(value, RangeValue):
        unit = ("number", "angle", "time").index(value.unit)
        return {"range": [value.start, value.stop, value.exclusive, unit]}
    if isinstance(value, Angle | Time):
        return {type(value).__name__.lower(): value.size}
    return value


def alike(one: Any, other: Any) -> bool:
    """Equal, or for numbers nearly: mathematical functions may differ in their last digit."""
    if isinstance(one, dict | list):
        items = list(one.items()) if isinstance(one, dict) else one
        others = list(other.items()) if isinstance(other, dict) else other
        return len(items) == len(others) and all(map(alike, items, others))
    if isinstance(one, tuple):
        return one[0] == other[0] and alike(one[1], other[1])
    if isinstance(one, float) and not isinstance(other, bool):
        return bool(one == pytest.approx(other, rel=1e-13, abs=0))
    return type(one) is type(other) and bool(one == other)


def written(pick: random.Random, depth: int) -> str:
    """A random expression; most of the deep ones are mistakes."""
    if depth == 0 or pick.random() < 0.15:
        return pick.choice(LITERALS.split())
    a, b, c = (written(pick, depth - 1) for _ in range(3))
    order, sign = pick.choice(["<", "<=", ">", ">=", "==", "!="]), pick.choice(["-", "+", "!"])
    word = pick.choice([*FUNCTIONS.values()])
    count = pick.randint(1, 3) if word.variadic else word.required
    ways = [
        *[f"({a} {op} {b})" for op in pick.sample(["+", "-", "*", "/", "%", "^"], 3)],
        *(f"-{a} ^ {b}", f"({sign}{a})", f"({a} {order} {b} ? {c} : {a})", f"({a} {order} {b} && {c})"),
        *(f"[{a}, {b}]", f"[{a}]", f"({a})[{b}]", f"({a}).{pick.choice('xyzrgb')}"),
        *[f"{word.name}({', '.join([a, b, c][:count])})"] * 5,
    ]
    return pick.choice(ways)


def test_random_expressions(viewer_page: Any) -> None:
    pick = random.Random(1)
    texts = [written(pick, pick.randint(1, 3)) for _ in range(2500)]
    texts += [f"rand({pick.choice([n, n / 7, -n, [n, n + 1]])})" for n in range(200)]
    texts += [
        f"str({x!r}{digits})"
        for x in (10.0 ** pick.uniform(-9, 23) * pick.choice([-1, 1]) for _ in range(200))
        for digits in ("", f", {pick.randint(0, 15)}")
    ]
    spots = [[pick.uniform(-9, 9) * 10.0 ** pick.randint(0, 8) for _ in range(n % 3 + 1)] for n in range(200)]
    texts += [f"noise({spot}, seed = {pick.randint(-9, 2**40)})" for spot in spots]
    texts += [f"str({n / 16}, {n % 5})" for n in range(-99, 99)]
    made = [(text, *pair) for text in texts if (pair := evaluated(text)) is not None]
    shown = viewer_page.evaluate(VALUES, [form for _, _, form in made])
    for (text, value, _), answer in zip(made, shown, strict=True):
        assert ("refused" in answer) == (value is POISON), (text, answer)
        assert value is POISON or alike(told(value), answer["value"]), (text, value, answer)
    good = sum(value is not POISON for _, value, _ in made)
    assert 600 < good < len(made) - 600
