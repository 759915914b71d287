"""Solids beside other renderers, from what `python -m lab bench solids` recorded."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from lab.charts import FAINT, INK, figure_png, pyplot
from lab.docs.figures import read
from lab.frontier.record import front

NAME, OURS = "solid-rivals", "network, adaptive"
SETS = {"diffuse": "diffuse", "solids3d": "solids and media"}
TITLES = {
    OURS: "network",
    "formulas, adaptive": "formulas",
}
COLOURS = {
    "network": "#1f77b4",
    "formulas": "#b0872b",
    "reference": "#2f8f5b",
    "POV-Ray": "#c8452f",
    "Mitsuba": "#7b5ea7",
}
Ways = Mapping[str, Any]


def ways_of(set_: str) -> Ways:
    """Measured ways on a set, each setting of POV-Ray once where there are no media."""
    result = read(NAME)["sets"][set_]["ways"]
    same = {way for way in result if set_ == "diffuse" and way.endswith(("10 in media", "3 in media"))}
    return {
        way.removesuffix(", 40 in media") if same else way: row
        for way, row in result.items()
        if way not in same
    }


def of(ways: Ways, renderer: str) -> dict[str, Any]:
    """A renderer's ways, the fastest first."""
    result = {way: row for way, row in ways.items() if way.startswith(renderer)}
    return dict(sorted(result.items(), key=lambda each: each[1]["ms"]["median"]))


def on_front(ways: Ways) -> list[str]:
    """Ways of a renderer that none of its others beats in time and error."""
    points = [(row["ms"]["median"], row["flip"]["mean"]) for row in ways.values()]
    return [way for way, yes in zip(ways, front(points), strict=True) if yes]


def as_near(ways: Ways, renderer: str) -> str:
    """The fastest way of a renderer whose error is at most that of ours, or else its nearest."""
    some, most = of(ways, renderer), ways[OURS]["flip"]["mean"]
    return next((way for way, row in some.items() if row["flip"]["mean"] <= most), on_front(some)[-1])


def chart() -> bytes:
    """Milliseconds against FLIP, a panel for each set."""
    plt = pyplot()
    figure, axes = plt.subplots(len(SETS), 1, figsize=(7.6, 9.2), sharex=True, sharey=True)
    for axis, (set_, words) in zip(axes, SETS.items(), strict=True):
        _panel(axis, ways_of(set_))
        count = read(NAME)["sets"][set_]["scenes"]
        axis.set_title(f"{words}: {count} scenes of {set_}", fontsize=9.5, color=INK, loc="left")
    axes[-1].set_xlabel(f"milliseconds of processor time a frame of {read(NAME)['side']}²", fontsize=8.5)
    figure.tight_layout()
    return figure_png(figure, dpi=150)


def _panel(axis: Any, ways: Ways) -> None:
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.margins(0.08)
    for name in ("reference", "formulas", "network"):
        some = of(ways, f"{name}, ")
        _line(axis, name, some, some, "--" if name == "formulas" else "-")
        if name != "formulas":
            _labels(axis, name, some)
    for name in ("POV-Ray", "Mitsuba"):
        some = of(ways, name)
        best = on_front(some)
        _line(axis, name, some, best, "-")
        ends = best if name == "Mitsuba" else [best[0], as_near(ways, name)]
        _labels(axis, name, {way: some[way] for way in ends})
    axis.set_ylabel("FLIP against its own converged picture", fontsize=8.5)
    axis.xaxis.set_major_formatter(lambda x, _: f"{x:,g}")
    axis.yaxis.set_major_formatter(lambda y, _: f"{y:g}")
    axis.yaxis.set_minor_formatter(lambda y, _: "")
    axis.tick_params(labelsize=8)
    axis.grid(color=FAINT, linewidth=0.5, which="major")
    axis.legend(fontsize=8, frameon=False, loc="upper right")


def _line(axis: Any, name: str, ways: Ways, joined: Iterable[str], style: str) -> None:
    """All of a renderer's ways as points with intervals, some joined."""
    colour = COLOURS[name]
    x = [row["ms"]["median"] for row in ways.values()]
    y, half = ([row["flip"][k] for row in ways.values()] for k in ("mean", "interval"))
    axis.errorbar(x, y, half, fmt="o", color=colour, markersize=4, elinewidth=0.7, alpha=0.9, zorder=2)
    points = [(ways[way]["ms"]["median"], ways[way]["flip"]["mean"]) for way in joined]
    axis.plot(*zip(*points, strict=True), style, color=colour, linewidth=1.4, label=name, zorder=2)


def _labels(axis: Any, name: str, ways: Ways) -> None:
    places = {"network": (-6, -10), "POV-Ray": (6, 6), "Mitsuba": (6, 3), "reference": (6, 4)}
    for way, row in ways.items():
        words = way.removeprefix(f"{name}, ").removesuffix(" spp")
        words = {"adaptive": "default"}.get(words, words.partition(", ")[0].replace("-A", "off"))
        _label(axis, words, (row["ms"]["median"], row["flip"]["mean"]), COLOURS[name], places[name])


def _label(axis: Any, words: str, at: tuple[float, float], colour: str, place: tuple[int, int]) -> None:
    axis.annotate(
        words,
        at,
        xytext=place,
        textcoords="offset points",
        fontsize=7.5,
        color=colour,
        ha="right" if place[0] < 0 else "left",
    )
