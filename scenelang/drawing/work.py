"""The work of a picture, counted from its Program before it is drawn, and how much of it there may be.

Work is counted by objects' bounds in the plane, and by few rays through solids, so that the same Program has
always the same. A picture of too much is drawn coarser, or not at all.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np

from scenelang.compiler.program import Program
from scenelang.drawing.how import LESS, RenderError, Samples
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.size import sized
from scenelang.drawing.solid.around import light_work
from scenelang.drawing.solid.draw import draw_solids
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.march import Work

PROBES: Final = (
    (4, 1 << 15),
    (16, 0),
)  # roots of the pixels of small pictures of solids, and work that is enough
MANY: Final = 1000  # objects of which each is asked; of more only some are
GRID: Final = 64  # cells of a canvas along each side, by which overlaps are counted
OVERLAID: Final = 0.25  # of what a pixel around bounds takes, for each object below it


class Load(NamedTuple):
    """Numbers that a frame's time depends on."""

    objects: int  # rows of the Program
    pixels: float  # of the canvas
    meetings: float  # pixels within objects' bounds, summed over objects; of solids, network evaluations
    # pixels around those bounds, summed likewise, for each four samples, and more where they overlap; of
    # solids, evaluations for a pixel times pixels of the canvas's shorter side, as outlines and shadows grow
    # with both
    outline: float
    light: float = 0.0  # evaluations for what comes from the sky, however many pixels there are

    def row(self, skip: bool) -> tuple[float, float, float, float, float]:
        """The terms of the sum; without skipping every object meets every pixel."""
        meetings = self.meetings if skip else float(self.objects * self.pixels)
        return 1.0, float(self.objects), float(self.pixels), meetings, self.outline


def load_of(program: Program, network: Any = None) -> Load:
    """The load of a Program, of solids by a very small picture of a network, by default the shipped one;
    `ModelError` if its weights are missing.
    """
    width, height = program.canvas
    if program.stage is not None:
        return _of_solids(program, network or load_arrays(program.model, program.weights).network)
    unit = min(width, height) / 2  # pixels of a world unit
    half = np.array([width, height], np.float64) / 2
    corners = np.clip(program.bounds.astype(np.float64).reshape(-1, 2, 2) * unit, -half, half)
    size = corners[:, 1] - corners[:, 0]  # (N, 2)
    outlines = np.minimum(2 * size.sum(1), 2 * half.sum())
    outline = (outlines.sum() + OVERLAID * _overlaid(corners, outlines, half)) * (program.samples / 4)
    return Load(len(program), width * height, float(size.prod(1).sum()), float(outline))


def _overlaid(corners: np.ndarray, outlines: np.ndarray, half: np.ndarray) -> float:
    """Pixels around bounds, no more than there are, times how many more bounds than one lie there: of corners
    (N, 2, 2) around the middle of a canvas, with outlines (N,).
    """
    side = 2 * half / GRID
    low = np.floor(corners[:, 0] / side + GRID / 2).clip(0, GRID - 1).astype(int)
    high = np.ceil(corners[:, 1] / side + GRID / 2).astype(int).clip(low + 1, GRID)
    each = np.stack([outlines, (corners[:, 1] - corners[:, 0]).prod(1) / side.prod()])
    each /= (high - low).prod(1)
    sums = np.zeros((GRID + 1, GRID + 1, 2))  # what changes from cell to cell
    for x, y, sign in ((low, low, 1), (high, low, -1), (low, high, -1), (high, high, 1)):
        np.add.at(sums, (x[:, 0], y[:, 1]), sign * each.T)
    around, depth = np.moveaxis(sums.cumsum(0).cumsum(1), 2, 0)
    return float((np.minimum(around, side.prod()) * (depth - 1).clip(0.0)).sum())


def _of_solids(program: Program, network: Any) -> Load:
    program = sized(program)  # as it is drawn
    (width, height), stage, pixels = program.canvas, program.stage, program.canvas[0] * program.canvas[1]
    assert stage is not None
    some = slice(None, None, -(-len(program) // MANY) or 1)
    brought, paints = program.brought()[some], program.paints()[some]
    tokens = program.tokens[some] if some.step == 1 else program.tokens[some] & 1
    field = SolidField(network, program.vectors[some], tokens, brought, paints)
    work = Work()
    for root, enough in PROBES:
        sides = [max(1, round(side * root / pixels**0.5)) for side in program.canvas]
        work = draw_solids(field, replace(stage, sky=None), tuple(sides), samples="one")[1]
        if work.met > enough:
            break
    each = some.step * work.met / (sides[0] * sides[1])
    light = (
        0.0 if stage.sky is None else some.step * light_work(field, stage, program.canvas, program.samples)
    )
    return Load(len(program), pixels, each * pixels, each * min(width, height), light)


_NS: Final = (1.8e6, 12e3, 5.0, 0.0, 100.0)
"""Nanoseconds of a frame, an object, a pixel, a meeting and a pixel around bounds (`Load.row`).

`python -m lab bench work` fits them and `_SHARES` to the examples and random scenes on several canvases.
"""
_SOLID_NS: Final = (6e6, 1e4, 600.0, 12.0, 0.0)
"""The like for solids."""
LIGHT_MS: Final = 2e-5  # for an evaluation of what comes from the sky
_SHARES: Final[dict[Samples, float]] = {"four": 1.1, "one": 0.6, "draft": 0.45}
"""Shares of that for other ways to sample."""
_REFINED: Final = 0.1, 6.0  # share of the pixels of solids that take all samples, and more along a side
_CARE: Final = 2.5  # evaluations for one of hasty ways to sample solids


def work_ms(program: Program, samples: Samples = "adaptive", load: Load | None = None) -> float:
    """Milliseconds to draw a Program on one core of the machine that was measured."""
    load, share, costs = load or load_of(program), _SHARES.get(samples, 1.0), _NS
    if program.stage is not None:
        often = 1 + program.samples * (_REFINED[0] + _REFINED[1] / load.pixels**0.5)
        ways = {"one": 1.0, "draft": 0.25, "quick": often, "four": _CARE * program.samples}
        share, costs = 1.0, _SOLID_NS
        load = load._replace(meetings=load.meetings * ways.get(str(samples), _CARE * often))
    return (
        share * sum(n * ns for n, ns in zip(load.row(True), costs, strict=True)) / 1e6 + LIGHT_MS * load.light
    )


BOUND_S, LEAST_S = 300.0, 45.0  # processor seconds that a picture of 256 x 256 may take, and the smallest
SURE: Final = 0.5  # of these; where more is foretold, a picture is drawn coarser
EASY: Final = 1 << 24  # objects times pixels and lamps of solids without a sky that never take long
FIRST: Final = 0.8  # of what is allowed, after which a picture is begun again, coarser
COARSER: Final = (1, 2, 4, 8)  # pixels across that one stands for
LATE: Final = 4  # of these, where a picture took longer than was foretold


def allowed_s(canvas: tuple[int, int]) -> float:
    """Processor seconds that a picture may take."""
    return LEAST_S + (BOUND_S - LEAST_S) * canvas[0] * canvas[1] / 256**2


def until_s(canvas: tuple[int, int], patient: bool = False, part: float = 1.0) -> float:
    """Processor seconds of the process when a part of the time of a picture that begins now is over."""
    return float("inf") if patient else time.process_time() + part * allowed_s(canvas)


class Plan(NamedTuple):
    """A way to draw a Program within bounds."""

    canvas: tuple[int, int]
    even: bool = False  # with even light in place of the sky's
    told: str = ""  # what is coarser than asked for, and why


def plan_of(program: Program, network: Any, samples: Samples = "adaptive") -> Plan:
    """The finest way for a network to draw a Program in the time that there is; `RenderError` if none is."""
    (width, height), stage, most = program.canvas, program.stage, SURE * allowed_s(program.canvas)
    lamps = 0 if stage is None or stage.sky is not None else 1 + len(stage.lights)
    if 0 < len(program) * width * height * lamps < EASY:
        return Plan(program.canvas)
    load, why = load_of(program, network), ""
    for even in (False, True)[: 1 + (load.light > 0)]:
        for across in COARSER:
            pixels, meetings, outline = (part / across**2 for part in load[1:4])
            part = Load(load.objects, pixels, meetings, outline, 0.0 if even else load.light)
            seconds = work_ms(program, samples, part) / 1e3
            why = why or f"about {seconds:,.0f} s of work, and {most:,.0f} are allowed"
            if seconds <= most:
                told = f"{why}: " if even or across > 1 else ""
                return _coarser(program, across, even, told)
    raise RenderError(f"{why} at {width} x {height}; {LESS}")


def late_plan(program: Program) -> Plan:
    """A coarser way for a Program that took longer than was foretold."""
    sky = program.stage is not None and program.stage.sky is not None
    return _coarser(program, LATE, sky, "more work than was foretold: ")


def _coarser(program: Program, across: int, even: bool, why: str) -> Plan:
    width, height = (-(-side // across) for side in program.canvas)
    how = f"drawn at {width} x {height}" + ", by even light in place of the sky's" * even
    return Plan((width, height), even, why and f"{why}{how}; --patient draws all of it")
