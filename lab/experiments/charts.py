"""Charts and strips of pictures out of the JSON files of experiments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image as pillow
from PIL import ImageDraw

from lab.charts import FAINT, INK, figure_png, pyplot
from scenelang.image import Image

Result = Mapping[str, Any]
LABEL, LINE, ENLARGED = 170, 4, 2  # pixels; how much larger strips are shown


def experiment_chart(found: Result) -> bytes:
    """The chart of an experiment.

    Args:
        found: of `lab.experiments.experiment.run_experiment`.
    """
    figure = _DRAWN.get(found["experiment"], _bars)(pyplot(), found)
    figure.tight_layout()
    return figure_png(figure)


def _compare(plt: Any, found: Result) -> Any:
    """PSNR over the budget; a line for each renderer and lifting."""
    figure, axis = plt.subplots(figsize=(6.4, 4.0))
    names = list(dict.fromkeys(run["name"] for run in found["runs"]))
    for name in names:
        runs = [run for run in found["runs"] if run["name"] == name]
        x = [run["config"]["seconds"] for run in runs]
        renderer, lifting = name.split("+")
        axis.plot(
            x,
            [run["psnr"]["mean"] for run in runs],
            marker="o",
            linestyle="-" if lifting == "exact" else "--",
            color={"framed": "#1f77b4", "reading": "#2f9e63", "streaming": "#c8452f"}[renderer],
            label=name,
        )
    axis.set_xscale("log")
    ticks = sorted({run["config"]["seconds"] for run in found["runs"]})
    axis.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axis.minorticks_off()
    axis.set_xlabel("processor seconds of training")
    return _finish(figure, axis, f"unseen scenes at {found['runs'][0]['resolution']}²")


def _bars(plt: Any, found: Result) -> Any:
    """A bar a run, the worst scene as a dot."""
    runs = found["runs"]
    figure, axis = plt.subplots(figsize=(7.0, 0.8 + 0.34 * len(runs)))
    y = range(len(runs))
    axis.barh(y, [run["psnr"]["mean"] for run in runs], color="#9fc4e0")
    axis.plot([run["psnr"]["worst"] for run in runs], y, ".", color="#c8452f")
    groups = {run["group"] for run in runs}
    labels = [run["name"] if len(groups) == 1 else f"{run['name']}, {run['group']}" for run in runs]
    axis.set_yticks(y, labels, fontsize=8)
    axis.invert_yaxis()
    axis.set_xlabel("PSNR, dB (bar: mean, dot: worst scene)")
    axis.grid(axis="x", color=FAINT, linewidth=0.5)
    return figure


def _finish(figure: Any, axis: Any, title: str) -> Any:
    axis.set_ylabel("PSNR, dB")
    axis.grid(axis="y", color=FAINT, linewidth=0.5)
    if title:
        axis.set_title(title, fontsize=9, color=INK)
    axis.legend(fontsize=7.5, frameon=False)
    return figure


_DRAWN = {"compare": _compare}


def strips(found: Result, folder: Path) -> Image:
    """The same scenes drawn by every run of an experiment, a row each, the exact ones on top.

    Args:
        found: of `run_experiment`.
        folder: where its strips lie.

    Raises:
        OSError: a strip is missing.
    """
    rows: list[tuple[str, Path]] = []
    exact = ""
    for run in found["runs"]:
        seen = "-seen" if run["config"]["fixed"] else ""
        truth = f"exact-{run['resolution']}px{seen}.png"
        if truth != exact:
            rows.append(("exact", folder / truth))
            exact = truth
        groups = {other["group"] for other in found["runs"]}
        label = run["name"] if len(groups) == 1 else f"{run['name']}, {run['group']}"
        rows.append((f"{label}\n{run['psnr']['mean']:.1f} dB", folder / run["strip"]))
    return _sheet(rows)


def _sheet(rows: Sequence[tuple[str, Path]]) -> Image:
    pictures = []
    for label, path in rows:
        with pillow.open(path) as file:
            size = file.width * ENLARGED, file.height * ENLARGED
            pictures.append((label, file.convert("RGB").resize(size, pillow.Resampling.NEAREST)))
    width = LABEL + max(picture.width for _, picture in pictures)
    height = sum(picture.height + LINE for _, picture in pictures)
    sheet = pillow.new("RGB", (width, height), "white")
    pen, top = ImageDraw.Draw(sheet), 0
    for label, picture in pictures:
        pen.text((4, top + 4), label, fill="black")
        sheet.paste(picture, (LABEL, top))
        top += picture.height + LINE
    return (np.asarray(sheet, np.float32) / 255).view(Image)
