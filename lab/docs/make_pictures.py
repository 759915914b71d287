"""Draw every picture of the documentation: ``python -m lab docs pictures``.

The pictures come from scenes, drawn by the shipped network, so that one command draws all of them again
when the scenes or the weights change. `plan` lists them:

- ``NAME.png`` for each scene of ``examples/``, and ``NAME.webp`` for each animation;
- ``PAGE/NAME.png`` (or ``.webp``) for each scene of a page: a block of ``nsg``, an empty line, and a picture
  ``![text](pictures/PAGE/NAME.png)`` is drawn from that block;
- ``language/NAME.png``, a strip of labelled pictures, for scenes of ``examples/reference/``: a comment
  ``// Shown: label: -D k=0 | label: -D k=1`` says what is in the strip of the scene's name, and
  ``// Shown NAME: …`` in another one;
- the gallery, one scene beside its exact picture, and the worst cases of an evaluation.

Pictures with few colours are stored with a palette. Files that would not change are left alone.
"""

from __future__ import annotations

import argparse
import fnmatch
import io
import json
import re
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from PIL import Image as pillow
from PIL import ImageDraw, ImageFont

import scenelang as nsg
from lab import DOCS
from lab.charts import budget_chart, stability_chart
from lab.docs import light_rivals, solid_rivals
from lab.docs.blocks import pictured
from lab.docs.figures import read
from lab.evaluate import SceneFigures, exact_of, sheet
from lab.frontier.chart import frontier_chart
from lab.frontier.record import Frontier
from lab.sets.scenes import draw_scene, scenes_of
from lab.shadows import measure_shadows
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.weights import read_facts
from scenelang.drawing.neural.load import load_model
from scenelang.inverse.search import Blur, blurred
from scenelang.language.diagnostics import SourceFile
from scenelang.output.frontier import frontier_path

EXAMPLES = DOCS.parent / "examples"
REFERENCE = EXAMPLES / "reference"
PICTURES = DOCS / "pictures"
GALLERY = (
    *("letters", "chess", "flower", "stones", "watch", "lotus"),
    *("lantern", "dusk", "clouds", "mandala", "castle", "vortex"),
)
GALLERY_FRAMES = {"vortex": 8, "stones": 48}
COMPARED = "chain"
RECORDED = {
    "play.webp",  # by make_play.py
    # of measurements that are not made again; the page tells their revisions
    *("codes.png", "element-bytes.png", "parts.png"),
    *(f"experiments/{name}.png" for name in ("codes-meshes-strips", "codes-textures-strips", "compare")),
    *(f"experiments/{name}-strips.png" for name in ("compare", "overfit", "table3")),
}
WHITE_DB = 19.27  # PSNR of a white picture on the scenes of long trainings
LONGEST_HOURS = 100  # to which their curves are drawn on
GAP_PX = 8
STREAMED = 8  # scenes of a strip
LOUDER = 20  # factor on the difference of two pictures
SHARPER = 2  # strips and the gallery are drawn larger by this and made smaller again, for screens' sake
STRIP_PX, LABEL_PX = 150, 20  # a cell of a strip, and the line below it
MOVING_PX, MOVING_FPS = 192, 12  # animations: the shorter side, and the most frames a second
MOVING_BYTES = 220_000
PALETTE = 256
SHADED = 3000  # colours from which on a palette is dithered, so that shading shows no bands
NEAR = 2.5  # a palette that changes values by more than this on average (of 255) is not used
_SHOWN = re.compile(r"^// Shown( \w+)?: (.*)$", re.MULTILINE)


@dataclass(frozen=True)
class PictureSource:
    """A scene's file or text, its params and the frame that stands for it."""

    path: Path | None = None
    text: str = ""
    params: tuple[tuple[str, str], ...] = ()
    frame: int = 0

    def scene(self, frame: int | None = None) -> nsg.Scene:
        """The scene in a frame."""
        number = self.frame if frame is None else frame
        if self.path is not None:
            return nsg.load(self.path, params=dict(self.params), frame=number)
        return nsg.loads(self.text, root=EXAMPLES, frame=number)


def sized(scene: nsg.Scene, shorter_px: int) -> nsg.Scene:
    """The same scene on a canvas whose shorter side is this long."""
    width, height = scene.canvas
    factor = shorter_px / min(width, height)
    return scene.model_copy(update={"canvas": (round(width * factor), round(height * factor))})


def over_white(picture: nsg.Image) -> pillow.Image:
    """A picture without alpha."""
    shown = picture.to_pil().convert("RGBA")
    return pillow.alpha_composite(pillow.new("RGBA", shown.size, "white"), shown).convert("RGB")


def png(picture: pillow.Image) -> bytes:
    """A small PNG: with a palette where that looks the same."""
    if picture.mode == "RGB":
        few = picture.quantize(PALETTE, pillow.Quantize.MEDIANCUT, dither=pillow.Dither.NONE)
        if picture.getcolors(SHADED) is None:
            few = picture.quantize(palette=few, dither=pillow.Dither.FLOYDSTEINBERG)
        off = np.abs(np.asarray(few.convert("RGB"), np.float64) - np.asarray(picture, np.float64))
        if off.mean() < NEAR and np.percentile(off, 99.9) < 10 * NEAR:
            picture = few
    data = io.BytesIO()
    picture.save(data, "PNG", optimize=True)
    return data.getvalue()


def still(source: PictureSource) -> bytes:
    """One frame as a PNG, with alpha if it has any."""
    return png(nsg.render(source.scene()).to_pil())


def moving(source: PictureSource) -> bytes:
    """An animation as a WebP, small, over white."""
    first = source.scene(0)
    if first.animation is None:
        raise SystemExit(f"{source.path or source.text}: not an animation")
    animation = first.animation
    every = max(1, round(animation.fps / MOVING_FPS)) if animation.frames > 1 else 1
    frames = [
        over_white(nsg.render(sized(source.scene(number), MOVING_PX)))
        for number in range(0, animation.frames, every)
    ]
    shown_ms = round(1000 * animation.seconds / len(frames)) if animation.fps >= 2 else 250
    data = webp(frames, shown_ms, animation.loop)
    if len(data) > MOVING_BYTES:  # many small parts that all move
        frames, shown_ms = frames[::2], 2 * shown_ms
        data = webp(frames, shown_ms, animation.loop)
    while len(data) > MOVING_BYTES:
        side = round(0.85 * frames[0].width), round(0.85 * frames[0].height)
        frames = [frame.resize(side, pillow.Resampling.LANCZOS) for frame in frames]
        data = webp(frames, shown_ms, animation.loop)
    return data


def webp(frames: list[pillow.Image], shown_ms: int, loop: bool) -> bytes:
    """An animated WebP; without a loop its last frame stays for a while."""
    data, first = io.BytesIO(), frames[0]
    shown = [*[shown_ms] * (len(frames) - 1), shown_ms if loop else 1500]
    first.save(
        data, "WEBP", save_all=True, append_images=frames[1:], duration=shown, loop=0, quality=70, method=4
    )
    return data.getvalue()


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


def strips(path: Path) -> dict[str, list[tuple[str, PictureSource]]]:
    """(label, scene) of each cell, for each strip of a scene of the reference."""
    result = {}
    for name, cells in _SHOWN.findall(path.read_text("utf-8")):
        parts = [cell.rpartition(": -D ") for cell in cells.split(" | ")]
        result[name.strip() or path.stem] = [
            (label.strip(), PictureSource(path, params=tuple(re.findall(r"([\w.]+)=(\S+)", values))))
            for label, _, values in parts
        ]
    return result


def strip(cells: list[tuple[str, PictureSource]]) -> bytes:
    """A row of pictures with a label below each."""
    sheet = pillow.new("RGB", (len(cells) * (STRIP_PX + GAP_PX) - GAP_PX, STRIP_PX + LABEL_PX), "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(13)
    for index, (label, source) in enumerate(cells):
        large = over_white(nsg.render(sized(source.scene(), SHARPER * STRIP_PX)))
        left = index * (STRIP_PX + GAP_PX)
        sheet.paste(large.resize((STRIP_PX, STRIP_PX), pillow.Resampling.BOX), (left, 0))
        pen.text((left + STRIP_PX / 2, STRIP_PX + LABEL_PX / 2 + 1), label, "#333", font, anchor="mm")
    return png(sheet)


def gallery() -> bytes:
    """Some examples on a sheet."""
    scenes = [
        PictureSource(EXAMPLES / f"{name}.nsg", frame=GALLERY_FRAMES.get(name, 0)).scene() for name in GALLERY
    ]
    large = [over_white(nsg.render(sized(scene, SHARPER * 200))) for scene in scenes]
    return png(tiled(large, 4, (200, 200)))


def compared() -> bytes:
    """A scene by the network, exactly, and the difference between the two."""
    scene = nsg.load(EXAMPLES / f"{COMPARED}.nsg")
    network, exact = nsg.render(scene), nsg.render(scene, backend="reference", patient=True)
    difference = np.clip(LOUDER * np.abs(network - exact), 0.0, 1.0).astype(np.float32).view(nsg.Image)
    return png(tiled([over_white(picture) for picture in (network, exact, difference)], 3, (256, 256)))


def worst_cases(name: str, count: int, model: str = "shapes2d", folder: str = "") -> bytes:
    """The worst cases of an evaluation: network, exact picture, FLIP map."""
    report = json.loads((DOCS / "results" / folder / f"{name}.json").read_text("utf-8"))
    cases = [
        SceneFigures(c["index"], c["last"], 0, {"psnr": c["psnr"], "flip": c["flip"]})
        for c in report["worst_cases"]
    ]
    shown = sheet(load_model(model), name, report["seed"], cases[:count]).to_pil()
    shown.thumbnail((1100, 1100))
    return png(shown.quantize(128))


def shadows() -> bytes:
    """Scenes in which a medium throws its shadow on a solid."""
    return png(measure_shadows(load_model("solids3d"), 6, 2021, 128)[1].to_pil().quantize(256))


def stability(dimension: int) -> bytes:
    """Charts of the stability suite, from what `python -m lab stability` wrote: of every model measured."""
    paths = sorted((DOCS / "results").glob("stability*.json"), key=lambda path: len(path.name))
    reports = [json.loads(path.read_text("utf-8")) for path in paths]
    return _few_colours(
        stability_chart([r for r in reports if load_manifest(r["model"]).dimension == dimension])
    )


def _few_colours(chart: bytes) -> bytes:
    with pillow.open(io.BytesIO(chart)) as picture:
        return png(picture.convert("RGB").quantize(64, pillow.Quantize.MAXCOVERAGE))  # keeps rare colours


def budgets() -> bytes:
    """The curves of the paper's renderers, from the headers of their weights."""
    names = {"": "streaming, exact lifting", "-learned": "streaming, learned lifting"}
    names = {f"shapes2d-streaming{end}": name for end, name in names.items()}
    names["shapes2d-reading"] = "reading, learned lifting"
    curves = {name: read_facts(model)["training"]["curve"] for model, name in names.items()}
    return _few_colours(budget_chart(curves, WHITE_DB, LONGEST_HOURS))


def streamed() -> bytes:
    """Unseen scenes, exact and by the paper's renderers, a row each."""
    models = [load_model(f"shapes2d-{name}") for name in ("streaming", "streaming-learned", "reading")]
    scene_at = scenes_of(models[0], "unions", 2021, 64)
    scenes = [scene_at(index) for index in range(STREAMED)]
    rows = [[exact_of(scene, models[0].manifest, None) for scene in scenes]]
    rows += [[draw_scene(model, scene)[1] for scene in scenes] for model in models]
    cells = [over_white(picture) for row in rows for picture in row]
    return png(tiled(cells, STREAMED, (128, 128)).quantize(256))


def frontier(model: str) -> bytes:
    """The charts of a shipped frontier."""
    return _few_colours(frontier_chart(Frontier.from_json(frontier_path(model).read_bytes())))


def fit_scene(name: str) -> SourceFile:
    """A scene of docs/fit.md."""
    result = re.search(
        rf'^```nsg title="{name}"\n(.*?)```', (DOCS / "fit.md").read_text("utf-8"), re.MULTILINE | re.DOTALL
    )
    return SourceFile(name, result[1] if result else "")


def fitted() -> bytes:
    """Before, after and target of a scene of docs/fit.md; the target is exact, out of focus and has noise."""
    text = fit_scene("lost.nsg")
    true = {"x": -0.31, "y": 0.22, "size": 0.5, "turn": "20deg", "ink": "#dd3311", "stones": 4}
    exact = nsg.render(nsg.loads(text.text, params=true), backend="reference")
    soft = blurred(np.asarray(exact, np.float64), Blur(1.2))
    photo = np.clip(soft + np.random.default_rng(7).normal(0.0, 0.04, soft.shape), 0.0, 1.0)
    names = ("x", "y", "size", "turn", "ink", "stones")
    result = nsg.fit(text, photo.astype(np.float32), params=names)
    return png(
        result.sheet().to_pil().quantize(100, pillow.Quantize.MEDIANCUT, kmeans=2)
    )  # noise keeps its own


def fitted_frames() -> bytes:
    """The same of a scene of docs/fit.md with two frames."""
    text = fit_scene("swing.nsg")
    true = {"wide": "50deg", "lag": 0.15, "long": 0.8}
    frames = {n: nsg.render(nsg.loads(text.text, params=true, frame=n), backend="reference") for n in (0, 6)}
    return _few_colours(png(nsg.fit(text, frames).sheet().to_pil()))


@lru_cache
def fitted_solid() -> nsg.Fit:
    """Camera and light of a scene of docs/fit.md, from an exact picture."""
    text = fit_scene("table.nsg")
    true = {"turn": "40deg", "height": 1.8, "sun": "-30deg", "power": 45}
    return nsg.fit(text, nsg.render(nsg.loads(text.text, params=true), backend="reference"))


def way_of(found: nsg.Fit) -> bytes:
    """The way of a fit; its ends are shown for longer."""
    frames = [over_white(nsg.render(scene)) for scene in found.way]
    return webp([frames[0]] * 4 + frames + [frames[-1]] * 8, 150, True)


def swept() -> bytes:
    """The contact sheet of docs/sweep.md, of the scene and the grid that stand there."""
    result = re.search(
        r"^```nsg[^\n]*\n(.*?)```", (DOCS / "sweep.md").read_text("utf-8"), re.MULTILINE | re.DOTALL
    )
    with tempfile.TemporaryDirectory() as folder:
        scene, sheet = Path(folder) / "flowers.nsg", Path(folder) / "sheet.png"
        scene.write_text(result[1] if result else "", "utf-8")
        nsg.render_many(scene, f"{folder}/out/", grid={"petals": "", "turn": "../7"}, sheet=sheet)
        return _few_colours(sheet.read_bytes())


def plan() -> dict[str, Callable[[], bytes]]:
    """Files of `docs/pictures`, with the function that makes each."""
    made: dict[str, Callable[[], bytes]] = {}
    for path in sorted(EXAMPLES.glob("*.nsg")):
        animation = nsg.load(path).animation
        middle = 0 if animation is None else animation.frames - 1 if not animation.loop else 0
        made[f"{path.stem}.png"] = lambda source=PictureSource(path, frame=middle): still(source)
        if animation is not None:
            made[f"{path.stem}.webp"] = lambda source=PictureSource(path): moving(source)
    for path in sorted(REFERENCE.glob("*.nsg")):
        for name, cells in strips(path).items():
            made[f"language/{name}.png"] = lambda cells=cells: strip(cells)
    for page in sorted(DOCS.glob("*.md")):
        for text, name in pictured(page.read_text("utf-8")):
            if name in made:
                raise SystemExit(f"{page.name}: {name} is drawn twice")
            draw = moving if name.endswith(".webp") else still
            made[name] = lambda draw=draw, source=PictureSource(text=text): draw(source)
    made["gallery.png"] = gallery
    made["fit.png"] = fitted
    made["fit-frames.png"] = fitted_frames
    made["fit-solid.png"] = lambda: png(fitted_solid().sheet().to_pil())
    made["fit-solid.webp"] = lambda: way_of(fitted_solid())
    made["sweep.png"] = swept
    made[f"{COMPARED}-compared.png"] = compared
    made["stability.png"] = lambda: stability(2)
    made["stability-solids.png"] = lambda: stability(3)
    for model, name in (("shapes2d", "frontier"), ("solids3d", "frontier-solids")):
        if frontier_path(model).exists():
            made[f"{name}.png"] = lambda model=model: frontier(model)
    made["light-rivals.png"] = lambda: _few_colours(light_rivals.chart(read("light/rivals")["scenes"]))
    made["solid-rivals.png"] = lambda: _few_colours(solid_rivals.chart())
    made["worst-chains.png"] = lambda: worst_cases("chains", 6)
    made["shadows.png"] = shadows
    made["budgets.png"], made["experiments/streamed.png"] = budgets, streamed
    made["worst-solids.png"] = lambda: worst_cases("booleans", 6, "solids3d", "solids3d")
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", metavar="PATTERN", default="*", help="such as 'tutorial/*' or 'gear.png'")
    only = parser.parse_args().only
    made = plan()
    chosen = [name for name in made if fnmatch.fnmatch(name, only)]
    if not chosen:
        raise SystemExit(f"no picture is called {only}; there are {', '.join(made)}")
    changed = 0
    for name in chosen:
        started = time.perf_counter()
        path, data = PICTURES / name, made[name]()
        before = path.read_bytes() if path.exists() else None
        if data != before:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
            changed += 1
            state = "new" if before is None else "changed"
            print(
                f"{state:8}{len(data) / 1024:7.1f} KB{time.perf_counter() - started:7.1f} s  {name}",
                flush=True,
            )
    stale = [
        path
        for path in sorted(PICTURES.rglob("*.*"))
        if path.relative_to(PICTURES).as_posix() not in {*made, *RECORDED}
    ]
    for path in stale:
        print(f"no longer made: {path.relative_to(PICTURES)}")
    total = sum(path.stat().st_size for path in PICTURES.rglob("*.*"))
    print(f"{changed} of {len(chosen)} changed; all pictures together {total / 2**20:.2f} MB")


if __name__ == "__main__":
    main()
