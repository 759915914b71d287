"""Trainings at equal budgets, measured on the same unseen scenes: one experiment, one JSON file.

An experiment is a list of runs. Each trains a student (`scenelang.training.studies`) for a stated budget of
processor time and draws the same scenes, whose seeds no training uses. Runs keep checkpoints, so that an
interrupted experiment goes on where it stopped and a run that two experiments share is trained once.
"""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from scenelang.evaluation.metrics import MOST_DB, measure
from scenelang.files import write_whole
from scenelang.image import Image
from scenelang.renderers.streaming import StreamingConfig
from scenelang.training.ablations import ablation_runs
from scenelang.training.encoders import LiftingConfig
from scenelang.training.loop import revision
from scenelang.training.pictures import PictureConfig, Scenes, pictures, random_scenes
from scenelang.training.students import LiftingName, RendererName, StreamingStudent, Student, StudentConfig
from scenelang.training.studies import RATES, Study, StudyConfig, level_at

UNSEEN = 2021  # seed of the scenes that are measured; trainings use small ones
STRIP = 8  # scenes of a strip
CHUNK = 8  # scenes drawn at once
POINTS = 6  # of a curve over time
SIDE = 32  # pixels along a side of the pictures: what `streaming` reaches on a processor in minutes
SIZES_SIDE = 16  # of the thirteen trainings of the size study
PARTS_SIDE = 128  # where only renderers that answer points are compared
RENDERERS: tuple[RendererName, ...] = ("framed", "reading", "streaming")
LIFTINGS: tuple[LiftingName, ...] = ("exact", "learned")
SIZES = (1, 2, 4, 8, 16, 32, 64)


@dataclass(frozen=True, slots=True)
class Run:
    """One training and what it is called.

    Args:
        name: in tables.
        group: runs that are compared with one another.
        study: what is trained.
        seen: measure on the fixed scenes it was trained on.
        side: pixels along a side of the pictures that are measured.
    """

    name: str
    group: str
    study: StudyConfig
    seen: bool = False
    side: int = SIDE

    @property
    def folder(self) -> str:
        """Where its checkpoint lies, the same for the same run of another experiment."""
        study = self.study
        parts = [self.name, f"{study.seconds:g}s", f"seed{study.seed}"]
        if study.fixed:
            parts.append(f"{study.fixed}scenes")
        return "-".join(parts).replace("+", "-").replace(" ", "-")


def plain(renderer: RendererName, lifting: LiftingName, seconds: float, seed: int = 1) -> StudyConfig:
    """The usual training of a renderer and a lifting; `streaming` has an eighth of the paper's filters."""
    streaming = StreamingConfig(resolution=SIDE, width=1 / 8)
    student = StudentConfig(renderer=renderer, lifting=lifting, streaming=streaming)
    scenes = 8 if renderer == "streaming" else 16  # a picture of a scene takes long
    rate = RATES[renderer]
    if (renderer, lifting) == ("framed", "learned"):
        rate /= 10  # faster, its frames collapse and it draws the mean colour
    warm = renderer == "streaming"  # a level that begins as noise costs more than minutes can pay
    return StudyConfig(student, seconds=seconds, rate=rate, scenes=scenes, seed=seed, warm=warm)


def overfit(budget_s: float, seed: int) -> list[Run]:
    """Each renderer on 16 scenes it sees again and again: does it work at all?"""
    runs = []
    for renderer in RENDERERS:
        for lifting in LIFTINGS:
            if lifting == "exact" and renderer != "framed":
                continue
            study = replace(plain(renderer, lifting, budget_s, seed), fixed=16, average=0.98)
            runs.append(Run(f"{renderer}+{lifting}", "16 scenes", study, seen=True))
    return runs


def compare(budget_s: float, seed: int) -> list[Run]:
    """Every renderer with every lifting at a third of the budget and at all of it."""
    return [
        Run(f"{renderer}+{lifting}", f"{seconds:g} s", plain(renderer, lifting, seconds, seed))
        for seconds in (budget_s / 3, budget_s)
        for renderer in RENDERERS
        for lifting in LIFTINGS
    ]


def table1(budget_s: float, seed: int) -> list[Run]:
    """Sizes 1 to 64 of the geometry vector and of the material vector, the other one 32 (Table 1)."""
    base = plain("streaming", "learned", budget_s, seed)
    sizes = replace(base.student.streaming, resolution=SIZES_SIDE)
    runs = []
    for side in ("geometry", "material"):
        for d in SIZES:
            if side == "material" and d == 32:
                continue  # the same run as the geometry's
            student = replace(base.student, streaming=sizes, learned=LiftingConfig(**{side: d}))
            runs.append(Run(f"{side} {d}", side, replace(base, student=student), side=SIZES_SIDE))
    return runs


def table2(budget_s: float, seed: int) -> list[Run]:
    """Deformed shapes: the paper's method, and ours (Table 2, left)."""
    return [
        Run(f"{r}+{lifting}", f"{budget_s:g} s", plain(r, lifting, budget_s, seed)) for r, lifting in _PAIRS
    ]


_PAIRS: tuple[tuple[RendererName, LiftingName], ...] = (("streaming", "learned"), ("framed", "exact"))


def table3(budget_s: float, seed: int) -> list[Run]:
    """Growing resolution by resolution against training at the last one at once (Table 3)."""
    grown = plain("streaming", "learned", budget_s, seed)
    return [
        Run("streaming+learned", "grown, each level from the one below", grown),
        Run("streaming+learned cold", "grown, each level from noise", replace(grown, warm=False)),
        Run("streaming+learned direct", "direct", replace(grown, grow=False)),
    ]


def table4(budget_s: float, seed: int) -> list[Run]:
    """The paper's two renderers (Table 4)."""
    renderers: tuple[RendererName, ...] = ("streaming", "reading")
    return [Run(f"{r}+learned", f"{budget_s:g} s", plain(r, "learned", budget_s, seed)) for r in renderers]


def losses(budget_s: float, seed: int) -> list[Run]:
    """The likelihood alone, and with half of a perceptual loss beside it, as the paper trains."""
    alone = plain("streaming", "learned", budget_s, seed)
    return [
        Run("streaming+learned", "likelihood", alone),
        Run("streaming+learned perceptual", "perceptual", replace(alone, perceptual=0.5)),
    ]


def seeds(budget_s: float, seed: int) -> list[Run]:
    """Three seeds of each renderer: spread and divergence."""
    pairs: tuple[tuple[RendererName, LiftingName], ...] = (*_PAIRS, ("reading", "learned"))
    return [
        Run(f"{r}+{lifting}", f"seed {s}", plain(r, lifting, budget_s, s))
        for r, lifting in pairs
        for s in range(seed, seed + 3)
    ]


def parts(budget_s: float, seed: int) -> list[Run]:
    """`framed` without one of its parts at a time, and at other sizes: what each of them buys."""
    return [Run(*run, side=PARTS_SIDE) for run in ablation_runs(budget_s, seed)]


EXPERIMENTS: dict[str, Callable[[float, int], list[Run]]] = {
    "overfit": overfit,
    "compare": compare,
    "table1": table1,
    "table2": table2,
    "table3": table3,
    "table4": table4,
    "losses": losses,
    "seeds": seeds,
    "parts": parts,
}


@dataclass(frozen=True, slots=True)
class Settings:
    """How an experiment is run and measured.

    Args:
        folder: gets the JSON file, the strips and the runs' checkpoints.
        scenes: unseen scenes that are measured.
        device: torch device.
    """

    folder: Path
    scenes: int = 200
    device: str = "cpu"


def run_experiment(
    name: str,
    budget_s: float,
    seed: int,
    settings: Settings,
    report: Callable[[Run, Study, float], None] | None = None,
) -> dict[str, Any]:
    """Train and measure all runs of an experiment.

    Args:
        name: of `EXPERIMENTS`.
        budget_s: processor seconds of a training.
        seed: of parameters and training scenes.
        settings: where and how.
        report: called with a run, its study and the PSNR so far, a few times a run.

    Returns:
        What is written to ``FOLDER/NAME.json``.
    """
    runs = EXPERIMENTS[name](budget_s, seed)
    results = [run_one(run, settings, report) for run in runs]
    return {
        "experiment": name,
        "set": "shapes2d",
        "seed": seed,
        "revision": revision(),
        "machine": platform.machine(),
        "torch": torch.__version__.split("+")[0],
        "threads": torch.get_num_threads(),
        "device": settings.device,
        "budget_s": budget_s,
        "white": white(max(run.side for run in runs), settings),
        "runs": results,
    }


def white(side: int, settings: Settings) -> dict[str, Any]:
    """Figures of pictures with nothing on them, which a renderer has to beat to have learned anything."""
    generator = torch.Generator(settings.device).manual_seed(UNSEEN)
    scenes = random_scenes(settings.scenes, PictureConfig(), generator)
    exact = torch.cat(
        [pictures(scenes.pick(rows), side) for rows in torch.split(torch.arange(len(scenes.leaf)), CHUNK)]
    )
    return _figures(torch.ones_like(exact).cpu(), exact.cpu())


def run_one(
    run: Run, settings: Settings, report: Callable[[Run, Study, float], None] | None = None
) -> dict[str, Any]:
    """Train one run, or what is left of it, and measure it."""
    config = run.study
    study = Study(
        config, settings.folder / "runs" / run.folder, settings.device, _perceptual(config, settings)
    )
    few = _scenes(run, study, 24, settings)
    # kept beside the checkpoint, for runs that are measured again
    kept = settings.folder / "runs" / run.folder / "curve.json"
    curve: list[list[float]] = json.loads(kept.read_text("utf-8")) if kept.exists() else []
    finite = True
    due = config.seconds / POINTS
    for progress in study.run():
        finite = finite and math.isfinite(progress.loss)
        if not finite:
            break
        if progress.seconds >= due * (len(curve) + 1) and progress.seconds < config.seconds:
            r, blend = min(run.side, SIDE), 1.0
            if config.student.renderer == "streaming":
                r, blend = level_at(progress.seconds / config.seconds, r, config.grow)
            shown, exact = draw(study.averaged, few, r, blend)
            curve.append([round(progress.seconds, 1), round(_psnr(shown, exact), 2)])
            kept.parent.mkdir(parents=True, exist_ok=True)
            write_whole(kept, json.dumps(curve).encode())
            if report is not None:
                report(run, study, curve[-1][1])
    finite = finite and all(bool(p.isfinite().all()) for p in study.averaged.parameters())
    scenes = _scenes(run, study, settings.scenes, settings)
    shown, exact = draw(study.averaged, scenes, run.side)
    figures = _figures(shown, exact)
    if report is not None:
        report(run, study, figures["psnr"]["mean"])
    return {
        "name": run.name,
        "group": run.group,
        "config": config.to_json(),
        "seconds": round(study.progress.seconds, 1),
        "steps": study.progress.step,
        "parameters": sum(p.numel() for p in study.averaged.parameters()),
        "finite": finite,
        "resolution": run.side,
        "scenes": len(scenes.leaf),
        **figures,
        "curve": curve,
        "strip": _strips(run, shown, exact, settings.folder),
    }


def _perceptual(config: StudyConfig, settings: Settings) -> Callable[[Tensor, Tensor], Tensor] | None:
    if not config.perceptual:
        return None
    from scenelang.evaluation.lpips import load_lpips

    return load_lpips("alexnet").to(settings.device)


def _scenes(run: Run, study: Study, count: int, settings: Settings) -> Scenes:
    if run.seen:
        assert study.fixed is not None
        return study.fixed
    generator = torch.Generator(settings.device).manual_seed(UNSEEN)
    return random_scenes(count, PictureConfig(), generator)


@torch.no_grad()
def draw(student: Student, scenes: Scenes, r: int, blend: float = 1.0) -> tuple[Tensor, Tensor]:
    """A student's pictures and the exact ones (B, 3, R, R).

    Args:
        student: what draws.
        scenes: what is drawn.
        r: pixels R along a side.
        blend: share of the newest level, of a student that grows.
    """
    shown, exact = [], []
    for rows in torch.split(torch.arange(len(scenes.leaf)), CHUNK):
        some = scenes.pick(rows)
        if isinstance(student, StreamingStudent):
            image = student.image(some, r, blend)
        else:
            image = student.image(some, r)
        shown.append(image.clamp(0.0, 1.0))
        exact.append(pictures(some, r))
    return torch.cat(shown).cpu(), torch.cat(exact).cpu()


def _psnr(shown: Tensor, exact: Tensor) -> float:
    errors = (shown - exact).square().mean((1, 2, 3)).clamp_min(10 ** (-MOST_DB / 10))
    return float((-10 * errors.log10()).mean())


def _figures(shown: Tensor, exact: Tensor) -> dict[str, Any]:
    """Mean, worst and the tail towards it, of each metric over the scenes."""
    cases = []
    for one, other in zip(shown, exact, strict=True):
        # a network that came to nothing draws what is not a number; its picture is grey
        a, b = (v.nan_to_num(0.5).permute(1, 2, 0).numpy() for v in (one, other))
        cases.append(measure(a, b))
    out: dict[str, Any] = {}
    for metric in ("psnr", "ssim", "flip"):
        values = np.array([case[metric] for case in cases])
        tail, worst = (95, values.max()) if metric == "flip" else (5, values.min())
        out[metric] = {
            "mean": round(float(values.mean()), 4),
            f"p{tail}": round(float(np.percentile(values, tail)), 4),
            "worst": round(float(worst), 4),
        }
    out["lpips"] = _lpips(shown, exact)
    return out


def _lpips(shown: Tensor, exact: Tensor) -> dict[str, float] | None:
    """LPIPS of VGG16 features, mean; None where its weights are not installed."""
    from scenelang.evaluation.lpips import LpipsError, load_lpips

    try:
        distance = load_lpips("vgg16")
    except LpipsError:
        return None
    with torch.no_grad():
        found = [
            float(distance(a.nan_to_num(0.5), b)) * len(a)
            for a, b in zip(torch.split(shown, CHUNK), torch.split(exact, CHUNK), strict=True)
        ]
    return {"mean": round(sum(found) / len(shown), 4)}


def _strips(run: Run, shown: Tensor, exact: Tensor, folder: Path) -> str:
    """Write the first scenes in a row, and the exact ones beside it; returns the file's name."""
    name = f"{run.folder}.png"
    truth = f"exact-{run.side}px{'-seen' if run.seen else ''}.png"
    for file, images in ((name, shown), (truth, exact)):
        row: Sequence[Tensor] = [image.nan_to_num(0.5).permute(1, 2, 0) for image in images[:STRIP]]
        picture = np.ascontiguousarray(torch.cat(list(row), 1).numpy(), np.float32)
        folder.mkdir(parents=True, exist_ok=True)
        picture.view(Image).save(folder / file)
    return name
