"""Light from everywhere beside path tracers: ``python -m lab bench light_rivals [FAMILY …]``.

Ours, Mitsuba 3, and the laboratory's compiled tracer of the same field, the last two with Intel's denoiser
too (colours and normals of 16 samples help it; with Mitsuba's they are its picture's own). All are warm:
libraries, compiled kernels, weights and Mitsuba's trees of triangles are there, and pictures are made from
there on, ours with its nodes. Rivals have two threads, ours as many as it takes by default. Ways are drawn
in turns, each with new seeds, and their least times kept. Each is held to its own converged picture; the
noise of Mitsuba's, as two halves tell it, is taken off its squared errors. With ``--orbits`` the camera goes
around scenes: flicker is how errors to traced pictures change from a frame to the next.
"""

from __future__ import annotations

import argparse
import itertools
import math
import time
from collections.abc import Callable, Mapping
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pyoidn

from lab.about import about, write_json
from lab.bench import mitsuba_light, mitsuba_scenes
from lab.docs.light_rivals import chart
from lab.light.families import FAMILIES, scene_text
from lab.light.field import world_of
from lab.light.measure import reference, scene_of
from lab.light.paths import traced_picture
from scenelang import render
from scenelang.drawing.image import encoded, from_light
from scenelang.drawing.metrics import flip, over_white, psnr

SEED, THREADS, TURNS = 2021, 2, 2
SPP = tuple(2**k for k in range(9))  # of Mitsuba
CLEANED = SPP[:6]  # and of what is denoised
PATHS = tuple(8 << k for k in range(3))  # of a pixel, of the compiled tracer
HALF = 256  # spp of each half of Mitsuba's converged picture
SIZE, ORBIT_PATHS, FEW = 96, 256, 16  # of orbits
FRAMES, PAIRS = 48, (0, 16, 32)  # and the first frames of pairs that are traced
APART = (4, 6, 7, 9, 10, 11, 2, 3)  # scenes of mist without a medium in another object, which Mitsuba lacks
Picture = np.ndarray[Any, Any]  # (H, W, 3), encoded


def denoised(light: np.ndarray, albedo: np.ndarray, normal: np.ndarray, clean: bool = False) -> np.ndarray:
    parts = (np.ascontiguousarray(part, np.float32) for part in (light, np.clip(albedo, 0, 1), normal))
    found: np.ndarray = pyoidn.denoise(*parts, hdr=True, clean_aux=clean)
    return found


def traced_by(scene: Any, spp: int, seed: int) -> np.ndarray:
    return np.array(mi.render(scene, seed=mi.UInt32(seed), spp=spp))


def held(draw: Callable[[int], Picture], truth: Picture, noise: float = 0.0) -> Callable[[int], list[float]]:
    """From a seed to seconds, processor seconds, squared error (less ``noise``) and FLIP of a picture."""

    def measured(seed: int) -> list[float]:
        wall, cpu = time.perf_counter(), time.process_time()
        picture = draw(seed)
        took = time.perf_counter() - wall, time.process_time() - cpu
        return [*took, max(float(np.mean((picture - truth) ** 2)) - noise, 1e-6), flip(picture, truth)]

    return measured


def ways_of(family: str, index: int, size: int, cache: Path | None) -> tuple[dict[str, Any], dict[str, Any]]:
    """Ways to draw a scene, by their names, and facts."""
    text = scene_text(family, SEED, index, size)
    program, graph = scene_of(text)
    stage, world = graph.stage, world_of(graph)
    assert stage is not None
    known = reference(text, graph, 512, THREADS, cache, f"{family}-{SEED}-{size}-{index:03}")
    ours = over_white(from_light(known.mean, program.background is None))
    theirs, guided = mitsuba_light.exported(graph), mitsuba_light.exported(graph, guides=True)
    halves = [encoded(traced_by(theirs, HALF, 1000 + seed)[..., :3]) for seed in (0, 1)]
    truth, noise = (halves[0] + halves[1]) / 2, float(np.mean((halves[0] - halves[1]) ** 2) / 4)
    albedo, normal = np.split(traced_by(guided, 16, 7)[..., -6:], 2, axis=2)

    def guarded(spp: int, seed: int) -> Picture:
        found = traced_by(guided, spp, seed)
        return encoded(denoised(found[..., :3], found[..., -6:-3], found[..., -3:]))

    def same(paths: int, clean: bool, seed: int) -> Picture:
        batch = max(paths // 2, 4)
        how: dict[str, Any] = {"paths": paths, "batch": batch, "seed": seed + 1, "threads": THREADS}
        light = np.moveaxis(traced_picture(world, stage, graph.canvas, **how).mean[:3], 0, 2)
        return encoded(denoised(light, albedo, normal, True) if clean else light)

    ways = {
        f"ours {pace}": held(lambda _, pace=pace: over_white(render(program, samples=pace)), ours)
        for pace in ("adaptive", "one")
    }
    ways |= {
        f"Mitsuba {n}": held(lambda s, n=n: encoded(traced_by(theirs, n, s)[..., :3]), truth, noise)
        for n in SPP
    }
    ways |= {f"Mitsuba denoised {n}": held(partial(guarded, n), truth, noise) for n in CLEANED}
    for n in PATHS:
        ways[f"same field {n}"] = held(partial(same, n, False), ours)
        ways[f"same field denoised {n}"] = held(partial(same, n, True), ours)
    facts = {"family": family, "scene": index, "own": round(known.decibels, 2)}
    facts |= {"theirs_own": round(-10 * np.log10(noise), 2), "alike": round(psnr(truth, ours), 2)}
    return ways, facts


def seconds_to(rows: Mapping[str, Mapping[str, float]], name: str, wanted: float, unit: str) -> float:
    """When a way is as near as ``wanted`` decibels, linear in log time between its settings, and beyond them
    by the last two.
    """
    own = [row for key, row in rows.items() if key.rpartition(" ")[0] == name]
    near, far = np.maximum.accumulate([row["psnr"] for row in own]), np.log([row[unit] for row in own])
    if near[-1] >= wanted:
        return float(np.exp(np.interp(wanted, near, far)))
    slope = (far[-1] - far[-3]) / max(near[-1] - near[-3], 1e-3)
    return float(np.exp(far[-1] + slope * (wanted - near[-1])))


def measured(family: str, index: int, size: int, cache: Path | None) -> dict[str, Any]:
    """Figures of a scene's ways."""
    ways, facts = ways_of(family, index, size, cache)
    found: dict[str, list[list[float]]] = {name: [] for name in ways}
    for turn in range(TURNS + 1):
        for name, draw in ways.items():
            setting = name.split()[-1]
            if turn < 2 or not setting.isdigit() or int(setting) <= 16:  # long ones are timed once
                found[name].append(draw(turn + 1))
    rows = {}
    for name, each in found.items():
        wall, cpu, square, near = np.array(each[1:]).T  # the first turn warms
        errors = -10 * np.log10(square.mean()), near.mean()
        values = dict(zip(("s", "cpu_s", "psnr", "flip"), (wall.min(), cpu.min(), *errors), strict=True))
        rows[name] = {key: round(float(v), 4) for key, v in values.items()}
    own = rows["ours adaptive"]
    for name in ("Mitsuba", "Mitsuba denoised", "same field", "same field denoised"):
        for unit in ("s", "cpu_s"):
            facts[f"{name}, {unit}"] = round(seconds_to(rows, name, own["psnr"], unit) / own[unit], 2)
        quick = {k: row for k, row in rows.items() if k.rpartition(" ")[0] == name}
        best = max((r for r in quick.values() if r["s"] <= own["s"]), key=lambda r: r["psnr"], default=None)
        facts[f"{name}, in our time"] = best or {"least": min(row["s"] for row in quick.values())}
    return facts | {"ways": rows}


def change(a: np.ndarray, b: np.ndarray) -> float:
    """Root mean square of a difference, of 255."""
    return 255 * float(np.sqrt(np.mean((a - b) ** 2)))


def orbit(family: str, cache: Path | None) -> dict[str, float]:
    """Mean and worst change between neighbouring frames, and of pairs that are traced."""
    scene = FAMILIES[family](np.random.default_rng([77, 3]))
    drawn, errors = list[np.ndarray](), dict[int, list[np.ndarray]]()
    for frame in range(FRAMES):
        turn = math.tau * frame / FRAMES
        eye = f"{5.8 * math.sin(turn):.6f}, 1.6, {5.8 * math.cos(turn):.6f}"
        text = f"nsg 1;\ncanvas({SIZE}, {SIZE});\ncamera([{eye}], [0, 0, 0], 38deg);\n{scene}"
        program, graph = scene_of(text)
        drawn.append(over_white(render(program, threads=THREADS)))
        if not {frame, frame - 1} & {*PAIRS}:
            continue
        known = reference(text, graph, ORBIT_PATHS, THREADS, cache, f"orbit-{family}-{frame:02}")
        truth = over_white(from_light(known.mean, program.background is None))
        assert graph.stage is not None
        how: dict[str, Any] = {"paths": FEW, "batch": FEW // 2, "seed": frame + 1, "threads": THREADS}
        light = traced_picture(world_of(graph), graph.stage, graph.canvas, **how).mean[:3]
        light = np.ascontiguousarray(np.moveaxis(light, 0, 2), np.float32)
        shown = drawn[-1], encoded(light), encoded(pyoidn.denoise(light, hdr=True))
        errors[frame] = [truth, *(picture - truth for picture in shown)]
    ours = [change(drawn[i - 1], drawn[i]) for i in range(FRAMES)]
    row = {"mean": float(np.mean(ours)), "worst": max(ours), "ours": np.mean([ours[i + 1] for i in PAIRS])}
    for k, name in enumerate(("traced", "flicker", "flicker_paths", "flicker_denoised")):
        row[name] = np.mean([change(errors[i][k], errors[i + 1][k]) for i in PAIRS])
    return {name: round(float(value), 3) for name, value in row.items()}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m lab bench light_rivals")
    parser.add_argument("families", nargs="*", default=["sky", "soft", "several", "mist"])
    parser.add_argument("--scenes", type=int, default=3, help="of each family")
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--cache", type=Path, help="of traced pictures")
    parser.add_argument("--chart", type=Path, default=Path("docs/pictures/light-rivals.png"))
    parser.add_argument("--orbits", action="store_true")
    parser.add_argument("-o", "--out", type=Path, default=Path("docs/results/light/rivals.json"))
    chosen = parser.parse_args()
    if chosen.orbits:
        rows = {family: orbit(family, chosen.cache) for family in chosen.families}
        write_json(chosen.out, about() | {"paths": ORBIT_PATHS, "few": FEW, "families": rows})
        return
    by, scenes = mitsuba_scenes.by_vectors(), list[dict[str, Any]]()
    for at, family in itertools.product(range(chosen.scenes), chosen.families):
        scenes.append(measured(family, APART[at] if family == "mist" else at, chosen.size, chosen.cache))
        print({key: value for key, value in scenes[-1].items() if key != "ways"}, flush=True)
        record = about() | {"mitsuba": by, "oidn": version("pyoidn"), "threads": THREADS, "scenes": scenes}
        write_json(chosen.out, record)
    chosen.chart.write_bytes(chart(scenes))


if __name__ == "__main__":
    main()
