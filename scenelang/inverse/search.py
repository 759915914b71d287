"""The nearest picture: a look around, then descents from the best places, from coarse to fine.

A point holds a number for each axis: of a continuous one in [0, 1], of others the index of a choice. A vector
has an axis for each of its numbers. A descent is Levenberg's and Marquardt's (1944, 1963); J'J measures how
sensitive the picture is to each param.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain, product
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from PIL import Image as pillow
from PIL import ImageOps

from scenelang.assets.files import read_regular
from scenelang.assets.records import Record
from scenelang.drawing.exact.mesh import FitError
from scenelang.drawing.exact.outline import opened
from scenelang.drawing.image import decoded, encoded
from scenelang.language.evaluation import (
    Axis,
    Evaluation,
    Knob,
    ParamError,
    knob_of,
    param_named,
    params_of,
    value_at,
    written,
)
from scenelang.language.values import Vec, unpack

Point = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
MOST_AXES: Final = 64


class SearchBox:
    """Box of the values of some params, and of other axes behind theirs."""

    def __init__(self, knobs: Sequence[Knob], *others: Axis) -> None:
        self.knobs = tuple(knobs)
        self.axes = (*(axis for knob in knobs for axis in knob.axes), *others)
        # of n axes: true where one is continuous; its largest number, 1 or the last index of a choice; true
        # where it is an angle over a full turn
        self.smooth = np.array([not axis.choices for axis in self.axes], bool)
        self.most = np.array([max(1, len(axis.choices) - 1) for axis in self.axes], np.float64)
        self.wraps = np.array([axis.wraps for axis in self.axes], bool)

    def inside(self, u: Point) -> Point:
        """The nearest point of the box; full turns are taken off."""
        return np.where(self.wraps, u % 1.0, np.clip(u, 0.0, self.most))

    def gap(self, u: Point, v: Point) -> Point:
        """Distance between two points along each axis, in shares of its range."""
        gap = abs(u - v) / self.most
        return np.where(self.wraps, np.minimum(gap, 1.0 - gap), gap)

    def values(self, u: Point) -> dict[str, Any]:
        """Values of the params at a point, in the types of the language."""
        result, rest = {}, iter(zip(self.axes, u.tolist(), strict=True))
        for knob in self.knobs:
            items = [value_at(*next(rest), knob.value) for _ in knob.axes]
            result[knob.name] = Vec(tuple(items)) if knob.inner else items[0]
        return result

    def literals(self, u: Point) -> dict[str, str]:
        """Values at a point, as text of the language."""
        values = self.values(u)
        return {knob.name: written(knob, values[knob.name]) for knob in self.knobs}

    def point(self, values: Mapping[str, Any]) -> Point:
        result: list[float] = []
        for knob in self.knobs:
            value = values.get(knob.name, knob.value)
            items = value.items if knob.inner else (value,)
            result += [_where(axis, item) for axis, item in zip(knob.axes, items, strict=True)]
        return self.inside(np.array(result, np.float64))


def _where(axis: Axis, value: Any) -> float:
    def plain(value: Any) -> Any:
        if value.__class__ is Vec:
            return tuple(map(plain, value.items))
        return value if isinstance(value, bool | str) else round(unpack(value)[0], 9)

    if axis.choices:
        known = [plain(choice) for choice in axis.choices]
        return float(known.index(plain(value))) if plain(value) in known else 0.0
    width = axis.high - axis.low
    return (unpack(value)[0] - axis.low) / width if width > 0 else 0.0


def space_of(evaluation: Evaluation, names: Iterable[str] = (), fixed: Iterable[str] = ()) -> SearchBox:
    """The box of params: those of ``names``, or all with a range, without ``fixed``; raises `FitError`."""
    try:
        named = [param_named(evaluation, name) for name in dict.fromkeys(names)]
        chosen = named or [stmt for stmt in params_of(evaluation).values() if stmt.range is not None]
        excluded = set(fixed)
        left = [stmt for stmt in chosen if stmt.name.text not in excluded]
        space = SearchBox([knob_of(stmt, evaluation.context) for stmt in left])
    except ParamError as error:
        raise FitError(str(error)) from None
    if not space.axes:
        raise FitError("no param to fit: give one a range, as in `param k = 0.5 in 0..1;`, or name some")
    if len(space.axes) > MOST_AXES:
        raise FitError(f"{len(space.axes)} numbers to fit, where at most {MOST_AXES} are")
    return space


Picture = npt.NDArray[np.float64]
Given = npt.NDArray[np.floating] | str | os.PathLike[str]  # a picture as an argument
MOST_BYTES: Final = 64 << 20
_ASPECT: Final = 0.02  # most relative difference of aspects, beyond which a picture shows another part
WHITE: Final = (1.0, 1.0, 1.0)


class TargetPicture(Record):
    """Picture to compare with, and the weights of its pixels."""

    colours: Picture  # (H, W, 3), sRGB-encoded in [0, 1], laid over ``under`` where it was transparent
    weights: Picture  # (H, W), in [0, 1]: how much a pixel counts
    under: tuple[float, float, float] = WHITE  # behind what is transparent, in the target and in the scene

    def sized(self, canvas: tuple[int, int], light: bool) -> tuple[Picture, Picture]:
        """Colours and weights on a canvas; ``light`` has the means of linear light, as solids' pixels are."""
        colours = decoded(self.colours) if light else self.colours
        channels = [_resized(channel, canvas) for channel in np.moveaxis(colours, 2, 0)]
        result = np.stack(channels, 2)
        return encoded(result) if light else result, _resized(self.weights, canvas)


def _resized(channel: Picture, canvas: tuple[int, int]) -> Picture:
    """Means over areas where it becomes smaller, linear between pixels where it becomes larger."""
    smaller = canvas[0] <= channel.shape[1]
    how = pillow.Resampling.BOX if smaller else pillow.Resampling.BILINEAR
    image = pillow.fromarray(np.ascontiguousarray(channel, np.float32))
    return np.asarray(image.resize(canvas, how), np.float64)


def over(picture: npt.NDArray[np.floating], under: tuple[float, float, float]) -> Picture:
    """Colours (H, W, 3) of a picture that may have straight alpha."""
    values = np.asarray(picture, np.float64)
    if values.shape[2] == 3:
        return values
    return np.asarray(values[..., :3] * values[..., 3:] + np.array(under) * (1 - values[..., 3:]))


class Blur(NamedTuple):
    """Blur of a picture."""

    sigma: float = 0.0  # standard deviation of a Gaussian, pixels; 0 without a blur
    light: bool = True  # blurs linear light, as a lens out of focus does; else the sRGB-encoded numbers


def blurred(picture: Picture, blur: Blur, finer: int = 1) -> Picture:
    """A picture (H, W, 3) after a blur, with its edges repeated; one pixel is the mean of ``finer`` ** 2."""
    sigma = blur.sigma * finer
    if sigma <= 0.0 and finer == 1:
        return picture
    result, reach = decoded(picture) if blur.light else picture, math.ceil(3 * sigma)
    weights = np.exp(-np.square(np.arange(-reach, reach + 1) / max(sigma, 1e-9)) / 2)
    for axis in (0, 1):
        wide = np.pad(result, [(reach * (at == axis),) * 2 for at in range(3)], mode="edge")
        views = np.lib.stride_tricks.sliding_window_view(wide, len(weights), axis)
        result = np.asarray(views @ (weights / weights.sum()))
    height, width = result.shape[0] // finer, result.shape[1] // finer
    result = result.reshape(height, finer, width, finer, 3).mean((1, 3))
    return encoded(result) if blur.light else result


def target_of(
    picture: Given,
    canvas: tuple[int, int],
    *,
    mask: Given | None = None,
    crop: tuple[int, int, int, int] | None = None,
    under: tuple[float, float, float] = WHITE,
) -> TargetPicture:
    """A target for scenes of a canvas (width, height); arguments and errors are those of `scenelang.fit`."""
    result = over(_read(picture), under)
    weights = np.ones(result.shape[:2]) if mask is None else over(_read(mask), (0.0, 0.0, 0.0)).mean(2)
    if weights.shape != result.shape[:2]:
        sizes = [f"{part.shape[1]} × {part.shape[0]}" for part in (weights, result)]
        raise FitError(f"a mask of {sizes[0]} pixels for a target of {sizes[1]}")
    if crop is not None:
        x, y, wide, high = crop
        if x + wide > result.shape[1] or y + high > result.shape[0]:
            raise FitError(f"a part that leaves the target of {result.shape[1]} × {result.shape[0]} pixels")
        result, weights = result[y : y + high, x : x + wide], weights[y : y + high, x : x + wide]
    height, width = weights.shape
    if abs(width * canvas[1] / (height * canvas[0]) - 1) > _ASPECT:
        fact = f"a target of {width} × {height} pixels for a canvas of {canvas[0]} × {canvas[1]}"
        raise FitError(f"{fact}: say which part of it shows the scene, or give the scene another canvas")
    if not weights.any():
        raise FitError("a mask in which no pixel counts")
    return TargetPicture(result, weights, under)


def _read(picture: Given) -> npt.NDArray[np.floating]:
    if isinstance(picture, str | os.PathLike):
        data = read_regular(picture, MOST_BYTES)
        try:
            if len(data) > MOST_BYTES:
                raise FitError(f"a file of more than {MOST_BYTES >> 20} MiB")
            with opened(data) as file:
                kind = "RGBA" if file.has_transparency_data else "RGB"
                return np.asarray(ImageOps.exif_transpose(file).convert(kind), np.float64) / 255
        except FitError as error:
            raise FitError(f"{os.fspath(picture)}: {error}") from None
    if picture.ndim != 3 or picture.shape[2] not in (3, 4):
        raise FitError(f"a picture of shape {picture.shape}, not (height, width, 3 or 4)")
    return picture


Residuals = Callable[[Point], Point | None]
Report = Callable[[str, int, int], None]
Matrix = npt.NDArray[np.float64]

MANY: Final = 6  # numbers from which on derivatives by reverse passes cost less than differences
APART: Final = 0.02  # least distance of two solutions, in shares of a range
LOOKS: Final = 48  # places that a round looks at, times n + 1 of n numbers
SCANS: Final = 16  # places along an axis
DESCENTS: Final = 4  # n more of the best places are followed down
KEPT: Final = 3  # best places that go on to larger pictures
ROUNDS: Final = 4
STEPS: Final = 0.01, 0.006, 0.003, 0.002, 0.002  # of differences, shares of a range, in pictures of each size
FINE: Final = 1 / 3  # of these steps, for central differences where nothing else helps
ALIKE: Final = 1.26  # errors that differ by 1 dB
FAIR: Final = 1e-3  # 30 dB: farther off, a round without success is tried again
NEAR: Final = 10**-4.6  # mean square error that is near enough: 46 dB
AGREED: Final = 0.02  # least relative gain of a round, or it confirms those before
_TRIES: Final = 6  # steps that may fail in a row
_ENOUGH: Final = 1e-3  # least relative gain of a step
_GRAIN: Final = 1e-7  # mean square error below which a difference is invisible


class Found(Record):
    """A place that a search reached."""

    point: Point  # its coordinates
    cost: float  # sum of squares of the residuals there
    way: tuple[Point, ...] = ()  # earlier points, each nearer than the one before in pictures of its size

    def after(self, before: Found) -> Found:
        """The same place with the way of an earlier one in front of its own."""
        return Found(self.point, self.cost, before.way + self.way)


def spread(space: SearchBox, count: int, seed: int) -> Iterator[Point]:
    """Points all over the box, moved by a seed: the generalised golden ratio's sequence (Roberts 2018)."""
    n = len(space.axes)
    phi = 2.0  # becomes the root of x^(n + 1) = x + 1, the golden ratio for n = 1
    for _ in range(50):
        phi = (1 + phi) ** (1 / (n + 1))
    step, first = phi ** -np.arange(1.0, n + 1), np.random.default_rng(seed).random(n)
    choices = np.array([max(1, len(axis.choices)) for axis in space.axes])
    for index in range(1, count + 1):
        u = (first + index * step) % 1.0
        yield np.where(space.smooth, u, np.floor(u * choices))


def slopes(
    residuals: Residuals, space: SearchBox, u: Point, at: Point, step: float, free: Mask, fine: bool = False
) -> Matrix:
    """Derivatives (R, n) of residuals (``at`` u), 0 of axes not free; steps are in shares of a range."""
    result = np.zeros((len(at), len(u)))
    # gives (R, n), and a mask (n,) of the axes that it knows; or None
    by_passes = getattr(residuals, "slopes", None)
    if np.count_nonzero(free) >= MANY and by_passes is not None and (exact := by_passes(u)) is not None:
        result, free = exact[0], free & ~exact[1]
    if fine and free.any() and (better := central(residuals, space, u, step * FINE, free)) is not None:
        return np.where(free, better, result)
    for axis in np.flatnonzero(free):
        sign = -1.0 if u[axis] + step > 1.0 and not space.wraps[axis] else 1.0
        moved = u.copy()
        moved[axis] += sign * step
        if (there := residuals(space.inside(moved))) is not None:
            result[:, axis] = (there - at) / (sign * step)
    return result


def central(residuals: Residuals, space: SearchBox, u: Point, step: float, free: Mask) -> Matrix | None:
    """Derivatives (R, n) of residuals by central differences, 0 of axes that are not free."""
    columns: dict[int, Point] = {}
    for axis in np.flatnonzero(free).tolist():
        move = step * (np.arange(len(u)) == axis)
        low, high = space.inside(u - move), space.inside(u + move)
        one, other = residuals(low), residuals(high)
        if one is None or other is None:
            return None
        columns[axis] = (other - one) / (2 * step if space.wraps[axis] else high[axis] - low[axis])
    none = np.zeros_like(next(iter(columns.values()), np.zeros(0)))
    return np.stack([columns.get(axis, none) for axis in range(len(u))], 1) if columns else np.zeros((0, 0))


def descend(
    residuals: Residuals,
    space: SearchBox,
    u: Point,
    *,
    step: float,
    most: int = 12,
    fine: bool = False,
    enough: float = _ENOUGH,
) -> Found | None:
    """Follow the continuous axes down from a point, ``most`` steps; None where that has no picture.

    Differences take a ``step`` in shares of a range; ``fine`` ones are central: twice the pictures, but they
    follow a narrow valley that others lose. The first step of less relative gain than ``enough`` is the last.
    """
    if (at := residuals(u)) is None:
        return None
    cost, damping = float(at @ at), 1e-2
    way: list[Point] = []
    for _ in range(most):
        if cost < _GRAIN or not space.smooth.any():
            break
        j = slopes(residuals, space, u, at, step, space.smooth, fine)
        pull = j.T @ at  # half the gradient of the cost
        # axes at an end of the box whose descent leads outwards
        ends = ~space.wraps & (((u <= 0.0) & (pull > 0)) | ((u >= 1.0) & (pull < 0)))
        free = np.flatnonzero(space.smooth & ~ends & (np.square(j).sum(0) > 1e-12))
        if not len(free):
            break
        square = j[:, free].T @ j[:, free]
        before = cost
        for _ in range(_TRIES):
            # Marquardt's scaling; the second term holds axes with almost no slope
            scale = np.diag(damping * np.diag(square) + 1e-9 * np.trace(square))
            move = np.zeros_like(u)
            move[free] = -np.linalg.solve(square + scale, pull[free])
            move *= min(1.0, 0.3 / max(1e-12, float(abs(move).max())))  # at most 0.3 of a range
            moved = space.inside(u + move)
            if (there := residuals(moved)) is not None and (lower := float(there @ there)) < cost:
                way.append(u)
                u, at, cost, damping = moved, there, lower, max(1e-6, damping / 5)
                break
            damping = min(1e6, damping * 6)
        if before - cost < enough * before:
            break
    return Found(u, cost, tuple(way))


def stepped(residuals: Residuals, space: SearchBox, start: Found, *, step: float) -> Found:
    """Try the neighbours of choices, and follow the continuous axes from each that is nearly as good."""
    best, better = start, True
    while better:
        better = False
        for axis in np.flatnonzero(~space.smooth):
            for move in (-1.0, 1.0):
                u = best.point.copy()
                u[axis] += move
                if not 0.0 <= u[axis] <= space.most[axis]:
                    continue
                result = descend(residuals, space, u, step=step, most=4)
                if result is not None and result.cost < best.cost * (1 - _ENOUGH):
                    best, better = result.after(best), True
    return best


def apart(space: SearchBox, places: list[Found], most: int) -> list[Found]:
    """The best distinct places, best first."""
    chosen: list[Found] = []
    for one in sorted(places, key=lambda one: one.cost):
        if all(float(space.gap(one.point, other.point).max()) > APART for other in chosen):
            chosen.append(one)
    return chosen[:most]


def scanned(coarse: Residuals, space: SearchBox, known: Found) -> list[Found]:
    """The best other valley along each axis: one of several things may be wrong while others are right."""
    result: list[Found] = []
    for axis in range(len(space.axes)):
        count = SCANS if space.smooth[axis] else min(SCANS, int(space.most[axis]) + 1)
        row: list[Found] = []
        for share in (np.arange(count) + 0.5) / count:
            u = known.point.copy()
            u[axis] = share if space.smooth[axis] else np.floor(share * (space.most[axis] + 1))
            there = coarse(u)
            row.append(Found(u, math.inf if there is None else float(there @ there)))
        costs = [one.cost for one in row]
        ends = [costs[-1], *costs, costs[0]] if space.wraps[axis] else [math.inf, *costs, math.inf]
        valleys = [
            one
            for one, before, after in zip(row, ends, ends[2:], strict=False)
            if one.cost <= min(before, after) and space.gap(one.point, known.point)[axis] > 1 / count
        ]
        result += sorted(valleys, key=lambda one: one.cost)[:1]
    return result


def look(
    coarse: Residuals, space: SearchBox, known: Sequence[Found], seed: int, until: float, report: Report
) -> list[Found]:
    """Look around in small pictures and descend from the best places, some of which may be known."""
    places = [*(one.point for one in known), *spread(space, LOOKS * (len(space.axes) + 1), seed)]
    seen: list[Found] = []
    for at, u in enumerate(places):
        if time.monotonic() > until and seen:
            break
        report("looking around", at, len(places))
        if (there := coarse(u)) is not None:
            seen.append(Found(u, float(there @ there)))
    low: list[Found] = []
    most = DESCENTS + len(space.axes)
    scans = (scanned(coarse, space, one) for one in known if math.isfinite(one.cost))
    picked = apart(space, seen, most) + apart(space, list(chain(*scans)), most)
    for at, one in enumerate(picked):
        if time.monotonic() > until and low:
            break
        report("coming near", at, len(picked))
        if (near_it := descend(coarse, space, one.point, step=STEPS[0])) is not None:
            low.append(near_it if space.smooth.all() else stepped(coarse, space, near_it, step=STEPS[0]))
    return low


def solve(
    problems: Sequence[Residuals],
    space: SearchBox,
    start: Point,
    *,
    seed: int = 0,
    until: float = math.inf,
    noise: Callable[[Found], bool] = lambda place: False,
    report: Report = lambda what, done, count: None,
) -> tuple[list[Found], bool]:
    """Distinct places with the nearest pictures, the best first, and whether the search converged by itself.

    Each round looks around, follows the best places down in the smallest pictures, and the best of these
    through larger ones. It ends when a picture is `NEAR` enough (a sum of squares), when nothing but
    ``noise`` is left, or when a round or two found none nearer. No descent is begun after the time ``until``.
    ``problems`` are residuals at sizes from small to large, those of the last by pixels alone.
    """
    coarse, best, idle = problems[0], math.inf, 0
    low: list[Found] = []  # that came near in the smallest pictures
    ended: list[Found] = []
    for turn in range(ROUNDS):
        before = list(low)
        low += look(coarse, space, ended or [Found(start, math.inf)], seed + turn, until, report)
        low = apart(space, low, KEPT)
        fresh = [one for one in low if not any(one is other for other in before)]
        for at, one in enumerate(fresh):
            for fine, (problem, step) in product((False, True), zip(problems[1:], STEPS[1:], strict=False)):
                if fine and (one.cost <= NEAR or one.cost > ALIKE * min(one.cost for one in [one, *ended])):
                    break
                report("looking closer", at, len(fresh))
                nearer = descend(problem, space, one.point, step=step, most=8, fine=fine)
                one = one if nearer is None else nearer.after(one)
            ended.append(one)
        ended = apart(space, ended, KEPT)
        was, best = best, min((one.cost for one in ended), default=math.inf)
        idle = idle + 1 if best > was * (1 - AGREED) else 0
        if best <= NEAR or (ended and noise(ended[0])) or idle >= (1 if best <= FAIR else 2):
            return ended, True
        if time.monotonic() > until:
            break
    return ended, False
