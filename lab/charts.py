"""Charts of measurements, drawn from their JSON by matplotlib as PNG."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from scenelang.drawing.metrics import MOST_DB

INK, FAINT, LINE, WARN = "#22303c", "#c9d1d8", "#1f77b4", "#c8452f"
COLUMNS = 3
WIDE_IN = 9.5  # 760 pixels, as pages show them
TICKS = 6  # named along an axis


def stability_chart(results: Sequence[Mapping[str, Any]]) -> bytes:
    """PSNR of every probe: mean with interval, shaded from the 5th percentile, the worst as dots."""
    plt = pyplot()
    first = results[0]
    names = list(first["probes"])
    lines = (len(names) + COLUMNS - 1) // COLUMNS
    figure, axes = plt.subplots(lines, COLUMNS, figsize=(WIDE_IN, 2.1 * lines), squeeze=False)
    for axis, name in zip(axes.flat, names, strict=False):
        curves = [{**r["probes"][name], "model": r["model"]} for r in results if name in r["probes"]]
        _probe(axis, curves)
        lowest = min(row["psnr"]["worst"] for curve in curves for row in curve["rows"])
        axis.set_ylim(min(40.0, lowest - 1), MOST_DB + 1)
    for axis in axes.flat[len(names) :]:
        axis.set_axis_off()
    if len(results) > 1:
        axes.flat[0].legend(fontsize=7, frameon=False)
    figure.tight_layout()
    return figure_png(figure, dpi=120)


def _probe(axis: Any, curves: Sequence[Mapping[str, Any]]) -> None:
    first = curves[0]
    for i, curve in enumerate(curves):
        x = [row["value"] for row in curve["rows"]]
        mean, p5, worst = ([row["psnr"][k] for row in curve["rows"]] for k in ("mean", "p5", "worst"))
        (line,) = axis.plot(x, mean, marker="o", markersize=3, linewidth=1.5, label=curve["model"])
        if i == 0:
            off = [row["psnr"].get("interval", 0.0) for row in curve["rows"]]
            axis.errorbar(x, mean, yerr=off, fmt="none", ecolor=line.get_color(), elinewidth=1, capsize=2)
            axis.fill_between(x, p5, mean, color=line.get_color(), alpha=0.15, linewidth=0)
            axis.plot(x, worst, ".", color=WARN, markersize=4)
    values = [row["value"] for row in first["rows"]]
    if min(values) > 0 and max(values) / min(values) > 8:
        axis.set_xscale("log", base=2)
    every = -(-len(values) // TICKS)
    axis.set_xticks(values, [f"{v:g}" if i % every == 0 else "" for i, v in enumerate(values)])
    axis.minorticks_off()
    axis.axvline(first["healthy"], color=FAINT, linewidth=5, zorder=0)
    axis.set_title(first["title"], fontsize=8, color=INK, wrap=True)
    axis.set_xlabel(first["quantity"], fontsize=8)
    axis.set_ylabel("PSNR, dB", fontsize=8)
    axis.tick_params(labelsize=7)
    axis.grid(axis="y", color=FAINT, linewidth=0.5)


def budget_chart(curves: Mapping[str, Sequence[Sequence[float]]], white: float, hours: float) -> bytes:
    """PSNR over core-hours of long trainings, by name, and lines of their last third drawn on to ``hours``.

    A point is steps, seconds, side and PSNR. Where a training began with the weights of another, the points
    that both have are drawn once. The error is taken to fall by a power of the time, which is a guess.
    """
    plt = pyplot()
    figure, axis = plt.subplots(figsize=(WIDE_IN, 3.6))
    seen: set[tuple[float, ...]] = set()
    for name, points in curves.items():
        own = [p for p in points if tuple(p) not in seen]
        seen |= {tuple(p) for p in points}
        x, y = np.array([p[1] / 3600 for p in own]), np.array([p[3] for p in own])
        (line,) = axis.plot(x, y, linewidth=1.5, label=name)
        tail = len(x) - max(3, len(x) // 3)
        rise, level = np.polyfit(np.log10(x[tail:]), y[tail:], 1)
        on = np.geomspace(x[-1], hours)
        axis.plot(on, rise * np.log10(on) + level, ":", color=line.get_color(), linewidth=1)
    axis.axhline(white, color=FAINT, linewidth=1)
    axis.annotate(
        "a white picture", (hours, white), (0, 3), textcoords="offset points", ha="right", fontsize=7
    )
    axis.set_xscale("log")
    axis.set_ylim(white - 1, MOST_DB)
    axis.set_xlabel("core-hours", fontsize=8)
    axis.set_ylabel("PSNR, dB", fontsize=8)
    axis.tick_params(labelsize=7)
    axis.grid(color=FAINT, linewidth=0.5)
    axis.legend(fontsize=7, frameon=False)
    figure.tight_layout()
    return figure_png(figure, dpi=120)


def pyplot() -> Any:
    """matplotlib's pyplot, drawing to files alone; the same data give the same bytes."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    plt.rcParams.update(
        {
            "font.family": "DejaVu Sans",
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.edgecolor": FAINT,
        }
    )
    return plt


def figure_png(figure: Any, dpi: int = 80) -> bytes:
    """The figure as a PNG; it is closed."""
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=dpi, metadata={"Software": None})
    pyplot().close(figure)
    return data.getvalue()
