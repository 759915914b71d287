"""Charts of error over numbers and over bytes: of `python -m lab codes` and of `lab.bench.forms`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from lab.charts import FAINT, INK, LINE, WARN, figure_png, pyplot
from lab.docs.figures import read
from lab.docs.sizes import PAPER

THEIRS, OURS = "#8a97a3", "#2f9e63"
COLOURS = {"element": OURS, "grid, 8 bits": WARN, "grid, 16 bits": "#e0a030", "triangles": LINE}
COLOURS |= {"JPEG": LINE, "smaller picture": WARN, "palette, PNG": "#e0a030"}


def _axes(titles: Iterable[str], across: str, up: Iterable[str]) -> tuple[Any, Any]:
    figure, axes = pyplot().subplots(1, 2, figsize=(9.5, 4.0))
    for axis, title, label in zip(axes, titles, up, strict=True):
        axis.set_title(title, fontsize=11, color=INK)
        axis.set_xlabel(across, fontsize=10)
        axis.set_ylabel(label, fontsize=10)
        axis.tick_params(labelsize=9)
        axis.grid(color=FAINT, linewidth=0.5)
    return figure, axes


def _done(figure: Any, axes: Any) -> bytes:
    for axis in axes:
        axis.legend(fontsize=9, frameon=False)
    figure.tight_layout()
    return figure_png(figure)


def numbers_chart() -> bytes:
    """PSNR over numbers of a texture and of a mesh: codes, forms, elements and the paper's vectors."""
    figure, axes = _axes(PAPER, "numbers of each (elements: bytes)", ["PSNR, dB"] * 2)
    for axis, (what, published) in zip(axes, PAPER.items(), strict=True):
        rows = read(f"codes-{what}")["rows"]
        for kind, colour, mark in (("codes", LINE, "o-"), ("forms", WARN, "o-"), ("elements", OURS, "s-")):
            own = [row for row in rows if row["kind"] == kind and row.get("seed", 1) == 1]
            if not own:
                continue
            x, y, spread = zip(
                *((r["d"], r["psnr"]["mean"], r["psnr"]["interval"]) for r in own), strict=True
            )
            axis.errorbar(x, y, spread, fmt=mark, color=colour, markersize=4, label=kind)
        theirs = [line.psnr for line in published.values()]
        axis.plot([*published], theirs, "o--", color=THEIRS, markersize=4, label="the paper's vectors")
        axis.set_xscale("log", base=10)
    return _done(figure, axes)


def bytes_chart() -> bytes:
    """Error over bytes of meshes and of pictures: elements and other forms."""
    found: Mapping[str, Any] = read("element-bytes")
    titles = [f"{found[kind]['files']} {kind}" for kind in ("meshes", "pictures")]
    figure, axes = _axes(titles, "bytes at most", ("mean distance off, radii", "PSNR of texels, dB"))
    for axis, kind in zip(axes, ("meshes", "pictures"), strict=True):
        rows = found[kind]["rows"]
        for form in dict.fromkeys(row["form"] for row in rows):
            own = [row for row in rows if row["form"] == form]
            x, y = [row["bytes"] for row in own], [row["mean"] for row in own]
            axis.plot(x, y, "o-", color=COLOURS[form], markersize=4, label=form)
        axis.set_xscale("log", base=2)
        ticks = sorted({row["bytes"] for row in rows})
        axis.set_xticks(ticks, [f"{n:,}" for n in ticks], rotation=30)
        axis.minorticks_off()
    axes[0].set_yscale("log")
    return _done(figure, axes)


class Chart(NamedTuple):
    """A chart and the records that it is drawn from."""

    draw: Callable[[], bytes]
    records: tuple[str, ...]


CHARTS = {
    "codes": Chart(numbers_chart, tuple(f"codes-{what}" for what in PAPER)),
    "element-bytes": Chart(bytes_chart, ("element-bytes",)),
}
