"""How many numbers a texture or a mesh needs: the paper's Table 1, by codes and by forms.

*Codes* are d learned numbers for each, decoded by a network that all share (`decoder`). *Forms* are d numbers
that are all there is (`forms`), *elements* what ``scenelang learn`` makes, a byte counted as a number. Scenes
are drawn by our own renderer with what they give in the place of the elements that ship.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from PIL import Image as pillow
from PIL import ImageDraw

from lab.about import about
from lab.codes.forms import Array
from lab.codes.world import SEEDS, Way, World, load_arrays, save_arrays
from lab.evaluate import exact_of
from lab.experiments.lpips import LpipsError, load_lpips
from lab.sets.scenes import interval, scenes_of, summarise
from scenelang.backend.neural import draw_program
from scenelang.elements.element import Element
from scenelang.image import Image
from scenelang.measure.metrics import compare, over_white
from scenelang.program.compile import compile_scene
from scenelang.program.program import Program

SIZES: Final = (1, 2, 4, 8, 16, 32, 64)  # those of the paper
BEYOND: Final = (256, 1024, 4096, 16384, 65536)  # where forms go on
SETS: Final = {"textures": "textures2d", "meshes": "meshes3d"}
LOOKED_AT: Final = 8  # scenes that LPIPS is measured on
SHOWN: Final = (1, 3, 8)  # scenes of a strip
CELL, HEAD, SIDE = 96, 18, 62  # pixels of a strip

Scenes = list[tuple[Program, Array]]


def random_pictures(found: World, count: int, seed: int, side: int | None, kept: Path | None) -> Scenes:
    """Programs of random scenes of a world's set, and their exact pictures over white (H, W, 3)."""
    scene_at = scenes_of(found.model, SETS[found.what], seed, side)
    model, scenes = found.model, [scene_at(index) for index in range(count)]
    return [
        (
            compile_scene(s, model=model.manifest.name, codes=model.codes),
            _white(exact_of(s, model.manifest, kept)),
        )
        for s in scenes
    ]


def _white(picture: Array) -> Array:
    return np.ascontiguousarray(over_white(picture), np.float32)


def drawn(program: Program, found: World, elements: Mapping[str, Element]) -> Array:
    """The picture (H, W, 3) of a Program with other elements of the same names."""
    palette = tuple(paint._replace(element=elements[paint.element.name]) for paint in program.palette)
    brought = tuple(elements[element.name] for element in program.elements)
    other = replace(program, elements=brought, palette=palette)
    return _white(draw_program(other, found.model, threads=1).image)


def measured(found: World, way: Way, scenes: Scenes) -> tuple[dict[str, Any], Array]:
    """A row of the record, and the pictures of the scenes that are shown."""
    pictures = [drawn(program, found, way.elements) for program, _ in scenes]
    exact = [picture for _, picture in scenes]
    cases = [compare(a, b) for a, b in zip(pictures, exact, strict=True)]
    figures = summarise(cases)
    look = _lpips()
    apart = [look(a, b) for a, b in zip(pictures[:LOOKED_AT], exact, strict=False)] if look else []
    lpips = {"mean": round(sum(apart) / len(apart), 4), "interval": interval(apart)} if apart else None
    row = {"kind": way.kind, "d": way.d, **way.said, **figures, "lpips": lpips}
    return row, np.stack([pictures[at % len(pictures)] for at in SHOWN])


@lru_cache(maxsize=1)
def _lpips() -> Callable[[Array, Array], float] | None:
    """LPIPS of two pictures (H, W, 3); None where its weights are not installed."""
    try:
        network = load_lpips()
    except LpipsError:
        return None

    @torch.no_grad()
    def apart(a: Array, b: Array) -> float:
        return float(network(*(torch.from_numpy(v).permute(2, 0, 1)[None] for v in (a, b))))

    return apart


def study(
    found: World,
    count: int,
    seed: int,
    seconds: float,
    folder: Path,
    *,
    sizes: tuple[int, ...] = SIZES,
    beyond: tuple[int, ...] = BEYOND,
    side: int | None = None,
    kept: Path | None = None,
    report: Callable[[dict[str, Any]], None] = lambda row: None,
) -> tuple[dict[str, Any], Image]:
    """Draw random scenes every way and compare them with exact pictures.

    Args:
        count: scenes.
        seed: of the scenes.
        seconds: of processor time that a decoder is trained.
        folder: of what was trained and measured, from which a study that was stopped goes on.
        sizes: numbers of a code and of a form.
        beyond: further numbers of a form.
        side: pixels along a side of the canvas; by default that of the set.
        kept: folder of exact pictures.
        report: called with each row.

    Returns:
        A record for JSON, and a strip of some scenes at every size.
    """
    scenes = random_pictures(found, count, seed, side, kept)
    made = about()
    rows, shown = [], {}
    for way in found.ways(sizes, beyond, seconds, folder):
        name = f"{found.what}-{way.label}-{count}x{len(scenes[0][1])}-{seed}-{made['revision'][:8]}.npz"
        if not (folder / name).exists():
            row, pictures = measured(found, way, scenes)
            save_arrays(folder / name, pictures, row)
        pictures, row = load_arrays(folder / name)
        shown[way.label] = pictures
        rows.append(row)
        report(row)
    record = {
        "what": found.what,
        "set": SETS[found.what],
        "scenes": count,
        "scenes_lpips": min(count, LOOKED_AT),
        "seed": seed,
        "canvas": list(scenes[0][1].shape[1::-1]),
        **made,
        "seconds": seconds,
        "rows": rows,
    }
    return record, strip(shown, [scenes[at % count][1] for at in SHOWN], sizes)


def strip(shown: Mapping[str, Array], exact: Sequence[Array], sizes: Sequence[int]) -> Image:
    """Scenes at every size, a row for codes and one for forms, the exact picture behind both."""
    lines = [(kind, at) for at in range(len(exact)) for kind in ("codes", "forms")]
    sheet = pillow.new("RGB", (SIDE + CELL * (len(sizes) + 1), HEAD + CELL * len(lines)), "white")
    pen = ImageDraw.Draw(sheet)
    for x, head in enumerate((*map(str, sizes), "exact")):
        pen.text((SIDE + CELL * x + CELL // 2, 2), head, fill="black", font_size=14, anchor="ma")
    for y, (kind, at) in enumerate(lines):
        pen.text((2, HEAD + CELL * y + CELL // 2), kind, fill="black", font_size=14, anchor="lm")
        labels = [f"{kind}-{d}" + (f"-{SEEDS[0]}" if kind == "codes" else "") for d in sizes]
        for x, picture in enumerate([*(shown.get(label) for label in labels), exact]):
            if picture is not None:
                cell = np.ascontiguousarray(picture[at], np.float32).view(Image).to_pil()
                sheet.paste(cell.resize((CELL, CELL)), (SIDE + CELL * x, HEAD + CELL * y))
    return (np.asarray(sheet, np.float32) / 255).view(Image)
