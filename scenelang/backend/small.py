"""Small pictures are drawn by numpy, without waiting for torch to be imported.

Numpy on one core draws as fast as torch on one core. Torch has more cores and devices, and takes one to two
seconds to import; so a single picture is worth it from some amount of work on. That amount is counted from
the Program and never measured while drawing: the same Program is always drawn by the same library.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Literal, NamedTuple, Unpack

from scenelang.backend.closed import field_of
from scenelang.backend.load import load_of
from scenelang.backend.options import Care, Device, RenderError, Samples, keep_memory, threads_for
from scenelang.elements.element import credit_of
from scenelang.models.manifest import load_manifest
from scenelang.models.weights import ModelError
from scenelang.program.program import Program, ProgramError
from scenelang.renderers.draw import Drawing, Kept, draw_objects

MOST_MS: Final = 250.0
"""Work up to which numpy draws: a quarter of the least that importing torch was seen to take."""
_NS: Final = (4.3e6, 11e3, 11.0, 0.0, 3600.0)
"""Nanoseconds of a frame, an object, a pixel, a meeting and a pixel around bounds (`Load.row`).

`python -m lab bench work` fits them and `_SHARES` to the examples and random scenes on several canvases.
"""
_SHARES: Final[dict[Samples, float]] = {"four": 1.1, "one": 0.6, "draft": 0.45}
"""Of that, what other ways to sample take."""


class Drawer(NamedTuple):
    """Which library draws a picture, and the reason in words."""

    library: Literal["numpy", "torch"]
    why: str


def choose_drawer(
    program: Program, device: Device = "auto", samples: Samples = "adaptive", *, exact: bool = False
) -> Drawer:
    """Who draws a single picture: a function of the Program, and of where a caller wants it drawn.

    Args:
        device, samples: as of `How`.
        exact: whether formulas take the network's place.

    Raises:
        RenderError: there is no such model.
    """
    if exact:
        return Drawer("numpy", "formulas in the network's place")
    if device != "auto":
        return Drawer("torch", f"asked for by device {device}")
    try:
        renderer = load_manifest(program.model).renderer
    except KeyError:
        raise RenderError(f"unknown model `{program.model}`") from None
    if renderer == "solid":
        return Drawer("numpy", "solids are")
    if renderer != "framed":
        return Drawer("torch", f"a `{renderer}` network is large work for any picture")
    ms = work_ms(program, samples)
    numpy = ms <= MOST_MS
    bound = "at most" if numpy else "more than"
    return Drawer("numpy" if numpy else "torch", f"about {ms:,.0f} ms of work, {bound} {MOST_MS:.0f}")


def work_ms(program: Program, samples: Samples = "adaptive") -> float:
    """What drawing a Program takes on one core of the machine that was measured, in milliseconds."""
    row = load_of(program).row(skip=True)
    return _SHARES.get(samples, 1.0) * sum(n * ns for n, ns in zip(row, _NS, strict=True)) / 1e6


def draw_small(
    program: Program,
    *,
    kept: Kept | None = None,
    progress: Callable[[float], None] | None = None,
    threads: int | None = None,
    split: int | None = None,
    exact: bool = False,
    **care: Unpack[Care],
) -> Drawing:
    """Draw a Program by numpy, on one core, or solids, if they are large, on several.

    Args:
        program: of any size, for a model with a framed or a solids' network.
        kept: the picture before this one, of which tiles that show the same are taken over.
        threads, split: of solids, as for `scenelang.backend.neural.draw_program`.
        exact: ask formulas in place of the network.
        **care: ``samples``, as of `How`.

    Raises:
        RenderError: its model's weights are missing, it was compiled for others or by no compiler, or there
            are no formulas for it.
    """
    keep_memory()
    try:
        network = field_of(program, exact)
        if program.stage is None:
            threads = split = 1
        drawing = draw_objects(
            network,
            program,
            threads=threads or threads_for(program.canvas),
            split=split,
            kept=kept,
            progress=progress,
            **care,
        )
    except (ModelError, ProgramError) as error:
        raise RenderError(str(error)) from None
    drawing.image.credit = credit_of(program.elements)
    return drawing
