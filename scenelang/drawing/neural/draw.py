"""Programs to pictures and outputs: strips of rows of the plane, on threads, and rays through solids."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Unpack

import numpy as np
import numpy.typing as npt

from scenelang.assets.records import Record
from scenelang.compiler.program import Program, ProgramError
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.how import Care, OutOfTime, check_time
from scenelang.drawing.image import Image, Outputs, enlarged, from_samples, sample_places
from scenelang.drawing.kernel import load_kernel, there_is_a_kernel
from scenelang.drawing.neural.assets import GridShape
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.network import FramedNetwork
from scenelang.drawing.neural.outlines import OutlineShapes
from scenelang.drawing.neural.tables import page_row, tables_of
from scenelang.drawing.neural.units import LeafUnits
from scenelang.drawing.size import sized
from scenelang.drawing.solid.draw import draw_solids, solid_outputs
from scenelang.drawing.solid.march import Work
from scenelang.drawing.solid.network import SolidNetwork
from scenelang.drawing.solid.plain import solid_field
from scenelang.drawing.work import FIRST, Plan, late_plan, plan_of, until_s


class Run(Care, total=False):
    """Arguments of a single drawing, which calls hand on to the renderer.

    Args:
        threads: strips drawn at the same time; by default as `threads_for` says.
        split: threads that the picture is split for, which shows in the last bits; by default ``threads``.
        progress: called with the share done, in [0, 1], from any thread.
        samples: as of `How`.
    """

    threads: int | None
    split: int | None
    progress: Callable[[float], None] | None


STRIP = 64  # rows that are drawn at a time
WORK = 1 << 22  # pixels times objects between two looks at the clock
PAIRS = 1 << 18  # of an object and a sample at a time, where the kernel does not draw


class Drawing(Record, frozen=False):
    """A picture and what it cost."""

    image: Image  # (H, W, 3), or (H, W, 4) with straight alpha
    pairs: int  # (object, sample) pairs that went through the network
    refined: int  # pixels of which all samples were taken
    met: int  # pixels that an object reached; the others show the background, unseen by the network
    work: Work | None = None  # of solids, what it took in rays and steps
    coarser: str = ""  # why it is coarser than asked for, if it is


@contextmanager
def timed(
    network: FramedNetwork | SolidNetwork, program: Program, patient: bool, part: float = 1.0
) -> Iterator[None]:
    """Have the network raise `OutOfTime` when a part of the time of a picture is over, unless patient."""
    network.until_s = until_s(program.canvas, patient, part)
    try:
        yield
    finally:
        network.until_s = float("inf")


def draw_objects(
    network: FramedNetwork | SolidNetwork, program: Program, *, skip: bool = True, **run: Unpack[Run]
) -> Drawing:
    """Draw a Program, as of `Run`, in the time that there is, coarser where it turns out too short; raises
    `RenderError` where even that takes longer.
    """
    program, patient = sized(program), run.pop("patient", False)

    def drawn(plan: Plan, part: float) -> Drawing:
        coarse = program if plan.canvas == program.canvas else replace(program, canvas=plan.canvas)
        with timed(network, program, patient, part):
            drawing = _drawn(network, coarse, skip, plan.even, run.copy())
        return replace(drawing, image=enlarged(drawing.image, program.canvas), coarser=plan.told)

    if patient:
        return drawn(Plan(program.canvas), 1.0)
    plan = plan_of(program, network, run.get("samples", "adaptive"))
    try:
        return drawn(plan, FIRST)
    except OutOfTime:
        return drawn(late_plan(program), 1 - FIRST)


def _drawn(
    network: FramedNetwork | SolidNetwork, program: Program, skip: bool, even: bool, run: Run
) -> Drawing:
    """Draw a Program of the plane or of solids, as `draw` does, if the network has its dimension.

    Solids are drawn anew in each picture, and always with the rules that ``skip`` leaves out; all of their
    pixels count as met. There are two further ``samples``: ``"draft"``, one for each 2 x 2 pixels, and
    ``"quick"``, as ``"adaptive"``, of solids with longer steps and fewer pixels sampled more than once.
    """
    if run.get("samples") == "draft":
        run |= {"samples": "one", "split": None}
        drawing = _drawn(network, halved(program), skip, even, run)
        return replace(drawing, image=enlarged(drawing.image, program.canvas))
    if network.layout.dimension == 2:
        if program.stage is not None:
            raise ProgramError("a program of solids, which the model does not draw")
        if run.get("samples") == "quick":
            run["samples"] = "adaptive"
        run.pop("split", None)
        return draw(network, program, skip=skip, **run)  # type: ignore[arg-type,misc]
    if program.stage is None:
        raise ProgramError("a program of the plane, which the model does not draw")
    brought, paints = program.brought(), program.paints()
    field = solid_field(network, program.vectors, program.tokens, brought, paints)  # type: ignore[arg-type]
    image, work = draw_solids(
        field,
        replace(program.stage, sky=None) if even else program.stage,
        program.canvas,
        threads=run.get("threads") or 1,
        split=run.get("split"),
        samples=run.get("samples", "adaptive"),
        count=program.samples,
        progress=run.get("progress"),
    )
    return Drawing(image, work.met, work.refined, image.shape[0] * image.shape[1], work)


def draw(
    network: FramedNetwork,
    program: Program,
    *,
    threads: int | None = None,
    skip: bool = True,
    samples: str = "adaptive",
    progress: Callable[[float], None] | None = None,
) -> Drawing:
    """Draw a Program's objects in stream order; arguments are those of `Run`.

    The network as it is written, which draws by torch, or without ``skip``, takes all samples everywhere but
    for ``"one"``. Raises `ProgramError` for vectors that no compiled scene has.
    """
    (width, height), count = program.canvas, program.samples
    field = Field(network, program.vectors, program.tokens, program.brought(), program.paints())
    background = None if program.background is None else np.asarray(program.background, np.float32)
    out = np.empty((height, width, 4 if background is None else 3), np.float32)
    by_kernel = skip and draws(field)
    if by_kernel:
        tables, page = tables_of(field), page_row(program.canvas, count, samples, background)
    places = sample_places(1 if samples == "one" else count) - 0.5
    strips = [range(top, min(top + STRIP, height)) for top in range(0, height, STRIP)]
    costs: list[tuple[int, ...]] = []
    often = max(1, WORK // (STRIP * width * (1 + len(program))))  # strips for each look at the clock

    def one(strip: range) -> None:
        if strip.start // STRIP % often == 0:
            check_time(network.until_s)
        if by_kernel:
            part = out[strip.start : strip.stop]
            costs.append(load_kernel().plane(tables, page, strip, part))
        else:
            picture = _written(field, program.canvas, strip, places, skip)
            behind = 0.0 if background is None else (1 - picture[..., 3:]) * background
            out[strip.start : strip.stop] = picture[..., : out.shape[2]] + behind
            pixels = len(strip) * width
            costs.append((pixels * places.shape[1] * len(program), pixels * (samples != "one"), pixels))
        if progress is not None:
            progress(len(costs) / len(strips))

    network.xp.each(threads or 1, one, strips)
    # the kernel's numbers lie in [0, 1]
    image: Image = out.view(Image) if by_kernel and background is not None else as_image(out)
    pairs, refined, met = map(sum, zip(*costs, strict=True))
    return Drawing(image, pairs, refined, met)


def draws(field: Field) -> bool:
    """Whether the kernel draws a field of the plane: norm units of numpy, and what users brought."""
    config, known = field.network.config, (LeafUnits, GridShape, OutlineShapes)
    sizes = config.features, config.state, config.paint_lines
    kinds = all(isinstance(field.shapes[at], known) for at in set(field.shape.tolist()))
    return field.xp is NUMPY and sizes == (1, 1, 2) and kinds and there_is_a_kernel()


def _written(
    field: Field, canvas: tuple[int, int], strip: range, places: npt.NDArray[np.float64], skip: bool
) -> npt.NDArray[np.float32]:
    """Rows of a picture (rows, width, 4) by the network as it is written, of samples at places (2, K) about
    pixels' middles; if ``skip``, of the objects that may reach a part of the rows.
    """
    (width, height), xp = canvas, field.xp
    px, each = 2 / min(width, height), STRIP
    result = np.empty((len(strip), width, 4), np.float32)
    for left in range(0, width, each):
        columns = np.arange(left, min(left + each, width))
        x = (columns + 0.5 - width / 2) * px
        y = (height / 2 - 0.5 - np.arange(strip.start, strip.stop)) * px
        room = np.array([px, px])
        box = np.array([x[0], y[-1]]) - room, np.array([x[-1], y[0]]) + room
        objects = field.within(*box) if skip else np.arange(len(field.tokens))
        p = np.stack(np.broadcast_arrays(x[None], y[:, None])).reshape(2, -1).astype(np.float32)
        some = max(1, PAIRS // max(1, len(objects)))
        parts = []
        for first in range(0, p.shape[1], some):
            check_time(field.network.until_s)
            with xp.inference():
                points = xp.array(np.ascontiguousarray(p[:, first : first + some]), field.like)
                parts.append(xp.to_numpy(field.sampled(points, (places * px).astype(np.float32), objects)))
        result[:, columns] = np.concatenate(parts, 1).T.reshape(len(y), len(x), 4)
    return result


def halved(program: Program) -> Program:
    """The same on a canvas with half of the columns and half of the rows."""
    width, height = program.canvas
    return replace(program, canvas=(-(-width // 2), -(-height // 2)))


def as_image(picture: npt.NDArray[np.float32]) -> Image:
    """The image of a picture (H, W, 3), or premultiplied (H, W, 4); `ProgramError` if not finite."""
    if not np.isfinite(picture.sum()):
        raise ProgramError("a damaged program: numbers that the network cannot draw with")
    return from_samples(picture[..., :3], picture[..., 3] if picture.shape[2] == 4 else None)


def program_outputs(
    network: FramedNetwork | SolidNetwork, program: Program, *, threads: int = 1, patient: bool = False
) -> Outputs:
    """All outputs of a Program, numbered as in the scene; raises ProgramError for numbers of no scene, and
    `RenderError` where the time of a picture is over.
    """
    with timed(network, program, patient):
        return _outputs(network, program, threads)


def _outputs(network: FramedNetwork | SolidNetwork, program: Program, threads: int) -> Outputs:
    if program.stage is not None:
        by, program = program.stage.growth, sized(program)
        assert program.stage is not None
        solids = solid_field(network, program.vectors, program.tokens, program.brought())  # type: ignore[arg-type]
        result = solid_outputs(solids, program.stage, program.canvas, threads=threads, count=program.samples)
        assert result.depth is not None
        result = replace(result, depth=result.depth / np.float32(by))
    else:
        image = draw(network, replace(program, background=None), threads=threads).image  # type: ignore[arg-type]
        field = Field(network, program.vectors, program.tokens, program.brought())  # type: ignore[arg-type]
        owners = _owners(field, program.canvas)
        result = Outputs(object=owners, alpha=np.asarray(image)[..., 3])
    assert result.object is not None
    return replace(result, object=np.array((0, *program.numbers), np.int32)[result.object])


def _owners(field: Field, canvas: tuple[int, int]) -> npt.NDArray[np.int32]:
    """Numbers (H, W), from 1, of the objects that paint pixels' centres, 0 where none does."""
    (width, height), px = canvas, 2 / min(canvas)
    result = np.empty((height, width), np.int32)
    if draws(field):
        tables, page = tables_of(field), page_row(canvas, 4, "owners")
        for top in range(0, height, STRIP):
            check_time(field.network.until_s)
            strip = range(top, min(top + STRIP, height))
            load_kernel().plane(tables, page, strip, result[strip.start : strip.stop])
        return result
    x = ((np.arange(width) + 0.5 - width / 2) * px).astype(np.float32)
    for row in range(height):
        check_time(field.network.until_s)
        y = np.full_like(x, (height / 2 - 0.5 - row) * px)
        with field.xp.inference():
            points = field.xp.array(np.stack([x, y]), field.like)
            result[row] = field.xp.to_numpy(field.folded(points, owners=True)[1])
    return result
