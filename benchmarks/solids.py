"""What a frame of solids costs: ours, the formulas in the same march, the reference, POV-Ray, Mitsuba.

    python -m benchmarks.solids [-o docs/results/solid-rivals.json] [--rounds N]

Processor time, all threads together, of frames of 256² pixels. Each of ours is of a Program that was not
drawn before in the process, warm otherwise; the least of all rounds counts. POV-Ray and Mitsuba's
`scalar_rgb` draw the same scene with the cheapest settings by which their picture is as near to their own
converged one as ours is to the exact one, converged too: FLIP of the middle 96² pixels. Starting them, which
includes reading the scene, is told apart. Mitsuba leaves out ambient light, the fade and the sky. The floor
is what the products of the network's layers take, on batches of the sizes that came up. Needs the extra
``oracles`` and POV-Ray.
"""

from __future__ import annotations

import argparse
import cProfile
import json
import platform
import pstats
import resource
import time
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

import scenelang as nsg
from benchmarks.floor import SOLIDS
from scenelang.backend.neural import draw_program, open_model, usable_cores
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.graph.lower import lower
from scenelang.graph.nodes import Graph
from scenelang.image import encoded
from scenelang.lab.frontier.closed import closed_forms
from scenelang.measure.metrics import flip
from scenelang.models.framed import load_arrays
from scenelang.models.manifest import load_manifest
from scenelang.program.program import Program
from scenelang.reference.samples import sample_points
from scenelang.reference.solid.field import Field
from scenelang.reference.solid.image import radiance, solid_image
from scenelang.renderers.arrays import SMOOTH_BLOCK as BLOCK
from scenelang.renderers.draw import Drawing, draw_objects
from tests.reference import mitsuba_scenes, povray

MODEL, SIDE, MIDDLE = "solids3d", 256, 96
WINDOW = slice((SIDE - MIDDLE) // 2, (SIDE + MIDDLE) // 2)
OUT = Path("docs/results/solid-rivals.json")
SCENES = {name: SOLIDS[name] for name in ("three diffuse solids", "two media and a solid")}
GRIDS = [["-A"]]
GRIDS += [["+AM1", f"+A{limit}", f"+R{side}"] for side in (2, 3) for limit in (0.3, 0.1, 0.03)]
GRIDS += [["+AM2", f"+A{limit}", f"+R{side}"] for side in (2, 3, 4) for limit in (0.3, 0.1, 0.03)]
"""Ways in which POV-Ray samples pixels."""
STEPS = 3, 5, 10, 20, 40  # of its samples along a ray in a medium
DENSE = 6  # samples along each side of a pixel in its converged picture, and in the exact one
STRATA = 1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24  # along each side of Mitsuba's pixels
CONVERGED = 40  # in its converged picture


@contextmanager
def processor_s(found: list[float], who: int = resource.RUSAGE_SELF) -> Iterator[None]:
    """Append the processor time that this process, or its children, take within."""
    before = resource.getrusage(who)
    yield
    after = resource.getrusage(who)
    found.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def text(name: str, turn: int) -> str:
    return f"nsg 1; canvas({SIDE}, {SIDE}); {SCENES[name].replace('TURN', f'{60 + turn}deg')}"


def graph_of(name: str) -> Graph:
    """The scene that is drawn everywhere, lowered."""
    return lower(nsg.loads(text(name, 0)), load_manifest(MODEL), None, Diagnostics())


# ---------------------------------------------------------------- ours

Draw = Callable[[Program], Drawing]


def ways() -> dict[str, Draw]:
    """Ways of ours to draw a Program, on every core."""
    cores, arrays, model, closed = (
        usable_cores(),
        load_arrays(MODEL).network,
        open_model(MODEL),
        closed_forms(MODEL),
    )
    return {
        "network, numpy": lambda program: draw_objects(arrays, program, threads=cores),
        "network, torch": lambda program: draw_program(program, model),
        "formulas in the same march": lambda program: draw_objects(closed, program, threads=cores),
    }


def frames(name: str, rounds: int) -> dict[str, list[float]]:
    """Seconds of the frames of each way, in turn, each of a new Program."""
    taken: dict[str, list[float]] = {way: [] for way in ways()}
    for turn in range(rounds + 1):
        for at, (way, draw) in enumerate(ways().items()):
            program = nsg.compile(nsg.loads(text(name, len(taken) * turn + at)))
            with processor_s(taken[way]):
                draw(program)
    return {way: seconds[1:] for way, seconds in taken.items()}  # the first is cold


def exact_middle(graph: Graph, per_side: int) -> np.ndarray:
    """The middle of the exact picture."""
    rows = range(WINDOW.start, WINDOW.stop)
    x, y = sample_points((SIDE, SIDE), rows, per_side)
    part = np.reshape(x, (1, len(rows), per_side, SIDE, per_side))[..., WINDOW, :].reshape(1, -1)
    along = np.reshape(y, (1, len(rows), per_side, SIDE, per_side))[..., WINDOW, :].reshape(1, -1)
    assert graph.stage is not None
    forward, right, up = (np.reshape(axis, (3, 1)) for axis in graph.stage.camera.axes())
    way = forward / np.tan(graph.stage.camera.fov_rad / 2) + part * right + along * up
    light = radiance(Field(graph.root), graph.stage, way / np.linalg.norm(way, axis=0))[:3]
    return np.moveaxis(encoded(light.reshape(3, MIDDLE, per_side, MIDDLE, per_side).mean((2, 4))), 0, 2)


def floor(network: Any, program: Program) -> dict[str, float]:
    """A frame's evaluations: how many, seconds of the layers' products alone, and of all that they do."""
    batches: Counter[int] = Counter()
    ask = type(network).field

    def counted(q: np.ndarray, layers: Any, gradient: bool) -> Any:
        count = q.shape[1]
        batches.update([BLOCK] * (count // BLOCK) + [count % BLOCK] * (count % BLOCK > 0))
        return ask(network, q, layers, gradient)

    network.field = counted
    try:
        draw_objects(network, program)
    finally:
        del network.field
    layers = network.decoder(network.codes[0])

    def seconds(work: Callable[[], object], count: int, times: int) -> float:
        """Of ``times`` calls, each for so many points."""
        each: list[float] = []
        repeats = max(times, ceil(3e4 / count))  # long enough for the clock
        for _ in range(3):
            with processor_s(each):
                for _ in range(repeats):
                    work()
        return min(each) * times / repeats

    def products(inputs: list[np.ndarray]) -> None:
        for (weights, _), x in zip(layers, inputs, strict=True):
            weights @ x

    total = [0.0, 0.0]
    for count, times in batches.items():
        inputs = [np.random.default_rng(0).random((w.shape[1], count), np.float32) for w, _ in layers]
        total[0] += seconds(partial(products, inputs), count, times)
        total[1] += seconds(partial(ask, network, inputs[0], layers, False), count, times)
    evaluations = sum(size * times for size, times in batches.items())
    return {"evaluations": evaluations, "products_s": total[0], "whole_s": total[1]}


def shares(network: Any, program: Program) -> dict[str, float]:
    """Shares of a frame's time by the module of the renderer that spends it, on one core."""
    draw_objects(network, program)
    profile = cProfile.Profile()
    profile.runcall(draw_objects, network, program)
    stats: Any = pstats.Stats(profile).stats  # type: ignore[attr-defined]
    spent = {function: entry[2] for function, entry in stats.items()}
    for _ in range(8):  # what numpy and helpers spend is their callers'
        for function, (_, _, _, _, callers) in stats.items():
            if "/solid/" in function[0] or not callers:
                continue
            amount, spent[function] = spent[function], 0.0
            weights = {caller: entry[3] + 1e-12 for caller, entry in callers.items()}
            for caller, weight in weights.items():
                spent[caller] = spent.get(caller, 0.0) + amount * weight / sum(weights.values())
    found: Counter[str] = Counter()
    for (file, _, _), seconds in spent.items():
        found[Path(file).stem if "/solid/" in file else "rest"] += seconds
    return {name: seconds / sum(found.values()) for name, seconds in found.most_common()}


# ---------------------------------------------------------------- the others


def difference(picture: np.ndarray, converged: np.ndarray) -> float:
    """FLIP of the middles of two pictures of linear light."""
    return flip(encoded(picture[WINDOW, WINDOW]), encoded(converged[WINDOW, WINDOW]))


def by_povray(graph: Graph, target: float) -> dict[str, Any]:
    """The cheapest settings with a FLIP up to the target, and what a frame takes with them."""
    assert graph.stage is not None
    scene = povray.exported(graph.root, graph.stage, (SIDE, SIDE))
    media = "media {" in scene

    def draw(grid: list[str], steps: int, side: int = SIDE, part: bool = False) -> np.ndarray:
        first, last = side * WINDOW.start // SIDE, side * WINDOW.stop // SIDE
        window = [f"+{end}{axis}{at}" for axis in "CR" for end, at in (("S", first + 1), ("E", last))]
        text = scene.replace("samples 40", f"samples {steps}")
        return povray.traced(text, (side, side), *grid, *(window if part else []))

    dense = draw(["-A"], STEPS[-1], DENSE * SIDE, True)
    converged = dense.reshape(SIDE, DENSE, SIDE, DENSE, 3).mean((1, 3))
    found: list[tuple[float, float, list[str], int]] = []
    for steps in STEPS if media else STEPS[-1:]:
        for grid in GRIDS:
            taken: list[float] = []
            with processor_s(taken, resource.RUSAGE_CHILDREN):
                picture = draw(grid, steps, part=True)
            found.append((taken[0], difference(picture, converged), grid, steps))
        if any(error <= target for _, error, _, _ in found):
            break
    _, error, grid, steps = min(each for each in found if each[1] <= target)
    taken, started = [], []
    for _ in range(3):
        with processor_s(taken, resource.RUSAGE_CHILDREN):
            draw(grid, steps)
        with processor_s(started, resource.RUSAGE_CHILDREN):
            draw(["-A"], steps, 1)
    options = " ".join(grid) + (f", {steps} samples along a ray in a medium" if media else "")
    seconds = min(taken) - min(started)
    return {"options": options, "flip": error, "seconds": seconds, "start_s": min(started)}


def by_mitsuba(graph: Graph, target: float) -> dict[str, Any]:
    """As `by_povray`."""
    assert graph.stage is not None
    stage, started, taken = graph.stage, list[float](), list[float]()
    with processor_s(started):
        objects = mitsuba_scenes.solids(graph.root)
    window = {f"crop_offset_{axis}": WINDOW.start for axis in "xy"} | {
        "crop_width": MIDDLE,
        "crop_height": MIDDLE,
    }

    def middle(side: int) -> np.ndarray:
        scene = mitsuba_scenes.exported(objects, stage, (SIDE, SIDE), side * side, **window)
        return encoded(mitsuba_scenes.picture(scene))

    converged = middle(CONVERGED)
    errors = {STRATA[-1]: float("nan")}

    def enough(side: int) -> bool:
        errors[side] = flip(middle(side), converged)
        return errors[side] <= target

    side = STRATA[min(bisect_left(STRATA, True, key=enough), len(STRATA) - 1)]
    with processor_s(started):
        scene = mitsuba_scenes.exported(objects, stage, (SIDE, SIDE), side * side)
    with processor_s(taken):
        mitsuba_scenes.picture(scene)
    options = f"{side * side} samples a pixel" + (", the most tried" if errors[side] > target else "")
    return {"options": options, "flip": errors[side], "seconds": taken[0], "start_s": sum(started)}


# ---------------------------------------------------------------- all of it


def measured(name: str, rounds: int) -> dict[str, Any]:
    """All about a scene."""
    graph, program = graph_of(name), nsg.compile(nsg.loads(text(name, 0)))
    network, reference = load_arrays(MODEL).network, list[float]()
    converged, defined = exact_middle(graph, DENSE), exact_middle(graph, 2)
    rows: dict[str, dict[str, Any]] = {}
    for way, seconds in frames(name, rounds).items():
        picture = np.asarray(ways()[way](program).image)[WINDOW, WINDOW]
        errors = {"flip": flip(picture, converged), "flip_defined": flip(picture, defined)}
        rows[way] = {"options": "", **errors, "seconds": min(seconds), "start_s": 0.0}
    assert graph.stage is not None
    with processor_s(reference):
        solid_image(graph.root, graph.stage, (SIDE, SIDE))
    error = flip(defined, converged)
    rows["reference"] = {
        "options": "",
        "flip": error,
        "flip_defined": 0.0,
        "seconds": reference[0],
        "start_s": 0.0,
    }
    target = rows["network, numpy"]["flip"]
    rows["POV-Ray"] = by_povray(graph, target)
    rows["Mitsuba"] = by_mitsuba(graph, target)
    return {"ways": rows, "floor": floor(network, program), "shares": shares(network, program)}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--out", type=Path, default=OUT, metavar="FILE")
    parser.add_argument("--rounds", type=int, default=6, metavar="N", help="frames of each of our ways")
    given = parser.parse_args()
    started = time.perf_counter()
    scenes = {}
    for name in SCENES:
        scenes[name] = found = measured(name, given.rounds)
        print(name)
        for way, row in found["ways"].items():
            print(
                f"  {way:28} {1e3 * row['seconds']:9.1f} ms  FLIP {row['flip']:.4f}"
                f"  start {1e3 * row['start_s']:6.0f} ms  {row['options']}"
            )
        ours, least = found["ways"]["network, numpy"]["seconds"], found["floor"]
        products, whole = (1e3 * least[name] for name in ("products_s", "whole_s"))
        print(
            f"  floor {products:.1f} ms, {products / ours / 10:.0f} % of a frame, for the products of "
            f"{least['evaluations']:,} evaluations; {whole:.1f} ms for all of these"
        )
        print("  " + ", ".join(f"{part} {share:.0%}" for part, share in found["shares"].items()), flush=True)
    record = {"side": SIDE, "rounds": given.rounds, "machine": platform.machine(), "scenes": scenes}
    given.out.write_text(json.dumps(record, indent=1) + "\n")
    print(f"{time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    main()
