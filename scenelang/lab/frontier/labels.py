"""Labels beside points of a chart, moved apart until none covers another or a point."""

from __future__ import annotations

import itertools
from typing import Any, Final

from scenelang.lab.charts import INK

SIZE: Final = 8
_PLACES: Final = [
    (dx * reach, dy * reach)
    for reach in (1.0, 1.8, 2.8, 4.0, 5.5, 7.5)
    for dx, dy in ((9, 0), (-9, 0), (7, 8), (7, -9), (-7, 8), (-7, -9), (0, 10), (0, -11))
]
"""Points from the mark to the label's near side, the best first."""

Box = tuple[float, float, float, float]


def place_labels(figure: Any, axis: Any) -> None:
    """Write each mark's label, as matplotlib calls it, beside it.

    Args:
        figure: laid out, so that positions are final.
        axis: of it.
    """
    from matplotlib.patheffects import Normal, Stroke
    from matplotlib.text import Text

    figure.canvas.draw()
    render = figure.canvas.get_renderer()
    dots = figure.dpi / 72  # of a point
    window = axis.get_window_extent(render).extents
    marks = [line for line in axis.get_lines() if not line.get_label().startswith("_")]
    taken: list[Box] = []
    corners = [xy for line in axis.get_lines() if line.get_label() == "_front" for xy in _corners(line)]
    for (x0, y0), (x1, y1) in itertools.pairwise(axis.transData.transform(corners) if corners else []):
        taken.append((min(x0, x1) - 2, min(y0, y1) - 2, max(x0, x1) + 2, max(y0, y1) + 2))
    for text in axis.texts:
        text.update_positions(render)
    taken += [Text.get_window_extent(t, render).extents for t in axis.texts]
    placed = []
    for mark in marks:
        x, y = axis.transData.transform((mark.get_xdata()[0], mark.get_ydata()[0]))
        taken.append((x - 7, y - 7, x + 7, y + 7))
        words = figure.text(0, 0, mark.get_label(), fontsize=SIZE)
        size = words.get_window_extent(render)
        words.remove()
        placed.append((x, y, mark, size.width, size.height))
    for x, y, mark, width, height in sorted(placed, key=lambda p: p[:2]):
        boxes = [_box(x + dx * dots, y + dy * dots, dx, width, height) for dx, dy in _PLACES]
        costs = [sum(_shared(box, t) for t in taken) + 50 * _outside(box, window) for box in boxes]
        best = costs.index(min(costs))
        dx, dy = _PLACES[best]
        taken.append(boxes[best])
        label = axis.annotate(
            mark.get_label(),
            (mark.get_xdata()[0], mark.get_ydata()[0]),
            xytext=(dx, dy),
            textcoords="offset points",
            fontsize=SIZE,
            color=INK,
            ha="left" if dx > 0 else "right" if dx < 0 else "center",
            va="center",
            zorder=4,
            arrowprops={"arrowstyle": "-", "color": "#8b98a3", "linewidth": 0.6, "shrinkB": 5}
            if abs(dx) + abs(dy) > 14
            else None,
        )
        label.set_path_effects([Stroke(linewidth=2.5, foreground="white"), Normal()])


def _box(x: float, y: float, side: float, width: float, height: float) -> Box:
    """Of words whose near side is at a place: their left one where ``side`` is positive."""
    left = x if side > 0 else x - width if side < 0 else x - width / 2
    return left, y - height / 2, left + width, y + height / 2


def _outside(box: Box, window: Any) -> float:
    """Pixels by which a box leaves a window."""
    over = (window[0] - box[0], window[1] - box[1], box[2] - window[2], box[3] - window[3])
    return float(sum(max(0.0, v) for v in over))


def _corners(line: Any) -> list[tuple[float, float]]:
    """The corners of a staircase that is drawn with steps after its points."""
    points = list(zip(line.get_xdata(), line.get_ydata(), strict=True))
    steps = [((x1, y0), (x1, y1)) for (_, y0), (x1, y1) in itertools.pairwise(points)]
    return [*points[:1], *itertools.chain.from_iterable(steps)]


def _shared(a: Any, b: Any) -> float:
    """Area that two boxes share."""
    wide = min(a[2], b[2]) - max(a[0], b[0])
    high = min(a[3], b[3]) - max(a[1], b[1])
    return float(wide * high) if wide > 0 and high > 0 else 0.0
