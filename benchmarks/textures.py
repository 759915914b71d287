"""How much longer a frame takes with textures than with plain colours, drawn in turns in one process.

Processor time of one core, warm, frames of 256²; the least of all rounds counts.

    python -m benchmarks.textures [ROUNDS]
"""

from __future__ import annotations

import dataclasses
import sys
import time
from itertools import cycle, islice

import numpy as np
import torch

import scenelang as nsg
from scenelang.elements.textures import load_textures
from scenelang.models.framed import load_arrays
from scenelang.models.load import load_model
from scenelang.program.compile import compile_scene
from scenelang.program.paints import Paint
from scenelang.program.program import Program
from scenelang.renderers.draw import draw_objects

SCENES = {
    "a square": "square { scale(0.8); rotate(20deg); }",
    "four squares": """square { scale(0.5, 0.3); translate(-0.4, 0.5); } square { scale(0.4); }
        square { scale(0.3, 0.5); translate(0.5, 0.1); } square { scale(0.5); translate(0.2, -0.5); }""",
    "four deformed, a blend": """chain { square { scale(0.55); translate(-0.4, 0.4); twirl(1.2); }
        star { scale(0.7); translate(0.5, 0.4); twirl(1.2); }
        triangle { scale(0.6); translate(0.4, -0.4); bend(1); }
        smooth pentagon { scale(0.5); translate(-0.3, -0.3); twirl(1.2); } }""",
    "three solids": """torus { scale(1.1); rotate(60deg, axis = X); }
        sphere { scale(0.5); translate(1.3, -0.4, 0.6); }
        sphere { scale(0.6, 0.4, 0.6); translate(-1.3, -0.4, 0.4); }""",
    "two media": """sphere { material volumetric; rotate(30deg, axis = Y); }
        torus { scale(0.6); translate(1.4, -0.4, 0.6); material volumetric; }""",
    "a solid in a medium": "sphere { material volumetric; } torus { scale(0.9); rotate(50deg, axis = X); }",
}  # fmt: skip


def textured(program: Program) -> Program:
    """The same with the textures that ship, every second one with its hue shifted."""
    found = load_textures().values()
    palette = [Paint(element, (("hue", 0.1),) if at % 2 else ()) for at, element in enumerate(found)]
    worn = tuple(islice(cycle(palette[:: max(1, len(palette) // 5)]), len(program)))
    shown = tuple(dict.fromkeys(worn))
    elements = tuple(dict.fromkeys(paint.element for paint in shown))
    index = np.array([shown.index(paint) for paint in worn], np.int32)
    return dataclasses.replace(program, elements=elements, palette=shown, worn=index)


def main() -> None:
    """Print milliseconds and ratios."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 15
    torch.set_num_threads(1)
    for name, text in SCENES.items():
        plain = compile_scene(nsg.loads(text))
        both = plain, textured(plain)
        for library in ("numpy", "torch"):
            network = (
                load_arrays(plain.model).network if library == "numpy" else load_model(plain.model).network
            )
            least = [float("inf")] * 2
            for _ in range(rounds):
                for at, program in enumerate(both):
                    started = time.process_time()
                    draw_objects(network, program)
                    least[at] = min(least[at], time.process_time() - started)
            times = f"{least[0] * 1e3:7.1f} {least[1] * 1e3:7.1f} ms"
            print(f"{name:24} {library:6} {times}  {least[1] / least[0]:.2f}")


if __name__ == "__main__":
    main()
