"""What a frame with a mesh costs beside one with a torus in its place, and what loading the mesh takes.

    python -m lab bench elements [-o docs/results/element-speed.json] [--rounds N]

Processor time of frames of 256² pixels on one thread, by numpy and by torch. Each round draws every scene
with a torus and with each mesh of `std/meshes`, one after the other; the least of all rounds counts. Loading
is what the first picture takes longer: to inflate the grid and refine it.
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import scenelang as nsg
from scenelang.backend.neural import draw_program, open_model
from scenelang.backend.small import draw_small
from scenelang.elements.pyramid import unpacked
from scenelang.elements.zoo import load_zoo
from scenelang.scene import library

MESHES = ("m.bunny", "m.teapot", "m.monkey")
SCENES = {
    "one, large": "SHAPE { scale(1.2); rotate(30deg, axis = X); material diffuse { color(#c96); } }",
    "beside others": """
      SHAPE { scale(0.7); rotate(40deg, axis = X + Y); material diffuse { color(#c96); } }
      sphere { scale(0.4); translate(1.1, -0.5, 0.4); material diffuse { color(#d04030); } }
      torus { scale(0.6); translate(-1.1, 0.2, 0); material diffuse { color(#4070e0); } }""",
    "three": """
      for (i in 0..2) {
        SHAPE { scale(0.6); rotate(40deg * i, axis = X + Y); translate(1.3 * i - 1.3, 0, 0);
          material diffuse { color(#c96); } }
      }""",
    "mist": "SHAPE { scale(0.9); rotate(30deg, axis = X); material volumetric { color(#c96); } }",
    "cut and twisted": """
      chain {
        SHAPE { twist(0.6); scale(0.9); material diffuse { color(#c96); } }
        subtract sphere { scale(0.5); translate(0.4, 0.4, 0.4); }
      }""",
}


def seconds(draw: Callable[[], object]) -> float:
    started = time.process_time()
    draw()
    return time.process_time() - started


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("-o", "--out", type=Path, default=Path("docs/results/element-speed.json"))
    parser.add_argument("--rounds", type=int, default=5)
    asked = parser.parse_args()
    model = open_model("solids3d", "cpu")
    ways: dict[str, Callable[[nsg.Program], object]] = {
        "numpy": lambda program: draw_small(program, threads=1),
        "torch": lambda program: draw_program(program, model, threads=1),
    }
    programs = {
        (scene, shape): nsg.compile(
            nsg.loads(f'import "std/meshes" as m; canvas(256, 256); {text.replace("SHAPE", shape)}')
        )
        for scene, text in SCENES.items()
        for shape in ("torus", *MESHES)
    }
    least: dict[tuple[str, str, str], float] = {}
    for _ in range(asked.rounds + 1):  # the first one loads
        for way, draw in ways.items():
            for key, program in programs.items():
                took = seconds(lambda draw=draw, program=program: draw(program))
                least[way, *key] = min(took, least.get((way, *key), np.inf))
    rows = {
        way: {
            scene: {
                "torus_ms": round(1e3 * least[way, scene, "torus"], 1),
                **{m: round(least[way, scene, m] / least[way, scene, "torus"], 2) for m in MESHES},
            }
            for scene in SCENES
        }
        for way in ways
    }
    path = library.find("std/meshes")
    assert path is not None
    loads = {
        name: round(1e3 * min(seconds(lambda e=element: unpacked(e)) for _ in range(3)), 1)
        for name, element in load_zoo(path).geometries.items()
    }
    made = {"machine": platform.machine(), "rounds": asked.rounds, "ratios": rows, "load_ms": loads}
    asked.out.write_text(json.dumps(made, indent=1) + "\n", "utf-8")
    for way, found in rows.items():
        for scene, row in found.items():
            print(f"{way:>6}  {scene:<16} {row}")
    print("load, ms:", loads)


if __name__ == "__main__":
    main()
