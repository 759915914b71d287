"""One run that takes the time and the error of every way to draw, side by side.

Each scene is drawn by all ways in turn, beginning with another one each time, each frame of a Program that
was not drawn before. Ways that take long draw fewer scenes; the file says how many.
"""

from __future__ import annotations

import contextlib
import math
import platform
import statistics
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

from lab.about import Report, about, revision, silent
from lab.evaluate import exact_of
from lab.frontier.fit import fit_cost
from lab.frontier.record import FrameErrors, Frontier, Point, Quality, Ratio, Times, front
from lab.frontier.ways import PAPER, Draw, Way, paired, ways_of
from lab.sets.scenes import interval, scenes_of, usual_set
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import Manifest, load_manifest
from scenelang.drawing.how import keep_memory
from scenelang.drawing.image import Image, enlarged, from_samples
from scenelang.drawing.metrics import flip, over_white, psnr
from scenelang.drawing.torch_backend import open_model
from scenelang.drawing.work import Load, load_of
from scenelang.language.scene import Scene
from scenelang.output.frontier import Cost, error_scale, reference_of, yardstick

SHOWN = 4  # scenes whose pictures are kept
CONVERGED = 8  # scenes compared with 64 samples a pixel
SLOW_S = 20.0  # a way that takes over `LATE_MS`, or is not offered, draws so long at most,
LEAST = 4  # but at least so many scenes
COMPARED = 30  # scenes of the reference with other samples than the definition's
TIMED = 20  # scenes of ways of which only the time is taken
SIDE = 256  # pixels along a side of the scenes
OTHERS = 1000  # index of the first scene of the other cases
LATE_MS = 1000.0  # ways that take longer draw nothing of these
PROMISED = 0.975
MARGIN = 1.25  # of 40 scenes without it, one scene in ten of another seed was worse than promised
FEW = 118  # of fewer scenes the largest may lie under the quantile by more than 5 % (0.975^118 = 0.05)
FEW_MARGIN = 1.5  # of 45 scenes of solids with a quarter alone, one in twenty of another seed was worse


class PromisedScenes(NamedTuple):
    """Scenes that promises are made and tried on: of a set, on a canvas or the set's own."""

    name: str
    set: str
    canvas: tuple[int, int] | None
    share: float  # of the scenes that are asked for
    solid: float = 1 / 3  # of solids, whose exact pictures take long

    def scenes(self, asked: int, dimension: int) -> int:
        """Number of its scenes to draw for a requested number."""
        return max(1, round(asked * (self.share if dimension == 2 else self.solid)))

    def on(self, scene: Scene) -> Scene:
        """The scene on its canvas."""
        return scene if self.canvas is None else scene.model_copy(update={"canvas": self.canvas})


CASES: tuple[PromisedScenes, ...] = (
    PromisedScenes("256 x 256", "", None, 1.0, 1.0),
    PromisedScenes("128 x 128", "", (128, 128), 1 / 3),
    PromisedScenes("512 x 512", "", (512, 512), 1 / 3, 1 / 8),
    PromisedScenes("16 objects", "many", None, 1 / 3),
)
CROWD = PromisedScenes("100 objects", "crowd", None, 1 / 6, 1 / 8)  # of which only the time is taken


@dataclass(slots=True)
class Timings:
    ms: list[float] = field(default_factory=list)  # of each scene
    # of each scene
    flip: list[float] = field(default_factory=list)
    psnr: list[float] = field(default_factory=list)
    # of the frames that its cost is fitted to, and their milliseconds
    loads: list[Load] = field(default_factory=list)
    fitted: list[float] = field(default_factory=list)
    pictures: list[Image] = field(default_factory=list)  # of the first scenes
    converged: list[float] = field(default_factory=list)  # FLIP against 64 samples a pixel
    others: list[list[float]] = field(default_factory=list)  # FLIP of each other case, over `error_scale`


def measure_frontier(
    base: str,
    scenes: int,
    seed: int,
    threads: int,
    report: Report = silent,
    kept: Path | None = None,
) -> tuple[Frontier, dict[str, list[Image]], list[Image]]:
    """Measure all ways to draw scenes of the set of ``base``, with exact pictures ``kept`` in a folder.

    Returns the figures, pictures of the first scenes by the name of what drew them, and the exact ones.
    """
    keep_memory()
    torch.set_num_threads(threads)
    manifest = load_manifest(base)
    ways = ways_of(base, threads)
    records = {way.name: Timings() for way in ways}
    scene_at = scenes_of(open_model(base), usual_set(manifest), seed, SIDE)
    spare = scene_at(scenes)
    quota = {way.name: _quota(way, spare, scenes, threads) for way in ways}
    stick = yardstick()
    for index in range(scenes):
        scene = scene_at(index)
        wanted = [way for way in ways if index < quota[way.name]]
        turn = index % len(wanted)
        _one_scene(scene, wanted[turn:] + wanted[:turn], records, manifest, index, threads, kept)
        report("scenes", index + 1, scenes)
    offered_ways = [way for way in ways if way.offered]
    _other_cases(base, offered_ways, records, scenes, seed, threads, report, kept)
    paper = next((records[w.name] for w in ways if w.name.startswith(PAPER)), None)
    points = [_point(way, records[way.name], paper) for way in ways]
    offered = [p for p in points if p.offered and p.flip is not None and not p.side]
    best = front([(p.ms.median, p.flip.mean) for p in offered if p.flip is not None])
    on_front = {p.name for p, yes in zip(offered, best, strict=True) if yes}
    points = [replace(p, on_front=p.name in on_front) for p in points]
    frontier = Frontier(
        set=usual_set(manifest),
        seed=seed,
        scenes=scenes,
        canvas=spare.canvas,
        threads=threads,
        clock="processor" if threads == 1 else "wall",
        machine=machine(),
        revision=revision(),
        torch=torch.__version__.split("+")[0],
        yardstick_ms=(stick + yardstick()) / 2,
        streaming_ms=statistics.median(paper.ms) if paper is not None else 0.0,
        converged={n: float(np.mean(r.converged)) for n, r in records.items() if r.converged},
        points=tuple(sorted(points, key=lambda p: p.ms.median)),
        ratios=tuple(_ratios(base, records)),
        command=about()["command"],
    )
    pictures = {name: record.pictures for name, record in records.items() if record.pictures}
    shown = [_white(exact_of(scene_at(i), manifest, kept)) for i in range(min(SHOWN, scenes))]
    return frontier, pictures, shown


def _white(picture: Image) -> Image:
    return from_samples(over_white(picture), None)


def _timed(run: Draw, threads: int) -> tuple[float, Image]:
    """Milliseconds and the picture. One thread's processor time is its time on an idle machine."""
    clock = time.thread_time if threads == 1 else time.perf_counter
    started = clock()
    image = run()
    return 1000 * (clock() - started), image


def _quota(way: Way, scene: Scene, scenes: int, threads: int) -> int:
    """Number of scenes that a way draws, without its first frames, which load and warm up."""
    for _ in range(2):
        ms, _ = _timed(way.prepare(scene), threads)
    most = TIMED if not way.drawn else scenes if way.offered or way.backend == "neural" else COMPARED
    least = scenes if way.offered and ms < LATE_MS else LEAST  # which makes promises
    return max(1, min(scenes, most, max(least, int(1000 * SLOW_S / ms))))


def _one_scene(
    scene: Scene,
    ways: Sequence[Way],
    records: dict[str, Timings],
    manifest: Manifest,
    index: int,
    threads: int,
    kept: Path | None,
) -> None:
    exact = over_white(exact_of(scene, manifest, kept))
    load = load_of(compile_scene(scene, model=manifest.name))
    many = None
    if index < CONVERGED and manifest.dimension == 2:  # with 64 samples a picture of solids takes minutes
        many = over_white(reference_of(scene, manifest, per_side=8))
    drawn = [(way, *_timed(run, threads)) for way, run in [(way, way.prepare(scene)) for way in ways]]
    for way, ms, image in drawn:
        record = records[way.name]
        record.ms.append(ms)
        record.loads.append(load)
        record.fitted.append(ms)
        if not way.drawn:
            continue
        picture = _white(enlarged(image, (exact.shape[1], exact.shape[0])))
        record.flip.append(flip(picture, exact))
        record.psnr.append(psnr(picture, exact))
        if index < SHOWN:
            record.pictures.append(picture)
        if many is not None:
            record.converged.append(flip(picture, many))


def _other_cases(
    base: str,
    ways: Sequence[Way],
    records: dict[str, Timings],
    scenes: int,
    seed: int,
    threads: int,
    report: Report,
    kept: Path | None,
) -> None:
    """Draw offered ways on other canvases and of more objects: what costs are fitted to, and promises."""
    manifest = load_manifest(base)
    model = open_model(base)
    for case in (*CASES[1:], CROWD):
        scene_at = scenes_of(model, case.set or usual_set(manifest), seed, SIDE)
        count = case.scenes(scenes, manifest.dimension)
        errors: dict[str, list[float]] = {}
        for index in range(-1, count):  # the first of its kind finds its memory, and is not counted
            scene = case.on(scene_at(OTHERS + index))
            program = compile_scene(scene, model=base)
            load, scale = load_of(program), error_scale(scene.canvas, len(program))
            exact = over_white(exact_of(scene, manifest, kept)) if index >= 0 and case is not CROWD else None
            for way in ways:
                record = records[way.name]
                if (way.side and case.canvas) or statistics.median(record.ms) > LATE_MS:
                    continue
                ms, image = _timed(way.prepare(scene), threads)
                if index < 0:
                    continue
                record.loads.append(load)
                record.fitted.append(ms)
                if not way.side and exact is not None:
                    errors.setdefault(way.name, []).append(flip(over_white(image), exact) / scale)
            report(case.name, index + 1, count)
        for name, values in errors.items():
            records[name].others.append(values)


def promised(values: Sequence[float]) -> float:
    """A bound that a new value of the same kind exceeds with a probability of at most 2.5 %.

    The k-th smallest of n values, k = ceil(0.975 (n + 1)), or a little over the largest: a conformal quantile
    (Vovk, Gammerman, Shafer, *Algorithmic Learning in a Random World*, 2005).
    """
    ordered = sorted(values)
    k = math.ceil(PROMISED * (len(ordered) + 1))
    if k <= len(ordered):
        return ordered[k - 1]
    return 1.5 * ordered[-1]


def margin(scenes: int) -> float:
    """By how much more than its quantile an error is promised, of a set of which so many were drawn."""
    return MARGIN if scenes >= FEW else FEW_MARGIN


def _point(way: Way, record: Timings, paper: Timings | None) -> Point:
    errors = quality = None
    if record.flip:
        errors = FrameErrors(
            bound=margin(len(record.flip)) * max(map(promised, [record.flip, *record.others])),
            mean=float(np.mean(record.flip)),
            p95=float(np.percentile(record.flip, 95)),
            worst=max(record.flip),
            interval=interval(record.flip),
        )
        quality = Quality(
            float(np.mean(record.psnr)),
            float(np.percentile(record.psnr, 5)),
            min(record.psnr),
            interval(record.psnr),
        )
    cost: Cost | None = None
    if way.offered:
        cost = fit_cost(record.loads, record.fitted, way.skip, fixed=bool(way.side))
    shared = {f.name: getattr(way, f.name) for f in fields(Way) if f.name not in ("prepare", "drawn")}
    return Point(
        **shared,
        offered=way.offered,
        scenes=len(record.ms),
        ms=Times(
            statistics.median(record.ms), float(np.percentile(record.ms, 95)), *median_interval(record.ms)
        ),
        ratio_to_streaming=0.0 if paper is None else float(np.mean(_over(paper, record))),
        flip=errors,
        psnr=quality,
        cost=cost,
        on_front=False,
    )


def median_interval(values: Sequence[float]) -> tuple[float, float]:
    """The 95 % interval of a median: the values whose ranks are 0.98 √n from the middle, or the extremes."""
    ordered, n = sorted(values), len(values)
    rank = max(1, round(n / 2 - 0.98 * math.sqrt(n)))
    return ordered[rank - 1], ordered[n - rank]


def _ratios(base: str, records: dict[str, Timings]) -> Iterator[Ratio]:
    for slow, fast in paired(base):
        if slow in records and fast in records:
            result = _over(records[slow], records[fast])
            yield Ratio(slow, fast, len(result), float(np.mean(result)), interval(result))


def _over(slow: Timings, fast: Timings) -> list[float]:
    """Ratios of the times of two ways, for each scene that both drew."""
    return [a / b for a, b in zip(slow.ms, fast.ms, strict=False)]


def machine() -> str:
    name = platform.processor() or platform.machine()
    with contextlib.suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text("utf-8", "replace").splitlines()
        name = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), name)
    return f"{name}, {platform.machine()}"
