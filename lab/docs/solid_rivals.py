"""Solids beside other renderers, from what `python -m lab bench solids` recorded: a table and a chart."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from lab.charts import FAINT, INK, figure_png, pyplot
from lab.docs.figures import read
from lab.docs.tables import markdown
from scenelang.measure.frontier import front

NAME, OURS = "solid-rivals", "network, adaptive"
SETS = {"diffuse": "diffuse", "solids3d": "solids and media"}
TITLES = {
    OURS: "network",
    "formulas, adaptive": "formulas",
    "marched, adaptive": "network, all marched",
    "width 4, adaptive": "network of width 4",
    "width 16, adaptive": "network of width 16",
}
COLOURS = {
    "network": "#1f77b4",
    "formulas": "#b0872b",
    "width": "#1f77b4",
    "reference": "#2f8f5b",
    "POV-Ray": "#c8452f",
    "Mitsuba": "#7b5ea7",
}
Ways = Mapping[str, Any]


def ways_of(set_: str) -> Ways:
    """What was measured on a set, each setting of POV-Ray once where there are no media."""
    found = read(NAME)["sets"][set_]["ways"]
    same = {way for way in found if set_ == "diffuse" and way.endswith(("10 in media", "3 in media"))}
    return {
        way.removesuffix(", 40 in media") if same else way: row
        for way, row in found.items()
        if way not in same
    }


def of(ways: Ways, renderer: str) -> dict[str, Any]:
    """A renderer's ways, the fastest first."""
    found = {way: row for way, row in ways.items() if way.startswith(renderer)}
    return dict(sorted(found.items(), key=lambda each: each[1]["ms"]["median"]))


def on_front(ways: Ways) -> list[str]:
    """Those of a renderer's ways that no other one beats in time and error."""
    points = [(row["ms"]["median"], row["flip"]["mean"]) for row in ways.values()]
    return [way for way, yes in zip(ways, front(points), strict=True) if yes]


def as_near(ways: Ways, renderer: str) -> str:
    """The fastest way of a renderer whose error is at most that of ours, or else its nearest."""
    some, most = of(ways, renderer), ways[OURS]["flip"]["mean"]
    return next((way for way, row in some.items() if row["flip"]["mean"] <= most), on_front(some)[-1])


def shown(ways: Ways) -> list[str]:
    """Ways that the table shows: of others the fastest, the fastest that is as near as ours, the nearest."""
    some = {way for way in ways if way in TITLES or way.startswith(("network", "reference, 4"))}
    for other in ("POV-Ray", "Mitsuba"):
        best = on_front(of(ways, other))
        some |= {best[0], as_near(ways, other), best[-1]}
    return [way for way in of(ways, "") if way in some]


def table() -> str:
    """Times and errors of the ways that matter."""
    record, rows = read(NAME), []
    for set_, words in SETS.items():
        ways = ways_of(set_)
        for way in shown(ways):
            row, bold = ways[way], "**" if way == OURS else ""
            errors = [f"{row['flip'][k]:.4f}" for k in ("mean", "interval")]
            decibels = [f"{row['psnr'][k]:.1f}" for k in ("mean", "interval")]
            near = f"{row['flip_defined']['mean']:.4f}" if "flip_defined" in row else ""
            rows.append(
                [
                    words,
                    f"{bold}{TITLES.get(way, way)}{bold}",
                    f"{row['ms']['median']:,.0f}",
                    f"{row['times']['mean']:.2f} ± {row['times']['interval']:.2f}",
                    f"{row['start_ms']:,.0f}" if row["start_ms"] else "",
                    " ± ".join(errors),
                    " ± ".join(decibels),
                    near,
                ]
            )
    heads = [
        "set",
        "drawn by",
        "ms",
        "× the network",
        "start, ms",
        "FLIP",
        "PSNR, dB",
        "FLIP to the definition",
    ]
    counts = ", ".join(f"{found['scenes']} of `{set_}`" for set_, found in record["sets"].items())
    said = (
        f"`{record['command']}`, revision `{record['revision'][:8]}`: {counts} at {record['side']}², seed "
        f"{record['seed']}; milliseconds of processor time, median; the others means, ± half of the 95 % "
        f"interval. {record['machine']}; {record['povray']}; {record['mitsuba']}."
    )
    return f"{markdown(heads, rows)}\n\n{said}"


# ---------------------------------------------------------------- the chart


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
    widths = of(ways, "width")
    for way, row in widths.items():
        if way.endswith("adaptive"):
            at = row["ms"]["median"], row["flip"]["mean"]
            axis.plot(*at, "s", color=COLOURS["width"], markerfacecolor="white", markersize=6, zorder=3)
            _label(axis, way.partition(",")[0], at, COLOURS["width"], (7, 5))
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
