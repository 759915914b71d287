"""Residuals between the pictures of a scene's values and its targets, at a size, and how they change.

A pixel's four samples see an outline jump from one to the next: a picture of few pixels stays as it is while
a param moves a little. So for slopes one sample tells how much of its pixel is covered: the network's own
gates (those of union, subtraction and intersection, and the one that reads coverage) are made as wide as a
pixel. Nothing else of the network changes.

Two reverse passes tell how all pixels change with numbers of their own: one through the cell, by distances,
colours and widths of blends, and one through decoders and frames, of the few pixels that change with a
distance at all. Params that change different numbers are moved together (Curtis, Powell and Reid 1974).
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from scenelang.assets.records import Record
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.groups import SMOOTH, UNION
from scenelang.compiler.lifting import LAYOUTS, STRENGTHS, WIDTH
from scenelang.compiler.program import Program
from scenelang.drawing.arrays_torch import TORCH
from scenelang.drawing.how import Sampling
from scenelang.drawing.neural.draw import draw_objects
from scenelang.drawing.neural.field import BLEND
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.frames import FrameMap, FrameTurn
from scenelang.drawing.neural.load import Framed, load_model
from scenelang.drawing.neural.network import EMPTY, Cell, FramedArrays
from scenelang.drawing.small import draw_small
from scenelang.inverse.search import (
    WHITE,
    Blur,
    Matrix,
    Picture,
    Point,
    SearchBox,
    TargetPicture,
    blurred,
    over,
)
from scenelang.language import tree
from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile
from scenelang.language.evaluation import Evaluation, Source
from scenelang.language.reports import SceneError
from scenelang.language.scene import Scene


@lru_cache(maxsize=64)
def softened(name: str, width: float) -> FramedArrays:
    """A shipped model of the plane with gates that are at least so wide, world units."""
    network = load_arrays(name).network
    assert isinstance(network, FramedArrays)
    soft = copy.copy(network)
    cell = Cell(*network.cell_weights())
    unit = float(np.linalg.norm(cell.candidate[UNION, 0]))  # growth of the state per world unit
    # coverage rises from 0 to 1 over 4 / exp(slope) of the state: make that at least the width
    soft.read_slope = np.float32(min(float(network.read_slope), math.log(4 / (unit * width))))
    features = network.config.features
    steep = np.linalg.norm(cell.lines[..., :features], axis=-1)  # (TOKENS, S + L), per world unit
    soft.cell_gain = network.cell_gain - np.log(np.maximum(1.0, steep * width)).astype(np.float32)
    return soft


PAIRS: Final = 1 << 18  # of an object and a pixel at a time
_LEAST: Final = 1e-30  # of a square, whose root has no derivative at 0


class _Parts(NamedTuple):
    """Numbers of N objects and of the background, or n rates of these."""

    geometry: Tensor  # geometry vectors, and behind them how far leaves grow and their shells (N, G + 2, n)
    colours: Tensor  # (N, 3, n)
    widths: Tensor  # of the blends by which objects join (N, n)
    clear: Tensor  # 1 - opacities (N, n)
    behind: Tensor  # colour of the background (3, n)


class SoftPlane:
    """Soft picture of a plain Program of the plane by its numbers, over the sRGB-encoded colour ``under``."""

    def __init__(
        self, program: Program, under: tuple[float, float, float] = WHITE, dtype: torch.dtype = torch.float32
    ) -> None:
        (width, height), self.dtype = program.canvas, dtype
        px, count = 2 / min(width, height), len(program)
        self.network = network = _network(program.model, px, dtype)
        self.layout = layout = network.layout
        self.canvas, self.count = program.canvas, count
        tokens = program.tokens.astype(np.int64)
        self.cell = [part[tokens][..., None] for part in network.cell_weights()]
        self.smooth, self.union = (torch.from_numpy(tokens == token) for token in (SMOOTH, UNION))
        parts = layout.unpack(program.vectors)
        self.late = torch.from_numpy(parts.order % 2).to(dtype)[:, None]  # of leaves that grow behind a shell
        self.widest = float(parts.width[tokens == SMOOTH].max(initial=BLEND))
        codes, self.shapes = np.unique(parts.code, axis=0, return_inverse=True)
        self.decoders = network.decoders(torch.from_numpy(codes).to(dtype))
        self.albedo = network.object_albedo(torch.from_numpy(parts.material.copy()).to(dtype))
        self.under = None if program.background else torch.tensor(under, dtype=dtype)[:, None]
        y, x = torch.meshgrid(torch.arange(height), torch.arange(width), indexing="ij")
        places = torch.stack([x + 0.5 - width / 2, height / 2 - 0.5 - y]).double() * px
        self.points = places.reshape(2, -1).to(dtype)

    def __call__(self, base: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The picture (H, W, 3) of numbers (K,), and its derivatives (H, W, 3, n) along rates (K, n)."""
        still, moving = (self._read(torch.from_numpy(x).to(self.dtype)) for x in (base[:, None], rates))
        if self.under is not None:
            still, moving = still._replace(behind=self.under), moving._replace(behind=0 * moving.behind)
        self.turning = [
            at
            for _, warps in self.layout.ways
            for at in range(warps.start, warps.stop, STRENGTHS)
            if any(part.geometry[:, at : at + STRENGTHS].any() for part in (still, moving))
        ]
        self.skinned = any(bool(part.geometry[:, -2:].any()) for part in (still, moving))
        self.clear = bool(still.clear.any() or moving.clear.any())
        moving.colours.mul_((still.colours >= 0) & (still.colours <= 1))
        still.colours.clamp_(0.0, 1.0)
        pieces = torch.split(self.points, max(1, PAIRS // self.count), 1)
        result = zip(*(self._changes(p, still, moving) for p in pieces), strict=True)
        pictures, slopes = (torch.cat(part, 1) for part in result)
        shape = 3, self.canvas[1], self.canvas[0]
        return (
            pictures.reshape(shape).movedim(0, 2).numpy(),
            slopes.reshape(*shape, -1).movedim(0, 2).numpy(),
        )

    def _read(self, numbers: Tensor) -> _Parts:
        """Parts of numbers (K, n), or of rates: all are linear in them."""
        vectors, behind = numbers[:-3].reshape(self.count, WIDTH, -1), numbers[-3:]
        colours = vectors[:, self.layout.places.rgb] * self.albedo[:, :, None]
        at = self.layout.places
        geometry = vectors[:, [*range(self.layout.geometry), at.grow, at.shell]]
        return _Parts(geometry, colours, vectors[:, at.width], vectors[:, at.clear], behind)

    def _changes(self, p: Tensor, still: _Parts, moving: _Parts) -> tuple[Tensor, Tensor]:
        """Colours (3, M) of points (2, M), and their derivatives (3, M, n)."""
        count = p.shape[1]
        with torch.no_grad():
            d = self._distances(p, still.geometry)
        shape, each = (3, self.count, count), (d, still.colours.swapaxes(0, 1), still.widths, still.clear)
        leaves = [part.expand(shape).clone().requires_grad_() for part in each]
        leaves.append(still.behind.expand(3, count).clone().requires_grad_())
        shown = self._fold(*leaves)
        found = torch.autograd.grad(shown.sum(), leaves, materialize_grads=True)
        by_distance, by_colour, by_width, by_clear, by_behind = found
        slopes = by_behind[..., None] * moving.behind[:, None]
        slopes += by_colour.swapaxes(1, 2) @ moving.colours.swapaxes(0, 1)
        slopes += by_width.swapaxes(1, 2) @ moving.widths
        slopes += by_clear.swapaxes(1, 2) @ moving.clear
        near = by_distance.any(0).any(0).nonzero()[:, 0]
        own = still.geometry.expand(-1, -1, len(near)).clone().requires_grad_()
        (by_number,) = torch.autograd.grad(self._distances(p[:, near], own).sum(), own)
        along = by_number.swapaxes(1, 2) @ moving.geometry  # (N, near, n)
        slopes[:, near] += torch.einsum("kim,imn->kmn", by_distance[:, :, near], along)
        return shown.detach(), slopes

    def _distances(self, p: Tensor, geometry: Tensor) -> Tensor:
        """World distances (N, M) of objects with numbers (N, G + 2, M or 1) at world points (2, M)."""
        layout = self.layout
        steps: list[FrameMap | FrameTurn] = []
        maps = []
        for frame, warps in layout.ways:
            a, b, u, c, d, v = geometry[:, frame].unbind(1)
            maps.append((a, b, c, d))
            steps.append(FrameMap(((a, b, u), (c, d, v))))
            for at in range(warps.start, warps.stop, STRENGTHS):
                if at in self.turning:
                    twirl, *bend = geometry[:, at : at + STRENGTHS].unbind(1)
                    steps.append(FrameTurn(twirl, tuple(bend)))
        points: Any = [x.expand(self.count, -1) for x in p]
        for step in steps:
            points = step(TORCH, points)
        q = torch.stack(list(points))
        result: list[Any] = [None] * self.count
        for shape, decoder in enumerate(self.decoders):
            which = np.flatnonzero(self.shapes == shape).tolist()
            own = q[:, which].reshape(2, -1)
            decoded = self.network.decode(own, TORCH.length(list(own)), 1.0, decoder)
            for at, row in zip(which, decoded.reshape(len(which), -1), strict=True):
                result[at] = row
        d = torch.stack(result)
        if self.skinned:
            grow, shell = geometry[:, -2], geometry[:, -1]
            d = d - (1 - self.late) * grow
            d = torch.where(shell > 0, d.abs() - shell / 2, d) - self.late * grow
        return d * _scale(*maps)

    def _fold(self, d: Tensor, colours: Tensor, widths: Tensor, clear: Tensor, behind: Tensor) -> Tensor:
        """Channels (3, M) of points by distances, colours, widths, 1 - opacities (3, N, M) and ``behind``."""
        lines, bias, candidate, bump = self.cell
        state = d.new_full((3, 1, d.shape[2]), EMPTY * self.widest / BLEND)
        colour = torch.zeros_like(torch.cat([state] * (1 + self.clear), 1))  # and coverage behind it
        slope = self.network.read_slope.exp() / 4
        for i in range(self.count):
            own, narrow = d[:, i : i + 1], BLEND / widths[:, i : i + 1] if self.smooth[i] else 1.0
            levels = bias[i] + (lines[i, :, 0] * own + lines[i, :, 1] * state) * narrow
            given = colours[:, i : i + 1]
            if self.clear:
                through = clear[:, i : i + 1]
                given = torch.cat([given, torch.ones_like(given)], 1) * (1 - through)
                if self.union[i]:
                    given = given + (0.5 - state * slope).clamp(0.0, 1.0) * through * colour
            wanted, lowered = candidate[i, :, 0] * own, bump[i, 0] / narrow
            state, colour = self.network.update(levels, wanted, lowered, state, colour, given)
        coverage = (0.5 - state * slope).clamp(0.0, 1.0)
        hidden = coverage * colour[:, 1:] if self.clear else coverage
        shown: Tensor = (colour * coverage)[:, 0] + (1 - hidden[:, 0]) * behind
        return shown


def _scale(last: tuple[Tensor, ...], middle: tuple[Tensor, ...]) -> Tensor:
    """World distance per leaf distance (N, M or 1): one over the most by which the maps back stretch."""
    (a, b, c, d), (e, f, g, h) = middle, last
    p, q, r, s = a * e + b * g, a * f + b * h, c * e + d * g, c * f + d * h
    # half the sum of the two roots is the largest singular value of [p q; r s]
    squares = (p + s).square() + (r - q).square(), (p - s).square() + (r + q).square()
    one, other = (square.clamp(_LEAST).sqrt() for square in squares)
    return 2.0 / (one + other)


@lru_cache(maxsize=16)
def _network(name: str, width: float, dtype: torch.dtype) -> Framed:
    """A shipped model of the plane with gates of at least a width, as `softened` has them."""
    network = load_model(name).framed.to(dtype)
    soft = softened(name, width)
    network.cell_gain.copy_(torch.from_numpy(np.asarray(soft.cell_gain)))
    network.read_slope.copy_(torch.from_numpy(np.asarray(soft.read_slope)))
    return network


Floats = npt.NDArray[np.float64]
STEP: Final = 1e-3  # of differences, shares of a range: vectors are rounded to float32


def numbers_of(program: Program) -> Floats:
    """Numbers (K,) of a Program that a picture changes smoothly with: vectors by row, then the background."""
    at = LAYOUTS[2 if program.stage is None else 3].places.width
    vectors = program.vectors.astype(np.float64)
    vectors[:, at] = np.where((program.tokens == SMOOTH) & (vectors[:, at] <= 0), BLEND, vectors[:, at])
    return np.concatenate([vectors.reshape(-1), program.background or (0.0, 0.0, 0.0)])


def alike(a: Program, b: Program) -> bool:
    """Return whether two Programs differ in their numbers alone."""
    alone = ("model", "objects", "elements", "palette", "samples")
    same = all(getattr(a, name) == getattr(b, name) for name in alone)
    tables = all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("tokens", "forms", "worn"))
    return same and tables and (a.background is None) == (b.background is None)


class Rates:
    """Derivatives of a Program's numbers; ``program`` compiles the scene of a point, or gives None."""

    def __init__(self, program: Callable[[Point], Program | None], space: SearchBox) -> None:
        self.program, self.space = program, space
        self._moved: dict[int, npt.NDArray[np.bool_]] = {}  # (K,) which numbers an axis changes

    def at(self, u: Point, here: Program) -> tuple[Floats, npt.NDArray[np.bool_]]:
        """Derivatives (K, n) at a point, in shares of ranges, and of which axes (n,) they are known.

        Those of choices are not, nor those of axes along which objects come or go.
        """
        base = numbers_of(here)
        result, known = np.zeros((len(base), len(u))), np.zeros(len(u), bool)
        if any(len(mask) != len(base) for mask in self._moved.values()):
            self._moved = {}
        groups = self._groups(len(base))
        while groups:
            group = groups.pop()
            change = self._change(u, here, base, group)
            masks = [self._moved.get(axis, np.ones(len(base), bool)) for axis in group]
            if len(group) > 1 and (change is None or change[0][~np.any(masks, 0)].any()):
                groups += [[axis] for axis in group]  # more has changed than did so far
                continue
            for axis, mask in zip(group, masks, strict=True):
                if change is not None:
                    column = change[0] * mask if len(group) > 1 else change[0]
                    result[:, axis], known[axis] = column / change[1][axis], True
                    self._moved[axis] = self._moved.get(axis, False) | (column != 0)
        return result, known

    def _groups(self, count: int) -> list[list[int]]:
        """Continuous axes, those together that are known to change different numbers."""
        groups: list[tuple[list[int], npt.NDArray[np.bool_]]] = []
        for axis in np.flatnonzero(self.space.smooth).tolist():
            mask = self._moved.get(axis, np.ones(count, bool))
            for group, taken in groups:
                if not (taken & mask).any():
                    group.append(axis)
                    taken |= mask
                    break
            else:
                groups.append(([axis], mask.copy()))
        return [group for group, _ in groups]

    def _change(self, u: Point, here: Program, base: Floats, axes: list[int]) -> tuple[Floats, Point] | None:
        """By how much numbers (K,) change as axes move, and by how much these do (n,)."""
        for way in (1.0, -1.0):
            moved = u.copy()
            moved[axes] += way * np.where((u[axes] + way * STEP > 1.0) & ~self.space.wraps[axes], -STEP, STEP)
            end = self.space.inside(moved)
            if (program := self.program(end)) is not None and alike(here, program):
                width = end - self.space.inside(u)
                change = numbers_of(program) - base
                return change, np.where(self.space.wraps, (width + 0.5) % 1.0 - 0.5, width)
        return None


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
