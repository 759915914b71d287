"""Damaged Programs through the kernel: ``python -m fuzz.kernel [--count N] [--seed S]``, under sanitizers.

The library is built by gcc with AddressSanitizer and UndefinedBehaviorSanitizer, whose runtime has to be
loaded before Python: this starts itself once more with it. Programs are those of examples and of the
conformance suite, with numbers, tokens, elements and paints of rows changed. A finding ends the process.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fuzz.tensors import FLOATS
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Program, ProgramError
from scenelang.drawing.closed import field_of
from scenelang.drawing.kernel import Exchange, Kernel
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.tables import WAYS, page_row, tables_of
from scenelang.drawing.solid.march import MARCH_SETTINGS
from scenelang.drawing.solid.mist import Segment
from scenelang.drawing.tables import AROUND, NODE, Tables, stage_rows
from scenelang.language.evaluation import load
from scenelang.language.reports import SceneError

ROOT = Path(__file__).parents[1]
POINTS = 100  # asked of each Program


@np.errstate(all="ignore")
def mutated(program: Program, seed: int) -> Program:
    """A Program with some of its rows changed; raises `ProgramError` where it is none."""
    rng = np.random.default_rng(seed)
    vectors, tokens = program.vectors.copy(), program.tokens.copy()
    forms, worn = (np.array(part, np.int32) for part in (program.forms, program.worn))
    count = len(program)
    for _ in range(int(rng.integers(1, 4))):
        row, place, kind = int(rng.integers(count)), int(rng.integers(vectors.shape[1])), int(rng.integers(8))
        if kind < 2:
            vectors[row, place] = FLOATS[rng.integers(len(FLOATS))]
        elif kind == 2:
            vectors[row, place] = rng.normal() * 10.0 ** rng.integers(-6, 9)
        elif kind == 3:
            vectors[row] = vectors[rng.integers(count)] * rng.choice([1, -1, 1e-3, 1e3])
        elif kind == 4:
            vectors[:, place] *= rng.normal(size=count)
        elif kind == 5:
            tokens[row] = rng.integers(0, 128)
        elif kind == 6:
            tokens[rng.integers(count) :] &= 3
        else:
            forms[row] = rng.integers(-1, 1 + len(program.elements))
            worn[row] = rng.integers(-1, 1 + len(program.palette))
    return replace(program, vectors=vectors, tokens=tokens, forms=forms, worn=worn)


@np.errstate(all="ignore")
def ask(kernel: Kernel, program: Program, seed: int) -> None:
    """Ask for the field of a Program anywhere, rays, cones and light, or in the plane for pictures; raises
    `ProgramError` where it holds no scene.
    """
    rng = np.random.default_rng(seed)
    given = (program.vectors, program.tokens, program.brought(), program.paints())
    if program.stage is None:
        ask_plane(kernel, Field(field_of(program, seed % 3 == 0), *given), rng)  # type: ignore[arg-type]
        return
    tables = Tables(field_of(program, seed % 3 == 0), *given, reach=seed % 2 * 0.3)  # type: ignore[arg-type]
    p = (rng.normal(size=(3, POINTS)) * 10.0 ** rng.integers(-2, 3, POINTS)).astype(np.float32)
    some = rng.integers(0, POINTS, 3)
    p[rng.integers(0, 3, 3), some] = (np.inf, np.nan, 3e38)
    reach = np.array([0.0, 0.1, 3.0, np.inf], np.float32)[rng.integers(0, 4, POINTS)]
    found = kernel.field(tables, p, reach, *(rng.random(2) < 0.5).tolist())
    assert ((found.owner >= 0) & (found.owner <= len(program))).all()
    objects = rng.integers(0, len(program), POINTS)
    kernel.own(tables, objects, p)
    kernel.worn(tables, objects, p)
    way = rng.normal(size=(3, POINTS))
    way = (way / np.linalg.norm(way, axis=0)).astype(np.float32)
    limit = np.array([0.0, 1.0, 30.0, np.inf, np.nan], np.float32)[rng.integers(0, 5, POINTS)]
    gap, steps = float(rng.choice([0.0, 0.009, 1.0])), int(rng.choice([0, 3, 800]))
    for origin in (p, p[:, int(rng.integers(POINTS))]):
        trails = kernel.rays(tables, origin, way, limit, reach, gap=gap, steps=steps, parted=bool(seed % 2))
        assert (np.diff(trails.pieces["ray"]) >= 0).all()
    lamp, radius = rng.normal(size=3) * 10.0 ** rng.integers(-1, 2), float(rng.choice([0.0, 0.1, 3.0, 1e9]))
    kernel.cones(tables, lamp.astype(np.float32), radius, p, way)
    if program.stage is not None:
        width, height = rng.choice([1, 3, 7], 2).tolist()
        pace, glow = MARCH_SETTINGS["adaptive"]._replace(gap=gap), tables.looks.hues * tables.looks.glowing
        shown, (count, every) = [tables] * 2, (int(rng.choice([0, 4, 9, 289])), bool(rng.random() < 0.3))
        stage, (lamps, _) = stage_rows(
            program.stage, (width, height), pace, count, every and count > 0, glow, shown
        )
        stage["eye"], lamps["at"] = p[:, 0], p[:, 1 : 1 + len(lamps)].T
        kernel.shade(tables, stage, range(height))
    light_up(kernel, tables, p, way, rng)


@np.errstate(all="ignore")
def light_up(
    kernel: Kernel, tables: Tables, p: np.ndarray, way: np.ndarray, rng: np.random.Generator
) -> None:
    """Ask for light from everywhere at points (3, M), by nodes, lamps, discs and media of any numbers."""
    wild = 10.0 ** rng.integers(-3, 9)
    row, ground, near, counts = np.zeros((), AROUND), int(rng.integers(2, 5)), 5, rng.integers(1, 4, 3)
    nodes, sides, cells = np.zeros(9 + ground**2, NODE), rng.integers(2, 5, 3), 6 * int(counts.prod())
    for name in NODE.names or ():
        nodes[name] = rng.normal(size=nodes[name].shape) * wild
    given = {"node": nodes, "index": rng.integers(0, 9, (cells, near), np.int32)}
    given |= {"alike": rng.integers(0, 2, (cells, 16), np.uint8)}
    sizes = {"about": (cells, 7, 16), "lamp": (2, 7), "disc": (3, 10), "haze": (int(sides.prod()), 4)}
    given |= {name: (rng.normal(size=size) * wild).astype(np.float32) for name, size in sizes.items()}
    given["about"][:, :, near:] = 0
    values: dict[str, Any] = {
        "side": 0.5,
        "scale": 2.0,
        "warp": 4.5,
        "spacing": 0.3,
        "fade": 64.0,
        "first": 9,
        "near": near,
    }
    values |= {"nodes": len(nodes), "ground": ground, "grounded": 1, "floor": -1.0, "lamps": 2, "discs": 3}
    values |= {"steps": 3, "hollow": rng.integers(2)}
    values |= {name: part.ctypes.data for name, part in given.items()}
    if rng.random() < 0.5:
        del values["haze"]
    for name, value in (values | {"counts": counts, "sides": sides}).items():
        row[name] = value
    place = np.array([0.0, 1.0, np.inf, np.nan])[rng.integers(0, 4)]
    row["low"], row["corner"], row["horizon"] = place, place, wild
    begin, room = np.zeros(p.shape[1] + 1, np.int64), p.shape[1] * 3 * near
    parts = Exchange(begin, np.empty(room, np.int32), np.empty(room, np.float32))
    kernel.around(tables, row, p, way, way, 3, parts=parts)
    kernel.around(tables, row, p, way, way, 3, finer=True)
    kernel.arriving(tables, row, p, way, True)
    kernel.glowing(tables, row, p, way, float(rng.choice([0.0, 1.0, np.inf])), drawn=int(rng.integers(0, 34)))
    if "haze" in values:
        kernel.haze(tables, row, p, way, abs(p[0]))
    kernel.mirrored(p[:, 0], float(rng.choice([0.0, 0.5])), p, way, np.concatenate([p, way, p])[:7])
    view = np.array([*p[:, 0], *way[:, :3].T.reshape(-1), 20.0, 30.0, 40.0, 3.0, 4.0, 5.0], np.float32)
    rows, count = int(rng.choice([3, 6])), 20
    seen = (rng.normal(size=(count, 6 + 3 * rows)) * wild).astype(np.float32)
    kernel.between(p, way, view, seen)
    step, part = int(rng.integers(1, 5)), int(rng.integers(0, 3))
    kernel.evened(view, seen.T[:3], seen.T[3:6], seen.T[6:], step, part)
    here, light = (rng.random((count, size)).astype(np.float32) for size in (1, 4))
    far = int(rng.choice([-30, -7, -1, 1, 5, 19]))
    segment = Segment(0.1, here, here, light if rng.random() < 0.5 else None, light, here, far)
    kernel.passed_on(segment, light, light * np.float32(wild), light, 0 * light)
    objects = np.sort(rng.integers(0, int(tables.scene["objects"]), p.shape[1]))
    kernel.crossings(tables, objects, p, way, abs(p[1]), np.full(p.shape[1], 0.1))


def ask_plane(kernel: Kernel, field: Field, rng: np.random.Generator) -> None:
    """Ask for a picture, owners and states of a field of the plane; raises `ProgramError`."""
    tables = tables_of(field)
    canvas = int(rng.integers(1, 150)), int(rng.integers(1, 100))
    count, samples = int(rng.choice([4, 16])), str(rng.choice(WAYS))
    behind = rng.random(3) if rng.random() < 0.5 and samples != "owners" else None
    owners = samples == "owners"
    sides = canvas[::-1] if owners else (*canvas[::-1], 4 if behind is None else 3)
    out = np.empty(sides, np.int32 if owners else np.float32)
    kernel.plane(tables, page_row(canvas, count, samples, behind), range(canvas[1]), out)
    if owners:
        assert ((out >= 0) & (out <= len(field.tokens))).all()
    p = (rng.normal(size=(2, POINTS)) * 10.0 ** rng.integers(-2, 3, POINTS)).astype(np.float32)
    p[rng.integers(0, 2, 3), rng.integers(0, POINTS, 3)] = (np.inf, np.nan, 3e38)
    kernel.states(tables, p, float(rng.choice([0.0, 0.1, 9.0])))


def programs() -> list[Program]:
    """Programs of all scenes."""
    found = []
    for path in sorted([*ROOT.glob("examples/*.nsg"), *ROOT.glob("tests/conformance/cases/*.nsg")]):
        try:
            program = compile_scene(load(path))
        except SceneError:
            continue
        if len(program):
            found.append(program)
    return found


def run(library: Path, count: int, seed: int) -> None:
    """Mutate and ask so many times."""
    kernel, known = Kernel(library), programs()
    answered = 0
    for at in range(seed, seed + count):
        try:
            ask(kernel, mutated(known[at % len(known)], at), at)
            answered += 1
        except ProgramError:
            continue
    print(f"{count:,} Programs, {answered:,} of which the kernel answered for, nothing found")


def main() -> int:
    """Build the library, and start again with the sanitizers' runtime."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--library", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.library is not None:
        run(options.library, options.count, options.seed)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder, "libkernel.so")
        build = [sys.executable, str(ROOT / "kernel" / "build.py"), str(library), "--check"]
        subprocess.run(build, check=True)
        asked = [["gcc", f"-print-file-name={name}"] for name in ("libasan.so", "libubsan.so")]
        runtimes = [subprocess.check_output(each, text=True).strip() for each in asked]
        own = [sys.executable, "-m", "fuzz.kernel", "--library", str(library)]
        own += ["--count", str(options.count), "--seed", str(options.seed)]
        # Python itself leaks, and what it allocates is watched only without its own allocator
        kept = {"LD_PRELOAD": ":".join(runtimes), "ASAN_OPTIONS": "detect_leaks=0", "PYTHONMALLOC": "malloc"}
        return subprocess.run(own, env={**os.environ, **kept}, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
