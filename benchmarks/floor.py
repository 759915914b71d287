"""Where the time of a warm frame in the plane goes, and how far it is from its products alone.

    python benchmarks/floor.py [--frames N] [--library LIBRARY] [--scene NAME ...] [--against CHECKOUT]

Processor time of one thread. Each frame is of a Program that was not drawn before in it. Shares are
of the renderer's modules, what numpy and torch spend on their behalf included; *floor* is what products of
the decoder take at the rate of a large float32 product on the same core. With ``--against`` a process of
another checkout draws each Program in turn with this one, several times, of which the least counts, and
pictures are compared.
"""

from __future__ import annotations

import argparse
import copy
import cProfile
import json
import os
import pstats
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import scenelang as nsg
from scenelang.backend.options import keep_memory
from scenelang.measure.sets import SETS, random_scene
from scenelang.models.framed import load_arrays
from scenelang.program.program import Program
from scenelang.renderers.draw import Drawing, draw_objects

ROUNDS = 5  # of which the least counts: others interrupt
SIDE = 768  # of the matrices whose product's rate is the floor's


def stars(count: int, scale: float, side: int) -> Callable[[int], Any]:
    """Stars strewn over a canvas, others for each frame."""

    def made(frame: int) -> Any:
        at = 100_000 * frame
        return nsg.loads(
            f"canvas({side}, {side}); for (i in 0..<{count}) {{ star {{ scale({scale}); rotate(7deg * i); "
            f"translate(2 * rand(i + {at}) - 1, 2 * rand(i + {at + 50_000}) - 1); }} }}"
        )

    return made


def of_set(name: str) -> Callable[[int], Any]:
    """Scenes of an evaluation set."""
    return lambda frame: random_scene(np.random.default_rng([2021, frame]), SETS[name])


SCENES: dict[str, Callable[[int], Any]] = {
    "shapes2d": of_set("shapes2d"),
    "chains": of_set("chains"),
    "many": of_set("many"),
    "crowd": of_set("crowd"),
    "200 stars": stars(200, 0.08, 256),
    "10,000 small stars": stars(10_000, 0.008, 1024),
}


def programs(name: str, frames: int) -> list[Program]:
    """Programs of scenes that something is seen of; one more than frames, as the first one warms up."""
    found: list[Program] = []
    for frame in range(10 * frames + 10):
        try:
            found.append(nsg.compile(SCENES[name](frame), model="shapes2d"))
        except nsg.SceneError:
            continue
        if len(found) > frames:
            break
    return found


def network(library: str) -> Any:
    """The network that a library draws with, on one core."""
    if library == "numpy":
        return load_arrays("shapes2d").network
    import torch

    from scenelang.models.load import load_model

    torch.set_num_threads(1)
    return load_model("shapes2d").network


def timed(net: Any, program: Program) -> tuple[float, Drawing]:
    """Seconds of a frame, and what was drawn."""
    started = time.process_time()
    drawing = draw_objects(net, program)
    return time.process_time() - started, drawing


def gemm_rate() -> float:
    """Floating-point operations a second of a large product."""
    a = np.random.default_rng(0).random((SIDE, SIDE), np.float32)
    taken = []
    for _ in range(5):
        started = time.process_time()
        a @ a
        taken.append(time.process_time() - started)
    return float(2 * SIDE**3 / min(taken))


def shares(net: Any, made: list[Program]) -> dict[str, float]:
    """Shares of the time by the module that spends it."""
    profile = cProfile.Profile()
    for program in made:
        profile.runcall(draw_objects, net, program)
    stats: Any = pstats.Stats(profile).stats  # type: ignore[attr-defined]
    spent = {function: entry[2] for function, entry in stats.items()}
    for _ in range(8):  # what numpy and helpers spend is their callers'
        for function, (_, _, _, _, callers) in stats.items():
            if _own(function[0]) or not callers:
                continue
            amount, spent[function] = spent[function], 0.0
            weights = {caller: entry[3] + 1e-12 for caller, entry in callers.items()}
            for caller, weight in weights.items():
                spent[caller] = spent.get(caller, 0.0) + amount * weight / sum(weights.values())
    found: Counter[str] = Counter()
    for (file, _, function_name), seconds in spent.items():
        found[f"{Path(file).stem}.{function_name}" if _own(file) else "rest"] += seconds
    return {name: seconds / sum(found.values()) for name, seconds in found.most_common(14)}


def _own(file: str) -> bool:
    return "/renderers/" in file and "/arrays" not in file


def worker(name: str, frames: int, library: str, folder: str) -> None:
    """Draw a frame for each line of the input; a line of JSON says what it took."""
    keep_memory()
    net, made = network(library), programs(name, frames)
    print("ready", flush=True)
    for line in sys.stdin:
        index = int(line)
        seconds, drawing = timed(net, copy.copy(made[index]))
        np.save(f"{folder}/{index}.npy", np.asarray(drawing.image))
        print(json.dumps([seconds, drawing.pairs, drawing.refined]), flush=True)


def compared(name: str, frames: int, library: str, checkout: str) -> None:
    """Frames of this checkout and of another in turn."""
    with tempfile.TemporaryDirectory(dir="/dev/shm") as folder:
        sides = []
        for at, root in enumerate((str(Path(__file__).parents[1]), checkout)):
            out = Path(folder, str(at))
            out.mkdir()
            sides.append(
                subprocess.Popen(
                    [
                        *(sys.executable, __file__, "--worker", str(out), "--frames", str(frames)),
                        *("--library", library, "--scene", name),
                    ],
                    env={**os.environ, "PYTHONPATH": root, "OMP_NUM_THREADS": "1"},
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    text=True,
                )
            )
        for side in sides:
            side.stdout.readline()  # type: ignore[union-attr]
        taken: list[list[float]] = [[], []]
        worst, most = 0.0, 0
        for index in range(frames + 1):
            least = [float("inf")] * 2
            for turn in range(2 * ROUNDS):
                at, side = turn % 2, sides[turn % 2]
                side.stdin.write(f"{index}\n")  # type: ignore[union-attr]
                side.stdin.flush()  # type: ignore[union-attr]
                seconds = json.loads(side.stdout.readline())[0]  # type: ignore[union-attr]
                least[at] = min(least[at], seconds)
            for found, seconds in zip(taken, least, strict=True):
                found.append(seconds)
            ours, theirs = (np.load(f"{folder}/{at}/{index}.npy") for at in (0, 1))
            off = abs(ours - theirs)
            worst, most = max(worst, float(off.max())), most + int((off.max(2) > 1 / 255).sum())
        for side in sides:  # type: ignore[assignment]
            side.stdin.close()  # type: ignore[union-attr]
            side.wait()
    now, before = (1e3 * statistics.median(side[1:]) for side in taken)
    ratio = statistics.median(b / a for a, b in list(zip(*taken, strict=True))[1:])
    print(
        f"{name}, {library}: {now:.2f} ms, before {before:.2f} ms, {ratio:.2f} times as fast; "
        f"worst pixel {255 * worst:.2f}/255, {most} pixels by more than 1/255",
        flush=True,
    )


def measured(name: str, frames: int, library: str) -> None:
    """A frame's time, its products, and shares."""
    keep_memory()
    net, made = network(library), programs(name, frames)
    each = sum(2 * w.shape[1] * w.shape[2] for w in net.decoder_w)
    rate, taken, pairs, refined, met = gemm_rate(), [], [], [], []
    for program in made:
        seconds, drawing = timed(net, program)
        taken.append(seconds)
        pairs.append(drawing.pairs)
        refined.append(drawing.refined)
        met.append(drawing.met)
    frame, count = statistics.median(taken[1:]), statistics.median(pairs[1:])
    floor = count * each / rate
    print(
        f"{name}, {library}: {1e3 * frame:.2f} ms; {count:,.0f} meetings, {count * each / 1e6:.0f} MFLOP, "
        f"floor {1e3 * floor:.2f} ms at {rate / 1e9:.0f} GFLOP/s, {floor / frame:.0%}; "
        f"{statistics.median(met[1:]):,.0f} pixels met, {statistics.median(refined[1:]):,.0f} refined"
    )
    print("  " + ", ".join(f"{part} {share:.0%}" for part, share in shares(net, made).items()), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--frames", type=int, default=12, metavar="N")
    parser.add_argument("--library", choices=("numpy", "torch"), default="numpy")
    parser.add_argument("--scene", action="append", choices=SCENES)
    parser.add_argument("--against", metavar="CHECKOUT")
    parser.add_argument("--worker", metavar="FOLDER", help=argparse.SUPPRESS)
    given = parser.parse_args()
    for name in given.scene or SCENES:
        if given.worker:
            worker(name, given.frames, given.library, given.worker)
        elif given.against:
            compared(name, given.frames, given.library, given.against)
        else:
            measured(name, given.frames, given.library)


if __name__ == "__main__":
    main()
