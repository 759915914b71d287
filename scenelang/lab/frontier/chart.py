"""The frontier as charts: milliseconds against FLIP, and against PSNR.

Labels are placed here: `adjustText`, which does that too, needs scipy and left labels on top of each other.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from scenelang.lab.charts import FAINT, INK, figure_png, pyplot
from scenelang.measure.frontier import Frontier, Point, front

FLOOR: Final = 5e-5
"""FLIP below which points lie on the chart's lower edge; 0 has no place on a logarithmic axis."""
COLOURS: Final = {
    "framed": "#1f77b4",
    "solid": "#1f77b4",
    "exact field": "#b0872b",
    "streaming": "#c8452f",
    "reading": "#7b5ea7",
    "reference": "#2f8f5b",
}
MARKS: Final = {
    "unskipped": ("v", "nothing skipped"),
    "adaptive": ("o", "four samples near outlines"),
    "four": ("s", "four samples everywhere"),
    "one": ("^", "one sample a pixel"),
    "quick": ("D", "four samples near strong outlines, longer steps"),
    "draft": ("<", "one sample for four pixels, enlarged"),
}


def frontier_chart(frontier: Frontier) -> bytes:
    """Both charts above each other, as a PNG."""
    return figure_png(frontier_figure(frontier), dpi=100)


def frontier_figure(frontier: Frontier) -> Any:
    """The charts as a matplotlib figure."""
    plt = pyplot()
    figure, axes = plt.subplots(2, 1, figsize=(11, 13))
    _chart(axes[0], frontier, lambda p: None if p.flip is None else max(p.flip.mean, FLOOR), low_is_good=True)
    axes[0].set_yscale("log")
    axes[0].set_ylabel("FLIP, mean over scenes (lower is nearer; the bottom is 0)", fontsize=9)
    axes[0].set_ylim(FLOOR * 0.72, None)
    _chart(axes[1], frontier, lambda p: None if p.psnr is None else p.psnr.mean, low_is_good=False)
    axes[1].set_ylabel("PSNR in dB, mean over scenes, at most 50 each (higher is nearer)", fontsize=9)
    width, height = frontier.canvas
    cores = "one core" if frontier.threads == 1 else f"{frontier.threads} cores"
    figure.suptitle(
        f"Speed against error: {frontier.scenes} scenes of {frontier.set}, {width} x {height}, {cores}",
        fontsize=12,
        color=INK,
        y=0.995,
    )
    caption = (
        f"Seed {frontier.seed}, {frontier.machine}, torch {frontier.torch}, {frontier.revision[:10]}. "
        "All ways drew each scene in turn. Error against the exact picture, four samples a pixel.\n"
        f"Filled: what `scenelang render` chooses from. Hollow: measured for comparison. "
        f"The line joins what nothing offered beats. w8 is the model {frontier.set}-w8, and so on."
    )
    _legend(axes[1], frontier)
    figure.text(0.01, 0.004, caption, fontsize=7.5, color=INK)
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    for axis in axes:
        _place_labels(figure, axis)
    return figure


def _chart(
    axis: Any, frontier: Frontier, value: Callable[[Point], float | None], *, low_is_good: bool
) -> None:
    drawn = [(p, v) for p in frontier.points if (v := value(p)) is not None]
    axis.set_xscale("log")
    for point, y in drawn:
        colour = COLOURS.get(point.renderer, INK)
        axis.plot(
            point.ms.median,
            y,
            marker=MARKS[mark_of(point)][0],
            markersize=7.5,
            markerfacecolor=colour if point.offered else "white",
            markeredgecolor=colour,
            markeredgewidth=1.4,
            linestyle="none",
            zorder=3,
            label=short_name(point, frontier.set),  # `_place_labels` reads it
        )
    _front(axis, drawn, low_is_good)
    timed = [p for p in frontier.points if value(p) is None]
    for point in timed:
        axis.axvline(point.ms.median, color=FAINT, linewidth=1, linestyle=":", zorder=1)
        axis.annotate(
            f"{point.name} (time only)",
            (point.ms.median, 0.03),
            xycoords=("data", "axes fraction"),
            xytext=(-3, 0),
            textcoords="offset points",
            rotation=90,
            fontsize=7,
            color=INK,
            va="bottom",
            ha="right",
        )
    times = [p.ms.median for p in frontier.points]
    axis.set_xlim(min(times) / 1.6, max(times) * 1.6)
    axis.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
    axis.set_xlabel(_x_label(frontier), fontsize=9)
    axis.tick_params(labelsize=8)
    axis.grid(color=FAINT, linewidth=0.5, which="major")


def mark_of(point: Point) -> str:
    """Which of `MARKS` a point has."""
    if point.renderer == "framed" and not point.skip:
        return "unskipped"
    return point.samples


def short_name(point: Point, base: str) -> str:
    """A point's name without what its mark says and without its set's."""
    if point.backend == "reference":
        return point.name.replace("exact reference", "exact").replace(",", "")
    name = point.name.partition(",")[0].removeprefix(f"{base}-") or base
    return f"{name} ({point.side}² enlarged)" if point.side else name


def _legend(axis: Any, frontier: Frontier) -> None:
    """What colours and marks mean."""
    from matplotlib.lines import Line2D

    shown = {p.renderer for p in frontier.points}
    used = {mark_of(p) for p in frontier.points if p.flip is not None and p.renderer in ("framed", "solid")}
    handles = [
        Line2D([], [], color=colour, marker="o", linestyle="none", label=name)
        for name, colour in COLOURS.items()
        if name in shown
    ]
    handles += [
        Line2D([], [], color=INK, marker=mark, linestyle="none", markerfacecolor="white", label=words)
        for name, (mark, words) in MARKS.items()
        if name in used
    ]
    axis.legend(handles=handles, fontsize=8, frameon=False, loc="center right", ncols=1)


def _x_label(frontier: Frontier) -> str:
    clock = " of processor time" if frontier.clock == "processor" else ""
    text = f"milliseconds{clock} a frame, median, warm"
    if frontier.streaming_ms > 0:
        text += f" (the paper's streaming renderer at full size: {frontier.streaming_ms:,.0f} ms)"
    return text


def _front(axis: Any, drawn: Sequence[tuple[Point, float]], low_is_good: bool) -> None:
    """A staircase through the points that are on the front, by this chart's own error."""
    offered = [(p, v) for p, v in drawn if p.offered and not p.side]
    sign = 1 if low_is_good else -1
    kept = front([(p.ms.median, sign * v) for p, v in offered])
    steps = sorted((p.ms.median, v) for (p, v), yes in zip(offered, kept, strict=True) if yes)
    if steps:
        xs, ys = zip(*steps, strict=True)
        axis.plot(xs, ys, drawstyle="steps-post", color=INK, linewidth=1.3, zorder=2, label="_front")


PLACES: Final = [
    (dx * reach, dy * reach)
    for reach in (1.0, 1.8, 2.8, 4.0, 5.5, 7.5)
    for dx, dy in ((9, 0), (-9, 0), (7, 8), (7, -9), (-7, 8), (-7, -9), (0, 10), (0, -11))
]
"""Points from a mark to its label's near side, the best first."""


def _place_labels(figure: Any, axis: Any) -> None:
    """Write each mark's label, as matplotlib calls it, beside it: where it covers least of what is there."""
    from matplotlib.patheffects import Normal, Stroke
    from matplotlib.transforms import Bbox

    figure.canvas.draw()
    window, dots = axis.get_window_extent(), figure.dpi / 72  # dots of a point
    taken = [text.get_window_extent() for text in axis.texts]
    marks = []
    for line in axis.get_lines():
        at = axis.transData.transform(line.get_xydata())
        if line.get_label() == "_front":  # a staircase, which steps after its points
            for (x0, y0), (x1, y1) in itertools.pairwise(at):
                for a, b in (((x0, y0), (x1, y0)), ((x1, y0), (x1, y1))):
                    taken.append(Bbox([np.minimum(a, b) - 2, np.maximum(a, b) + 2]))
        elif not line.get_label().startswith("_"):
            marks.append((*at[0], line))
            taken.append(Bbox([at[0] - 7, at[0] + 7]))
    for x, y, mark in sorted(marks, key=lambda m: m[:2]):
        label = axis.annotate(
            mark.get_label(),
            mark.get_xydata()[0],
            xytext=(0, 0),
            textcoords="offset points",
            fontsize=8,
            color=INK,
            va="center",
            zorder=4,
            arrowprops={"arrowstyle": "-", "color": "#8b98a3", "linewidth": 0.6, "shrinkB": 5},
            path_effects=[Stroke(linewidth=2.5, foreground="white"), Normal()],
        )
        size = label.get_window_extent()

        def box(dx: float, dy: float, x: float = x, y: float = y, size: Any = size) -> Any:
            left = x + dx * dots - size.width * (0 if dx > 0 else 1 if dx < 0 else 0.5)
            return Bbox.from_bounds(left, y + dy * dots - size.height / 2, size.width, size.height)

        def cost(place: tuple[float, float], box: Any = box) -> float:
            found = box(*place)
            inside = Bbox.intersection(found, window)
            outside = found.width * found.height - (inside.width * inside.height if inside else 0.0)
            shared = (Bbox.intersection(found, other) for other in taken)
            return float(50 * outside + sum(both.width * both.height for both in shared if both))

        dx, dy = min(PLACES, key=cost)
        taken.append(box(dx, dy))
        label.set(position=(dx, dy), ha="left" if dx > 0 else "right" if dx < 0 else "center")
        label.arrow_patch.set_visible(abs(dx) + abs(dy) > 14)
