"""Fitting: the values of a scene's params whose picture is nearest to a target.

A target's blur is fitted with the values. Otherwise sizes and colours would make up for it, and the nearest
picture would not be that of the true values.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

import numpy as np

from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.exact.mesh import FitError
from scenelang.drawing.how import Sampling
from scenelang.drawing.image import Image
from scenelang.drawing.metrics import UNCAPPED_DB
from scenelang.inverse import search
from scenelang.inverse.problem import LEVELS, FitProblem, Moment
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Axis, Source, literals_of, rewritten
from scenelang.language.reports import SceneError
from scenelang.language.scene import Scene

SIDES: Final = (32, 64, 128, 256)  # pixels along the shorter side, from coarse to fine
MOST_SOLID: Final = 128  # the same at most of solids, which take longer
MOST_TARGETS: Final = 64


def problems_of(
    moments: Sequence[Moment],
    goals: Sequence[search.TargetPicture],
    space: search.SearchBox,
    canvas: tuple[int, int],
) -> list[FitProblem]:
    """Comparisons of frames with their targets, from small to large; the last is of the final pictures."""
    values = space.values(space.point({}))
    solid = True in {_is_solid(each, values, canvas) for each in moments}
    smallest = min(min(goal.weights.shape) for goal in goals)
    short = min(MOST_SOLID if solid else SIDES[-1], *canvas, smallest)

    def compared(side: int, samples: Sampling, levels: int, soft: bool) -> FitProblem:
        size = max(1, round(canvas[0] * side / min(canvas))), max(1, round(canvas[1] * side / min(canvas)))
        return FitProblem(moments, space, goals, size, light=solid, soft=soft, samples=samples, levels=levels)

    sides = enumerate([*(side for side in SIDES if side < short), short])
    result = [compared(side, "adaptive" if at else "four", max(1, LEVELS - at), True) for at, side in sides]
    return result if solid else [*result, compared(short, "adaptive", 1, False)]


def _is_solid(moment: Moment, values: Mapping[str, Any], canvas: tuple[int, int]) -> bool:
    """Return whether a scene is of solids; raises `FitError` where its pictures cannot be compared."""
    if (program := moment.program(values, canvas)) is None:
        raise SceneError(moment.trouble)
    manifest = load_manifest(program.model)
    if manifest.renderer not in ("framed", "solid"):
        fact = f"model `{manifest.name}` draws pictures of one size only"
        raise FitError(f"{fact}, and fitting needs small ones")
    return manifest.renderer == "solid"


WIDEST: Final = 8.0  # standard deviation, pixels
ENOUGH: Final = 1e-6  # least relative gain of a step; small, as most of the error may be noise


class Lens:
    """Blur of a target, fitted with the values as one more number of the search of the last size."""

    def __init__(self, problem: FitProblem, space: search.SearchBox, until: float) -> None:
        self.problem, self.space, self.until = problem, space, until
        self.finer = problem.finer()
        self._last: tuple[search.Found, search.Found, search.Blur] | None = None

    def followed(self, place: search.Found) -> tuple[search.Found, search.Blur]:
        """The place after a descent with blurred pictures, and the blur; the same place where none helps."""
        if self._last is None or self._last[0] is not place:
            self._last = place, *self._follow(place, (True, False))
        return self._last[1:]

    def noise(self, place: search.Found) -> bool:
        """Return whether the remaining difference is like noise, once the blur is taken into account."""
        result, blur = self.followed(place)
        return self.problem.noise(result.point, blur)

    def ended(self, places: Sequence[search.Found]) -> tuple[list[search.Found], search.Blur]:
        """Descend again from the places of a search, best first, with the blur of the first, if any."""
        first, blur = self.followed(places[0])
        if not blur.sigma:
            return list(places), blur
        near = (one for one in places[1:] if one.cost <= search.ALIKE * places[0].cost)
        others = [self._follow(one, (blur.light,))[0] for one in near]
        return [first, *sorted(others, key=lambda one: one.cost)], blur

    def _follow(self, place: search.Found, ways: Sequence[bool]) -> tuple[search.Found, search.Blur]:
        pictures = None if place.cost <= search.NEAR else self.problem.pictures(place.point)
        sigma = 0.0 if pictures is None else self.problem.blur(pictures)
        best = place, search.Blur()
        if not sigma:
            return best
        wide = search.SearchBox(self.space.knobs, Axis("blur", 0.0, WIDEST))
        start = np.append(place.point, sigma / WIDEST)
        for light in ways:
            if time.monotonic() > self.until:
                break
            residuals = partial(self._residuals, light)
            result = search.descend(residuals, wide, start, step=search.STEPS[-1], enough=ENOUGH)
            if result is not None and result.cost < best[0].cost:
                way = place.way + tuple(u[:-1] for u in result.way)
                ended = search.Found(result.point[:-1], result.cost, way)
                best = ended, search.Blur(WIDEST * float(result.point[-1]), light)
        return best

    def _residuals(self, light: bool, u: search.Point) -> search.Point | None:
        """Residuals at a point whose last number is the blur, as a share of `WIDEST`."""
        drawn = self.finer if light else self.problem
        result, blur = drawn.pictures(u[:-1]), search.Blur(WIDEST * float(u[-1]), light)
        if result is None:
            return None
        times = drawn.canvas[0] // self.problem.canvas[0]
        return self.problem.residuals([search.blurred(one, blur, times) for one in result])


TIED: Final = 0.9  # correlation from which two numbers explain each other
LEVEL: Final = 1 / 255
_UNSEEN: Final = 1e-4  # root mean square change over a whole range up to which the picture does not show it


@dataclass(frozen=True, slots=True)
class FittedNumber:
    """One fitted number, or one of a vector; its range and value are in base units."""

    label: str  # `k`, or `ink.2` of a vector
    low: float
    high: float
    value: float
    # change, in shares of its range, that changes the picture by 1/255 (root mean square of all channels);
    # inf where the picture does not show it, NaN where it is not known
    felt: float


@dataclass(frozen=True, slots=True)
class Fit:
    """Result of `scenelang.fit`."""

    text: str = field(repr=False)  # the scene with the values as defaults; comments and layout stay
    values: dict[str, str]  # as text of the language, by param
    psnr: float  # of the picture of ``text`` to the target in dB, over pixels that count; at most 100
    blur: search.Blur  # estimated blur of the target
    blurred_psnr: float  # PSNR of the picture after the same blur
    start_psnr: float  # PSNR of the picture before the search
    size: tuple[int, int]  # width and height of the pictures that were compared
    done: bool  # true where the search converged before the time was out
    notes: tuple[str, ...]  # obstacles to a nearer picture or a surer value, without a full stop
    numbers: tuple[FittedNumber, ...]  # continuous params and how sensitive the picture is to each
    tied: tuple[tuple[str, str, float], ...]  # pairs of their labels and their correlation, from `TIED` on
    others: tuple[dict[str, str], ...]  # values of other places whose pictures are about as near
    frames: int  # pictures that were drawn
    # pictures (H, W, 3) of that size, of several targets one below the other
    before: Image = field(repr=False)
    after: Image = field(repr=False)
    target: Image = field(repr=False)
    way: tuple[Scene, ...] = field(repr=False)  # from the start to the result, for `scenelang.animate`

    def told(self) -> list[str]:
        """The report, line by line."""
        felt = {one.label: one.felt for one in self.numbers}
        lines = [f"PSNR to the target {self.psnr:.1f} dB, before {self.start_psnr:.1f} dB (more is nearer)"]
        if self.blur.sigma:
            seen = "out of focus" if self.blur.light else "blurred, in sRGB"
            lines.append(
                f"the target is {seen}: after a blur of {self.blur.sigma:.2f} pixels the PSNR is "
                f"{self.blurred_psnr:.1f} dB"
            )
        for name, text in self.values.items():
            shares = [share for label, share in felt.items() if label.partition(".")[0] == name]
            said = ""
            if shares and not any(map(math.isnan, shares)):
                most = max(shares)
                said = f"  ± {most:.2%} of its range changes it by 1/255" if most < math.inf else "  not seen"
            lines.append(f"  {name} = {text}{said}")
        lines += [f"`{a}` and `{b}` explain each other here (correlation {r:.2f})" for a, b, r in self.tied]
        for other in self.others:
            said = ", ".join(f"{name} = {text}" for name, text in other.items())
            lines.append(f"about as near: {said}")
        return [*lines, *self.notes]

    def sheet(self) -> Image:
        """Before, after and target side by side."""
        gap = np.ones((self.target.shape[0], 4, 3), np.float32)
        parts = [np.asarray(part, np.float32) for part in (self.before, self.after, self.target)]
        return np.concatenate([parts[0], gap, parts[1], gap, parts[2]], 1).view(Image)


def numbers_of(
    space: search.SearchBox, u: search.Point, slopes: search.Matrix | None
) -> tuple[FittedNumber, ...]:
    """Value and sensitivity of each continuous axis."""
    result = []
    for at in np.flatnonzero(space.smooth).tolist():
        axis = space.axes[at]
        rate = 0.0 if slopes is None else float(np.linalg.norm(slopes[:, at]))
        share = math.nan if slopes is None else LEVEL / rate if rate > _UNSEEN else math.inf
        value = axis.low + float(u[at]) * (axis.high - axis.low)
        result.append(FittedNumber(axis.label, axis.low, axis.high, value, share))
    return tuple(result)


def ties(space: search.SearchBox, slopes: search.Matrix | None) -> tuple[tuple[str, str, float], ...]:
    """Pairs of axes whose effects on the picture are correlated, and the correlation."""
    if slopes is None:
        return ()
    seen = np.flatnonzero(np.linalg.norm(slopes, axis=0) > _UNSEEN)
    unit = slopes[:, seen] / np.linalg.norm(slopes[:, seen], axis=0)
    spread = np.linalg.inv(unit.T @ unit + 1e-6 * np.eye(len(seen)))  # equal columns would be singular
    size = np.sqrt(np.diag(spread))
    result = []
    for i in range(len(seen)):
        for j in range(i):
            r = float(spread[i, j] / (size[i] * size[j]))
            if abs(r) >= TIED:
                result.append((space.axes[seen[j]].label, space.axes[seen[i]].label, r))
    return tuple(result)


def hindrances(
    space: search.SearchBox,
    u: search.Point,
    numbers: Sequence[FittedNumber],
    psnr: float,
    done: bool,
    worst: tuple[str, search.Matrix],
    noise: bool,
) -> tuple[str, ...]:
    """Reasons why the picture is no nearer; ``worst`` and ``noise`` are those of `FitProblem`."""
    notes = []
    if not done:
        notes.append("not converged: the last rounds still found nearer pictures, or time was out")
    ends = np.flatnonzero(space.smooth & ~space.wraps & (np.minimum(u, 1 - u) < 1e-6)).tolist()
    notes += [f"`{space.axes[at].label}` is at an end of its range" for at in ends]
    unseen = [f"`{one.label}`" for one in numbers if math.isinf(one.felt)]
    if unseen:
        notes.append(f"the picture does not show {', '.join(unseen)} here, so any value would do")
    if psnr < GOOD_DB and noise:
        notes.append("what differs is like noise, of which no values come nearer")
    elif psnr < GOOD_DB:
        name, gap = worst
        rows, columns = (np.arange(length) for length in gap.shape)
        y, x = (gap.sum(1) @ rows / gap.sum(), gap.sum(0) @ columns / gap.sum())
        top, left = divmod(int(gap.argmax()), gap.shape[1])
        notes.append(
            f"no values that were tried come nearer: the scene differs from the target most at pixel "
            f"{left}, {top} of {gap.shape[1]} × {gap.shape[0]}{name}, on average around "
            f"{x:.0f}, {y:.0f}"
        )
    return tuple(notes)


GOOD_DB: Final = 35.0  # PSNR from which no note says where a picture differs
NEAREST_DB: Final = 45.0  # pictures this near count as alike however they differ


def fit(
    scene: str | os.PathLike[str] | SourceFile,
    target: search.Given | Mapping[int, search.Given],
    *,
    params: Iterable[str] = (),
    start: Mapping[str, Any] | None = None,
    fixed: Mapping[str, Any] | None = None,
    mask: search.Given | None = None,
    crop: tuple[int, int, int, int] | None = None,
    background: tuple[float, float, float] = search.WHITE,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    frame: int = 0,
    seed: int = 0,
    budget_s: float = 300.0,
    progress: search.Report = lambda what, done, count: None,
) -> Fit:
    """Find the values of params whose picture comes nearest to a target: ``fit("a.nsg", "a.png")``.

    Args:
        scene: the file, or its text, which then imports from ``root``.
        target: a picture (.png, .jpg), or an array (H, W, 3 or 4) of sRGB-encoded values in [0, 1]; several
            by their frames of an animation, as in ``{0: "a.png", 12: "b.png"}``.
        params: those to find, of the file itself; by default all that have a range. Colours need none.
        start: values to begin with, as for `scenelang.load`; by default the scene's.
        fixed: values of other params, which are kept.
        mask: a picture of the target's size, bright where its pixels count; of each, where there are several.
        crop: x, y, width and height of the part of each target that shows the scene.
        background: sRGB-encoded, behind what is transparent in the target and in the scene.
        model, root, frame: as for `scenelang.load`; the frame is that of a single target.
        seed: of where to look; the same seed finds the same, unless time was out.
        budget_s: nothing new is begun after so many seconds.
        progress: called with what is done, how much of it, and all.

    Returns:
        The result, also where its picture is not near.

    Raises:
        FitError: there is nothing to find, the target does not fit the scene, or no values give a picture.
        SceneError: the scene has errors.
        OSError: a file cannot be read.
    """
    until = time.monotonic() + budget_s
    start, fixed, diagnostics = start or {}, fixed or {}, Diagnostics()
    given = {"text": scene} if isinstance(scene, SourceFile) else {"path": scene}
    source = Source(**given, params=fixed, model=model, root=root).parsed(diagnostics)
    if diagnostics.errors:
        raise SceneError(diagnostics)
    targets = {int(at): one for at, one in target.items()} if isinstance(target, Mapping) else {frame: target}
    if not 0 < len(targets) <= MOST_TARGETS:
        raise FitError(f"{len(targets):,} targets, where 1 to {MOST_TARGETS} are compared")
    moments = [Moment(source, number) for number in sorted(targets)]
    evaluation, first_scene = moments[0].evaluated(start)
    space = search.space_of(evaluation, params, fixed)
    for name in start:
        if all(name != knob.name for knob in space.knobs):
            raise FitError(f"a start for `{name}`, which is not among the params to find")
    goals = [
        search.target_of(targets[each.frame], first_scene.canvas, mask=mask, crop=crop, under=background)
        for each in moments
    ]
    problems, first = problems_of(moments, goals, space, first_scene.canvas), space.point({})
    last = problems[-1]
    lens = Lens(last, space, until)
    places, done = search.solve(
        problems, space, first, seed=seed, until=until, noise=lens.noise, report=progress
    )
    if not places:
        raise FitError("no values that were tried give a picture")
    places, blur = lens.ended(places)
    best, every = places[0].point, [space.literals(place.point) for place in places]
    text = rewritten(moments[0].tree, {**literals_of(evaluation, fixed), **every[0]})
    after = last.drawn([each.reads(text).program({}, last.canvas) for each in moments])
    before = last.pictures(first)
    if after is None:
        raise FitError("the scene with the values that were found has no picture")
    soft = [search.blurred(one, blur) for one in after]
    soft_db = _db(last, soft)
    step = 2 * search.STEPS[min(len(problems), len(search.STEPS)) - 1]
    slopes = search.central(last.pixels, space, best, step, space.smooth)
    numbers = numbers_of(space, best, slopes)
    alike = max(search.ALIKE * places[0].cost, 10 ** (-NEAREST_DB / 10))
    return Fit(
        text=text,
        values=every[0],
        psnr=_db(last, after),
        blur=blur,
        blurred_psnr=soft_db,
        start_psnr=_db(last, before) if before is not None else -math.inf,
        size=last.canvas,
        done=done,
        notes=hindrances(space, best, numbers, soft_db, done, last.worst(soft), last.noise(best, blur)),
        numbers=numbers,
        tied=ties(space, slopes),
        others=tuple(own for place, own in zip(places[1:], every[1:], strict=True) if place.cost <= alike),
        frames=sum(problem.frames for problem in (*problems, lens.finer)),
        before=_image(after if before is None else before),
        after=_image(after),
        target=_image(last.colours),
        way=tuple(_scenes(moments[0], space, [first, *places[0].way, best])),
    )


def _scenes(moment: Moment, space: search.SearchBox, way: Sequence[search.Point]) -> Iterator[Scene]:
    for u in way:
        with suppress(SceneError):
            yield moment.evaluated(space.values(u))[1]


def _db(problem: FitProblem, pictures: Sequence[search.Picture]) -> float:
    """PSNR over the pixels that count."""
    off = problem.residuals(pictures)
    error = float(off @ off)
    return UNCAPPED_DB if error <= 0 else min(UNCAPPED_DB, -10 * math.log10(error))


def _image(pictures: Sequence[search.Picture]) -> Image:
    return np.concatenate(pictures).astype(np.float32).view(Image)
