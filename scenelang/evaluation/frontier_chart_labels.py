"""Labels beside points of a chart, moved apart until none covers another or a point."""

from __future__ import annotations

import itertools
from typing import Any, Final

from scenelang.evaluation.chart import INK

SIZE: Final = 8
_PLACES: Final = [
    (dx * reach, dy * reach)
    for reach in (1.0, 1.8, 2.8, 4.0, 5.5, 7.5)
    for dx, dy in ((9, 0), (-9, 0), (7, 8), (7, -9), (-7, 8), (-7, -9), (0, 10), (0, -11))
]

Box = tuple[float, float, float, float]


def place_labels(figure: Any, axis: Any) -> None:
    """Label every marker that has one, as matplotlib calls it, beside it.

    Args:
        figure: laid out, so that positions are final.
        axis: of it.
    """
    from matplotlib.patheffects import Normal, Stroke
    from matplotlib.text import Text

    figure.canvas.draw()
    render = figure.canvas.get_renderer()
    window = axis.get_window_extent(render)
    marks = [line for line in axis.get_lines() if not line.get_label().startswith("_")]
    taken: list[Box] = []
    corners = [xy for line in axis.get_lines() if line.get_label() == "_front" for xy in _corners(line)]
    for (x0, y0), (x1, y1) in itertools.pairwise(axis.transData.transform(corners) if corners else []):
        taken.append((min(x0, x1) - 2, min(y0, y1) - 2, max(x0, x1) + 2, max(y0, y1) + 2))
    for mark in marks:
        x, y = axis.transData.transform((mark.get_xdata()[0], mark.get_ydata()[0]))
        taken.append((x - 7, y - 7, x + 7, y + 7))
    for text in axis.texts:
        text.update_positions(render)
    taken += [Text.get_window_extent(t, render).extents for t in axis.texts]
    for mark in sorted(marks, key=lambda m: float(m.get_xdata()[0])):
        data = mark.get_xdata()[0], mark.get_ydata()[0]
        best: tuple[float, Any, Box] | None = None
        for dx, dy in _PLACES:
            label = axis.annotate(
                mark.get_label(),
                data,
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
            label.update_positions(render)
            box = tuple(Text.get_window_extent(label, render).extents)  # without the line to the point
            outside = max(0.0, window.x0 - box[0]) + max(0.0, box[2] - window.x1)
            outside += max(0.0, window.y0 - box[1]) + max(0.0, box[3] - window.y1)
            cost = sum(_shared(box, other) for other in taken) + 50 * outside
            if best is None or cost < best[0]:
                if best is not None:
                    best[1].remove()
                best = cost, label, box
            else:
                label.remove()
            if best[0] == 0:
                break
        if best is not None:
            taken.append(best[2])


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
