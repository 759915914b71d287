"""Write the tables of docs/results.md and of other pages from the JSON files in docs/results/.

python -m lab docs results            writes the pages
python -m lab docs results --check    fails where one is out of date
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from functools import partial

from lab import DOCS, RESULTS
from lab.docs import clusters, costs, fits, reported, sizes, solid_rivals
from lab.docs.tables import markdown
from lab.probes import LARGE
from scenelang.models.manifest import load_manifest

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
    "tree": "3 or 4 objects in a nested tree that needs no group",
    "deep": "the same with 5 to 8 objects",
    "many": "16 objects",
    "crowd": "100 objects at 0.4 of the size",
    "strong": "deformations up to ±2.4",
    "large": "three times the size",
}
PAGES = ("results.md", "report.md", "proof.md", "viewer.md", "elements.md", "fit.md", "sweep.md")


SOLIDS = {
    "solids3d": "1 to 3 spheres and tori, diffuse or of mist",
    "diffuse": "all diffuse",
    "media": "all of mist",
    "deformed": "with `twirl`, `bend`, `twist` up to ±0.8 and `displace`",
    "booleans": "2 to 4, random booleans, blends of any width from 0.05 to 0.5",
    "shuffled": "scale, rotate, translate, shear in random order, `twirl` and `bend` among them",
    "wide": "a canvas of 5 to 3",
    "staged": "random camera, light, ground and sky",
    "mixed": "1 to 4, deformed, booleans, on a random stage",
    "meshes3d": "1 to 4 of bunny, teapot and monkey, diffuse; scaled, turned and moved in random order",
}


TEXTURES = {
    "textures2d": "1 to 4 squares, scaled and moved; of their textures flip, rotation and hue",
    "textures2d-mixed": "four shapes, deformed, random booleans; any moves and colours, one in five plain",
    "shapes2d": "without textures",
}


def mean(found: dict[str, float], digits: int) -> str:
    """A mean and half its 95 % interval."""
    off = f" ± {found['interval']:.{digits}f}" if "interval" in found else ""
    return f"{found['mean']:.{digits}f}{off}"


def accuracy(folder: str = "", what: dict[str, str] = WHAT) -> str:
    """The Markdown table of the sets of a folder that were measured, with the commands."""
    heads = ("set", "what", "scenes", "PSNR, dB", "worst", "without the cap", "SSIM", "FLIP")
    rows: list[list[str]] = []
    commands, revisions = dict[str, None](), dict[str, None]()
    for name, words in what.items():
        path = RESULTS / folder / f"{name}.json"
        if not path.exists():
            continue
        d = json.loads(path.read_text())
        figures = [
            mean(d["psnr"], 2),
            f"{d['psnr']['worst']:.2f}",
            mean(d.get("psnr_uncapped", d["psnr"]), 1),
        ]
        figures += [f"{d['ssim']['mean']:.4f}", mean(d["flip"], 5)]
        rows.append([f"`{name}`", words, f"{d['scenes']:,}", *figures])
        command = re.sub(r"(--set) \S+", r"\1 SET", d.get("command", "python -m lab eval"))
        commands[re.sub(r"(--scenes) \S+", r"\1 SCENES", command)] = None
        revisions[f"`{d.get('revision', 'unknown')[:8]}`"] = None
    asked, drawn = " or ".join(f"`{command}`" for command in commands), " or ".join(revisions)
    said = f"{asked}; seed {d['seed']}, weights `{d['weights'][:8]}…`, revision {drawn}."
    return f"{markdown(heads, rows)}\n\n{said}"


def stability(dimension: int = 2) -> str:
    """Of every probe of every model measured the healthy mean PSNR, the least mean and the worst scene."""
    rows, said = [], []
    for path in sorted((RESULTS).glob("stability*.json"), key=lambda path: len(path.name)):
        found = json.loads(path.read_text())
        if load_manifest(found["model"]).dimension != dimension:
            continue
        for probe in found["probes"].values():
            by = {row["value"]: row["psnr"] for row in probe["rows"]}
            least, worst = (min(by, key=lambda value: by[value][k]) for k in ("mean", "worst"))
            cells = [f"{probe['quantity']}, {min(by):g} to {max(by):g}", mean(by[probe["healthy"]], 1)]
            cells += [mean(by[least], 1), f"{least:g}", f"{by[worst]['worst']:.1f}", f"{worst:g}"]
            scenes = f"{probe.get('scenes', found['scenes'])}"
            rows.append([f"`{found['model']}`", probe["title"], scenes, *cells])
        plain = f"python -m lab stability {found['model']} --scenes {found['scenes']}"
        command = found.get("command", plain)  # of an older record
        said.append(f"`{command}`, seed {found['seed']}, weights `{found['weights'][:8]}…`.")
    heads = (
        "model",
        "what",
        "scenes",
        "values",
        "healthy, dB",
        "least mean, dB",
        "at",
        "worst scene, dB",
        "at",
    )
    return "\n\n".join((markdown(heads, rows), *said))


def blends() -> str:
    """What blends of bright and dark cost, by contrast and by size, with the command."""
    found = json.loads((RESULTS / "stability.json").read_text())
    rows, scenes = [], {found["probes"][name]["scenes"] for name in ("contrast", "deep")}
    for name in ("contrast", "deep"):
        probe = found["probes"][name]
        for row in probe["rows"]:
            p, f = row["psnr"], row["flip"]
            contrast, size = (row["value"], LARGE) if name == "contrast" else (1, row["value"])
            rows.append(
                [
                    f"{contrast:g}",
                    f"{size:g}",
                    mean(p, 1),
                    f"{p['p5']:.1f}",
                    f"{p['worst']:.1f}",
                    f"{f['mean']:.4f}",
                ]
            )
    heads = ("difference", "size", "mean PSNR, dB", "5th percentile", "worst", "FLIP")
    said = f"`python -m lab stability shapes2d --only contrast --only deep --scenes {max(scenes)}`"
    return f"{markdown(heads, rows)}\n\n{said}, seed {found['seed']}; ± is the 95 % interval of the mean."


def texels() -> str:
    """What textures lose and how they flicker where they are drawn large and small."""
    found = json.loads((RESULTS / "stability-textures2d.json").read_text())
    rows = []
    for row in found["probes"]["texels"]["rows"]:
        p, flicker = row["psnr"], row.get("flicker")
        shown = (mean(flicker, 2), f"{flicker['worst']:.2f}") if flicker else ("–", "–")
        rows.append([f"{row['value']:g}", mean(p, 1), f"{p['worst']:.1f}", *shown])
    heads = ("texels to a pixel", "mean PSNR, dB", "worst", "flicker", "worst")
    said = f"`{found.get('command')}`, {found['scenes']} scenes a value, seed {found['seed']}"
    return f"{markdown(heads, rows)}\n\n{said}"


def shadows() -> str:
    """The error inside shadows of media, with the command."""
    found = json.loads((RESULTS / "solids3d" / "shadows.json").read_text())
    rows = [
        [what, *(f"{found[name][k]:.2f}" for k in ("mean", "interval", "p5", "worst"))]
        for what, name in (
            ("PSNR, dB, at most 50", "psnr"),
            ("the same without the cap", "psnr_uncapped"),
            ("of a picture without the shadow", "without"),
            ("share of the shadow that is wrong, %", "wrong_percent"),
        )
    ]
    heads = ("inside the shadow", "mean", "± (95 %)", "5th percentile from the bad end", "worst")
    command = f"python -m lab shadows {found['model']} --scenes {found['scenes']} --side {found['canvas'][0]}"
    said = f"`{command}`, seed {found['seed']}, revision `{found['revision'][:8]}`"
    return f"{markdown(heads, rows)}\n\n{said}"


def smallest_run() -> str:
    """What everything took at its smallest, and most of it."""
    path = RESULTS / "all.json"
    if not path.exists():
        return "*Not measured yet.*"
    found = json.loads(path.read_text())
    steps = sorted((s for s in found["steps"] if "exit" in s), key=lambda step: -step["processor_s"])
    longest = "; ".join(f"`{step['command']}` {step['processor_s']:.0f} s" for step in steps[:3])
    return (
        f"`{found['command']}` at revision `{found['revision'][:8]}`: {len(steps)} commands, "
        f"{sum(bool(step['exit']) for step in steps)} failed, {found['processor_s'] / 60:.0f} minutes of "
        f"processor time; the longest are {longest}."
    )


BLOCKS: dict[str, Callable[[], str]] = {
    "accuracy": accuracy,
    "stability": stability,
    "solids": partial(accuracy, "solids3d", SOLIDS),
    "textures": partial(accuracy, "textures2d", TEXTURES),
    "large-solids": partial(accuracy, "solids3d-256", SOLIDS),
    "solid-stability": partial(stability, 3),
    "blends": blends,
    "texels": texels,
    "rivals": solid_rivals.table,
    "shadows": shadows,
    **clusters.BLOCKS,
    **costs.BLOCKS,
    **fits.BLOCKS,
    **reported.BLOCKS,
    **sizes.BLOCKS,
    "all": smallest_run,
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
    for name in PAGES:
        page = DOCS / name
        text = page.read_text("utf-8")
        if filled(text) != text and "--check" in sys.argv:
            raise SystemExit(f"docs/{name} is out of date: python -m lab docs results")
        page.write_text(filled(text), "utf-8")


if __name__ == "__main__":
    main()
