"""The frontier as charts: milliseconds against FLIP, and against PSNR.

Labels are placed here: `adjustText`, which does that too, needs scipy and left labels on top of each other.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from lab.charts import FAINT, INK, figure_png, pyplot
from lab.frontier.record import Frontier, Point, front

LINEAR: Final = 1e-4
"""FLIP below which the axis is linear, so that 0 has its place at the bottom edge."""
_WIDE, _HIGH, _DPI = 7.6, 10.4, 125
_CAPTION, _ROW = 0.075, 0.0165  # shares of the height: the caption, a row of the legend
"""Inches, and dots of one: a page shows it 760 pixels wide, where letters of 7 points are 9.7 pixels."""
SMALL, USUAL, LARGE = 7, 7.8, 10  # points
COLOURS: Final = {
    "framed": "#1f77b4",
    "solid": "#1f77b4",
    "exact field": "#b0872b",
    "streaming": "#c8452f",
    "reading": "#7b5ea7",
    "reference": "#2f8f5b",
}
MARKS: Final = {
    "adaptive": ("o", "four samples near outlines"),
    "four": ("s", "four samples everywhere"),
    "one": ("^", "one sample a pixel"),
    "quick": ("D", "four samples near strong outlines, longer steps"),
    "draft": ("<", "one sample for four pixels, enlarged"),
}


def frontier_chart(frontier: Frontier) -> bytes:
    """Both charts above each other, as a PNG."""
    return figure_png(frontier_figure(frontier), dpi=_DPI)


def frontier_figure(frontier: Frontier) -> Any:
    """The charts as a matplotlib figure."""
    plt = pyplot()
    figure, axes = plt.subplots(2, 1, figsize=(_WIDE, _HIGH), dpi=_DPI, height_ratios=(1.2, 1))
    _chart(axes[0], frontier, lambda p: None if p.flip is None else p.flip.mean, low_is_good=True)
    _flip_axis(axes[0])
    _chart(axes[1], frontier, lambda p: None if p.psnr is None else p.psnr.mean, low_is_good=False)
    axes[1].set_ylabel("PSNR in dB, mean, at most 50 each (higher is nearer)", fontsize=USUAL)
    width, height = frontier.canvas
    cores = "one core" if frontier.threads == 1 else f"{frontier.threads} cores"
    title = f"{frontier.scenes} scenes of {frontier.set}, {width} x {height}, {cores}"
    figure.suptitle(f"Speed against error: {title}", fontsize=LARGE, color=INK, y=0.99)
    base = base_of(frontier)
    caption = (
        f"Seed {frontier.seed}, {frontier.machine}, torch {frontier.torch}, {frontier.revision[:10]}.\n"
        "All ways drew each scene in turn. Error against the exact picture, four samples a pixel.\n"
        "Filled: what `scenelang render` chooses from. Hollow: for comparison. The line joins what nothing\n"
        f"filled beats. Marks that nearly coincide share a label; w8 is the model {base}-w8, and so on."
    )
    figure.text(0.02, 0.008, caption, fontsize=SMALL, color=INK)
    rows = _legend(figure, frontier)
    figure.tight_layout(rect=(0, _CAPTION + rows * _ROW, 1, 0.995))
    for axis in axes:
        _place_labels(figure, axis)
    return figure


def base_of(frontier: Frontier) -> str:
    """The model named like the set, without whose name others are labelled."""
    return min((p.model for p in frontier.points if p.model is not None), key=len, default=frontier.set)


def _flip_axis(axis: Any) -> None:
    """Logarithmic down to `LINEAR`, and from there linear to 0 at the bottom edge."""
    axis.set_yscale("symlog", linthresh=LINEAR, linscale=0.6, subs=range(2, 10))
    axis.set_ylim(0, 1.5 * axis.get_ylim()[1])
    axis.yaxis.set_major_formatter(lambda y, _: f"{y:g}" if y >= LINEAR else "0")
    axis.set_ylabel("FLIP, mean (lower is nearer; linear below 0.0001)", fontsize=USUAL)


def _chart(
    axis: Any, frontier: Frontier, value: Callable[[Point], float | None], *, low_is_good: bool
) -> None:
    drawn = [(p, v) for p in frontier.points if (v := value(p)) is not None]
    axis.set_xscale("log")
    base = base_of(frontier)
    for point, y in drawn:
        colour = COLOURS.get(point.renderer, INK)
        axis.plot(
            point.ms.median,
            y,
            marker=MARKS[mark_of(point)][0],
            markersize=6,
            markerfacecolor=colour if point.offered else "white",
            markeredgecolor=colour,
            markeredgewidth=1.2,
            linestyle="none",
            zorder=3,
            clip_on=False,  # 0 lies on the edge
            label=short_name(point, base),  # `_place_labels` reads it
        )
    _front(axis, drawn, low_is_good)
    timed = [p for p in frontier.points if value(p) is None]
    for point in timed:
        axis.axvline(point.ms.median, color=FAINT, linewidth=1, linestyle=":", zorder=1)
        axis.annotate(
            f"{point.name} (time only)",
            (point.ms.median, 0.97 if low_is_good else 0.03),  # where there are few marks
            xycoords=("data", "axes fraction"),
            xytext=(-2, 0),
            textcoords="offset points",
            rotation=90,
            fontsize=SMALL,
            color=INK,
            va="top" if low_is_good else "bottom",
            ha="right",
            path_effects=_edged(),
        )
    times = [p.ms.median for p in frontier.points]
    axis.set_xlim(min(times) / 1.6, max(times) * 1.6)
    axis.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
    axis.set_xlabel(_x_label(frontier), fontsize=USUAL)
    axis.tick_params(labelsize=USUAL)
    axis.grid(color=FAINT, linewidth=0.5, which="major")


def mark_of(point: Point) -> str:
    """The entry of `MARKS` for a point."""
    return str(point.samples)


def short_name(point: Point, base: str) -> str:
    """A point's name without what its mark says and without its set's; none where its colour says it."""
    if point.renderer == "exact field":
        return ""
    if point.backend == "reference":
        return point.name.replace("exact reference", "reference").replace(",", "")
    name = point.name.partition(",")[0].removeprefix(f"{base}-") or base
    return f"{name} ({point.side}² enlarged)" if point.side else name


def _legend(figure: Any, frontier: Frontier) -> int:
    """Draw the legend of colours and marks; returns its number of rows."""
    from matplotlib.lines import Line2D

    drawn = [p for p in frontier.points if p.flip is not None]
    shown, used = {p.renderer for p in drawn}, {mark_of(p) for p in drawn if p.backend != "reference"}
    names = {"framed": "network", "solid": "network"}
    handles = [
        Line2D([], [], color=colour, marker="o", linestyle="none", label=names.get(name, name))
        for name, colour in COLOURS.items()
        if name in shown
    ]
    handles += [
        Line2D([], [], color=INK, marker=mark, linestyle="none", markerfacecolor="white", label=words)
        for name, (mark, words) in MARKS.items()
        if name in used
    ]
    place = {"loc": "lower left", "bbox_to_anchor": (0.01, _CAPTION - 0.012)}
    figure.legend(handles=handles, fontsize=USUAL, frameon=False, ncols=2, markerscale=0.9, **place)
    return (len(handles) + 1) // 2


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
        axis.plot(xs, ys, drawstyle="steps-post", color=INK, linewidth=1.1, zorder=2, label="_front")


PLACES: Final = [
    (dx * reach, dy * reach)
    for reach in (1.0, 1.8, 2.8, 4.0, 5.5, 7.5)
    for dx, dy in ((9, 0), (-9, 0), (7, 8), (7, -9), (-7, 8), (-7, -9), (0, 10), (0, -11))
]
"""Points from a mark to its label's near side, the best first."""


def _edged() -> list[Any]:
    from matplotlib.patheffects import Normal, Stroke

    return [Stroke(linewidth=2, foreground="white"), Normal()]


def _tied(marks: Sequence[tuple[float, float, str]], reach: float) -> list[list[tuple[float, float, str]]]:
    """Marks (x, y, name), from the left, in groups that share a label: each near the first of its group."""
    groups: list[list[tuple[float, float, str]]] = []
    for mark in sorted(marks):
        for group in groups:
            if mark[0] - group[0][0] <= 2.4 * reach and abs(mark[1] - group[0][1]) <= 0.7 * reach:
                group.append(mark)
                break
        else:
            groups.append([mark])
    return groups


def _place_labels(figure: Any, axis: Any) -> None:
    """Write the names of marks beside them, those of ties once: where they cover least of what is there."""
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
                    taken.append(Bbox([np.minimum(a, b) - dots, np.maximum(a, b) + dots]))
        elif line.get_label().startswith("_"):  # of which only the time is known
            taken.append(Bbox([at.min(0) - dots, at.max(0) + dots]))
        else:
            marks += [(*at[0], line.get_label())] if line.get_label() else []
            taken.append(Bbox([at[0] - 4 * dots, at[0] + 4 * dots]))
    for group in _tied(marks, 7 * dots):
        x, y, right = group[0][0], group[0][1], group[-1][0]
        label = axis.annotate(
            ", ".join(dict.fromkeys(name for *_, name in group)),
            (x, y),
            xycoords="figure pixels",
            xytext=(0, 0),
            textcoords="offset points",
            fontsize=USUAL,
            color=INK,
            va="center",
            zorder=4,
            arrowprops={"arrowstyle": "-", "color": "#8b98a3", "linewidth": 0.6, "shrinkB": 4},
            path_effects=_edged(),
        )
        size = label.get_window_extent()

        def box(
            dx: float, dy: float, x: float = x, y: float = y, right: float = right, size: Any = size
        ) -> Any:
            near = (right if dx > 0 else x) + dx * dots
            left = near - size.width * (0 if dx > 0 else 1 if dx < 0 else 0.5)
            return Bbox.from_bounds(left, y + dy * dots - size.height / 2, size.width, size.height)

        def cost(place: tuple[float, float], box: Any = box) -> float:
            result = box(*place)
            inside = Bbox.intersection(result, window)
            outside = result.width * result.height - (inside.width * inside.height if inside else 0.0)
            shared = (Bbox.intersection(result, other) for other in taken)
            return float(50 * outside + sum(both.width * both.height for both in shared if both))

        dx, dy = min(PLACES, key=cost)
        taken.append(box(dx, dy))
        label.xy = (right if dx > 0 else x, y)
        label.set(position=(dx, dy), ha="left" if dx > 0 else "right" if dx < 0 else "center")
        label.arrow_patch.set_visible(abs(dx) + abs(dy) > 14)
