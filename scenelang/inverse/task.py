"""What is asked of a fit: params, and pictures to be compared from coarse to fine."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any, Final

from scenelang.backend.options import Samples
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.span import SourceFile
from scenelang.evaluate.evaluation import Source
from scenelang.evaluate.ranges import literals_of
from scenelang.fitting.mesh import FitError
from scenelang.inverse.problem import LEVELS, Moment, Problem
from scenelang.inverse.several import Together
from scenelang.inverse.space import Point, Space, space_of
from scenelang.inverse.target import WHITE, Given, target_of
from scenelang.models.manifest import load_manifest
from scenelang.records import Record

SIDES: Final = (32, 64, 128, 256)  # of pictures from coarse to fine, pixels along the shorter side
MOST_SOLID: Final = 128  # of solids, which take longer
MOST_TARGETS: Final = 64


class Task(Record):
    """A scene, its params and what it is to look like.

    Args:
        problems: pictures of sizes from small to large; the last compare what is drawn in the end.
        space: the params that are searched.
        first: where they start.
        kept: the others that have been set, as text of the language.
    """

    problems: tuple[Together, ...]
    space: Space
    first: Point
    kept: dict[str, str]


def task_of(
    scene: str | os.PathLike[str] | SourceFile,
    target: Given | Mapping[int, Given],
    *,
    params: Iterable[str] = (),
    start: Mapping[str, Any] = {},
    fixed: Mapping[str, Any] = {},
    mask: Given | None = None,
    crop: tuple[int, int, int, int] | None = None,
    background: tuple[float, float, float] = WHITE,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    frame: int = 0,
) -> Task:
    """What `scenelang.fit`, whose arguments and errors these are, is to do."""
    found = Diagnostics()
    given = {"text": scene} if isinstance(scene, SourceFile) else {"path": scene}
    source = Source(**given, params=fixed, model=model, root=root).parsed(found)
    if found.errors:
        raise SceneError(found)
    targets = {int(at): one for at, one in target.items()} if isinstance(target, Mapping) else {frame: target}
    if not 0 < len(targets) <= MOST_TARGETS:
        raise FitError(f"{len(targets):,} targets, where 1 to {MOST_TARGETS} are compared")
    moments = [Moment(source, number) for number in sorted(targets)]
    evaluation, made = moments[0].evaluated(start)
    space = space_of(evaluation, params, fixed)
    for name in start:
        if name not in space.names:
            raise FitError(f"a start for `{name}`, which is not among the params to find")
    first = space.point({})
    solid = True in {_is_solid(each, space.values(first), made.canvas) for each in moments}
    goals = [
        target_of(targets[each.frame], made.canvas, mask=mask, crop=crop, under=background)
        for each in moments
    ]
    smallest = min(min(goal.weights.shape) for goal in goals)
    short = min(MOST_SOLID if solid else SIDES[-1], *made.canvas, smallest)
    sides = [side for side in SIDES if side < short] + [short]

    def compared(side: int, samples: Samples, levels: int, soft: bool) -> Together:
        canvas = _sized(made.canvas, side)
        return Together(
            [
                Problem(each, space, goal, canvas, light=solid, soft=soft, samples=samples, levels=levels)
                for each, goal in zip(moments, goals, strict=True)
            ]
        )

    problems = [
        compared(side, "adaptive" if at else "four", max(1, LEVELS - at), True)
        for at, side in enumerate(sides)
    ]
    if not solid:
        problems.append(compared(short, "adaptive", 1, False))
    return Task(tuple(problems), space, first, literals_of(evaluation, fixed))


def _is_solid(moment: Moment, values: Mapping[str, Any], canvas: tuple[int, int]) -> bool:
    """Whether a scene is of solids, if it has pictures that can be compared."""
    program = moment.program(values, canvas)
    if program is None:
        raise SceneError(moment.trouble)
    manifest = load_manifest(program.model)
    if manifest.renderer not in ("framed", "solid"):
        raise FitError(
            f"model `{manifest.name}` draws pictures of one size only, and fitting needs small ones"
        )
    return manifest.renderer == "solid"


def _sized(canvas: tuple[int, int], side: int) -> tuple[int, int]:
    factor = side / min(canvas)
    return max(1, round(canvas[0] * factor)), max(1, round(canvas[1] * factor))
