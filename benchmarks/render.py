"""How long a warm frame takes, and how far that is from what matrix products cost on the same core.

The roof counts the multiplications of the network only, at the rate of a large float32 matrix product on one
core, measured between the frames. It is out of reach: a network of 32 hidden units also moves, bends, clamps
and scatters, which no product does.

    python benchmarks/render.py [ROUNDS]
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from functools import partial

import torch
from startup import FOUR

import scenelang as nsg
from scenelang.backend.neural import draw_program, open_model, usable_cores
from scenelang.renderers.framed import Framed

SIDE = 768  # of the matrices of the roof
MANY = """for (i in 0..<200) {
  star { scale(0.08); rotate(7deg * i); translate(2 * rand(i) - 1, 2 * rand(i + 500) - 1); }
}"""
SCENES = {
    "4 objects, 256 x 256": FOUR,
    "4 objects, 1024 x 1024": "canvas(1024, 1024);" + FOUR,
    "200 objects, 256 x 256": MANY,
    "no object, 256 x 256": "",
}


def flop_per_pair(network: Framed) -> int:
    """Floating-point operations of the network's products for one sample that meets one object."""
    decoder: int = sum(2 * w.shape[1] * w.shape[2] for w in network.decoder_w)
    cell: int = 2 * network.cell_lines[0].numel()
    return decoder + cell


def seconds(work: Callable[[], object]) -> float:
    """Wall time of a call."""
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


def gemm_rate(rounds: int = 5) -> float:
    """Floating-point operations a second of a float32 matrix product on one core."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    a, b = torch.rand(SIDE, SIDE), torch.rand(SIDE, SIDE)
    best = min(seconds(lambda: a @ b) for _ in range(rounds))
    torch.set_num_threads(before)
    return float(2 * SIDE**3 / best)


def main() -> None:
    """Draw each scene warm with one thread and with all."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 15
    for name, text in SCENES.items():
        program = nsg.compile(nsg.loads(text))
        model = open_model(program.model)
        each = flop_per_pair(model.network)
        for threads in sorted({1, usable_cores()}):
            drawing = draw_program(program, model, threads=threads)
            taken, rates = [], []
            for _ in range(rounds):
                taken.append(seconds(partial(draw_program, program, model, threads=threads)))
                rates.append(gemm_rate(1))
            frame_s, rate = statistics.median(taken), statistics.median(rates)
            roof_s = drawing.pairs * each / rate / threads
            print(
                f"{name}, {threads} thread(s): {1e3 * frame_s:.1f} ms (best {1e3 * min(taken):.1f}), "
                f"{drawing.pairs:,} meetings, {drawing.pairs * each / 1e9:.2f} GFLOP, "
                f"roof {1e3 * roof_s:.1f} ms at {rate / 1e9:.0f} GFLOP/s a core, {roof_s / frame_s:.0%} of it"
            )


if __name__ == "__main__":
    main()
