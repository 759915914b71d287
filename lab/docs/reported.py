"""Tables of docs/measurements.md: chosen rows of records, and the commands behind them."""

from __future__ import annotations

from collections.abc import Mapping

from lab import RESULTS
from lab.docs import solid_rivals
from lab.docs.figures import kilobytes, numbers, read, told
from lab.docs.tables import markdown
from scenelang.drawing.neural import units as plane
from scenelang.drawing.solid.norms import FEATURES, LINES

PLANE = (
    "shapes2d",
    "exact field",
    "shapes2d, four samples",
    "exact field, four samples",
    "shapes2d, one sample",
    "exact field, one sample",
    "Skia",
    "exact reference, 4 spp",
    "the paper's streaming, 256²",
)
SPACE = (
    *("solids3d", "exact field", "solids3d, quick", "exact field, quick", "solids3d, draft"),
    *("exact reference, 1 spp", "exact reference, 4 spp", "the paper's streaming, 256²"),
)
STABILITY = (
    ("stability", "affine", (3, 64)),
    ("stability", "warp", (1, 3)),
    ("stability", "size", (0.03, 1, 8)),
    ("stability", "objects", (4, 128)),
    ("stability", "thin", (1, 30, 300)),
    ("stability", "blends", (1, 8, 64)),
    ("stability", "deep", (1, 2, 4)),
    ("stability-textures2d", "texels", (1, 4, 16)),
    ("stability-solids3d", "objects", (4, 100)),
    ("stability-solids3d", "affine", (3, 64)),
    ("stability-solids3d", "warp", (1, 3, 5)),
    ("stability-solids3d", "size", (0.03, 1, 4)),
    ("stability-solids3d", "blends", (1, 8)),
    ("stability-solids3d", "width", (0.15, 0.6, 1.2)),
    ("stability-solids3d", "thickness", (0.3, 0.03, 0.01, 0.003)),
    ("stability-solids3d", "depth", (3.6, 14)),
    ("stability-solids3d", "light", (1, 0.003)),
    ("stability-solids3d", "mist", (0.3, 2)),
    ("stability-solids3d", "fov", (5, 37, 150)),
)
COMMANDS = (
    ("accuracy", "shapes2d", "textures2d/textures2d", "solids3d/solids3d", "solids3d/shadows"),
    ("stability", "stability", "stability-textures2d", "stability-solids3d"),
    ("speed", "models/shapes2d/frontier", "models/solids3d/frontier", "unions-rivals", "solid-rivals"),
    ("promises", "frontier-verified", "frontier-verified-solids"),
    ("passes", "passes"),
)
UNSAID = {
    "textures2d/textures2d": "python -m lab eval textures2d --set textures2d --scenes {scenes}",
    "solids3d/shadows": "python -m lab shadows solids3d --scenes {scenes} --side {canvas[0]}",
    "models/shapes2d/frontier": "python -m lab frontier shapes2d --scenes {scenes}",
    "models/solids3d/frontier": "python -m lab frontier solids3d --scenes {scenes}",
    "solid-rivals": "python -m lab bench solids",
    "stability": "python -m lab stability shapes2d --scenes {scenes}",
    "stability-textures2d": "python -m lab stability textures2d --only texels --scenes {scenes}",
    "passes": "python -m tests.compiler.prove --scenes {scenes}",
}
"""Commands of records that were made before records said theirs."""


def plus_minus(found: Mapping[str, float], digits: int) -> str:
    """A mean and its interval, where that was measured."""
    said = f"{found['mean']:.{digits}f}"
    return f"{said} ± {found['interval']:.{digits}f}" if "interval" in found else said


def decoders(sizes: Mapping[str, int]) -> str:
    """Layers of a network's decoders by the sizes in its weights."""
    if "segment" not in sizes:
        return (
            f"{plane.FEATURES} features, {LINES * (sizes['units'] + 2)} lines, {sizes['units'] + 1} norms, 1"
        )
    return f"{FEATURES} features, {LINES * (sizes['units'] + 1)} lines, {sizes['units']} norms, 1"


def budgets() -> str:
    """Parameters and training cost of each network."""
    rows = []
    for model in ("shapes2d", "solids3d"):
        decoder = decoders(told(model)["config"]["network"])
        path, minutes = f"models/{model}/weights", told(model)["seconds"] / 60
        sizes = [f"{numbers(path):,}", f"{kilobytes(path):.0f}"]
        rows.append([f"`{model}`", decoder, *sizes, f"{minutes:.0f} minutes of one core"])
    return markdown(("network", "layers of decoders", "numbers", "KB", "training"), rows)


def front(base: str, names: tuple[str, ...]) -> str:
    """Chosen points of a frontier."""
    result = read(f"models/{base}/frontier")
    points, rows = {point["name"]: point for point in result["points"]}, []
    for name in names:
        point = points.get(name)
        if point is None:
            continue
        errors = ["", ""]
        if point["flip"] is not None:
            errors = [f"{point['flip']['mean']:.4f}", f"{point['psnr']['mean']:.2f}"]
        rows.append([name, f"{point['ms']['median']:,.3g}", *errors, str(point["scenes"])])
    return markdown(("way to draw", "ms", "FLIP", "PSNR, dB", "n"), rows)


def unions() -> str:
    """A rasteriser of polygons beside ours, where all is unions."""
    if not (RESULTS / "unions-rivals.json").exists():
        return "*Not measured yet.*"
    result = read("unions-rivals")
    rows = [
        [name, f"{way['ms']:.3g}", plus_minus(way["flip"], 4), plus_minus(way["flip64"], 4)]
        for name, way in result["ways"].items()
    ]
    heads = ("unions drawn by", "ms", "FLIP, 4 samples", "FLIP, 64 samples", "n")
    return markdown(heads, [[*row, str(result["scenes"])] for row in rows])


def rivals() -> str:
    """The cheapest way of each renderer whose picture is as near to its own converged one as ours is."""
    record, rows = read(solid_rivals.NAME), []
    if "sets" not in record:
        return "*Not measured yet.*"
    for name, words in solid_rivals.SETS.items():
        ways = solid_rivals.ways_of(name)
        chosen = [solid_rivals.OURS, "formulas, adaptive"]
        chosen += [solid_rivals.as_near(ways, other) or "" for other in ("POV-Ray", "Mitsuba")]
        for way in filter(ways.get, chosen):
            times, title = ways[way]["times"], solid_rivals.TITLES.get(way, way)
            cells = [words, title, f"{times['mean']:.2f} ± {times['interval']:.2f}"]
            rows.append([*cells, plus_minus(ways[way]["flip"], 4), str(record["sets"][name]["scenes"])])
    return markdown(("scenes", "drawn by", "time, × the network", "FLIP to its own converged", "n"), rows)


def stability() -> str:
    """Ends of probes."""
    rows = []
    for name, probe, values in STABILITY:
        record = read(name)
        result = record["probes"].get(probe)
        by_value = {row["value"]: row for row in result["rows"]} if result else {}
        cells = [f"{v:g}: {plus_minus(by_value[v]['psnr'], 1)}" for v in values if v in by_value]
        if result and cells:
            lowest = min(by_value[v]["psnr"]["worst"] for v in values if v in by_value)
            scenes = result.get("scenes", record["scenes"])
            rows.append(
                [f"`{record['model']}`: {result['title']}", ", ".join(cells), f"{lowest:.1f}", str(scenes)]
            )
    return markdown(("model and quantity", "value: mean PSNR, dB", "worst", "n"), rows)


def commands() -> str:
    """The commands behind the sections, as the records have them."""
    rows = []
    for section, *names in COMMANDS:
        for name in names:
            if name.startswith("models/") or (RESULTS / f"{name}.json").exists():
                record = read(name)
                said = record.get("command") or UNSAID.get(name, "").format(**record)
                rest = [record.get("seed"), record.get("scenes"), record.get("revision", "")[:8]]
                rows.append([section, f"`{name}.json`", f"`{said}`" if said else "", *rest])
    shown = [[str(cell) if isinstance(cell, str | int) else "" for cell in row] for row in rows]
    return markdown(("section", "record", "command", "seed", "n", "revision"), shown)


BLOCKS = {
    "report-plane": lambda: front("shapes2d", PLANE),
    "report-space": lambda: front("solids3d", SPACE),
    "report-unions": unions,
    "report-rivals": rivals,
    "report-stability": stability,
    "report-commands": commands,
    "budgets": budgets,
}
