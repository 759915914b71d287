"""Time of a warm frame, beside what the exact field takes in the network's place, or another checkout.

    python -m lab bench floor [--frames N] [--scene NAME ...]            on numpy
    python -m lab bench floor --exact [-o docs/results/floor.json] [...] formulas beside the network
    python -m lab bench floor --threads 2 [...]                          wall time, beside that of one thread
    python -m lab bench floor --against CHECKOUT [--library torch] [...] another checkout beside this one

Processor time of one thread. Each frame is of a Program of its own, and nothing is kept between frames.
Medians are over frames, of each of which the least of several drawings counts, the rivals' in turn.
With ``--against`` a process of another checkout draws the same Programs, and pictures are compared.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import scenelang as nsg
from lab import ROOT
from lab.about import about, write_json
from lab.sets.plane import SETS, random_scene
from lab.sets.solids import SOLID_SETS, random_solid
from scenelang.compiler.program import Program
from scenelang.drawing.how import keep_memory
from scenelang.drawing.neural.draw import draw_objects
from scenelang.drawing.neural.files import load_arrays

ROUNDS = 5  # of which the least counts: others interrupt
Rival = Callable[[int], "FrameTimes"]


class FrameTimes(NamedTuple):
    """Times of a frame; ``picture`` is (H, W, 3)."""

    seconds: float
    pairs: int
    refined: int
    met: int
    picture: Any
    first: float = 0.0  # seconds of its first drawing, where this is the fastest of several


def stars(frame: int, count: int, scale: float, side: int) -> Any:
    """Stars strewn over a canvas, others for each frame."""
    at = 100_000 * frame
    return nsg.loads(
        f"canvas({side}, {side}); for (i in 0..<{count}) {{ star {{ scale({scale}); rotate(7deg * i); "
        f"translate(2 * rand(i + {at}) - 1, 2 * rand(i + {at + 50_000}) - 1); }} }}"
    )


SOLIDS = {
    "three diffuse solids": """
      sphere { scale(0.6); translate(0, 0.6, 0); material diffuse { color(#e8c060); } }
      torus { scale(1.2, 1.2, 0.4); rotate(TURN, axis = X); material diffuse { color(#4070e0); } }
      sphere { scale(0.4); translate(1.0, -0.5, 0.4); material diffuse { color(#d04030); } }""",
    "two media and a solid": """
      sphere { scale(0.6); translate(-0.6, 0.2, 0); material volumetric { color(#5080ff); } }
      torus { scale(0.7); rotate(TURN, axis = X); translate(0.7, -0.1, 0.2);
        material volumetric { color(#e09050); } }
      sphere { scale(0.35); translate(0.2, 0.4, -1); material diffuse { color(#e8c060); } }""",
    "a mesh": "m.bunny { scale(1.2); rotate(TURN, axis = Y); material diffuse { color(#c96); } }",
    "a mesh of mist": "m.bunny { scale(0.9); rotate(TURN, axis = Y); material volumetric { color(#c96); } }",
    "a torus of mist": "torus { scale(0.9); rotate(TURN, axis = Y); material volumetric { color(#c96); } }",
}


def solids(frame: int, name: str, side: int = 256) -> Any:
    """Solids, turned a little further in each frame."""
    text = SOLIDS[name].replace("TURN", f"{60 + frame}deg")
    return nsg.loads(f'nsg 1; import "std/meshes" as m; canvas({side}, {side}); {text}')


def of_set(frame: int, name: str) -> Any:
    return random_scene(np.random.default_rng([2021, frame]), SETS[name])


def of_solid_set(frame: int, name: str) -> Any:
    return random_solid(np.random.default_rng([2021, frame]), SOLID_SETS[name])


SCENES: dict[str, Callable[[int], Any]] = {
    **{
        name: partial(of_set, name=name)
        for name in ("shapes2d", "chains", "many", "crowd", "textures2d-mixed")
    },
    **{name: partial(solids, name=name) for name in SOLIDS},
    **{f"solids, {name}": partial(of_solid_set, name=name) for name in SOLID_SETS},
    "200 stars": partial(stars, count=200, scale=0.08, side=256),
    "10,000 small stars": partial(stars, count=10_000, scale=0.008, side=1024),
}


def model_of(name: str) -> str:
    return "solids3d" if name in SOLIDS or name.startswith("solids") else "shapes2d"


def programs(name: str, frames: int) -> list[Program]:
    """Programs of scenes that something is seen of; one more than frames, as the first one warms up."""
    result: list[Program] = []
    for frame in range(10 * frames + 10):
        with contextlib.suppress(nsg.SceneError):
            result.append(nsg.compile(SCENES[name](frame), model=model_of(name)))
        if len(result) > frames:
            break
    return result


def network(library: str, model: str) -> Any:
    """The renderer on one core."""
    keep_memory()
    if library == "exact":
        from scenelang.drawing.closed import closed_forms

        return closed_forms(model)
    if library == "numpy":
        return load_arrays(model).network
    import torch

    from scenelang.drawing.neural.load import load_model

    torch.set_num_threads(1)
    return load_model(model).network


def here(net: Any, made: Sequence[Program], threads: int = 0) -> Rival:
    """Draws the frames of Programs in this process, in wall time if a number of threads is given."""
    clock = time.perf_counter if threads else time.process_time

    def draw(index: int) -> FrameTimes:
        program = copy.copy(made[index])
        started = clock()
        drawn = draw_objects(net, program, threads=threads or 1)
        seconds = clock() - started
        return FrameTimes(seconds, drawn.pairs, drawn.refined, drawn.met, np.asarray(drawn.image))

    return draw


def worker(draw: Rival, folder: str) -> None:
    """Draw a frame for each line of the input; a line of JSON says what it took."""
    for line in sys.stdin:
        frame = draw(int(line))
        np.save(f"{folder}/picture.npy", frame.picture)
        print(json.dumps(frame[:4]), flush=True)


@contextlib.contextmanager
def elsewhere(root: str, name: str, frames: int, library: str) -> Iterator[Rival]:
    """Draws frames by the code of a checkout in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        line = [sys.executable, "-m", "lab.bench.floor", "--worker", folder, "--frames", str(frames)]
        environment = {**os.environ, "PYTHONPATH": root, "OMP_NUM_THREADS": "1"}
        with subprocess.Popen(
            [*line, "--library", library, "--scene", name],
            env=environment,
            cwd=root,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        ) as process:
            assert process.stdin is not None
            assert process.stdout is not None

            def draw(index: int) -> FrameTimes:
                print(index, file=process.stdin, flush=True)
                return FrameTimes(*json.loads(process.stdout.readline()), np.load(f"{folder}/picture.npy"))

            yield draw
            process.stdin.close()


def race(rivals: Sequence[Rival], frames: int) -> list[list[FrameTimes]]:
    """The frames of each rival; they draw in turn, several times, of which the least counts."""
    result: list[list[FrameTimes]] = [[] for _ in rivals]
    for index in range(frames + 1):
        turns = [[rival(index) for rival in rivals] for _ in range(ROUNDS)]
        for own, drawn in zip(result, zip(*turns, strict=True), strict=True):
            least = min(drawn, key=lambda frame: frame.seconds)
            own.append(least._replace(first=drawn[0].seconds))
    return [own[1:] for own in result]


def told(title: str, frames: Sequence[FrameTimes]) -> str:
    seconds, pairs, refined, met = (statistics.median(f[at] for f in frames) for at in range(4))
    counts = f"{pairs:,.0f} pairs met, {met:,.0f} pixels asked, {refined:,.0f} of them four times"
    first = statistics.median(frame.first for frame in frames)
    return f"{title}: {1e3 * seconds:.2f} ms, {1e3 * first:.2f} drawn first; {counts}"


def middle(frames: Sequence[FrameTimes]) -> dict[str, float]:
    return {what: statistics.median(getattr(f, what) for f in frames) for what in ("seconds", "pairs")}


def against(ours: Sequence[FrameTimes], theirs: Sequence[FrameTimes], title: str) -> str:
    """Comparison of two rivals, frame by frame."""
    ratio = statistics.median(b.seconds / a.seconds for a, b in zip(ours, theirs, strict=True))
    off = [abs(a.picture - b.picture).max(2) for a, b in zip(ours, theirs, strict=True)]
    worst, many = 255 * max(one.max() for one in off), sum(int((one > 1 / 255).sum()) for one in off)
    return f"{title} takes {ratio:.2f} times as long; worst pixel {worst:.2f}/255, {many} by more than 1/255"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--frames", type=int, default=12, metavar="N")
    parser.add_argument("--library", choices=("numpy", "torch", "exact"), default="numpy")
    parser.add_argument("--scene", action="append", choices=SCENES)
    parser.add_argument("--exact", action="store_true")
    parser.add_argument("--threads", type=int, metavar="N")
    parser.add_argument("--against", metavar="CHECKOUT")
    parser.add_argument("--worker", metavar="FOLDER", help=argparse.SUPPRESS)
    parser.add_argument("-o", "--out", type=Path, metavar="FILE")
    given = parser.parse_args()
    rows: dict[str, Any] = {}
    for name in given.scene or SCENES:
        if given.against:
            with contextlib.ExitStack() as stack:
                roots = str(ROOT), given.against
                rivals = [stack.enter_context(elsewhere(r, name, given.frames, given.library)) for r in roots]
                ours, theirs = race(rivals, given.frames)
            print(f"{name}, {told(given.library, ours)}; {against(ours, theirs, given.against)}")
            continue
        made = programs(name, given.frames)
        nets = {
            library: network(library, model_of(name)) for library in [given.library, *["exact"] * given.exact]
        }
        rivals = [here(net, made) for net in nets.values()]
        if given.worker:
            worker(rivals[0], given.worker)
            return
        if given.threads:
            net = nets[given.library]
            several, one = race([here(net, made, given.threads), here(net, made, 1)], len(made) - 1)
            title = f"{given.library} on {given.threads} threads"
            print(f"{name}, {told(title, several)}; {against(several, one, 'one')}", flush=True)
            continue
        raced = race(rivals, len(made) - 1)
        for library, frames in zip(nets, raced, strict=True):
            print(f"{name}, {told(library, frames)}", flush=True)
        if given.exact:
            print(f"{name}, {against(raced[1], raced[0], 'the network')}", flush=True)
            rows[name] = {
                "frames": len(raced[0]),
                "ratio": statistics.median(a.seconds / b.seconds for a, b in zip(*raced, strict=True)),
                **{way: middle(frames) for way, frames in zip(("network", "exact"), raced, strict=True)},
            }
    if given.out:
        write_json(given.out, {**about(), "rounds": ROUNDS, "scenes": rows})


if __name__ == "__main__":
    main()
