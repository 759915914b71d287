"""Speed against error: the measured frontier, the choice of a point of it, and the cost of drawing a scene.

A *point* is a way to draw: a model with its sampling, or the exact reference. The *front* is
the set of points that no other one beats: nothing faster has less error.
"""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, Self

import numpy as np
from pydantic import ConfigDict, NonNegativeFloat, TypeAdapter, ValidationError

from scenelang.assets.files import read_json, read_regular
from scenelang.assets.records import Record
from scenelang.compiler.compile import why_chosen
from scenelang.compiler.graph import Fold, Graph, nodes
from scenelang.compiler.groups import OPERATOR
from scenelang.compiler.lower import Spans, lower
from scenelang.compiler.manifest import ROOT, Manifest, available, load_manifest
from scenelang.compiler.program import Program
from scenelang.compiler.steps import Affine
from scenelang.drawing.exact.picture import reference_image
from scenelang.drawing.how import RenderError, Samples
from scenelang.drawing.image import Image
from scenelang.drawing.metrics import MOST_DB, flip, over_white, psnr
from scenelang.drawing.render import exact_graph
from scenelang.drawing.small import draw_small
from scenelang.drawing.work import LIGHT_MS, Load
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.scene import Scene
from scenelang.language.words import TOKENS

if TYPE_CHECKING:
    from scenelang.drawing.neural.load import Model

FORMAT: Final = 1
NAME: Final = "frontier.json"
MOST_BYTES: Final = 4 << 20
REPEATS: Final = 3  # of a drawing that is timed
_STRICT: Final = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False)


class Limits(Record):
    """Limits of a picture's time and error; None for no limit."""

    ms: float | None  # most milliseconds of a frame on this machine
    flip: float | None  # most mean FLIP


@dataclass(frozen=True, slots=True)
class FrameErrors:
    """FLIP of frames, in [0, 1], over scenes."""

    __pydantic_config__ = _STRICT
    bound: NonNegativeFloat  # promised


@dataclass(frozen=True, slots=True)
class Cost:
    """Milliseconds of a frame as a sum; each coefficient is at least 0."""

    __pydantic_config__ = _STRICT
    frame: NonNegativeFloat  # of any frame
    thousand_objects: NonNegativeFloat  # for each 1,000 objects
    megapixel: NonNegativeFloat  # for each million pixels of the canvas
    megameeting: NonNegativeFloat  # for each million pixels within bounds (all of them if none is skipped)
    outline: NonNegativeFloat  # for each 1,000 pixels around the bounds, where pixels take four samples
    spread: NonNegativeFloat  # 95 of 100 measured frames took at most this many times the sum


@dataclass(frozen=True, slots=True)
class Point:
    """A way to draw, with the figures that a choice needs; the file has more."""

    __pydantic_config__ = _STRICT
    name: str  # label in charts
    backend: Literal["neural", "reference"]
    model: str | None  # name of the model; None for the reference and for a way without trained weights
    samples: Samples
    skip: bool
    offered: bool  # true where `scenelang render` may choose it
    why_not: str | None  # reason if not
    flip: FrameErrors | None  # None where only the time was measured
    cost: Cost | None  # what a frame takes elsewhere; None where it is not offered


@dataclass(frozen=True, slots=True)
class Frontier:
    __pydantic_config__ = _STRICT
    set: str  # the scenes' set
    yardstick_ms: NonNegativeFloat  # time of `yardstick` on the measured machine
    points: tuple[Point, ...]  # in the order of their time

    @classmethod
    def from_json(cls, data: bytes) -> Self:
        """Read a file as if a stranger had written it; raises `ValueError` where it is damaged."""
        result = read_json(data)
        if not isinstance(result, dict) or result.pop("format", None) != FORMAT:
            raise ValueError(f"not a frontier of format {FORMAT}")
        try:
            return TypeAdapter(cls).validate_json(json.dumps(result))
        except ValidationError as error:
            place = ".".join(map(str, error.errors()[0]["loc"]))
            raise ValueError(f"`{place}` of the frontier does not hold what it should") from None


def frontier_path(model: str) -> Path:
    """Shipped file of the frontier of a model's set: next to the weights of the model of the set's name."""
    return ROOT / load_manifest(model).set / NAME


def load_frontier(model: str) -> Frontier | None:
    """The shipped frontier of a model's set, or None; raises ValueError if damaged, KeyError for no model."""
    try:
        data = read_regular(frontier_path(model), MOST_BYTES)
    except FileNotFoundError:
        return None
    if len(data) > MOST_BYTES:
        raise ValueError(f"a frontier of more than {MOST_BYTES >> 20} MB")
    return Frontier.from_json(data)


LIGHT_SPREAD: Final = 2.0  # times as long as foretold takes light from everywhere, seldom more
UNITS: Final = (1.0, 1e3, 1e6, 1e6, 1e3)  # of the terms of a `Cost`
_ROUNDS: Final = 15  # of the yardstick
OBJECTS: Final = 4
"""Objects of the largest scenes whose errors were measured; more have more outlines to be wrong at."""


class NothingFits(Exception):
    """No point keeps the limits; the message names the nearest one."""


class Offer(Record):
    """A point and what it promises for a scene on this machine."""

    point: Point  # from the frontier
    ms: float  # at least the time of 95 of 100 frames
    flip: float  # at least the error of 97.5 of 100 scenes; 1 where nothing is known

    def told(self) -> str:
        ms = f"{self.point.name}: {self.ms:,.{0 if self.ms >= 10 else 1}f} ms"
        return (
            f"{ms} and FLIP {self.flip:.2g} at most" if self.flip < 1 else f"{ms} at most, no error promised"
        )


def error_scale(canvas: tuple[int, int], objects: int) -> float:
    """Factor of a promised error for a scene unlike those that were measured, at 256 x 256.

    Errors lie along outlines. On a smaller canvas more of the pixels do, in proportion to its shorter side,
    and with more than `OBJECTS` objects there is more outline, in proportion to their number. A larger canvas
    or fewer objects promise no less error than was measured.
    """
    return max(1.0, 256 / min(canvas)) * max(1.0, objects / OBJECTS)


def refusal(point: Point, scene: Scene | None, program: Program, only: str | None = None) -> str | None:
    """Reason why a point cannot draw a scene, or its ``program``; ``only`` is the one model to choose."""
    if only is not None and point.model != only:
        return f"--model {only}"
    if point.model is not None and point.model not in available():
        return "not installed"
    if not point.offered:
        return point.why_not or "not offered"
    if point.backend == "reference" and program.stage is not None and program.stage.sky is not None:
        return "its paths under a sky take longer than was measured"
    if scene is None:
        if point.backend == "reference":
            return "a compiled program keeps only what the network needs"
        return None if point.model == program.model else f"the program was compiled for `{program.model}`"
    if point.model is None:
        try:
            if scene.elements:
                exact_graph(scene)
        except RenderError as error:  # an element has no original
            return str(error)
        return None
    lower(scene, load_manifest(point.model), None, diagnostics := Diagnostics())
    return diagnostics.errors[0].message if diagnostics.errors else None


def offers(points: Sequence[Point], load: Load, canvas: tuple[int, int], scale: float) -> list[Offer]:
    """Promises of points for a scene, the fastest first; ``scale`` is that of `machine_scale`. Of light from
    everywhere no errors were measured.
    """
    result = []
    for point in points:
        if point.cost is None or point.flip is None:
            continue
        own = predicted_ms(point.cost, load, point.skip) * point.cost.spread
        ms = (own + LIGHT_SPREAD * LIGHT_MS * load.light) * scale  # which is the same for all
        flip = 1.0 if load.light else min(1.0, point.flip.bound * error_scale(canvas, load.objects))
        result.append(Offer(point, ms, flip))
    return sorted(result, key=lambda o: (o.ms, o.flip))


def choose(offers: Sequence[Offer], limits: Limits, refused: dict[str, str]) -> tuple[Offer, list[str]]:
    """The fastest offer that keeps the error, or the one of least error that keeps the time; and lines why.

    Of offers that promise nearly the same error, within 2 %, the faster one is better; where none promises
    any, the slowest, which takes most samples. With both limits the fastest that keeps both is taken. Raises
    `NothingFits` where no offer keeps them.
    """
    if not offers:
        reasons = "; ".join(f"{name}: {why}" for name, why in list(refused.items())[:3])
        raise NothingFits("nothing on the frontier draws this scene" + (f" ({reasons})" if reasons else ""))
    good = [offer for offer in offers if not _lacks(offer, limits)]
    if not good:
        raise NothingFits(_nearest(offers, limits))
    if limits.flip is not None:
        first = min(good, key=lambda o: (o.ms, o.flip))
        limit = f"FLIP {limits.flip:g}" + (f" and {limits.ms:g} ms" if limits.ms is not None else "")
        why = f"the fastest of {len(good)} that keep {limit}"
    else:
        least, way = min(o.flip for o in good), "most exact"
        first = min((o for o in good if o.flip <= 1.02 * least), key=lambda o: o.ms)
        if least == 1:
            first, way = max(good, key=lambda o: o.ms), "slowest"
        why = f"the {way} of {len(good)} that keep {limits.ms:g} ms"
    notes = [f"chosen by the frontier: {first.told()}, {why}"]
    others = [offer for offer in offers if offer is not first]
    by, worse = ("ms", "slower") if limits.flip is not None else ("flip", "no more exact")
    runner_up = min(others, key=lambda o: (o not in good, getattr(o, by)), default=None)
    if runner_up is not None:
        notes.append(f"runner-up: {runner_up.told()}, {_lacks(runner_up, limits) or worse}")
    return first, notes


def _lacks(offer: Offer, limits: Limits) -> str:
    slow = limits.ms is not None and offer.ms > limits.ms
    wrong = limits.flip is not None and offer.flip > limits.flip
    return " and ".join(["too slow"] * slow + ["not exact enough"] * wrong)


def _nearest(offers: Sequence[Offer], limits: Limits) -> str:
    """Message about the offer that is nearest to limits that none keeps."""
    asked = [f"{limits.ms:g} ms"] if limits.ms is not None else []
    asked += [f"FLIP {limits.flip:g}"] if limits.flip is not None else []
    exact = [o for o in offers if limits.flip is not None and o.flip <= limits.flip]
    if exact:
        nearest = f"exact enough is {min(exact, key=lambda o: o.ms).told()}"
    elif limits.flip is not None:
        nearest = f"the most exact is {min(offers, key=lambda o: (o.flip, o.ms)).told()}"
    else:
        nearest = f"the fastest is {min(offers, key=lambda o: o.ms).told()}"
    return f"nothing draws this scene within {' and '.join(asked)}; {nearest}"


def predicted_ms(cost: Cost, load: Load, skip: bool) -> float:
    """Likely milliseconds of a frame on the measured machine; at most `Cost.spread` times as many."""
    terms = (cost.frame, cost.thousand_objects, cost.megapixel, cost.megameeting, cost.outline)
    return sum(t * v / unit for t, v, unit in zip(terms, load.row(skip), UNITS, strict=True))


def yardstick() -> float:
    """Milliseconds of fixed work like a frame's on one core; their ratio scales the times of machines."""
    rng = np.random.default_rng(1)
    x, w = (rng.normal(size=shape).astype(np.float32) for shape in ((16, 32, 256), (32, 32)))
    plain = np.linspace(-1, 1, 1 << 15)
    times = []
    for _ in range(_ROUNDS):
        started = time.thread_time()
        y = x
        for _ in range(4):
            y = w @ y
            np.maximum(y, 0, out=y)
        _ = (np.cos(y[:, :8]) * y[:, 8:16]).sum()
        _ = np.cos(np.hypot(plain, 0.5)) * plain
        times.append(1000 * (time.thread_time() - started))
    return statistics.median(times[_ROUNDS // 3 :])


def machine_scale(frontier: Frontier, here_ms: float) -> float:
    """Time on this machine relative to the measured one, by the yardstick."""
    return here_ms / frontier.yardstick_ms if frontier.yardstick_ms > 0 else 1.0


def token_counts(tokens: Iterable[int]) -> dict[str, int]:
    """Number of rows that join by each word, of the words in use."""
    values = list(tokens)
    return {word: values.count(value) for word, value in TOKENS.items() if value in values}


def stages(graphs: Mapping[str, Graph]) -> list[dict[str, Any]]:
    """Sizes after ``lower`` and each pass, and whether it changed anything; each move is a matrix."""
    out: list[dict[str, Any]] = []
    before: Graph | None = None
    for name, graph in graphs.items():
        result = list(nodes(graph.root))
        folds = [node for node in result if isinstance(node, Fold)]
        steps = [move.step for node in result for move in node.moves]
        affines = sum(isinstance(step, Affine) for step in steps)
        sizes: dict[str, Any] = {"stage": name, "objects": len(result) - len(folds), "matrices": len(steps)}
        sizes |= {"affines": affines, "deformations": len(steps) - affines, "folds": len(folds)}
        tokens = token_counts(TOKENS[link.op] for fold in folds for link in fold.links)
        out.append({**sizes, "tokens": tokens, "changed": before is not None and graph != before})
        before = graph
    return out


def plan_of(
    scene: Scene,
    program: Program,
    graphs: Mapping[str, Graph],
    model: Model,
    *,
    asked: bool = False,
    spans: Spans | None = None,
    threads: int = 1,
) -> dict[str, Any]:
    """Results of `choice`, `stages` and `drawing_cost`, and the rows and tokens of the stream."""
    return {
        **choice(scene, program.model, asked),
        "stages": stages(graphs),
        "rows": len(program),
        "tokens": token_counts((program.tokens & OPERATOR).tolist()),
        "drawing": drawing_cost(scene, program, model, spans, threads),
    }


def choice(scene: Scene, chosen: str, asked: bool) -> dict[str, Any]:
    """The model that draws a scene, the reason (or that it was ``asked`` for), and the runner-up."""
    lacking, able = {}, []
    for model in (load_manifest(name) for name in available() if name != chosen):
        lower(scene, model, None, diagnostics := Diagnostics())
        if diagnostics.errors:
            lacking[model.name] = list(dict.fromkeys(error.message for error in diagnostics.errors))
        else:
            able.append(model)
    runner_up = min(able, key=lambda model: (model.flip(), model.name), default=None)
    why, second = why_chosen(scene, asked), runner_up.name if runner_up else None
    return {"model": chosen, "why": why, "runner_up": second, "lacking": lacking}


def reference_of(scene: Scene, manifest: Manifest, *, per_side: int = 2, spans: Spans | None = None) -> Image:
    """The exact picture of a scene over its background; ``per_side`` samples along each side of a pixel."""
    graph = lower(scene, manifest, spans, Diagnostics())
    if not graph.elements:
        return reference_image(graph, per_side=per_side)
    from scenelang.drawing.exact.originals import originals_of

    return reference_image(graph, per_side=per_side, brought=originals_of(scene, graph))


def drawing_cost(
    scene: Scene, program: Program, model: Model, spans: Spans | None = None, threads: int = 1
) -> dict[str, Any]:
    """Draw a Program of a scene and measure its work, time and error.

    Returns:
        ``pixels`` of the canvas, ``refined`` (pixels sampled four times),
        ``ms`` (the best of three frames, after one that does not count), ``psnr`` (dB, at most 50), ``flip``
        (None without its package), ``unknown`` (why there is no exact picture, or None) and ``parameters``.
        In the plane: ``evaluated`` (pixels that an object reached; the network saw no other), ``samples``,
        ``meetings`` (a sample and an object through the network) and ``meetings_unskipped`` (every sample
        with every object). In space: ``rays`` from the eye, ``light_rays`` between surfaces or media and the
        light, how many of both came ``near`` an object, their ``steps`` (points at which the field was asked)
        and ``evaluations`` (an object's network at a point).
    """
    from scenelang.drawing.neural.load import place_of
    from scenelang.drawing.torch_backend import draw_program

    framed = model.manifest.renderer in ("framed", "solid")  # which `render` draws by the kernel
    by_numpy = framed and place_of(model.network).type == "cpu"

    draw = partial(draw_small, program) if by_numpy else partial(draw_program, program, model)
    times = []
    for _ in range(1 + REPEATS):
        started = time.perf_counter()
        drawing = draw(threads=threads)
        times.append(1000 * (time.perf_counter() - started))
    own, unknown = over_white(drawing.image), None
    try:
        exact = over_white(reference_of(scene, model.manifest, spans=spans))
    except ValueError as error:
        exact, unknown = None, str(error)
    if (work := drawing.work) is not None:
        counts = {"rays": work.rays, "light_rays": work.lights, "near": work.near, "steps": work.steps}
        counts["evaluations"] = work.met
    else:
        samples = program.canvas[0] * program.canvas[1] + program.samples * drawing.refined
        if model.manifest.renderer != "framed":  # others take every sample, with every object
            samples = drawing.pairs // max(1, len(program))
        counts = {"evaluated": drawing.met, "samples": samples, "meetings": drawing.pairs}
        counts["meetings_unskipped"] = samples * len(program)
    off = None
    with suppress(ImportError):
        off = None if exact is None else round(flip(own, exact), 5)
    return {
        "pixels": program.canvas[0] * program.canvas[1],
        "refined": drawing.refined,
        **counts,
        "ms": round(min(times[1:]), 2),
        "psnr": None if exact is None else round(min(MOST_DB, psnr(own, exact)), 2),
        "flip": off,
        "unknown": unknown,
        "parameters": sum(p.numel() for p in model.network.parameters()),
    }
