"""No more than a scene needs: plans of scenes, what leaving out saves, what each part of `framed` buys."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import torch

from lab.about import about
from lab.charts import FAINT, INK, LINE, WARN, figure_png, pyplot
from scenelang.backend.neural import open_model
from scenelang.evaluate.evaluation import load
from scenelang.graph.nodes import Graph
from scenelang.measure.metrics import over_white, psnr
from scenelang.measure.plan import plan_of, reference_of
from scenelang.models.load import Model
from scenelang.passes import OPTIONAL
from scenelang.program.compile import compile_scene
from scenelang.renderers.draw import draw
from scenelang.scene.schema import Scene

REPEATS = 2
LEAST_DB = 0.5  # a part that buys less is not told from noise, however small the spread of the seeds

WAYS: Mapping[str, Mapping[str, Any]] = {
    "as shipped": {},
    "every sample meets every object": {"skip": False},
    "four samples in every pixel": {"samples": "four"},
    "both": {"skip": False, "samples": "four"},
    "hidden and unseen objects stay": {"without": OPTIONAL},
}
"""Ways of drawing that leave out less, by the arguments of `draw` and `compile_scene`."""


def shown_frame(path: Path) -> int:
    """The frame that stands for a scene: the first, or the last of an animation that does not loop."""
    animation = load(path).animation
    return 0 if animation is None or animation.loop else animation.frames - 1


def example_plan(path: Path) -> dict[str, Any]:
    """What `scenelang explain-plan` says of a scene on one thread, and what each of `WAYS` costs."""
    frame = shown_frame(path)
    scene = load(path, frame=frame)
    graphs: dict[str, Graph] = {}
    program = compile_scene(scene, after=graphs.__setitem__)
    model = open_model(program.model)
    return {
        "file": path.name,
        "frame": frame,
        "canvas": list(program.canvas),
        **plan_of(scene, program, graphs, model),
        "ways": ways_of(scene, model) if model.manifest.renderer == "framed" else {},
    }


def ways_of(scene: Scene, model: Model) -> dict[str, dict[str, float]]:
    """``meetings``, ``ms`` (the better of two) and ``psnr`` (dB) of a scene by each of `WAYS`."""
    exact = over_white(reference_of(scene, model.manifest))
    found = {}
    for name, options in WAYS.items():
        arguments = dict(options)
        without = arguments.pop("without", ())
        p = compile_scene(scene, model=model.manifest.name, codes=model.codes, without=without)
        best = math.inf
        for _ in range(REPEATS):
            started = time.perf_counter()
            drawing = draw(model.framed, p, **arguments)
            best = min(best, 1000 * (time.perf_counter() - started))
        error = psnr(over_white(drawing.image), exact)
        found[name] = {"meetings": drawing.pairs, "ms": round(best, 2), "psnr": round(error, 2)}
    return found


def measure_examples(
    paths: Iterable[Path], report: Callable[[dict[str, Any]], None] | None = None
) -> dict[str, Any]:
    """Plans of scenes, with the machine they were measured on; on one thread.

    Args:
        paths: scenes.
        report: called with each plan.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    plans, digests = [], {}
    try:
        for path in paths:
            plans.append(example_plan(path))
            digests[plans[-1]["model"]] = open_model(plans[-1]["model"]).digest
            if report is not None:
                report(plans[-1])
        found = about()
    finally:
        torch.set_num_threads(before)
    return {
        **found,
        "weights": digests,
        "plans": plans,
    }


class Verdict(NamedTuple):
    """What taking a part away, or another size, does to the error."""

    change: float  # mean PSNR in dB less the whole renderer's; below 0 where the part buys something
    blends: float  # the same of scenes of smooth unions alone
    word: str  # `pays`, `no difference` or `costs`: the changes against the spread over seeds


def whole_runs(parts: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The runs of the whole renderer, one a seed."""
    return [run for run in parts["runs"] if run["group"] == "whole"]


def whole_psnr(parts: Mapping[str, Any], *, blends: bool = False) -> tuple[float, float]:
    """Mean PSNR of the whole renderer over its seeds, and its spread: largest less smallest."""
    values = [_psnr(run, blends) for run in whole_runs(parts)]
    return sum(values) / len(values), max(values) - min(values)


def _psnr(run: Mapping[str, Any], blends: bool) -> float:
    value: float = run["blends"] if blends else run["psnr"]["mean"]
    return value


def verdict(run: Mapping[str, Any], parts: Mapping[str, Any]) -> Verdict:
    """Judge a run without a part.

    The part pays if pictures of either kind are worse without it by more than seeds are apart, and costs if
    one kind is better by as much and none is worse.

    Args:
        run: of `parts`.
        parts: what ``python -m lab experiment parts`` wrote.
    """
    changes, signs = [], set()
    for blends in (False, True):
        mean, spread = whole_psnr(parts, blends=blends)
        change = _psnr(run, blends) - mean
        changes.append(change)
        if abs(change) > max(spread, LEAST_DB):
            signs.add(change < 0)
    word = "pays" if True in signs else "costs" if signs else "no difference"
    return Verdict(changes[0], changes[1], word)


def parts_chart(parts: Mapping[str, Any]) -> bytes:
    """PSNR without each part beside the whole renderer's, and by each size.

    Args:
        parts: what ``python -m lab experiment parts`` wrote.
    """
    plt = pyplot()
    sizes = size_groups(parts)
    figure, axes = plt.subplots(
        1, 1 + len(sizes), figsize=(5 + 2.2 * len(sizes), 3.4), width_ratios=[2.4, *[1] * len(sizes)]
    )
    axes = [axes] if not sizes else list(axes)
    _bars(axes[0], parts)
    shown = [run["psnr"]["mean"] for runs in (whole_runs(parts), *sizes.values()) for run in runs]
    for axis, (name, runs) in zip(axes[1:], sizes.items(), strict=True):
        _sizes(axis, name, runs, parts)
        axis.set_ylim(min(shown) - 1, max(shown) + 1)
    figure.tight_layout()
    return figure_png(figure)


def size_groups(parts: Mapping[str, Any]) -> dict[str, list[Mapping[str, Any]]]:
    """Runs of other sizes by the size that differs."""
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for run in parts["runs"]:
        if run["group"] not in ("whole", "parts"):
            groups.setdefault(run["group"], []).append(run)
    return groups


def size_of(run: Mapping[str, Any], group: str) -> int:
    """The value of the size that a run has."""
    value: int = run["config"]["student"]["framed"][group]
    return value


def _band(axis: Any, parts: Mapping[str, Any], along: Callable[..., Any]) -> None:
    values = [run["psnr"]["mean"] for run in whole_runs(parts)]
    along(min(values) - 0.05, max(values) + 0.05, color=LINE, alpha=0.25, linewidth=0, zorder=0)


def _bars(axis: Any, parts: Mapping[str, Any]) -> None:
    runs = [*whole_runs(parts)[:1], *(run for run in parts["runs"] if run["group"] == "parts")][::-1]
    means = [run["psnr"]["mean"] for run in runs]
    tails = [run["psnr"]["p5"] for run in runs]
    axis.barh(range(len(runs)), means, color=[LINE if r["group"] == "whole" else FAINT for r in runs])
    axis.plot(tails, range(len(runs)), "|", color=WARN, markersize=9)
    for at, value in enumerate(means):
        axis.text(value + 0.3, at, f"{value:.1f}", va="center", fontsize=7, color=INK)
    _band(axis, parts, axis.axvspan)
    axis.set_yticks(range(len(runs)), [run["name"] for run in runs], fontsize=8)
    axis.set_xlim(0, max(means) + 5)
    axis.set_xlabel("PSNR, dB: mean; 5th percentile in red", fontsize=8)
    axis.tick_params(axis="x", labelsize=7)


def _sizes(axis: Any, name: str, runs: Sequence[Mapping[str, Any]], parts: Mapping[str, Any]) -> None:
    whole = whole_runs(parts)[0]
    points = sorted((size_of(run, name), run["psnr"]["mean"]) for run in [whole, *runs])
    axis.plot(*zip(*points, strict=True), marker="o", markersize=4, color=INK, linewidth=1.2)
    axis.plot(size_of(whole, name), whole["psnr"]["mean"], "o", markersize=7, color=LINE)
    _band(axis, parts, axis.axhspan)
    axis.set_xscale("log", base=2)
    axis.set_xticks([x for x, _ in points], [str(x) for x, _ in points])
    axis.minorticks_off()
    axis.set_title(name.replace("_", " "), fontsize=8.5, color=INK)
    axis.set_ylabel("PSNR, dB", fontsize=8)
    axis.tick_params(labelsize=7)
    axis.grid(axis="y", color=FAINT, linewidth=0.5)
