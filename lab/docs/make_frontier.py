"""Write the tables of docs/frontier.md from the shipped frontier and its verification.

python -m lab docs frontier            writes the page's tables
python -m lab docs frontier --check    fails where they are out of date
python -m lab docs frontier --ship OUT  first takes over what `python -m lab frontier` wrote into OUT

That is frontier.json, which is shipped beside the models, frontier.html and, after --verify, verified.json,
of the plane or of solids; the chart in docs/pictures is drawn anew.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from lab import DOCS, RESULTS, ROOT
from lab.frontier.ways import FIELD, FULL, PAPER, TITLES
from scenelang.measure.frontier import Errors, Frontier, Quality, Ratio, between, frontier_path

PAGE = DOCS / "frontier.md"
UNIONS = RESULTS / "unions-rivals.json"
BASES = {"shapes2d": "", "solids3d": "-solids"}  # models that sets are named after, and endings of names


def verified_path(base: str) -> Path:
    """What was found of a set's promises."""
    return RESULTS / f"frontier-verified{BASES[base]}.json"


def ship(out: Path) -> None:
    """Take over what was measured."""
    models = {p.model for p in Frontier.from_json((out / "frontier.json").read_bytes()).points}
    base = next(name for name in BASES if name in models)
    shutil.copyfile(out / "frontier.json", frontier_path(base))
    shutil.copyfile(out / "frontier.html", DOCS / f"frontier-chart{BASES[base]}.html")
    if (out / "verified.json").exists():
        shutil.copyfile(out / "verified.json", verified_path(base))
    picture = f"frontier{BASES[base]}.png"
    subprocess.run([sys.executable, "-m", "lab", "docs", "pictures", "--only", picture], cwd=ROOT, check=True)


def chart_text(frontier: Frontier, base: str) -> str:
    """The chart, and where the page with the pictures is."""
    ending = BASES[base]
    return (
        f"![milliseconds against FLIP and against PSNR](pictures/frontier{ending}.png)\n\n"
        f"[The interactive chart](frontier-chart{ending}.html) shows what each point draws, its figures and "
        "the command that draws with it.\nIt is one file that needs no network.\n\n"
        f"{frontier.scenes} scenes; filled points are chosen from, hollow ones measured for comparison."
    )


def points_text(frontier: Frontier, base: str) -> str:
    """What every way to draw takes and how far it is off."""
    lines = [
        "| way to draw | ms | 95 % interval | × the paper's speed | FLIP | promised | PSNR, dB | scenes | |",
        "|---|--:|---|--:|--:|--:|--:|--:|---|",
    ]
    digits = 5 if BASES[base] else 4
    for p in frontier.points:
        ratio = f"{p.ratio_to_streaming:.3g}" if p.ratio_to_streaming else ""
        errors = ["", "", ""]
        if p.flip is not None and p.psnr is not None:
            promise = f"{p.flip.bound:.{digits}f}" if p.offered and not p.side else ""
            errors = [_mean(p.flip, digits), promise, _mean(p.psnr, 2)]
        note = "**on the front**" if p.on_front else p.why_not or ""
        spread = f"{p.ms.low:.3g} to {p.ms.high:.3g}" if p.ms.high else ""
        cells = [p.title, f"{p.ms.median:.3g}", spread, ratio, *errors, str(p.scenes), note]
        lines.append(f"| {' | '.join(cells)} |")
    f = frontier
    cores = "one core" if f.threads == 1 else f"{f.threads} cores"
    clock = " of processor time" if f.clock == "processor" else ""
    said = f"`{f.command}`: " if f.command else ""
    about = (
        f"{said}{f.scenes} scenes of `{f.set}` at {f.canvas[0]}², seed {f.seed}; milliseconds{clock}, median "
        f"of warm frames on {cores} of {f.machine}, with its 95 % interval; torch {f.torch}, revision "
        f"`{f.revision[:9]}`. {between(f.points)} ways lie between the fastest and the nearest."
    )
    return "\n".join(lines) + "\n\n" + about


def _mean(value: Errors | Quality, digits: int) -> str:
    spread = f" ± {value.interval:.{digits}f}" if round(value.interval, digits) else ""
    return f"{value.mean:.{digits}f}{spread}"


SAVINGS = {
    "": "skipping and adaptive sampling",
    TITLES["four"]: "skipping alone",
    ", nothing skipped": "adaptive sampling alone",
    f", nothing skipped{TITLES['four']}": "neither",
    TITLES["quick"]: "long steps, adaptive sampling",
}


def savings_text(frontier: Frontier, base: str) -> str:
    """Network and exact field in the same renderer, each with the same savings."""
    lines = [
        "| saved by | network, ms | exact field, ms | network's time over its | network's FLIP | its FLIP |",
        "|---|--:|--:|--:|--:|--:|",
    ]
    for ending, words in SAVINGS.items():
        network, field = frontier.point(base + ending), frontier.point(FIELD + ending)
        ratio = frontier.ratio(base + ending, FIELD + ending)
        if network is None or field is None or ratio is None:
            continue
        assert network.flip is not None
        assert field.flip is not None
        cells = [words, f"{network.ms.median:.3g}", f"{field.ms.median:.3g}", _ratio(ratio)]
        cells += [_mean(network.flip, 5), _mean(field.flip, 5)]
        lines.append(f"| {' | '.join(cells)} |")
    if len(lines) == 2:
        return "*Not measured yet.*"
    slowest = f", nothing skipped{TITLES['four']}"
    both = [
        (words, frontier.ratio(name + slowest, name)) for words, name in (("network", base), (FIELD, FIELD))
    ]
    told = [f"{_ratio(found)} for the {name}" for name, found in both if found is not None]
    buy = f" Both savings together divide the time of a frame by {' and by '.join(told)}." if told else ""
    return (
        "\n".join(lines) + f"\n\nTimes are ratios of the same scene, ± the 95 % interval of their mean.{buy}"
    )


def _ratio(found: Ratio) -> str:
    return (
        f"{found.mean:.2f} ± {found.interval:.2f}"
        if found.mean < 10
        else f"{found.mean:.0f} ± {found.interval:.0f}"
    )


def lead_text(frontier: Frontier, base: str) -> str:
    """What the page begins with."""
    network, field, ratio = frontier.point(base), frontier.point(FIELD), frontier.ratio(base, FIELD)
    if network is None or field is None or ratio is None:
        return "*Not measured yet.*"
    skia = ""
    if UNIONS.exists():
        found = json.loads(UNIONS.read_text("utf-8"))
        slower = next(row for row in found["ratios"] if row["slow"] == FIELD)
        skia = (
            f" For unions a rasteriser of polygons is faster still: [Skia](#unions-by-a-rasteriser) takes "
            f"{found['ways']['Skia']['ms']:.2g} ms, and the exact field {slower['mean']:.1f} times as long."
        )
    return (
        "**In the plane the exact field draws as well as the network, and faster.** With formulas of the "
        "four polygons in the network's place\nand all else alike, skipping and adaptive sampling included, "
        f"a frame takes {field.ms.median:.3g} ms, and the network's {network.ms.median:.3g} ms: "
        f"{_ratio(ratio)} times as long.{skia}\nThe network is for shapes without a formula: the renderer "
        "asks for distances and colours alone, whoever answers."
    )


def paper_text(frontier: Frontier, base: str) -> str:
    """The paper's frame against network and exact field."""
    paper = f"{PAPER}, {FULL}²"
    told = [(name, frontier.ratio(paper, name)) for name in (base, FIELD)]
    words = " and ".join(
        f"**{_ratio(r)}** times as long as {_said(name)}" for name, r in told if r is not None
    )
    scenes = next((r.scenes for _, r in told if r is not None), 0)
    if not words:
        return "*Not measured yet.*"
    return (
        f"A frame of the paper's streaming renderer takes {frontier.streaming_ms:,.0f} ms: {words}, both "
        f"with skipping and adaptive sampling, on the same {scenes} scenes in the same run."
    )


def _said(name: str) -> str:
    return "the exact field's" if name == FIELD else f"that of `{name}`"


def unions_text() -> str:
    """Skia beside ours on unions."""
    if not UNIONS.exists():
        return "*Not measured yet.*"
    found = json.loads(UNIONS.read_text("utf-8"))
    lines = [
        "| drawn by | ms | 95 % interval | of which polygons | FLIP, 4 spp | 64 spp | PSNR, 4 spp | 64 spp |",
        "|---|--:|---|--:|--:|--:|--:|--:|",
    ]
    for name, way in found["ways"].items():
        made = f"{way['outlines_ms']:.2f}" if way["outlines_ms"] > 0.01 else ""
        cells = [name, f"{way['ms']:.3g}", f"{way['ms_low']:.3g} to {way['ms_high']:.3g}", made]
        cells += [f"{way[k]['mean']:.4f} ± {way[k]['interval']:.4f}" for k in ("flip", "flip64")]
        cells += [f"{way[k]['mean']:.1f} ± {way[k]['interval']:.1f}" for k in ("psnr", "psnr64")]
        lines.append(f"| {' | '.join(cells)} |")
    slower = " and ".join(
        f"{row['mean']:.1f} ± {row['interval']:.1f} times for {_said(row['slow'])}" for row in found["ratios"]
    )
    points = found["ways"]["Skia"]["points"]["mean"]
    about = (
        f"`{found['command']}`: {found['scenes']} scenes of `{found['set']}` at {found['canvas'][0]}², seed "
        f"{found['seed']}, Skia {found['skia']}, revision `{found['revision'][:9]}`. Time over Skia's on the "
        f"same scene: {slower}. Its polygons have {points:.0f} points a scene on average."
    )
    return "\n".join(lines) + "\n\n" + about


def converged_text(frontier: Frontier, base: str) -> str:
    """Errors against 64 samples a pixel."""
    lines = ["| way to draw | FLIP against 4 spp, the definition | FLIP against 64 spp |", "|---|--:|--:|"]
    wanted = ["exact reference, 1 spp", "exact reference, 4 spp", "exact reference, 16 spp", base]
    for name in (*wanted, f"{base}, one sample"):
        point = frontier.point(name)
        if point is not None and point.flip is not None and name in frontier.converged:
            lines.append(f"| {name} | {point.flip.mean:.4f} | {frontier.converged[name]:.4f} |")
    return "\n".join(lines)


def verified_text(found: dict[str, Any] | None) -> str:
    """In how many unseen scenes promises were kept."""
    if found is None:
        return "*Not verified yet.*"
    cases = list(found["cases"])
    lines = [f"| way to draw | {' | '.join(cases)} |", "|---|" + "--:|" * len(cases)]
    for name in found["cases"][cases[0]]:
        cells = []
        for case in cases:
            row = found["cases"][case].get(name)
            cells.append("" if row is None else f"{100 * row['kept']:.1f} % of {row['scenes']}")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    said = f"`{found['command']}`. " if "command" in found else ""
    verdict = "is kept" if found["held"] else "is **not** kept everywhere"
    about = (
        f"{said}Seed {found['seed']} (the promises are of seed {found['frontier_seed']}), revision "
        f"`{found['revision'][:9]}`. The promise of at least 95 % {verdict}."
    )
    return "\n".join(lines) + "\n\n" + about


WRITTEN = {"chart": chart_text, "points": points_text, "savings": savings_text, "paper": paper_text}


def page() -> str:
    """The page as it should be."""
    parts = {}
    for base, ending in BASES.items():
        path, verified = frontier_path(base), verified_path(base)
        frontier = Frontier.from_json(path.read_bytes()) if path.exists() else None
        found = json.loads(verified.read_text("utf-8")) if verified.exists() else None
        parts[f"verified{ending}"] = verified_text(found)
        for name, told in WRITTEN.items():
            text = told(frontier, base) if frontier is not None else "*Not measured yet.*"
            parts[f"{name}{ending}"] = text
        if base == "shapes2d":
            for name, told in (("converged", converged_text), ("lead", lead_text)):
                parts[name] = told(frontier, base) if frontier is not None else "*Not measured yet.*"
    parts["unions"] = unions_text()
    text = PAGE.read_text("utf-8")
    for name, words in parts.items():
        pattern = re.compile(rf"(<!-- begin {name} -->\n\n).*?(\n\n<!-- end {name} -->)", re.DOTALL)
        text, count = pattern.subn(lambda m, words=words: m[1] + words + m[2], text)  # type: ignore[misc]
        assert count == 1, name
    return text


def main() -> None:
    """See the module's description."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--ship", type=Path, metavar="OUT")
    asked = parser.parse_args()
    if asked.ship is not None:
        ship(asked.ship)
    text = page()
    if asked.check:
        if text != PAGE.read_text("utf-8"):
            raise SystemExit("docs/frontier.md is out of date: python -m lab docs frontier")
        return
    PAGE.write_text(text, "utf-8")


if __name__ == "__main__":
    main()
