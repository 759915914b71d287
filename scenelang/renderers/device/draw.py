"""Programs of the plane drawn on a device: one upload, one launch, one download, nothing waited for between.

The host says which objects can reach which blocks of pixels, from the Program alone, and makes the weights of
its leaves. Everything goes up in one piece of page-locked memory; `kernel.py` does the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from subprocess import SubprocessError
from typing import Any

import numpy as np
import torch
import triton
from torch import Tensor

from scenelang.image import enlarged
from scenelang.program.paints import STEPS
from scenelang.program.program import Program
from scenelang.renderers.coverage import Coverage
from scenelang.renderers.device.kernel import draw_blocks
from scenelang.renderers.draw import Drawing, as_image, halved
from scenelang.renderers.field import Field
from scenelang.renderers.framed import Framed
from scenelang.renderers.grid import GridShape
from scenelang.renderers.meetings import Closing, Pairs, meetings_of, nesting
from scenelang.renderers.network import Decoder, FramedArrays
from scenelang.renderers.raster import LEVELS, Raster, raster
from scenelang.renderers.texture import Texture

WIDTHS = 16, 32  # of decoders: the least of a product in Triton, and the most for which there is room
ALIGNED = 4  # words: Triton compiles a kernel once more for arrays that begin elsewhere
KINDS = list(STEPS)  # of steps of colour, by the place at which the kernel knows them
WARPS = 8  # of 32 threads, for the 256 samples of a block


@lru_cache
def ready() -> bool:
    """Whether Triton can start kernels: it looks for a device, and builds a library with a C compiler."""
    try:
        return triton.runtime.driver.active.get_current_target() is not None
    except (ImportError, OSError, RuntimeError, SubprocessError):
        return False


def draw_on_device(network: Framed, program: Program, samples: str = "adaptive") -> Drawing | None:
    """Draw a Program as `draw_objects` does, with four samples a pixel where that is adaptive.

    Returns:
        The drawing, None of what the kernel does not know: solids, decoders of more than 32 units, features
        beside a distance, a state of more than one number, and frames that need float64.

    Raises:
        ProgramError: as `scenelang.renderers.draw.draw`.
    """
    if samples == "draft":
        found = draw_on_device(network, halved(program), "one")
        return found and replace(found, image=enlarged(found.image, program.canvas))
    config = network.config
    if program.stage or not config.features == config.state == 1 or config.decoder_width > WIDTHS[1]:
        return None
    versions = [(id(p), 0 if p.is_inference() else p._version) for p in network.parameters()]
    host = on_host(network, tuple(versions))
    field = Field(host, program.vectors, program.tokens, program.brought(), program.paints())
    if field.frames.wild.any():
        return None
    grid = raster(program.canvas, range(program.canvas[1]))
    pairs = Coverage(field, prove=False).candidates(grid)
    count = 1 if samples == "one" else 4
    picture = start(field, grid, pairs, program.background, count, network.codes).cpu().numpy()
    met = LEVELS[0] ** 2 * len(np.unique(pairs.block))
    return Drawing(as_image(picture), LEVELS[0] ** 2 * len(pairs) * count, met * (count > 1), met)


def start(
    field: Field, grid: Raster, pairs: Pairs, background: Sequence[float] | None, samples: int, like: Tensor
) -> Tensor:
    """A picture (H, W, 3), or without a background premultiplied (H, W, 4), that a device has begun to draw.

    Args:
        field: on the host.
        pairs: of objects and the raster's largest blocks.
        like: a tensor that lies on the device.
    """
    (width, height), across = grid.canvas, grid.wide // LEVELS[0]
    blocks = across * grid.high // LEVELS[0]
    objects, levels, deepest = pairs.object, np.zeros(0, int), 1
    block = pairs.block
    if field.groups.deepest:
        block, objects, levels, deepest = _ordered(field, pairs)
    starts = block.searchsorted(np.arange(blocks + 1))
    config = field.network.config
    rows, wide = _rows(field), WIDTHS[config.decoder_width > WIDTHS[0]]
    parts, weights = _weights(field, wide)
    behind = np.asarray(() if background is None else background, np.float32)
    out = like.new_empty((height, width, len(behind) or 4))
    there = upload([starts, objects, levels, rows, parts, weights, behind], out.device)
    launch(
        blocks,
        *(out, *there, width, height, across, grid.left, grid.top, grid.px, field.nothing, field.slope),
        SIDE=LEVELS[0],
        SAMPLES=samples,
        CHANNELS=out.shape[2],
        ROW=rows.shape[1],
        OUTER=field.layout.outer,
        INNER=field.layout.inner,
        CELL=_cell_at(field),
        WIDTH=wide,
        LINES=config.paint_lines,
        LEVELS=1 << (deepest - 1).bit_length(),
        LEAVES=2 * len(field.tokens) if field.groups.deepest else 0,
    )
    return out


def upload(parts: Sequence[np.ndarray], device: torch.device) -> list[Tensor]:
    """Arrays as int32 or float32 tensors on a device, by one copy that the host does not wait for."""
    typed = [part.astype(np.float32 if part.dtype.kind == "f" else np.int32, copy=False) for part in parts]
    ends = np.cumsum([-(-part.size // ALIGNED) * ALIGNED for part in typed]).tolist()
    held = torch.empty(ends[-1], dtype=torch.int32, device="cpu", pin_memory=device.type == "cuda")
    words, begins = held.numpy(), [0, *ends]
    for part, begin in zip(typed, begins, strict=False):
        words[begin : begin + part.size] = part.view(np.int32).ravel()
    there = held.to(device, non_blocking=True)
    return [
        there[begin : begin + part.size].view(torch.float32 if part.dtype.kind == "f" else torch.int32)
        for part, begin in zip(typed, begins, strict=False)
    ]


def launch(programs: int, *arguments: Any, **sizes: int) -> None:
    """Start the kernel."""
    draw_blocks[(programs,)](*arguments, **sizes, num_warps=WARPS)


@lru_cache(maxsize=4)
def on_host(network: Framed, versions: tuple[tuple[int, int], ...]) -> FramedArrays:
    """A network's parameters as numpy arrays, fetched again when they have changed."""
    found = FramedArrays(network.config, {k: v.cpu().numpy() for k, v in network.state_dict().items()})
    found.layout = network.layout
    return found


def _ordered(field: Field, pairs: Pairs) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Blocks, rows and levels of pairs and of the groups that end between them, and how many levels are used.

    The rows of N objects are followed by those of objects that begin a state as they are, and by groups'.
    """
    meetings, _ = meetings_of(pairs)
    nest, count = nesting(meetings, field.groups), len(field.tokens)
    if nest is None:
        return pairs.block, pairs.object, np.zeros(0, int), 1
    found = list[tuple[np.ndarray, ...]]()  # columns, rows, levels, moments

    def close(closings: list[Closing]) -> None:
        for columns, groups, level in closings:
            found.append((columns, 2 * count + groups, level - 1, np.full(len(columns), len(found))))

    for part, level, fresh, before, after in nest.turns:
        close(before)
        rows = meetings.pairs.object[part] + count * fresh
        found.append((np.arange(len(level)), rows, level, np.full(len(level), len(found))))
        close(after)
    columns, rows, levels, moments = (np.concatenate(parts) for parts in zip(*found, strict=True))
    block = meetings.columns[columns]
    by = np.lexsort((moments, block))
    return block[by], rows[by], levels[by], nest.levels


def _cell_at(field: Field) -> int:
    """Place in a row of the kernel at which its cell begins: behind the way to the leaf, scale and colour."""
    return int(field.layout.geometry - field.layout.places.frame.start + 4)


def _rows(field: Field) -> np.ndarray:
    """What the kernel knows of each object, and behind these of those that begin a state, and of groups."""
    count, layout = len(field.tokens), field.layout
    whole = np.concatenate(
        [
            field.vectors[:, layout.places.frame.start : layout.geometry],
            field.frames.scale[:, None],
            field.colours.T,
        ],
        1,
    )
    parts = [(whole, field.cells(np.arange(count)))]
    if field.groups.deepest:
        groups = np.zeros((len(field.groups.joins), whole.shape[1]))
        groups[:, 0] = 1 / field.unit
        parts += [(whole, field.cells(np.arange(count), opened=True)), (groups, field.joins())]
    found = []
    for row, cell in parts:
        lines = np.concatenate([cell.lines, cell.bias[:, None]], 1)  # (1 + L, 3, N)
        gates = [lines.reshape(3 * len(lines), len(row)).T, cell.candidate[0].T, cell.bump.T]
        found.append(np.concatenate([row, *gates], 1, dtype=np.float32))
    return np.concatenate(found)


def _weights(field: Field, wide: int) -> tuple[np.ndarray, np.ndarray]:
    """What the kernel's ``parts`` are of each object (N, 6), and its ``weights``."""
    shapes = [s.nodes if isinstance(s, GridShape) else _decoder(s, wide) for s in field.shapes]
    textures = [_texture(texture) for texture in field.textures]
    weights = [np.empty(0, np.float32), *shapes, *textures]
    begins = np.cumsum([part.size for part in weights])
    sides = [shape.side if isinstance(shape, GridShape) else 0 for shape in field.shapes]
    looks = [(len(texture.steps), *texture.sides) for texture in field.textures]
    shape = np.stack([begins[: len(shapes)], np.array(sides, int)], 1)
    texture = np.concatenate([begins[len(shapes) : -1, None], np.reshape(looks, (-1, 3))], 1)
    none = np.zeros((1, 4))  # which the last place is, and so that of `NO_TEXTURE`
    parts = [shape[field.shape], np.concatenate([texture, none])[field.texture]]
    whole = np.concatenate(parts, 1).astype(np.int32)
    return np.concatenate([whole] * (2 if field.groups.deepest else 1)), np.concatenate(weights)


def _texture(texture: Texture) -> np.ndarray:
    """The place in the picture, the steps with numbers to come to four, and the texels."""
    steps = np.zeros((len(texture.steps), 4), np.float32)
    for row, (kind, *numbers) in zip(steps, texture.steps, strict=True):
        row[0], row[1 : 1 + len(numbers)] = KINDS.index(kind), numbers
    place = np.array(texture.place.rows, np.float32)
    return np.concatenate([part.ravel() for part in (place, steps, texture.texels)])


def _decoder(decoder: Decoder, wide: int) -> np.ndarray:
    """Weights in the order in which the kernel reads them, of layers widened by units that answer nothing."""
    (w0, b0), (w1, b1), (w2, b2) = decoder.layers
    rows, units = np.zeros((wide + 6, wide), np.float32), len(b0)
    rows[:2, :units], rows[2, :units] = w0.T, b0
    rows[3 : 3 + units, :units], rows[wide + 3, :units] = w1.T, b1
    rows[wide + 4, :units], rows[wide + 5, :2] = w2[0], (b2[0], decoder.far[0, 0])
    return rows.reshape(-1)
