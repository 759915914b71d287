"""The frontier as charts: milliseconds against FLIP, and against PSNR."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from typing import Any, Final

from scenelang.lab.charts import FAINT, INK, pyplot
from scenelang.lab.frontier.labels import place_labels
from scenelang.measure.frontier import Frontier, Point, front

FLOOR: Final = 5e-5
"""FLIP below which points lie on the chart's lower edge; 0 has no place on a logarithmic axis."""
COLOURS: Final = {"framed": "#1f77b4", "streaming": "#c8452f", "reading": "#7b5ea7", "reference": "#2f8f5b"}
MARKS: Final = {
    "unskipped": ("v", "nothing skipped"),
    "adaptive": ("o", "four samples near outlines"),
    "four": ("s", "four samples everywhere"),
    "one": ("^", "one sample a pixel"),
}


def frontier_chart(frontier: Frontier, kind: str) -> bytes:
    """Both charts above each other.

    Args:
        frontier: figures.
        kind: "png" or "svg".
    """
    figure = frontier_figure(frontier)
    data = io.BytesIO()
    about = {"Date": None} if kind == "svg" else {"Software": None}
    figure.savefig(data, format=kind, dpi=100, metadata=about)
    pyplot().close(figure)
    return data.getvalue()


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
        place_labels(figure, axis)
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
            label=short_name(point, frontier.set),  # `place_labels` reads it
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
    used = {mark_of(p) for p in frontier.points if p.flip is not None and p.renderer == "framed"}
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
