"""Growth of the time and memory of compiling with the number of objects.

``python -m lab bench compile [COUNT …]`` compiles flat scenes and scenes of composites, each in a fresh
process, and prints a table; ``--json FILE`` also writes it. Building the Scene is not counted.
"""

from __future__ import annotations

import argparse
import json
import random
import resource
import subprocess
import sys
import time

COUNTS = (100, 1_000, 10_000)
KINDS = ("flat", "composites", "nested")


def scene_of(kind: str, count: int):
    """A scene of ``count`` objects: in a row, in pairs of pentagon - star on a grid, or 100 groups deep."""
    from scenelang.language import scene as schema

    rng = random.Random(1)
    side = max(1, int((count / 2) ** 0.5 + 1))

    def leaf(geometry: str, size: float, x: float, y: float) -> schema.Object:
        flat = schema.Material(
            name="flat", ops=(schema.Color(rgb=(rng.random(), rng.random(), rng.random())),)
        )
        moves = (
            schema.Twirl(k=rng.uniform(-1, 1)),
            schema.Scale(x=size, y=size, z=size),
            schema.Rotate(angle=rng.uniform(0, 6)),
            schema.Translate(x=x, y=y),
        )
        return schema.Object(geometry=geometry, transforms=moves, material=flat)

    if kind == "flat":
        nodes = [leaf("star", 0.1, rng.uniform(-1, 1), rng.uniform(-1, 1)) for _ in range(count)]
        return schema.Scene(nodes=tuple(nodes))
    if kind == "composites":
        pairs = []
        for i in range(count // 2):
            x, y = 2 * (i % side + 0.5) / side - 1, 2 * (i // side + 0.5) / side - 1
            pair = leaf("pentagon", 0.8 / side, x, y), leaf("star", 0.5 / side, x, y)
            pairs.append(schema.Boolean(op="subtract", children=pair))
        return schema.Scene(nodes=tuple(pairs))
    depth, node = 100, None
    for _ in range(depth):
        children = [leaf("star", 0.1, rng.uniform(-1, 1), rng.uniform(-1, 1)) for _ in range(count // depth)]
        turn = schema.Rotate(angle=0.1)
        node = schema.Group(children=tuple([node, *children] if node else children), transforms=(turn,))
    return schema.Scene(nodes=(node,))


def measure(kind: str, count: int) -> dict[str, float | int | str]:
    """Seconds of the passes and of the whole compilation, best of three, and the growth of memory."""
    from scenelang.compiler.compile import compile_scene
    from scenelang.compiler.manifest import load_manifest
    from scenelang.compiler.passes import check_scene
    from scenelang.compiler.program import program_bytes
    from scenelang.language.diagnostics import Diagnostics

    manifest = load_manifest("shapes2d")
    scene = scene_of(kind, count)
    compile_scene(scene_of("flat", 1))  # imports are not what is measured
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    passes, whole = [], []
    for _ in range(3):
        start = time.perf_counter()
        check_scene(scene, None, Diagnostics(), manifest)
        middle = time.perf_counter()
        program = compile_scene(scene)
        passes.append(middle - start)
        whole.append(time.perf_counter() - middle)
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "kind": kind,
        "objects": count,
        "rows": len(program),
        "passes_ms": round(1e3 * min(passes), 1),
        "compile_ms": round(1e3 * min(whole), 1),
        "growth_mb": round((after - before) / 1024, 1),
        "peak_mb": round(after / 1024, 1),
        "file_kb": round(len(program_bytes(program)) / 1024, 1),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("counts", nargs="*", type=int, default=COUNTS)
    parser.add_argument("--json", metavar="FILE")
    parser.add_argument("--one", nargs=2, metavar=("KIND", "COUNT"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(options.one[0], int(options.one[1]))))
        return
    rows = []
    for kind in KINDS:
        for count in options.counts:
            child = [sys.executable, "-m", "lab.bench.compile", "--one", kind, str(count)]
            row = json.loads(subprocess.run(child, check=True, capture_output=True, text=True).stdout)
            if not rows:
                print("  ".join(f"{name:>10}" for name in row))
            print("  ".join(f"{value:>10}" for value in row.values()), flush=True)
            rows.append(row)
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump(rows, file, indent=1)


if __name__ == "__main__":
    main()
