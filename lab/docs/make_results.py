"""Write the tables of docs/measurements.md from the JSON files in docs/results/.

python -m lab docs results            writes the page
python -m lab docs results --check    fails where it is out of date
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from functools import partial

from lab import DOCS, RESULTS
from lab.docs import clusters, costs, fits, make_frontier, passes, reported, sizes
from lab.docs.tables import markdown

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
    "leaves2d": "discs and hexagons",
    "skins": "all leaves, with `grow` and `shell`",
    "trees2d": "any trees of these",
    "gradients": "all leaves, gradients",
    "opacity": "all leaves, translucent",
    "letters": "1 to 3 words",
}
PAGE = DOCS / "measurements.md"


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
    "leaves3d": "the five other leaves, at 256²",
    "skins": "all leaves, with `grow` and `shell`, at 256²",
    "trees3d": "any trees of these, at 256²",
    "gradients": "all leaves, gradients, at 256²",
    "meshes3d": "1 to 4 of bunny, teapot and monkey, diffuse; scaled, turned and moved in random order",
}


TEXTURES = {
    "textures2d": "1 to 4 squares, scaled and moved; of their textures flip, rotation and hue",
    "textures2d-mixed": "four shapes, deformed, random booleans; any moves and colours, one in five plain",
}


def mean(found: dict[str, float], digits: int) -> str:
    """A mean and half its 95 % interval."""
    off = f" ± {found['interval']:.{digits}f}" if "interval" in found else ""
    return f"{found['mean']:.{digits}f}{off}"


def accuracy(folder: str = "", what: dict[str, str] = WHAT) -> str:
    """The Markdown table of the sets of a folder that were measured, with the commands."""
    heads = ("set", "what", "scenes", "PSNR, dB", "worst", "without the cap", "FLIP")
    rows: list[list[str]] = []
    commands, weights, revisions = dict[str, None](), dict[str, None](), dict[str, None]()
    for name, words in what.items():
        path = RESULTS / folder / f"{name}.json"
        if not path.exists():
            continue
        d = json.loads(path.read_text())
        figures = [
            mean(d["psnr"], 2),
            f"{d['psnr']['worst']:.2f}",
            f"{d.get('psnr_uncapped', d['psnr'])['mean']:.1f}",
        ]
        figures.append(mean(d["flip"], 5))
        rows.append([f"`{name}`", words, f"{d['scenes']:,}", *figures])
        command = re.sub(r"(--set \S+ )+", "--set SET ", d.get("command", "python -m lab eval"))
        commands[re.sub(r"(--scenes) \S+", r"\1 SCENES", command)] = None
        weights[f"`{d['weights'][:8]}…`"] = None
        revisions[f"`{d.get('revision', 'unknown')[:8]}`"] = None
    asked = " or ".join(f"`{command}`" for command in commands)
    said = f"{asked}; seed {d['seed']}, weights {' or '.join(weights)}, revision {' or '.join(revisions)}."
    return f"{markdown(heads, rows)}\n\n{said}"


def smallest_run() -> str:
    """Time of the smallest run of everything, and its longest steps."""
    path = RESULTS / "all.json"
    if not path.exists():
        return "*Not measured yet.*"
    result = json.loads(path.read_text())
    steps = sorted((s for s in result["steps"] if "exit" in s), key=lambda step: -step["processor_s"])
    longest = "; ".join(f"`{step['command']}` {step['processor_s']:.0f} s" for step in steps[:3])
    return (
        f"`{result['command']}` at revision `{result['revision'][:8]}`: {len(steps)} commands, "
        f"{sum(bool(step['exit']) for step in steps)} failed, {result['processor_s'] / 60:.0f} minutes of "
        f"processor time; the longest are {longest}."
    )


BLOCKS: dict[str, Callable[[], str]] = {
    "accuracy": accuracy,
    "solids": partial(accuracy, "solids3d", SOLIDS),
    "textures": partial(accuracy, "textures2d", TEXTURES),
    **clusters.BLOCKS,
    **costs.BLOCKS,
    **fits.BLOCKS,
    **make_frontier.BLOCKS,
    **passes.BLOCKS,
    **reported.BLOCKS,
    **sizes.BLOCKS,
    "all": smallest_run,
}
"""Text between ``<!-- begin NAME -->`` and ``<!-- end NAME -->``."""


def filled(text: str) -> str:
    """The page with every block written again."""
    for name, block in BLOCKS.items():
        begin, end = f"<!-- begin {name} -->", f"<!-- end {name} -->"
        before, result, rest = text.partition(begin)
        if result:
            _, _, after = rest.partition(end)
            text = f"{before}{begin}\n\n{block()}\n\n{end}{after}"
    return text


def main() -> None:
    text = PAGE.read_text("utf-8")
    if filled(text) != text and "--check" in sys.argv:
        raise SystemExit("docs/measurements.md is out of date: python -m lab docs results")
    PAGE.write_text(filled(text), "utf-8")


if __name__ == "__main__":
    main()
