"""What a scene is by the compiler, for given params and frame, and whether a page's rows say the same."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scenelang.compiler import steps as affine
from scenelang.compiler.compile import compile_scene, find_model
from scenelang.compiler.graph import Graph
from scenelang.compiler.groups import BEGINS, ENDS
from scenelang.compiler.manifest import Manifest, load_manifest
from scenelang.compiler.passes import OPTIONAL
from scenelang.compiler.program import Program
from scenelang.compiler.steps import Affine, Displace, Step, Warp
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Evaluation, Source
from scenelang.language.reports import SceneError
from scenelang.language.words import BLEND, TOKENS
from scenelang.web.arrays import stage_of
from scenelang.web.export import view_of
from scenelang.web.form import Form, form_of
from tests.web.test_view import carried

WORDS = ("token", "shape", "material", "paint", "object")
POINTS = np.random.default_rng(0).uniform(-1.5, 1.5, (3, 50))


class Compiled(NamedTuple):
    """A scene by the compiler."""

    evaluation: Evaluation
    manifest: Manifest
    graph: Graph
    program: Program

    def form(self) -> Form:
        """The same for a page."""
        return form_of(self.evaluation, self.manifest, self.program.elements)


def compiled(source: SourceFile, path: Path | None = None, frame: int = 0, **inputs: Any) -> Compiled:
    """Compile a scene without passes that only save work; raises SceneError."""
    found, graphs = Diagnostics(), {}
    evaluation = Source(path, source, **inputs).evaluation(found, frame=frame)
    scene, _ = evaluation.run(frame)
    if scene is None:
        raise SceneError(found)
    model, after = inputs.get("model"), graphs.__setitem__
    program = compile_scene(scene, diagnostics=found, model=model, without=OPTIONAL, after=after)
    return Compiled(evaluation, load_manifest(program.model), graphs["check_trained"], program)


def moved(param: dict[str, Any]) -> list[Any]:
    """Values over a param's range, or among its choices."""
    if "low" in param:
        low, high, step = param["low"], param["high"], param.get("step")
        values = [low + (high - low) * share for share in (0.0, 0.25, 0.5, 0.77, 1.0)]
        return values if step is None else [low + round((v - low) / step) * step for v in values]
    if "choices" in param:
        return list(param["choices"])
    others = {"color": [[0.2, 0.7, 0.4]], "bool": [not param["value"]], "string": [], "vector": []}
    return others[param["kind"]] if param["kind"] in others else [0.9 * param["value"]]


def defined(param: dict[str, Any], value: Any) -> Any:
    """A page's value of a param as the compiler takes it."""
    unit = {"angle": "rad", "time": "s"}.get(param["kind"])
    return value if unit is None else f"{value!r}{unit}"


def way_back(steps: tuple[Step, ...], p: np.ndarray) -> np.ndarray:
    """World points (3, M) in a leaf's own space, by the definition of each step."""
    for step in reversed(steps):
        if isinstance(step, Displace):
            continue
        if isinstance(step, Affine):
            rows = np.reshape(affine.inverted(step.rows), (3, 4))
            p = rows[:, :3] @ p + rows[:, 3:]
            continue
        warps = isinstance(step, Warp)
        j, k = (1, step.twirl) if isinstance(step, Warp) else (2, step.twist)
        a = k * (np.linalg.norm(p, axis=0) if warps else p[1])
        if isinstance(step, Warp):
            a = a + step.bend[0] * p[0] + step.bend[1] * p[1]
        p = p.copy()
        p[0], p[j] = np.cos(a) * p[0] + np.sin(a) * p[j], np.cos(a) * p[j] - np.sin(a) * p[0]
    return p


def check_picture(picture: dict[str, Any], expected: Compiled, form: Form) -> None:
    """Hold what a page's evaluator says against what the compiler says."""
    graph, d = expected.graph, expected.manifest.dimension
    rows = graph.rows()
    assert len(picture["rows"]) == len(rows)
    names = [*expected.manifest.geometries, *form.shapes]
    for row, (op, leaf, k, begins, ends, _) in zip(picture["rows"], rows, strict=True):
        look = leaf.look
        assert row["token"] == TOKENS[op] + BEGINS * begins + (ends << ENDS)
        assert names[row["shape"]] == graph.elements.get(leaf.geometry, leaf.geometry)
        assert expected.manifest.materials[row["material"]] == look.material
        assert row["object"] == leaf.number
        assert row["blend"] == (k or (BLEND if op == "smooth" else 0))
        np.testing.assert_allclose(row["colour"], look.rgb, atol=1e-9)
        stretch = graph.space.stretches(affine.composed(leaf.steps))[0]
        np.testing.assert_allclose(row["scale"], stretch, rtol=1e-9)
        bump = next((s for s in leaf.steps if isinstance(s, Displace)), Displace(0.0, 0.0))
        assert (row["amount"], row["frequency"]) == (bump.amount, bump.frequency)
        _check_paint(row, look, form)
        there, here = carried(row["steps"], POINTS[:d]), way_back(leaf.steps, POINTS * [[1], [1], [d > 2]])
        np.testing.assert_allclose(there, here[:d], rtol=1e-6, atol=1e-6)
    stage = None if graph.stage is None else stage_of(graph.stage)
    assert _flat(picture["stage"]).keys() == _flat(stage).keys()
    for name, number in _flat(stage).items():
        np.testing.assert_allclose(_flat(picture["stage"])[name], number, atol=1e-9, err_msg=name)
    assert picture["background"] == (None if graph.background is None else list(graph.background))


def check_rows(rows: list[dict[str, Any]], program: Program) -> None:
    """Hold a page's rows against those of the Program, which names shapes and paints by their places too."""
    kept = view_of(program).data["program"]["rows"]
    assert len(rows) == len(kept)
    for row, own in zip(rows, kept, strict=True):
        assert [row[key] for key in WORDS] == [own[key] for key in WORDS]
        for key in (
            "colour",
            "scale",
            "blend",
            "amount",
            "frequency",
            *(("place",) if row["paint"] >= 0 else ()),
        ):
            np.testing.assert_allclose(row[key], own[key], rtol=1e-6, atol=1e-6)


def _check_paint(row: dict[str, Any], look: Any, form: Form) -> None:
    if look.element is None:
        assert row["paint"] == -1
        return
    assert form.paints[row["paint"]] == look.element
    inverse = affine.inverted(look.moved)
    np.testing.assert_allclose(row["place"], [inverse[at] for at in (0, 1, 3, 4, 5, 7)], atol=1e-9)
    assert [step[0] for step in row["paintSteps"]] == [step[0] for step in look.colours]
    for mine, theirs in zip(row["paintSteps"], look.colours, strict=True):
        np.testing.assert_allclose(mine[1:], theirs[1:], atol=1e-9)


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


def pictures(page: Any, jobs: list[tuple[Form, list[dict[str, Any]]]]) -> list[list[Any]]:
    """What a page says of forms for inputs: a picture, or why there is none."""
    found: list[list[Any]] = page.evaluate(RUN, [[form.data, inputs] for form, inputs in jobs])
    return found


def drawable(source: SourceFile, **inputs: Any) -> tuple[Form, Compiled | None] | None:
    """A scene's form, and what the compiler makes of it, if it does; nothing where no page draws it."""
    found = Diagnostics()
    evaluation = Source(text=source, **inputs).evaluation(found)
    scene, _ = evaluation.run(0)
    if scene is None or found.errors:
        return None
    if (manifest := find_model(scene, found)) is None or manifest.lifting != "exact":
        return None
    try:
        expected = compiled(source, **inputs)
    except SceneError:
        return form_of(evaluation, manifest), None
    return expected.form(), expected


def sources(root: Path) -> Iterator[SourceFile]:
    """Scenes of the documentation and the conformance suite."""
    for page in sorted([*root.glob("docs/*.md"), *root.glob("scenelang/language/pages/*.md")]):
        texts = re.findall(r"^```nsg[^\n]*\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)
        yield from (SourceFile(f"{page.stem}-{at}", text) for at, text in enumerate(texts))
    for path in sorted(root.glob("tests/conformance/cases/*.nsg")):
        yield SourceFile(path.stem, path.read_text())
