"""Solids drawn by us, by formulas in the same march, by the reference, POV-Ray and Mitsuba: time and error.

    python -m lab bench solids [-o docs/results/solid-rivals.json] [--scenes N]

Every way draws every scene once, in turn. Processor time of a warm frame counts, all threads together; the
time of starting, with reading the scene, stands apart. A picture is compared with the same renderer's of many
samples a pixel, ours with the exact one, and with the four samples that the language defines. Mitsuba leaves
out ambient light, the fade and the sky; it draws by vectors where there is an LLVM of at least 16, which
`DRJIT_LIBLLVM_PATH` may name. Needs the extra ``oracles`` and POV-Ray.
"""

from __future__ import annotations

import argparse
import hashlib
import resource
import statistics
import subprocess
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple, get_args

import numpy as np

from lab.about import about, write_json
from lab.bench import mitsuba_scenes, povray
from lab.frontier.measure import machine
from lab.sets.scenes import interval, scenes_of
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.graph import Fold, Graph
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.closed import closed_forms
from scenelang.drawing.exact.picture import reference_image
from scenelang.drawing.how import Samples, keep_memory
from scenelang.drawing.image import encoded
from scenelang.drawing.metrics import UNCAPPED_DB, flip, over_white, psnr
from scenelang.drawing.neural.draw import draw_objects
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.torch_backend import open_model
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.scene import Scene

MODEL, SIDE, SEED = "solids3d", 256, 2021
SETS = {"diffuse": 4, "solids3d": 10}  # and how many of their scenes
OUT = Path("docs/results/solid-rivals.json")
DENSE = 5  # samples along each side of a pixel in the converged pictures of the exact field and of POV-Ray
GRIDS = ["-A", *(f"+AM1 +A{limit} +R3" for limit in (0.3, 0.1, 0.03))]
GRIDS += [f"+AM2 +A{limit} +R{depth}" for limit, depth in ((0.3, 2), (0.1, 3), (0.03, 3), (0.01, 4))]
LADDERS = {3: GRIDS[:3], 10: GRIDS, 40: GRIDS[:6:5] + GRIDS[2:3]}
"""Ways in which POV-Ray samples pixels, by its samples along a ray in a medium."""
MOST = max(LADDERS)  # the converged picture's
SPP = 1, 4, 16, 64, 256  # samples of Mitsuba's pixels
BATCHES = 2  # of the most samples, in its converged picture

Picture = np.ndarray[Any, Any]  # (H, W, 3), encoded


class TimedPicture(NamedTuple):
    """A picture, the seconds that it took, and those of starting."""

    picture: Picture
    seconds: float
    start_s: float = 0.0


class Renderer(NamedTuple):
    """A renderer's ways to draw a scene, by their names, and its converged picture of it."""

    ways: dict[str, Callable[[], TimedPicture]]
    converged: Callable[[], Picture]


def timed(draw: Callable[[], Any], who: int = resource.RUSAGE_SELF) -> tuple[Any, float]:
    """Draw; returns the result and the processor time of this process and its children."""
    before = resource.getrusage(who)
    result = draw()
    after = resource.getrusage(who)
    return result, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def graph_of(scene: Scene) -> Graph:
    """A random scene, which is one chain of leaves, as the others take it."""
    graph = lower(scene, load_manifest(MODEL), None, Diagnostics())
    chain = graph.root.links[0].node
    assert isinstance(chain, Fold)
    return replace(graph, root=chain)


class Net(NamedTuple):
    """A network or formulas for distances along rays, and the ways to sample that are timed."""

    field: Any
    samples: tuple[Samples, ...] = get_args(Samples)


def nets() -> dict[str, Net]:
    """The shipped network and formulas."""
    return {"network": Net(load_arrays(MODEL).network), "formulas": Net(closed_forms(MODEL))}


def ours(known: dict[str, Net], scene: Scene) -> Renderer:
    """All of these in the same march, and the reference."""
    graph = graph_of(scene)

    def by(net: Net, samples: Samples) -> TimedPicture:
        program, field = compile_scene(scene, model=MODEL), net.field
        image, seconds = timed(lambda: draw_objects(field, program, threads=1, samples=samples).image)
        return TimedPicture(over_white(image), seconds)

    def exact(per_side: int) -> TimedPicture:
        image, seconds = timed(lambda: reference_image(graph, per_side=per_side))
        return TimedPicture(over_white(image), seconds)

    ways: dict[str, Callable[[], TimedPicture]] = {
        f"{name}, {samples}": partial(by, net, samples)
        for name, net in known.items()
        for samples in net.samples
    }
    ways |= {f"reference, {n * n} spp": partial(exact, n) for n in (1, 2)}
    return Renderer(ways, lambda: exact(DENSE).picture)


def by_povray(scene: Scene) -> Renderer:
    graph = graph_of(scene)
    assert graph.stage is not None
    width, height = scene.canvas
    text = povray.exported(graph.root, graph.stage, scene.canvas)

    def draw(steps: int, canvas: tuple[int, int], *options: str) -> tuple[np.ndarray, float]:
        some = text.replace(f"samples {MOST}", f"samples {steps}")
        return timed(lambda: povray.traced(some, canvas, *options), resource.RUSAGE_CHILDREN)

    @cache  # where there are no media, they are not sampled
    def way(grid: str, steps: int) -> TimedPicture:
        started = draw(steps, (1, 1))[1]
        light, seconds = draw(steps, scene.canvas, *grid.split())
        return TimedPicture(encoded(light), seconds - started, started)

    def converged() -> Picture:
        dense = draw(MOST, (DENSE * width, DENSE * height))[0]
        return encoded(dense.reshape(height, DENSE, width, DENSE, 3).mean((1, 3)))

    ways: dict[str, Callable[[], TimedPicture]] = {
        f"POV-Ray, {grid}, {steps} in media": partial(way, grid, steps if "media {" in text else MOST)
        for steps, grids in LADDERS.items()
        for grid in grids
    }
    return Renderer(ways, converged)


def by_mitsuba(scene: Scene) -> Renderer:
    graph = graph_of(scene)
    assert graph.stage is not None
    stage = graph.stage

    def load() -> Any:
        return mitsuba_scenes.exported(mitsuba_scenes.solids(graph.root), stage, scene.canvas, SPP[-1])

    scene_, loading_s = timed(load)

    def light(spp: int, seed: int) -> tuple[np.ndarray, float]:
        return timed(lambda: mitsuba_scenes.picture(scene_, seed, spp))

    def way(spp: int) -> TimedPicture:
        first = light(spp, 1)[1]  # by vectors it is compiled for each number of samples
        picture, seconds = light(spp, 0)
        return TimedPicture(encoded(picture), seconds, loading_s + max(0.0, first - seconds))

    def converged() -> Picture:
        return encoded(np.mean([light(SPP[-1], 2 + i)[0] for i in range(BATCHES)], 0))

    return Renderer({f"Mitsuba, {spp} spp": partial(way, spp) for spp in SPP}, converged)


Renderers = dict[str, Callable[[Scene], Renderer]]


def kept(folder: Path | None, name: str, scene: Scene, make: Callable[[], Picture]) -> Picture:
    """A converged picture, from a folder where it was kept, or made and kept there."""
    if folder is None:
        return make()
    path = folder / f"{name}-{hashlib.sha256(scene.model_dump_json().encode()).hexdigest()}.npy"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        np.save(path, make().astype(np.float32))
    return np.asarray(np.load(path, allow_pickle=False), np.float64)


def one_scene(
    renderers: Renderers, scene: Scene, turn: int, folder: Path | None
) -> dict[str, dict[str, float]]:
    """Time and error of every way on a scene."""
    defined = over_white(reference_image(graph_of(scene)))
    rows: dict[str, dict[str, float]] = {}
    each = [(name, make(scene)) for name, make in renderers.items()]
    for renderer, (ways, make) in each[turn % len(each) :] + each[: turn % len(each)]:
        converged = kept(folder, renderer, scene, make)
        for name, way in ways.items():
            picture, seconds, started = way()
            rows[name] = {
                "ms": 1e3 * seconds,
                "start_ms": 1e3 * started,
                "flip": flip(picture, converged),
                "psnr": psnr(picture, converged, UNCAPPED_DB),
                **({"flip_defined": flip(picture, defined)} if renderer == "ours" else {}),
            }
    return rows


def summary(rows: list[dict[str, float]], ours_ms: list[float]) -> dict[str, Any]:
    """Figures of a way over the scenes that it drew; times also as multiples of ours of the same scenes."""
    ratios = [row["ms"] / ms for row, ms in zip(rows, ours_ms, strict=True)]
    result: dict[str, Any] = {
        "scenes": len(rows),
        "ms": {"median": statistics.median(row["ms"] for row in rows)},
        "start_ms": statistics.median(row["start_ms"] for row in rows),
        "times": {"mean": float(np.mean(ratios)), "interval": interval(ratios)},
    }
    for name in ("flip", "psnr", "flip_defined"):
        values = [row[name] for row in rows if name in row]
        if values:
            result[name] = {"mean": round(float(np.mean(values)), 5), "interval": interval(values)}
    return result


def measured(renderers: Renderers, name: str, count: int, side: int, folder: Path | None) -> dict[str, Any]:
    """All ways on scenes of a set."""
    scene_at = scenes_of(open_model(MODEL), name, SEED, side)
    for draw in renderers["ours"](scene_at(count)).ways.values():
        draw()  # loads and warms up
    scenes = []
    for index in range(count):
        scenes.append(one_scene(renderers, scene_at(index), index, folder))
        print(f"{name} {index + 1}/{count}", flush=True)
    ways: dict[str, Any] = {}
    for way in dict.fromkeys(way for rows in scenes for way in rows):
        some = [rows for rows in scenes if way in rows]
        ways[way] = summary([rows[way] for rows in some], [rows["network, adaptive"]["ms"] for rows in some])
    return {"scenes": count, "ways": ways}


def povray_version() -> str:
    told = subprocess.run([str(povray.povray()), "--version"], capture_output=True, text=True, check=False)
    return next(line for line in (told.stdout + told.stderr).splitlines() if line.startswith("POV-Ray"))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--out", type=Path, default=OUT, metavar="FILE")
    parser.add_argument("--side", type=int, default=SIDE, metavar="PIXELS", help="of the pictures")
    parser.add_argument("--scenes", type=int, metavar="N", help="of each set, in place of the usual numbers")
    parser.add_argument("--kept", type=Path, metavar="FOLDER", help="of converged pictures")
    given = parser.parse_args()
    started = time.perf_counter()
    keep_memory()
    others = {"povray": povray_version(), "mitsuba": mitsuba_scenes.by_vectors()}
    renderers: Renderers = {
        "ours": partial(ours, nets()),
        "povray": by_povray,
        "mitsuba": by_mitsuba,
    }
    sets = {
        name: measured(renderers, name, given.scenes or count, given.side, given.kept)
        for name, count in SETS.items()
    }
    drawn = {
        "set": ", ".join(sets),
        "scenes": sum(result["scenes"] for result in sets.values()),
        "seed": SEED,
    }
    record = {**drawn, "side": given.side, **about(), **others, "machine": machine(), "sets": sets}
    write_json(given.out, record)
    for name, result in sets.items():
        print(name)
        for way, row in sorted(result["ways"].items(), key=lambda each: each[1]["ms"]["median"]):
            ms, error = row["ms"]["median"], row["flip"]
            print(
                f"  {way:30} {ms:9.1f} ms  start {row['start_ms']:6.0f} ms  FLIP {error['mean']:.4f}"
                f" ± {error['interval']:.4f}  {row['psnr']['mean']:.1f} dB  {row['scenes']} scenes"
            )
    print(f"{time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    main()
