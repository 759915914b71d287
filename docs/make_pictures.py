"""Draw the pictures of the documentation from examples/: ``python docs/make_pictures.py``.

Each example becomes ``docs/pictures/NAME.png``, drawn by the network. ``gallery.png`` shows several, and
``chain-compared.png`` one beside the exact picture and the difference between the two.
``worst-chains.png`` has the worst cases that ``docs/results/chains.json`` names.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from PIL import Image as pillow

import scenelang as nsg
from scenelang.evaluation.run import Case, worst_sheet
from scenelang.models.load import load_model

DOCS = Path(__file__).parent
EXAMPLES = DOCS.parent / "examples"
PICTURES = DOCS / "pictures"
GALLERY = ("gear", "flower", "tangram", "night", "blobs", "logo", "deformations", "tree")
COMPARED = "chain"
GAP_PX = 8
LOUDER = 20  # factor on the difference of two pictures
SHARPER = 2  # the gallery's scenes are drawn larger by this


def enlarged(scene: nsg.Scene, factor: int) -> nsg.Scene:
    """The same scene on a larger canvas."""
    width, height = scene.canvas
    return scene.model_copy(update={"canvas": (width * factor, height * factor)})


def over_white(picture: nsg.Image) -> pillow.Image:
    """A picture without alpha."""
    shown = picture.to_pil().convert("RGBA")
    return pillow.alpha_composite(pillow.new("RGBA", shown.size, "white"), shown).convert("RGB")


def tiled(pictures: list[pillow.Image], columns: int, side: tuple[int, int]) -> pillow.Image:
    """Pictures on a grid, each scaled to fill a cell and cut to it."""
    width, height = side
    rows = -(-len(pictures) // columns)
    size = columns * (width + GAP_PX) - GAP_PX, rows * (height + GAP_PX) - GAP_PX
    sheet = pillow.new("RGB", size, "white")
    for index, picture in enumerate(pictures):
        scale = max(width / picture.width, height / picture.height)
        fitted = picture.resize((round(picture.width * scale), round(picture.height * scale)), 1)
        left, top = (fitted.width - width) // 2, (fitted.height - height) // 2
        cell = fitted.crop((left, top, left + width, top + height))
        sheet.paste(cell, (index % columns * (width + GAP_PX), index // columns * (height + GAP_PX)))
    return sheet


def worst_cases(name: str, count: int) -> pillow.Image:
    """The worst cases of an evaluation: network, exact picture, FLIP map."""
    report = json.loads((DOCS / "results" / f"{name}.json").read_text("utf-8"))
    cases = [
        Case(c["index"], c["last"], 0, {"psnr": c["psnr"], "flip": c["flip"]}) for c in report["worst_cases"]
    ]
    sheet = worst_sheet(load_model("shapes2d"), name, report["seed"], cases, count).to_pil()
    sheet.thumbnail((1100, 1100))
    return sheet.quantize(128)


def main() -> None:
    """Draw everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--backend", choices=("neural", "reference"), default="neural")
    backend = parser.parse_args().backend
    PICTURES.mkdir(exist_ok=True)
    scenes = {path.stem: nsg.load(path) for path in sorted(EXAMPLES.glob("*.nsg"))}
    for name, scene in scenes.items():
        nsg.render(scene, backend=backend).to_pil().save(PICTURES / f"{name}.png", optimize=True)
    large = [over_white(nsg.render(enlarged(scenes[name], SHARPER), backend=backend)) for name in GALLERY]
    tiled(large, 4, (200, 200)).save(PICTURES / "gallery.png", optimize=True)

    worst_cases("chains", 6).save(PICTURES / "worst-chains.png", optimize=True)

    scene = scenes[COMPARED]
    network, exact = nsg.render(scene, backend=backend), nsg.render(scene, backend="reference")
    difference = np.clip(LOUDER * np.abs(network - exact), 0.0, 1.0).astype(np.float32).view(nsg.Image)
    shown = [over_white(picture) for picture in (network, exact, difference)]
    tiled(shown, 3, (256, 256)).save(PICTURES / f"{COMPARED}-compared.png", optimize=True)


if __name__ == "__main__":
    main()
