"""Frames in the plane on a GPU beside those of one core, and how far their pictures are apart.

    python -m lab bench device [--frames N] [--scene NAME ...] [--warps N]

Medians of wall-clock time, each frame of a new Program. *Host* ends when the kernel is on its way, *kernel*
is its time by the device's clock, *frame* ends when the picture is back. Pictures are compared with four
samples a pixel of numpy. Without a GPU only the host's part is timed.
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np
import torch

from lab.bench.floor import SCENES, model_of, programs
from scenelang.drawing.neural import device
from scenelang.drawing.neural.draw import draw_objects
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.load import load_model

HERE = torch.cuda.is_available()
LAUNCH = device.launch


class Watched:
    """The launch, and when it was over on the host and on the device."""

    def __call__(self, programs: int, out: torch.Tensor, *arguments: object, **sizes: int) -> None:
        if HERE:
            self.first, self.last = (torch.cuda.Event(enable_timing=True) for _ in range(2))
            self.first.record()
            LAUNCH(programs, out, *arguments, **sizes)
            self.last.record()
        else:
            out.zero_()
        self.launched = time.perf_counter()

    def kernel_ms(self) -> float:
        """Milliseconds of the device, once it is done."""
        return float(self.first.elapsed_time(self.last)) if HERE else 0.0


def measured(name: str, frames: int) -> None:
    """One line for a scene."""
    model = model_of(name)
    net, host = load_model(model, "cuda" if HERE else "cpu").framed, load_arrays(model).network
    watched = device.launch = Watched()
    rows, worst, most = [], 0.0, 0
    for program in programs(name, frames):
        started = time.perf_counter()
        drawing = device.draw_on_device(net, program)
        ended = time.perf_counter()
        if drawing is None:
            raise SystemExit(f"{name}: not for the kernel")
        draw_objects(host, program)
        core = time.perf_counter() - ended
        rows.append((watched.launched - started, watched.kernel_ms() / 1e3, ended - started, core))
        if HERE:
            four = draw_objects(host, program, samples="four")
            off = abs(np.asarray(drawing.image) - np.asarray(four.image))
            worst, most = max(worst, float(off.max())), most + int((off.max(2) > 1 / 255).sum())
    to_launch, kernel, frame, core = (
        1e3 * statistics.median(column) for column in zip(*rows[1:], strict=True)
    )
    if HERE:
        print(
            f"{name}: host {to_launch:.2f} ms, kernel {kernel:.3f}, frame {frame:.2f}; numpy {core:.2f}, "
            f"{core / frame:.1f} times as long; worst pixel {255 * worst:.2f}/255, {most} by more than 1/255",
            flush=True,
        )
    else:
        print(f"{name}: host {to_launch:.2f} ms, nothing drawn; numpy {core:.2f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--frames", type=int, default=12, metavar="N")
    parser.add_argument("--scene", action="append", choices=SCENES)
    parser.add_argument("--warps", type=int, default=device.WARPS, metavar="N", help="of 32 threads, a block")
    given = parser.parse_args()
    device.WARPS = given.warps
    torch.set_num_threads(1)
    print(torch.cuda.get_device_name() if HERE else "no CUDA device: the host's part alone")
    for name in given.scene or SCENES:
        measured(name, given.frames)


if __name__ == "__main__":
    main()
