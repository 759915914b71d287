"""Targets that other programs made: how near a fit comes to what can be reached.

    python -m lab bench fit_targets [-o docs/results/fit-targets.json] [--scenes N] [--seed N] [--stability]

A star, of which place, size, turn and colour are sought, under a triangle. One target of each scene is an SVG
that resvg draws; the other is like a photograph: the same polygons, averaged in linear light as a lens and a
sensor do, out of focus and with noise. What can be reached is the picture of the true values, drawn as fits
are. With ``--stability`` photographs are more and more out of focus, or noisy. Needs the extra ``oracles``.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import resvg_py
from PIL import Image as pillow
from PIL import ImageDraw

import scenelang
from lab.about import about
from lab.sets.scenes import interval
from scenelang.diagnostics.span import SourceFile
from scenelang.files import write_whole
from scenelang.image import Image, decoded, encoded
from scenelang.measure.metrics import UNCAPPED_DB, psnr

OUT: Final = Path("docs/results/fit-targets.json")
STABILITY: Final = Path("docs/results/fit-stability.json")
BLURS: Final = (0.0, 0.5, 1.0, 2.0, 4.0, 6.0, 8.0)  # pixels, with little noise
NOISES: Final = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4)  # of the range, a pixel out of focus
SIDE: Final = 200
REACHED_DB: Final = 40.0
INNER: Final = 0.381966  # radius of a star's inner corners
FINE: Final = 8  # pixels along each side of a pixel of a photograph
SCENE: Final = """\
nsg 1; canvas(200, 200); background(#f4f1ea);
param x = 0 in -0.7..0.7;
param y = 0 in -0.7..0.7;
param size = 0.3 in 0.15..0.6;
param turn = 0deg in -36deg..36deg;
param ink = #808080;
star { scale(size); rotate(turn); translate(x, y); material flat { color(ink); } }
triangle { scale(0.35); translate(0.2, -0.3); material flat { color(#3a6a8a); } }
"""
NAMES: Final = ("x", "y", "size", "turn", "ink")
Rng = np.random.Generator
Draw = Callable[[dict[str, Any], Rng], Image]


def polygons(true: dict[str, Any]) -> list[tuple[npt.NDArray[np.float64], str]]:
    """Corners (n, 2) in pixels, and colours, from back to front."""
    turns = np.radians(90 + 36 * np.arange(10) + true["turn"])
    star = true["size"] * np.where(np.arange(10) % 2, INNER, 1.0) * np.exp(1j * turns)
    star += true["x"] + 1j * true["y"]
    triangle = 0.35 * np.exp(1j * np.radians(90 + 120 * np.arange(3))) + 0.2 - 0.3j
    sheet = np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
    half = SIDE / 2
    return [
        (np.stack([half + half * z.real, half - half * z.imag], 1), colour)
        for z, colour in ((sheet, "#f4f1ea"), (star, true["ink"]), (triangle, "#3a6a8a"))
    ]


def by_resvg(true: dict[str, Any], rng: Rng) -> Image:
    """The scene as an SVG, drawn by resvg."""
    shapes = "".join(
        f'<polygon fill="{colour}" points="{" ".join(f"{x:.4f},{y:.4f}" for x, y in corners)}"/>'
        for corners, colour in polygons(true)
    )
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" width="{SIDE}" height="{SIDE}">{shapes}</svg>'
    with pillow.open(io.BytesIO(bytes(resvg_py.svg_to_bytes(svg_string=svg)))) as file:
        return (np.asarray(file.convert("RGB"), np.float32) / 255).view(Image)


def photographed(
    true: dict[str, Any], rng: Rng, blur: float | None = None, noise: float | None = None
) -> Image:
    """The scene as a camera might see it.

    Args:
        blur: standard deviation in pixels; from half a pixel to a pixel and a half if left out.
        noise: standard deviation of channels; 2 to 5 % if left out.
    """
    sheet = pillow.new("RGB", (FINE * SIDE, FINE * SIDE))
    for corners, colour in polygons(true):
        ImageDraw.Draw(sheet).polygon([tuple(corner) for corner in FINE * corners - 0.5], fill=colour)
    light = decoded(np.asarray(sheet, np.float64) / 255)
    light = light.reshape(SIDE, FINE, SIDE, FINE, 3).mean((1, 3))
    sigma = rng.uniform(0.5, 1.5) if blur is None else max(blur, 1e-3)
    reach = math.ceil(3.5 * sigma)
    focus = np.exp(-np.square(np.arange(-reach, reach + 1) / sigma) / 2)
    for axis in (0, 1):
        light = np.apply_along_axis(blurred, axis, light, focus / focus.sum())
    noisy = encoded(light) + rng.normal(0.0, rng.uniform(0.02, 0.05) if noise is None else noise, light.shape)
    return (np.floor(np.clip(noisy, 0.0, 1.0) * 255 + 0.5) / 255).astype(np.float32).view(Image)


def blurred(row: npt.NDArray[np.float64], focus: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """A row under a kernel; what is beyond its ends is as they are."""
    return np.convolve(np.pad(row, len(focus) // 2, mode="edge"), focus, mode="valid")


def drawn_values(rng: Rng) -> dict[str, Any]:
    """True values of a scene."""
    return {
        "x": rng.uniform(-0.7, 0.7),
        "y": rng.uniform(-0.7, 0.7),
        "size": rng.uniform(0.15, 0.6),
        "turn": rng.uniform(-36, 36),
        "ink": "#" + bytes(rng.integers(0, 200, 3).tolist()).hex(),
    }


def fitted(true: dict[str, Any], target: Image, seed: int) -> dict[str, Any]:
    """What a fit finds of a target, beside the picture of the true values."""
    reach = scenelang.render(scenelang.loads(SCENE, params={**true, "turn": f"{true['turn']}deg"}))
    started = time.process_time()
    found = scenelang.fit(SourceFile("star.nsg", SCENE), target, params=NAMES, seed=seed)
    spent = time.process_time() - started
    after = scenelang.render(scenelang.loads(found.text))
    row = {
        "start_db": found.start_psnr,
        "db": psnr(after, target, UNCAPPED_DB),
        "reach_db": psnr(reach, target, UNCAPPED_DB),
        "against_reach_db": psnr(after, reach, UNCAPPED_DB),
        "blur": found.blur.sigma,
        "light": found.blur.light,
        "done": found.done,
        "notes": list(found.notes),
        "seconds": spent,
    }
    return {key: round(x, 2) if isinstance(x, float) else x for key, x in row.items()}


def measure(scenes: int, seed: int) -> dict[str, Any]:
    """Fit scenes to both targets of each."""
    cases: list[dict[str, Any]] = []
    for index in range(scenes):
        rng = np.random.default_rng([seed, index])
        true = drawn_values(rng)
        for way, draw in (("resvg", by_resvg), ("photograph", photographed)):
            cases.append({"target": way, **fitted(true, draw(true, rng), seed)})
            print(cases[-1], flush=True)

    def of(way: str) -> dict[str, Any]:
        rows = [case for case in cases if case["target"] == way]
        near = [row["against_reach_db"] for row in rows]
        medians = ("db", "reach_db", "against_reach_db", "seconds")
        return {
            "reached": sum(db >= REACHED_DB for db in near),
            "named": sum(db < REACHED_DB and bool(row["notes"]) for db, row in zip(near, rows, strict=True)),
            "mean_db": round(statistics.mean(near), 2),
            "interval_db": interval(near),
            "lowest_db": min(near),
            "median": {key: round(statistics.median(row[key] for row in rows), 2) for key in medians},
        }

    return {
        **about(), "seed": seed, "scenes": scenes, "side": SIDE, "reached_db": REACHED_DB,
        "targets": {way: of(way) for way in ("resvg", "photograph")}, "cases": cases,
    }  # fmt: skip


def stability(scenes: int, seed: int) -> dict[str, Any]:
    """Fit scenes to photographs that are ever worse."""
    ladders = {
        "blur": [(value, {"blur": value, "noise": 0.02}) for value in BLURS],
        "noise": [(value, {"blur": 1.0, "noise": value}) for value in NOISES],
    }
    found: dict[str, list[dict[str, Any]]] = {name: [] for name in ladders}
    for name, ladder in ladders.items():
        for value, asked in ladder:
            rows = []
            for index in range(scenes):
                rng = np.random.default_rng([seed, index])
                true = drawn_values(rng)
                rows.append(fitted(true, photographed(true, rng, **asked), seed))
            near = [row["against_reach_db"] for row in rows]
            found[name].append(
                {
                    "value": value,
                    "reached": sum(db >= REACHED_DB for db in near),
                    "mean_db": round(statistics.mean(near), 2),
                    "interval_db": interval(near),
                    "lowest_db": min(near),
                    "blur": statistics.median(row["blur"] for row in rows),
                    "seconds": statistics.median(row["seconds"] for row in rows),
                }
            )
            print(name, found[name][-1], flush=True)
    return {**about(), "seed": seed, "scenes": scenes, "side": SIDE, "reached_db": REACHED_DB, **found}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--out", type=Path, metavar="FILE")
    parser.add_argument("--stability", action="store_true", help="ever worse photographs")
    parser.add_argument("--scenes", type=int, default=20, metavar="N")
    parser.add_argument("--seed", type=int, default=2021)
    given = parser.parse_args()
    found = (stability if given.stability else measure)(given.scenes, given.seed)
    out = given.out or (STABILITY if given.stability else OUT)
    write_whole(out, (json.dumps(found, indent=1) + "\n").encode())
    for name, way in found.get("targets", {}).items():
        print(f"{name:12}{way['reached']:3} of {given.scenes} reached, {way['named']} named; {way['median']}")


if __name__ == "__main__":
    main()
