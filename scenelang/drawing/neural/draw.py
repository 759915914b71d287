"""Programs to pictures and outputs: tiles and threads around coverage and rays.

A tile's pixels depend on the objects that reach the tile, on nothing else, and in no way on how fast or
where they are computed. Where all of those are, bit for bit, as in the picture before, so are the pixels.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import field, replace
from typing import Unpack

import numpy as np
import numpy.typing as npt

from scenelang.assets.records import Record
from scenelang.compiler.program import Program, ProgramError
from scenelang.drawing.how import Care, OutOfTime
from scenelang.drawing.image import Image, Outputs, enlarged, from_samples
from scenelang.drawing.neural.coverage import Coverage, Tile
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.meetings import LEVELS
from scenelang.drawing.neural.network import FramedNetwork
from scenelang.drawing.size import growth, sized
from scenelang.drawing.solid.draw import draw_solids, solid_outputs
from scenelang.drawing.solid.march import Work
from scenelang.drawing.solid.network import SolidNetwork
from scenelang.drawing.solid.plain import solid_field
from scenelang.drawing.work import FIRST, Plan, late_plan, plan_of, until_s

_ROOM_PX = 2.0  # around a tile: more than a sample lies off its pixel's centre


class TileCache(Record, frozen=False):
    """The last picture of a sequence."""

    keys: list[bytes] = field(default_factory=list)  # what each of its tiles showed, a digest
    # (H, W, 3 or 4), as `Tile` has it
    picture: npt.NDArray[np.float32] = field(default_factory=lambda: np.empty((0, 0, 4), np.float32))

    def shows(self, index: int, keys: list[bytes], shape: tuple[int, ...]) -> bool:
        """True where a tile of a picture with such keys shows the same as before."""
        return self.picture.shape == shape and len(self.keys) == len(keys) and self.keys[index] == keys[index]

    def look(self, coverage: Coverage, program: Program, tiles: Sequence[range]) -> list[bytes]:
        """A digest of what each tile of a new picture will show."""
        width, height = program.canvas
        px = 2 / min(width, height)  # world units
        scene = coverage.field
        reach, frames = scene.reach, scene.frames
        low, high = frames.boxes(reach + _ROOM_PX * px * frames.growth)
        low, high = (np.where(np.isinf(reach), end, y[1]) for end, y in ((-np.inf, low), (np.inf, high)))
        brought = [held and held.digest for held in scene.brought]
        paints = [held and (held.element.digest, held.steps) for held in scene.paints]
        looks = [hashlib.sha256(repr(pair).encode()).digest() for pair in zip(brought, paints, strict=True)]
        shown = (
            *(scene.vectors, scene.xp.to_numpy(scene.colours).T, scene.tokens, reach),
            np.frombuffer(b"".join(looks), np.uint8).reshape(-1, 32),
            *scene.nests(),
        )
        common = (
            repr((type(scene.xp).__name__, program.canvas, program.background, list(tiles))).encode()
            + bytes([coverage.count])
            + scene.codes.tobytes()
        )
        keys = []
        for tile in tiles:
            top = (height / 2 - tile.start + _ROOM_PX) * px
            bottom = (height / 2 - tile.start - LEVELS[0] * -(-len(tile) // LEVELS[0]) - _ROOM_PX) * px
            reaching = (low <= top) & (high >= bottom)
            what = b"".join(part[reaching].tobytes() for part in shown)
            keys.append(hashlib.sha256(common + what).digest())
        return keys


class Run(Care, total=False):
    """Arguments of a single drawing, which calls hand on to the renderer.

    Args:
        threads: tiles drawn at the same time; by default as `threads_for` says.
        split: threads that the picture is split for, which shows in the last bits; by default ``threads``.
        kept: the picture before this one, of which tiles that show the same are taken over.
        progress: called with the share done, in [0, 1], from any thread.
        samples: as of `How`.
    """

    threads: int | None
    split: int | None
    kept: TileCache | None
    progress: Callable[[float], None] | None


TILE = 1 << 18  # pixels that are drawn at a time


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
        run |= {"samples": "one", "split": None, "kept": None}
        drawing = _drawn(network, halved(program), skip, even, run)
        return replace(drawing, image=enlarged(drawing.image, program.canvas))
    if network.layout.dimension == 2:
        if program.stage is not None:
            raise ProgramError("a program of solids, which the model does not draw")
        if run.get("samples") == "quick":
            run["samples"] = "adaptive"
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
    split: int | None = None,
    kept: TileCache | None = None,
    skip: bool = True,
    samples: str = "adaptive",
    tile: int = TILE,
    progress: Callable[[float], None] | None = None,
) -> Drawing:
    """Draw a Program's objects in stream order; arguments are those of `Run`.

    Without ``split`` tiles are as high as for ``threads``, by default 1; ``tile`` is their pixels, at least
    one row. Raises `ProgramError` for vectors that no compiled scene has.
    """
    (width, height), threads = program.canvas, threads or 1
    field = Field(network, program.vectors, program.tokens, program.brought(), program.paints())
    coverage = Coverage(field, skip=skip, count=program.samples)
    rows = max(1, min(tile // width, -(-height // (split or threads))))
    rows = LEVELS[0] * -(-rows // LEVELS[0])
    tiles = [range(top, min(top + rows, height)) for top in range(0, height, rows)]
    background = None if program.background is None else np.asarray(program.background, np.float32)
    out = np.empty((height, width, 4 if background is None else 3), np.float32)
    drawn: list[Tile] = []
    finished: list[int] = []
    seen = kept.look(coverage, program, tiles) if kept is not None and skip and samples != "four" else None

    def one(index: int) -> None:
        band = tiles[index]
        if kept is not None and seen is not None and kept.shows(index, seen, out.shape):
            out[band.start : band.stop] = kept.picture[band.start : band.stop]
        else:
            result = coverage.tile(program.canvas, band, samples, background)
            out[band.start : band.stop] = result.picture
            drawn.append(result)
        finished.append(index)
        if progress is not None:
            progress(len(finished) / len(tiles))

    network.xp.each(threads, one, range(len(tiles)))
    if kept is not None and seen is not None:
        kept.picture, kept.keys = out.copy(), seen
    cost = [sum(getattr(t, name) for t in drawn) for name in ("pairs", "refined", "met")]
    return Drawing(as_image(out), *cost)


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
        by, program = growth(program.stage), sized(program)
        solids = solid_field(network, program.vectors, program.tokens, program.brought())  # type: ignore[arg-type]
        result = solid_outputs(solids, program.stage, program.canvas, threads=threads, count=program.samples)
        assert result.depth is not None
        result = replace(result, depth=result.depth / np.float32(by))
    else:
        image = draw(network, replace(program, background=None)).image  # type: ignore[arg-type]
        field = Field(network, program.vectors, program.tokens, program.brought())  # type: ignore[arg-type]
        coverage, rows = Coverage(field, prove=False), max(1, TILE // program.canvas[0])
        bands = [range(program.canvas[1])[top : top + rows] for top in range(0, program.canvas[1], rows)]
        owners = np.concatenate([coverage.owners(program.canvas, band) for band in bands])
        result = Outputs(object=owners, alpha=np.asarray(image)[..., 3])
    assert result.object is not None
    return replace(result, object=np.array((0, *program.numbers), np.int32)[result.object])
