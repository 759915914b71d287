"""Options of drawing, the error of drawing, and the process's memory and cores."""

from __future__ import annotations

import os
import sys
import time
from dataclasses import replace
from typing import Final, Literal, NamedTuple, TypedDict, TypeVar, cast, get_args

Backend = Literal["neural", "exact", "reference"]
Device = Literal["auto", "cpu", "cuda"]
Sampling = Literal["adaptive", "four", "quick", "one", "draft"]
Samples = Literal[Sampling, 4, 16]
T = TypeVar("T")


class RenderError(Exception):
    """Nothing can be drawn: no such device, no fitting weights, or a Program where a Scene is needed."""


class Care(TypedDict, total=False):
    """Fields of `How` that renderers take by these names, whichever library they use."""

    samples: Sampling
    patient: bool


class Options(TypedDict, total=False):
    """Fields of `How`, as calls take them by name."""

    samples: Samples
    backend: Backend
    device: Device
    threads: int | None
    patient: bool


class How(NamedTuple):
    """A way to draw pictures, alike for stills, films, sweeps and what is watched; `HELP` has its options.

    Args:
        backend: ``"neural"`` draws with the trained network, ``"exact"`` with formulas of the shapes in its
            place, all else alike, and ``"reference"`` a Scene by the exact definition, which knows no boolean
            rule and none of a model's limits.
        device: where torch runs the network, whatever the picture's size; with ``"auto"`` numpy draws solids
            and small stills, and torch others on CUDA where there is any.
        threads: tiles drawn at the same time; by default one for each 32,768 pixels, but no more than there
            are usable cores. Numpy draws the plane in one.
        samples: of a pixel: ``"four"`` as the language defines, ``"adaptive"``, four near outlines and one
            elsewhere, which looks the same, ``"one"``, which is faster and has hard edges, or ``"draft"``,
            one for each 2 x 2 pixels, enlarged. ``"quick"`` is ``"adaptive"`` with less care for solids:
            steps that may pass what is thinner than 0.04, as those of ``"one"`` and ``"draft"`` may. Of a
            scene with ``samples(16)`` four are sixteen; 4 and 16 are ``"adaptive"`` with so many, whatever
            the scene says.
        patient: draw all of it however long it takes. Else a picture of too much work is drawn coarser, or
            not at all: of more than 300 processor seconds at 256 x 256, and of less or more at other sizes.
    """

    backend: Backend = "neural"
    device: Device = "auto"
    threads: int | None = None
    samples: Samples = "adaptive"
    patient: bool = False

    def checked(self) -> How:
        """The same. Raises `ValueError` for other values, `RenderError` where two exclude each other."""
        for name, known in CHOICES.items():
            if str(value := getattr(self, name)) not in known:
                ways = ", ".join(f"`{way}`" for way in known)
                raise ValueError(f"unknown {name} `{value}`; there are {ways}")
        if self.threads is not None and self.threads < 1:
            raise ValueError(f"{self.threads} threads, where at least 1 is needed")
        if self.backend == "reference" and self.care["samples"] != "adaptive":
            raise RenderError("the reference always takes all samples of a pixel")
        if self.backend == "exact" and self.device == "cuda":
            raise RenderError("formulas are computed by numpy, not by device cuda")
        return self

    @property
    def care(self) -> Care:
        """The fields that renderers take."""
        given = self if self.number is None else self._replace(samples="adaptive")
        return cast("Care", {name: getattr(given, name) for name in Care.__annotations__})

    @property
    def number(self) -> int | None:
        """Number of a pixel's samples that overrides a scene's, if one does."""
        return int(self.samples) if str(self.samples).isdigit() else None

    def sampled(self, drawn: T) -> T:
        """A Scene, a Graph or a Program with the number of samples that overrides its own."""
        if self.number is None:
            return drawn
        if hasattr(drawn, "model_copy"):
            return cast("T", drawn.model_copy(update={"samples": self.number}))
        return replace(drawn, samples=self.number)  # type: ignore[type-var]


DEFAULT: Final = How()
CHOICES: Final = {
    "backend": get_args(Backend),
    "device": get_args(Device),
    "samples": tuple(map(str, get_args(Samples))),
}
HELP: Final = {
    "backend": "Draw with the trained network, with formulas of the shapes in its place (exact), or by the "
    "exact definition, which is slow (reference).",
    "device": "Device of torch; auto is CUDA where there is any, and numpy for solids or a small picture.",
    "threads": "Number of threads on the CPU.",
    "samples": "Samples of a pixel: four near outlines, four everywhere, four near strong outlines (solids), "
    "one, with hard edges, or one for each 2 x 2 pixels; or so many near outlines, whatever the scene says.",
    "patient": "Draw all of a picture that takes very long, which else is drawn coarser, or not at all.",
}  # The line of `--help` for each field of `How`

LESS: Final = "draw it smaller, with fewer objects or lamps, or with --patient"


class OutOfTime(RenderError):
    """The time that a picture may take is over."""


def check_time(until_s: float) -> None:
    """Raise `OutOfTime` where the process has used more than so many processor seconds."""
    if time.process_time() > until_s:
        raise OutOfTime(f"more work than was foretold, and than a picture may take; {LESS}")


KEEP_BYTES = 256 << 20
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # malloc.h


def keep_memory() -> bool:
    """Have glibc reuse blocks up to `KEEP_BYTES`, not page fault by page fault; False without glibc."""
    import ctypes

    try:
        if not sys.platform.startswith("linux") or not (os.confstr("CS_GNU_LIBC_VERSION") or ""):
            return False
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, ValueError):
        return False  # musl has neither the name nor the function
    return all(mallopt(option, KEEP_BYTES) == 1 for option in (_M_MMAP_THRESHOLD, _M_TRIM_THRESHOLD))


THREAD_PIXELS = 1 << 15
"""Pixels of a picture for each thread that draws it: smaller ones take as long as threads take to begin."""


def threads_for(canvas: tuple[int, int]) -> int:
    """Threads that a picture is drawn by unless a caller says how many."""
    return max(1, min(usable_cores(), canvas[0] * canvas[1] // THREAD_PIXELS))


def usable_cores() -> int:
    """Cores that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
