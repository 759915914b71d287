"""Residuals between the pictures of a scene's values and its targets, at a size."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from scenelang.assets.records import Record
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Program
from scenelang.drawing.how import Sampling
from scenelang.drawing.neural.draw import draw_objects
from scenelang.drawing.small import draw_small
from scenelang.inverse.gradient import Rates, SoftPlane, numbers_of, softened
from scenelang.inverse.search import Blur, Matrix, Picture, Point, SearchBox, TargetPicture, blurred, over
from scenelang.language import tree
from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile
from scenelang.language.evaluation import Evaluation, Source
from scenelang.language.reports import SceneError
from scenelang.language.scene import Scene

LEVELS: Final = 4  # of a pyramid: pixels, and means of 2, 4 and 8 pixels along each side
EDGE: Final = 2 ** (LEVELS - 1)  # side in pixels of the squares whose means the last level has
GRAIN: Final = 2.0  # most times the expected variance of means at which a difference counts as noise
BLURS: Final = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)  # standard deviations that are tried, pixels
SOFTER: Final = 0.98  # most of the error that a blur may leave to count as one


class Moment(Record, frozen=False):
    """A frame of a scene, to be run with other values of its params."""

    source: Source  # the scene, parsed, with values of params that are not searched
    frame: int = 0  # its number
    trouble: tuple[Diagnostic, ...] = ()  # of the last values that gave no scene

    def reads(self, text: str) -> Moment:
        """The same frame of another text, in which all params have their values."""
        file = SourceFile(self.tree.span.source.name, text)
        return Moment(replace(self.source, text=file, tree=None, params=None), self.frame)

    @property
    def tree(self) -> tree.File:
        assert self.source.tree is not None
        return self.source.tree

    def evaluated(self, values: Mapping[str, Any]) -> tuple[Evaluation, Scene]:
        """The scene of values of its params; raises `SceneError` where it has errors."""
        diagnostics = Diagnostics()
        params = {**self.source.values, **values}
        evaluation = replace(self.source, params=params).evaluation(diagnostics, frame=self.frame)
        scene, _ = evaluation.run(self.frame)
        if scene is None:
            raise SceneError(diagnostics)
        return evaluation, scene

    def program(self, values: Mapping[str, Any], canvas: tuple[int, int]) -> Program | None:
        """Compile the scene of values for a canvas; None where it has errors, which `trouble` then holds."""
        try:
            return compile_scene(self.evaluated(values)[1].sized(canvas))
        except SceneError as error:
            self.trouble = error.diagnostics
            return None


class FitProblem:
    """Residuals of the pictures of frames, all of one size (width, height), against their targets.

    With ``light`` pixels are means of linear light, as those of solids are. ``soft`` outlines of the plane
    are as wide as a pixel, and take one sample. One level of the pyramid compares pixels alone; more also
    sense outlines that do not overlap.
    """

    def __init__(
        self,
        moments: Sequence[Moment],
        space: SearchBox,
        targets: Sequence[TargetPicture],
        canvas: tuple[int, int],
        *,
        light: bool = False,
        soft: bool = False,
        samples: Sampling = "four",
        levels: int = LEVELS,
    ) -> None:
        self.moments, self.space, self.under = moments, space, targets[0].under
        self.canvas, self.light, self.samples, self.levels = canvas, light, samples, levels
        self.soft = soft and not light
        self.frames = 0  # drawn so far
        # colours (H, W, 3), and roots of the weights (H, W, 1), of each frame
        self.colours, weights = zip(*(target.sized(canvas, light) for target in targets), strict=True)
        self.roots = [np.sqrt(each / max(1e-9, each.mean()))[..., None] for each in weights]
        self._rates = [Rates(partial(self._program, at), space) for at in range(len(moments))]
        self._last: tuple[bytes, list[Program | None]] = b"", []

    def __call__(self, u: Point) -> Point | None:
        """Residuals (R,) of a point, whose squares sum to the mean of the sums of the frames."""
        result = self.pictures(u)
        return None if result is None else self.residuals(result, self.levels)

    def pixels(self, u: Point) -> Point | None:
        result = self.pictures(u)
        return None if result is None else self.residuals(result)

    def pictures(self, u: Point) -> list[Picture] | None:
        """The picture of each frame; None where values give no scene."""
        return self.drawn(self.programs(u))

    def drawn(self, programs: Sequence[Program | None]) -> list[Picture] | None:
        """The pictures (H, W, 3) of a Program of this canvas for each frame; None where one is None."""
        self.frames += len(programs)
        known = [program for program in programs if program is not None]
        return [self._drawn(program) for program in known] if len(known) == len(programs) else None

    def _drawn(self, program: Program) -> Picture:
        if self.soft:
            network = softened(program.model, 2 / min(self.canvas))
            return over(draw_objects(network, program, samples="one").image, self.under)
        return over(draw_small(program, samples=self.samples, threads=1).image, self.under)

    def finer(self) -> FitProblem:
        """The same with pictures, of the plane, of twice as many pixels along each side, as means of sRGB."""
        larger = copy.copy(self)
        larger.frames = 0
        if not self.light:
            larger.canvas, larger._last = (2 * self.canvas[0], 2 * self.canvas[1]), (b"", [])
        return larger

    def programs(self, u: Point) -> list[Program | None]:
        """Compile the scene of a point for each frame; the last Programs are cached."""
        if self._last[0] != u.tobytes():
            self._last = u.tobytes(), [self._program(at, u) for at in range(len(self.moments))]
        return self._last[1]

    def _program(self, at: int, u: Point) -> Program | None:
        return self.moments[at].program(self.space.values(u), self.canvas)

    def residuals(self, pictures: Sequence[Picture], levels: int = 1) -> Point:
        """Residuals (R,) of pictures, at so many levels of the pyramid."""
        return np.asarray(np.concatenate(self._gaps(pictures, levels)) / np.sqrt(len(pictures)))

    def _gaps(self, pictures: Sequence[Picture], levels: int) -> list[Point]:
        """Residuals of each frame, whose squares sum to the mean square errors of the levels."""
        every = zip(pictures, self.colours, self.roots, strict=False)
        return [_pyramid((picture - colours) * root, levels)[:, 0] for picture, colours, root in every]

    def slopes(self, u: Point) -> tuple[Matrix, npt.NDArray[np.bool_]] | None:
        """Derivatives (R, n) of the residuals, and of which axes (n,) there are; None where of none.

        A few compilations and one soft picture of each frame give them, however many params there are.
        Elements, textures, trees, solids, and axes along which objects come or go are left to differences.
        """
        rows, known, programs = [], np.ones(len(u), bool), self.programs(u) if self.soft else ()
        for program, given, root in zip(programs, self._rates, self.roots, strict=False):
            if program is None or not len(program) or program.elements or program.palette or program.extended:
                return None
            rates, axes = given.at(u, program)
            change = SoftPlane(program, self.under)(numbers_of(program), rates)[1].astype(np.float64)
            self.frames += 1
            height, width = change.shape[:2]
            rows.append(_pyramid((change * root[..., None]).reshape(height, width, -1), self.levels))
            known &= axes
        return (np.concatenate(rows) / np.sqrt(len(rows)), known) if rows else None

    def worst(self, pictures: Sequence[Picture]) -> tuple[str, Picture]:
        """Label of the frame whose picture is farthest off, empty of a single one, and its errors (H, W)."""
        every = zip(pictures, self.colours, self.roots, strict=True)
        gaps = [np.square((picture - colours) * root).sum(2) for picture, colours, root in every]
        at = int(np.argmax([gap.sum() for gap in gaps]))
        return f" of frame {self.moments[at].frame}" * (len(gaps) > 1), gaps[at]

    def noise(self, u: Point, blur: Blur = Blur()) -> bool:  # noqa: B008
        """Test for noise alone after a blur: its means over 8 x 8 pixels have a 64th of its variance."""
        pixels = means = 0.0
        pictures = [blurred(picture, blur) for picture in self.pictures(u) or ()]
        for picture, gap in zip(pictures, self._gaps(pictures, LEVELS), strict=True):
            left = np.square(gap)
            pixels += float(left[: picture.size].sum())
            means += float(left[-3 * math.prod(-(-side // EDGE) for side in self.canvas) :].sum())
        return bool(means * EDGE**2 <= GRAIN * pixels)

    def blur(self, pictures: Sequence[Picture]) -> float:
        """Standard deviation in pixels of the blur that brings pictures nearest; 0 where none helps."""
        best, result = SOFTER, 0.0
        for sigma in BLURS:
            left = self.residuals([blurred(one, Blur(sigma)) for one in pictures])
            share = float(left @ left) / max(1e-12, float(np.square(self.residuals(pictures)).sum()))
            if share < best:
                best, result = share, sigma
        return result


def _pyramid(gap: Picture, levels: int) -> Matrix:
    """Rows (R, n) of all pixels and channels of each level, of n pictures (H, W, 3 n), channels first."""
    parts: list[Matrix] = []
    for level in range(levels):
        if level:  # means of 2 x 2 pixels; the last row and column of an odd size stand twice
            x = np.pad(gap, ((0, gap.shape[0] % 2), (0, gap.shape[1] % 2), (0, 0)), mode="edge")
            gap = (x[::2, ::2] + x[1::2, ::2] + x[::2, 1::2] + x[1::2, 1::2]) / 4
        rows = gap.reshape(gap.shape[0] * gap.shape[1] * 3, -1)
        parts.append(rows / np.sqrt(len(rows)))
    return np.concatenate(parts)
