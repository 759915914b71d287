"""Write the tables of docs/results.md from the JSON files in docs/results/.

python docs/make_results.py            writes the page
python docs/make_results.py --check    fails where it is out of date

What `scenelang lab eval` measured lies in docs/results/, what `scenelang lab experiment` did in
docs/results/experiments/; charts and strips of the latter are drawn by `scenelang lab chart`.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

from scenelang.lab.experiments.runs import EXPERIMENTS as RUNNABLE
from scenelang.lab.experiments.tables import markdown, table_of
from scenelang.lab.stability.probes import LARGE

HERE = Path(__file__).parent
WHAT = {
    "shapes2d": "1 to 4 deformed objects, 40 % unions, else random booleans",
    "unions": "1 to 4 deformed objects, unions",
    "affine": "the same without deformations",
    "chains": "2 to 4 deformed objects, random booleans",
    "groups": "each object in two nested groups",
    "twelve": "twelve affine steps an object",
    "shuffled": "scale, rotate, translate, shear in random order",
    "tiny": "a tenth of the size",
    "wide": "320 × 192 pixels",
    "tree": "3 or 4 objects in a nested tree that the compiler linearises",
    "deep": "the same with 5 to 8 objects",
    "many": "16 objects",
    "crowd": "100 objects at 0.4 of the size",
    "strong": "deformations up to ±2.4",
    "large": "three times the size",
}
EXPERIMENTS = ("overfit", "compare", "table1", "table2", "table3", "table4", "losses", "seeds")


def accuracy() -> str:
    """The Markdown table of all sets that were measured."""
    lines = [
        "| set | what | scenes | PSNR, dB | 5th percentile | worst | SSIM | FLIP | FLIP, 95th percentile |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, what in WHAT.items():
        path = HERE / "results" / f"{name}.json"
        if not path.exists():
            continue
        d = json.loads(path.read_text())
        p, s, f = d["psnr"], d["ssim"], d["flip"]
        lines.append(
            f"| `{name}` | {what} | {d['scenes']:,} | {p['mean']:.2f} | {p['p5']:.2f} | {p['worst']:.2f} "
            f"| {s['mean']:.4f} | {f['mean']:.4f} | {f['p5']:.4f} |"
        )
    return "\n".join(lines)


def experiment(name: str) -> Callable[[], str]:
    """The table of an experiment, with what it was run with."""

    def block() -> str:
        path = HERE / "results" / "experiments" / f"{name}.json"
        if not path.exists():
            return "*Not measured yet.*"
        found = json.loads(path.read_text())
        scenes, side = found["runs"][0]["scenes"], found["runs"][0]["resolution"]
        seconds = found["budget_s"]
        command = f"{seconds:g} s of processor time each"  # of an experiment that is no longer run
        if name in RUNNABLE:
            command = f"`scenelang lab experiment {name} --budget {seconds / 60:g}`"
        said = (
            f"{command}: {scenes} scenes at {side}², seed {found['seed']}, {found['device']}, "
            f"{found['threads']} thread, torch {found['torch']}, revision `{found['revision'][:8]}`"
        )
        return f"{table_of(found)}\n\n{said}"

    return block


def stability() -> str:
    """Mean and worst PSNR at the healthy value and at both ends of every probe, of every model measured."""
    rows = []
    for path in sorted((HERE / "results").glob("stability*.json"), key=lambda path: len(path.name)):
        found = json.loads(path.read_text())
        for probe in found["probes"].values():
            healthy = next(row for row in probe["rows"] if row["value"] == probe["healthy"])
            cells = [f"{row['value']:g}: {row['psnr']['mean']:.1f}" for row in probe["rows"]]
            rows.append(
                [f"`{found['model']}`", probe["title"], f"{healthy['psnr']['mean']:.1f}", ", ".join(cells)]
            )
    return markdown(("model", "what", "healthy, dB", "value: mean PSNR, dB"), rows)


def blends() -> str:
    """What blends of bright and dark cost, by contrast and by size, with the command."""
    found = json.loads((HERE / "results" / "stability.json").read_text())
    rows, scenes = [], {found["probes"][name]["scenes"] for name in ("contrast", "deep")}
    for name in ("contrast", "deep"):
        probe = found["probes"][name]
        for row in probe["rows"]:
            p, f = row["psnr"], row["flip"]
            contrast, size = (row["value"], LARGE) if name == "contrast" else (1, row["value"])
            mean = f"{p['mean']:.1f} ± {p['interval']:.1f}"
            rows.append(
                [
                    f"{contrast:g}",
                    f"{size:g}",
                    mean,
                    f"{p['p5']:.1f}",
                    f"{p['worst']:.1f}",
                    f"{f['mean']:.4f}",
                ]
            )
    heads = ("difference", "size", "mean PSNR, dB", "5th percentile", "worst", "FLIP")
    said = f"`scenelang lab stability shapes2d --only contrast --only deep --scenes {max(scenes)}`"
    return f"{markdown(heads, rows)}\n\n{said}, seed {found['seed']}; ± is the 95 % interval of the mean."


BLOCKS: dict[str, Callable[[], str]] = {
    "accuracy": accuracy,
    "stability": stability,
    "blends": blends,
    **{name: experiment(name) for name in EXPERIMENTS},
}
"""What stands between ``<!-- begin NAME -->`` and ``<!-- end NAME -->``."""


def filled(text: str) -> str:
    """The page with every block written again."""
    for name, block in BLOCKS.items():
        begin, end = f"<!-- begin {name} -->", f"<!-- end {name} -->"
        before, found, rest = text.partition(begin)
        if found:
            _, _, after = rest.partition(end)
            text = f"{before}{begin}\n\n{block()}\n\n{end}{after}"
    return text


def main() -> None:
    page = HERE / "results.md"
    text = page.read_text("utf-8")
    if "--check" in sys.argv:
        if filled(text) != text:
            raise SystemExit("docs/results.md is out of date: python docs/make_results.py")
        return
    page.write_text(filled(text), "utf-8")


if __name__ == "__main__":
    main()
