"""`scenelang.fit`: a scene's params from a picture."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import numpy as np

from scenelang.backend.options import Samples
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.span import SourceFile
from scenelang.evaluate.evaluation import read_scene
from scenelang.evaluate.ranges import literals_of, rewritten
from scenelang.fitting.mesh import FitError
from scenelang.image import Image
from scenelang.inverse import search
from scenelang.inverse.fitted import Fit, felt, hindrances, numbers_of, ties
from scenelang.inverse.problem import LEVELS, Problem, Source
from scenelang.inverse.search import Found
from scenelang.inverse.several import Together
from scenelang.inverse.space import Point, Space, space_of
from scenelang.inverse.target import WHITE, Given, Picture, target_of
from scenelang.measure.metrics import UNCAPPED_DB
from scenelang.models.manifest import load_manifest
from scenelang.scene.schema import Scene
from scenelang.syntax import parse

Progress = Callable[[str, int, int], None]
SIDES: Final = (32, 64, 128, 256)  # of pictures from coarse to fine, pixels along the shorter side
MOST_TARGETS: Final = 64
MOST_SOLID: Final = 128  # of solids, which take longer
ALIKE: Final = 1.26  # errors that differ by 1 dB
NEAREST_DB: Final = 45.0  # pictures this near count as alike however they differ


def fit(
    scene: str | os.PathLike[str] | SourceFile,
    target: Given | Mapping[int, Given],
    *,
    params: Iterable[str] = (),
    start: Mapping[str, Any] | None = None,
    fixed: Mapping[str, Any] | None = None,
    mask: Given | None = None,
    crop: tuple[int, int, int, int] | None = None,
    background: tuple[float, float, float] = WHITE,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    frame: int = 0,
    seed: int = 0,
    budget_s: float = 300.0,
    progress: Progress = lambda what, done, count: None,
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
        What was found, also where it is not near.

    Raises:
        FitError: there is nothing to find, the target does not fit the scene, or no values give a picture.
        SceneError: the scene has errors.
        OSError: a file cannot be read.
    """
    until, found = time.monotonic() + budget_s, Diagnostics()
    text = scene if isinstance(scene, SourceFile) else read_scene(scene, found)
    tree = None if text is None else parse(text, found)
    if tree is None or found.errors:
        raise SceneError(found)
    targets = {int(at): one for at, one in target.items()} if isinstance(target, Mapping) else {frame: target}
    if not 0 < len(targets) <= MOST_TARGETS:
        raise FitError(f"{len(targets):,} targets, where 1 to {MOST_TARGETS} are compared")
    sources = [
        Source(
            tree, path=None if isinstance(scene, SourceFile) else Path(scene),
            root=None if root is None else Path(root), model=model, frame=number, fixed=fixed,
        )
        for number in sorted(targets)
    ]  # fmt: skip
    source = sources[0]
    evaluation, made = source.evaluated(start or {})
    space = space_of(evaluation, params, fixed or {})
    for name in start or {}:
        if name not in space.names:
            raise FitError(f"a start for `{name}`, which is not among the params to find")
    first = space.point({})
    solid = True in {_is_solid(each, space.values(first), made.canvas) for each in sources}
    goals = [
        target_of(targets[each.frame], made.canvas, mask=mask, crop=crop, under=background)
        for each in sources
    ]
    smallest = min(min(goal.weights.shape) for goal in goals)
    short = min(MOST_SOLID if solid else SIDES[-1], *made.canvas, smallest)
    sides = [side for side in SIDES if side < short] + [short]

    def compared(side: int, samples: Samples, levels: int, soft: bool) -> Together:
        canvas = _sized(made.canvas, side)
        return Together(
            [
                Problem(each, space, goal, canvas, light=solid, soft=soft, samples=samples, levels=levels)
                for each, goal in zip(sources, goals, strict=True)
            ]
        )

    problems = [
        compared(side, "adaptive" if at else "four", max(1, LEVELS - at), True)
        for at, side in enumerate(sides)
    ]
    if not solid:
        problems.append(compared(short, "adaptive", 1, False))
    places, done = search.solve(problems, space, first, seed=seed, until=until, report=progress)
    if not places:
        raise FitError("no values that were tried give a picture")
    return _fit(space, problems, first, places, done, literals_of(evaluation, fixed or {}))


def _is_solid(source: Source, values: Mapping[str, Any], canvas: tuple[int, int]) -> bool:
    """Whether a scene is of solids, if it has pictures that can be compared."""
    program = source.program(values, canvas)
    if program is None:
        raise SceneError(source.trouble)
    manifest = load_manifest(program.model)
    if manifest.renderer not in ("framed", "solid"):
        raise FitError(
            f"model `{manifest.name}` draws pictures of one size only, and fitting needs small ones"
        )
    return manifest.renderer == "solid"


def _sized(canvas: tuple[int, int], side: int) -> tuple[int, int]:
    factor = side / min(canvas)
    return max(1, round(canvas[0] * factor)), max(1, round(canvas[1] * factor))


def _fit(
    space: Space,
    problems: list[Together],
    first: Point,
    places: list[Found],
    done: bool,
    kept: Mapping[str, str],
) -> Fit:
    """What there is to say of the places that a search came to; ``kept`` are literals of fixed params."""
    last, best = problems[-1], places[0].point
    every = [space.literals(place.point) for place in places]
    source = last.parts[0].source
    text = rewritten(source.tree, {**kept, **every[0]})
    after = last.drawn([part.source.reads(text).program({}, last.canvas) for part in last.parts])
    before = last.pictures(first)
    if after is None:
        raise FitError("the scene with the values that were found has no picture")
    near = _db(last, after)
    slopes = felt(last.pixels, space, best, 2 * search.STEPS[min(len(problems), len(search.STEPS)) - 1])
    numbers = numbers_of(space, best, slopes)
    others = [
        literals
        for place, literals in zip(places[1:], every[1:], strict=True)
        if place.cost <= max(ALIKE * places[0].cost, 10 ** (-NEAREST_DB / 10))
    ]
    return Fit(
        text=text,
        values=every[0],
        psnr=near,
        start_psnr=_db(last, before) if before is not None else -math.inf,
        size=last.canvas,
        done=done,
        notes=hindrances(space, best, numbers, near, done, last.worst(after)),
        numbers=numbers,
        tied=ties(space, slopes),
        others=tuple(others),
        frames=sum(problem.frames for problem in problems),
        before=_image(after if before is None else before),
        after=_image(after),
        target=_image([part.colours for part in last.parts]),
        way=tuple(_scenes(source, space, [first, *places[0].way, best])),
    )


def _scenes(source: Source, space: Space, way: Sequence[Point]) -> Iterator[Scene]:
    """The scenes of places that have one."""
    for u in way:
        with suppress(SceneError):
            yield source.evaluated(space.values(u))[1]


def _db(problem: Together, pictures: Sequence[Picture]) -> float:
    """PSNR over the pixels that count."""
    off = problem.residuals(pictures)
    error = float(off @ off)
    return UNCAPPED_DB if error <= 0 else min(UNCAPPED_DB, -10 * math.log10(error))


def _image(pictures: Sequence[Picture]) -> Image:
    return np.concatenate(pictures).astype(np.float32).view(Image)
