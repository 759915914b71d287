"""Write the tables of docs/frontier.md from the shipped frontier and its verification.

python docs/make_frontier.py            writes the page's tables
python docs/make_frontier.py --check    fails where they are out of date
python docs/make_frontier.py --ship OUT  first takes over what `scenelang lab frontier` wrote into OUT

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

from scenelang.measure.frontier import Frontier, Point, between, frontier_path

HERE = Path(__file__).parent
PAGE = HERE / "frontier.md"
BASES = {"shapes2d": "", "solids3d": "-solids"}  # models that sets are named after, and endings of names


def verified_path(base: str) -> Path:
    """What was found of a set's promises."""
    return HERE / "results" / f"frontier-verified{BASES[base]}.json"


def ship(out: Path) -> None:
    """Take over what was measured."""
    models = {p.model for p in Frontier.from_json((out / "frontier.json").read_bytes()).points}
    base = next(name for name in BASES if name in models)
    shutil.copyfile(out / "frontier.json", frontier_path(base))
    shutil.copyfile(out / "frontier.html", HERE / f"frontier-chart{BASES[base]}.html")
    if (out / "verified.json").exists():
        shutil.copyfile(out / "verified.json", verified_path(base))
    picture = f"frontier{BASES[base]}.png"
    subprocess.run([sys.executable, str(HERE / "make_pictures.py"), "--only", picture], check=True)


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
        "| way to draw | ms | × the paper's speed | FLIP | promised | PSNR, dB | scenes | |",
        "|---|--:|--:|--:|--:|--:|--:|---|",
    ]
    for p in frontier.points:
        ratio = f"{p.ratio_to_streaming:.3g}" if p.ratio_to_streaming else ""
        errors, digits = ["", "", ""], 5 if BASES[base] else 4
        if p.flip is not None and p.psnr is not None:
            errors = [f"{p.flip.mean:.{digits}f}", f"{p.flip.bound:.{digits}f}", f"{p.psnr.mean:.2f}"]
        note = "**on the front**" if p.on_front else p.why_not or ""
        cells = [p.title, f"{p.ms.median:.3g}", ratio, *errors, str(p.scenes), note]
        lines.append(f"| {' | '.join(cells)} |")
    f = frontier
    cores = "one core" if f.threads == 1 else f"{f.threads} cores"
    clock = " of processor time" if f.clock == "processor" else ""
    about = (
        f"{f.scenes} scenes of `{f.set}` at {f.canvas[0]}², seed {f.seed}; milliseconds{clock}, median of "
        f"warm frames on {cores} of {f.machine}; torch {f.torch}, revision `{f.revision[:9]}`. "
        f"{between(f.points)} ways lie between the fastest and the nearest."
    )
    return "\n".join(lines) + "\n\n" + about


def paper_text(frontier: Frontier, base: str) -> str:
    """The default's frame against the paper's."""
    default = _named(frontier, base)
    if default is None or not default.ratio_to_streaming:
        return "*Not measured.*"
    ratio = default.ratio_to_streaming
    return (
        f"A frame of `{base}` takes {default.ms.median:.3g} ms, one of the paper's streaming renderer "
        f"{frontier.streaming_ms:,.0f} ms: **{ratio:.0f} times** as long, in the same run on the same scenes."
    )


def converged_text(frontier: Frontier, base: str) -> str:
    """Errors against 64 samples a pixel."""
    lines = ["| way to draw | FLIP against 4 spp, the definition | FLIP against 64 spp |", "|---|--:|--:|"]
    wanted = ["exact reference, 1 spp", "exact reference, 4 spp", "exact reference, 16 spp", base]
    for name in (*wanted, f"{base}, one sample"):
        point = _named(frontier, name)
        if point is not None and point.flip is not None and name in frontier.converged:
            lines.append(f"| {name} | {point.flip.mean:.4f} | {frontier.converged[name]:.4f} |")
    return "\n".join(lines)


def _named(frontier: Frontier, name: str) -> Point | None:
    return next((p for p in frontier.points if p.name == name), None)


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
    verdict = "is kept" if found["held"] else "is **not** kept everywhere"
    about = (
        f"Seed {found['seed']} (the promises are of seed {found['frontier_seed']}), revision "
        f"`{found['revision'][:9]}`. The promise of at least 95 % {verdict}."
    )
    return "\n".join(lines) + "\n\n" + about


def page() -> str:
    """The page as it should be."""
    parts = {}
    for base, ending in BASES.items():
        path, verified = frontier_path(base), verified_path(base)
        frontier = Frontier.from_json(path.read_bytes()) if path.exists() else None
        found = json.loads(verified.read_text("utf-8")) if verified.exists() else None
        parts[f"verified{ending}"] = verified_text(found)
        for name, told in (("chart", chart_text), ("points", points_text), ("paper", paper_text)):
            text = told(frontier, base) if frontier is not None else "*Not measured yet.*"
            parts[f"{name}{ending}"] = text
        if base == "shapes2d":
            text = converged_text(frontier, base) if frontier is not None else "*Not measured yet.*"
            parts["converged"] = text
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
            raise SystemExit("docs/frontier.md is out of date: python docs/make_frontier.py")
        return
    PAGE.write_text(text, "utf-8")


if __name__ == "__main__":
    main()
