"""`scenelang.fit`: a scene's params from a picture."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, Final

import numpy as np

from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.span import SourceFile
from scenelang.evaluate.ranges import rewritten
from scenelang.fitting.mesh import FitError
from scenelang.image import Image
from scenelang.inverse import search
from scenelang.inverse.fitted import Fit, hindrances, numbers_of, ties
from scenelang.inverse.focus import Lens
from scenelang.inverse.problem import Moment
from scenelang.inverse.search import Found
from scenelang.inverse.several import Together
from scenelang.inverse.space import Point, Space
from scenelang.inverse.target import WHITE, Blur, Given, Picture, blurred
from scenelang.inverse.task import Task, task_of
from scenelang.measure.metrics import UNCAPPED_DB
from scenelang.scene.schema import Scene

Progress = Callable[[str, int, int], None]
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
    until = time.monotonic() + budget_s
    task = task_of(
        scene, target, params=params, start=start or {}, fixed=fixed or {}, mask=mask, crop=crop,
        background=background, model=model, root=root, frame=frame,
    )  # fmt: skip
    lens = Lens(task.problems[-1], task.space, until)
    places, done = search.solve(
        task.problems,
        task.space,
        task.first,
        seed=seed,
        until=until,
        noise=lens.noise,
        report=progress,
    )
    if not places:
        raise FitError("no values that were tried give a picture")
    return _fit(task, lens, *lens.ended(places), done)


def _fit(task: Task, lens: Lens, places: list[Found], blur: Blur, done: bool) -> Fit:
    """What there is to say of the places that a search came to, and of the target's blur."""
    space, problems, first = task.space, task.problems, task.first
    last, best = problems[-1], places[0].point
    every = [space.literals(place.point) for place in places]
    moment = last.parts[0].moment
    text = rewritten(moment.tree, {**task.kept, **every[0]})
    after = last.drawn([part.moment.reads(text).program({}, last.canvas) for part in last.parts])
    before = last.pictures(first)
    if after is None:
        raise FitError("the scene with the values that were found has no picture")
    near = _db(last, after)
    soft = [blurred(one, blur) for one in after]
    step = 2 * search.STEPS[min(len(problems), len(search.STEPS)) - 1]
    slopes = search.central(last.pixels, space, best, step, space.smooth)
    numbers = numbers_of(space, best, slopes)
    others = [
        literals
        for place, literals in zip(places[1:], every[1:], strict=True)
        if place.cost <= max(search.ALIKE * places[0].cost, 10 ** (-NEAREST_DB / 10))
    ]
    return Fit(
        text=text,
        values=every[0],
        psnr=near,
        blur=blur,
        blurred_psnr=_db(last, soft),
        start_psnr=_db(last, before) if before is not None else -math.inf,
        size=last.canvas,
        done=done,
        notes=hindrances(
            space, best, numbers, _db(last, soft), done, last.worst(soft), last.noise(best, blur)
        ),
        numbers=numbers,
        tied=ties(space, slopes),
        others=tuple(others),
        frames=sum(problem.frames for problem in (*problems, lens.finer)),
        before=_image(after if before is None else before),
        after=_image(after),
        target=_image([part.colours for part in last.parts]),
        way=tuple(_scenes(moment, space, [first, *places[0].way, best])),
    )


def _scenes(moment: Moment, space: Space, way: Sequence[Point]) -> Iterator[Scene]:
    """The scenes of places that have one."""
    for u in way:
        with suppress(SceneError):
            yield moment.evaluated(space.values(u))[1]


def _db(problem: Together, pictures: Sequence[Picture]) -> float:
    """PSNR over the pixels that count."""
    off = problem.residuals(pictures)
    error = float(off @ off)
    return UNCAPPED_DB if error <= 0 else min(UNCAPPED_DB, -10 * math.log10(error))


def _image(pictures: Sequence[Picture]) -> Image:
    return np.concatenate(pictures).astype(np.float32).view(Image)
