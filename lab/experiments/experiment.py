"""Trainings at equal budgets, measured on the same unseen scenes: one experiment, one JSON file.

Each run of an experiment (`experiment_runs`) trains for a stated budget of processor time and draws the
same scenes, whose seeds no training uses. Runs keep checkpoints, so that an interrupted experiment goes on
where it stopped and a run that two experiments share is trained once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from lab.about import about
from lab.designs.pictures import PictureConfig, Scenes, pictures, random_scenes
from lab.designs.students import Student
from lab.designs.studies import Study
from lab.experiments.lpips import Lpips, LpipsError, load_lpips
from lab.experiments.runs import EXPERIMENTS, Run
from lab.sets.scenes import summarise
from scenelang.files import write_whole
from scenelang.image import Image
from scenelang.measure.metrics import MOST_DB, compare
from scenelang.program.groups import SMOOTH

UNSEEN = 2021  # seed of the scenes that are measured; trainings use small ones
STRIP = 8  # scenes of a strip
CHUNK = 8  # scenes drawn at once
REPORTS = 6  # while a run trains


Report = Callable[["Run", "Study", float | None], None]


@dataclass(frozen=True, slots=True)
class Settings:
    """How an experiment is run and measured."""

    folder: Path  # gets the JSON file, the strips and the runs' checkpoints
    scenes: int = 200  # unseen scenes that are measured
    device: str = "cpu"  # torch device


def run_experiment(
    name: str,
    budget_s: float,
    seed: int,
    settings: Settings,
    report: Report = lambda *_: None,
) -> dict[str, Any]:
    """Train and measure all runs of an experiment.

    Args:
        name: of `EXPERIMENTS`.
        budget_s: processor seconds of a training.
        seed: of parameters and training scenes.
        settings: where and how.
        report: called with a run, its study and at its end the PSNR, a few times a run.

    Returns:
        What is written to ``FOLDER/NAME.json``.
    """
    runs = EXPERIMENTS[name](budget_s, seed)
    results = [run_one(run, settings, report) for run in runs]
    _, blank = unseen(settings.scenes, max(run.side for run in runs), settings.device)
    return {
        "experiment": name,
        "set": "shapes2d",
        "seed": seed,
        **about(),
        "device": settings.device,
        "budget_s": budget_s,
        # pictures with nothing on them, which a renderer has to beat to have learned anything
        "white": _figures(torch.ones_like(blank), blank),
        "runs": results,
    }


def run_one(run: Run, settings: Settings, report: Report = lambda *_: None) -> dict[str, Any]:
    """Train one run, or what is left of it, and measure it."""
    config = run.study
    study = Study(config, settings.folder / "runs" / run.folder, settings.device)
    finite, due = True, 0.0
    for progress in study.run():
        finite = finite and math.isfinite(progress.loss)
        if not finite:
            break
        if progress.seconds >= due:
            report(run, study, None)
            due = progress.seconds + config.seconds / REPORTS
    finite = finite and all(bool(p.isfinite().all()) for p in study.averaged.parameters())
    scenes, exact = unseen(settings.scenes, run.side, settings.device)
    if run.seen:
        assert study.fixed is not None
        scenes, exact = study.fixed, _exact(study.fixed, run.side)
    shown = draw(study.averaged, scenes, run.side)
    figures = _figures(shown, exact)
    if run.blends:
        blended, truth = unseen(settings.scenes, run.side, settings.device, blends=True)
        figures["blends"] = round(_psnr(draw(study.averaged, blended, run.side), truth), 4)
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
        "strip": _strips(run, shown, exact, settings.folder),
    }


@lru_cache(maxsize=4)
def unseen(count: int, r: int, device: str, blends: bool = False) -> tuple[Scenes, Tensor]:
    """Scenes whose seed no training uses, and their exact pictures (B, 3, R, R).

    Args:
        count: scenes B.
        r: pixels R along a side.
        device: that makes them.
        blends: join all objects of a scene by smooth unions.
    """
    scenes = random_scenes(count, PictureConfig(), torch.Generator(device).manual_seed(UNSEEN))
    if blends:
        scenes.tokens[:, 1:] = SMOOTH
    return scenes, _exact(scenes, r)


def _chunks(scenes: Scenes) -> Iterator[Scenes]:
    return map(scenes.pick, torch.split(torch.arange(len(scenes.leaf)), CHUNK))


def _exact(scenes: Scenes, r: int) -> Tensor:
    return torch.cat([pictures(some, r) for some in _chunks(scenes)]).cpu()


@torch.no_grad()
def draw(student: Student, scenes: Scenes, r: int) -> Tensor:
    """A student's pictures (B, 3, R, R), of scenes at R pixels along a side."""
    return torch.cat([student.image(some, r) for some in _chunks(scenes)]).clamp(0.0, 1.0).cpu()


def _psnr(shown: Tensor, exact: Tensor) -> float:
    errors = (shown - exact).square().mean((1, 2, 3)).clamp_min(10 ** (-MOST_DB / 10))
    return float((-10 * errors.log10()).mean())


def _figures(shown: Tensor, exact: Tensor) -> dict[str, Any]:
    """Mean, worst and the tail towards it, of each metric over the scenes."""
    cases = []
    for one, other in zip(shown, exact, strict=True):
        # a network that came to nothing draws what is not a number; its picture is grey
        a, b = (v.nan_to_num(0.5).permute(1, 2, 0).numpy() for v in (one, other))
        cases.append(compare(a, b))
    return summarise(cases) | {"lpips": _lpips(shown, exact)}


def _lpips(shown: Tensor, exact: Tensor) -> dict[str, float] | None:
    """LPIPS of VGG16 features, mean; None where its weights are not installed."""
    try:
        distance = _vgg()
    except LpipsError:
        return None
    with torch.no_grad():
        found = [
            float(distance(a.nan_to_num(0.5), b)) * len(a)
            for a, b in zip(torch.split(shown, CHUNK), torch.split(exact, CHUNK), strict=True)
        ]
    return {"mean": round(sum(found) / len(shown), 4)}


@lru_cache(maxsize=1)
def _vgg() -> Lpips:
    return load_lpips()


def _strips(run: Run, shown: Tensor, exact: Tensor, folder: Path) -> str:
    """Write the first scenes in a row, and the exact ones beside it; returns the file's name."""
    name = f"{run.folder}.png"
    truth = f"exact-{run.side}px{'-seen' if run.seen else ''}.png"
    for file, images in ((name, shown), (truth, exact)):
        row: Sequence[Tensor] = [image.nan_to_num(0.5).permute(1, 2, 0) for image in images[:STRIP]]
        picture = np.ascontiguousarray(torch.cat(list(row), 1).numpy(), np.float32)
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(folder / file, picture.view(Image).encode())
    return name
