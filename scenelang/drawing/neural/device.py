"""Programs of the plane drawn on a device by one kernel of Triton: one upload, one launch, one download.

The kernel, `draw_blocks`, computes `network.py`, `frames.py`, `assets.py` and four samples a pixel. Values
stay in registers from a sample's place to its pixel's colour, so that a frame is one launch, however many
objects meet however many blocks. M are a block's samples, those of a pixel side by side.

The host lists the objects that can reach each block of pixels, from the Program alone, and mixes the weights
of its leaves. Everything goes up in one piece of page-locked memory.
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
import triton.language as tl
from torch import Tensor

from scenelang.compiler.graph import LUMA
from scenelang.compiler.program import STEPS, Program
from scenelang.drawing.image import enlarged
from scenelang.drawing.neural.assets import GridShape, Texture
from scenelang.drawing.neural.coverage import Coverage
from scenelang.drawing.neural.draw import Drawing, as_image, halved
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.load import Framed
from scenelang.drawing.neural.meetings import LEVELS, Pairs, Raster, meetings_of, nesting, raster
from scenelang.drawing.neural.network import RADIUS, Decoder, FramedArrays

# mypy: disable-error-code="no-untyped-def, no-untyped-call, untyped-decorator"


_RIM = tl.constexpr(RADIUS)
_RED, _GREEN, _BLUE = (tl.constexpr(weight) for weight in LUMA)
_COLOR, _GRAYSCALE = (tl.constexpr(list(STEPS).index(name)) for name in ("color", "grayscale"))


@triton.jit
def _unit(x):
    return tl.minimum(tl.maximum(x, 0.0), 1.0)


@triton.jit
def _affine(x, y, numbers):
    """Points behind the map of six numbers."""
    a, b, u = tl.load(numbers), tl.load(numbers + 1), tl.load(numbers + 2)
    c, d, v = tl.load(numbers + 3), tl.load(numbers + 4), tl.load(numbers + 5)
    return a * x + b * y + u, c * x + d * y + v


@triton.jit
def _warp(x, y, numbers):
    """Points behind the warp of three numbers."""
    twirl, bend_x, bend_y = tl.load(numbers), tl.load(numbers + 1), tl.load(numbers + 2)
    if (twirl != 0.0) | (bend_x != 0.0) | (bend_y != 0.0):
        angle = bend_x * x + bend_y * y + twirl * tl.sqrt_rn(x * x + y * y)
        cos, sin = tl.cos(angle), tl.sin(angle)
        x, y = x * cos + y * sin, y * cos - x * sin
    return x, y


@triton.jit
def _learned(x, y, weights, WIDTH: tl.constexpr):
    """Distances (M,) by a decoder: two layers, a third, and the growth beyond the rim."""
    unit = tl.arange(0, WIDTH)
    radius = tl.sqrt_rn(x * x + y * y)
    shrink = _RIM / tl.maximum(radius, _RIM)
    hidden = (x * shrink)[:, None] * tl.load(weights + unit)[None, :]
    hidden += (y * shrink)[:, None] * tl.load(weights + WIDTH + unit)[None, :]
    hidden = tl.maximum(hidden + tl.load(weights + 2 * WIDTH + unit)[None, :], 0.0)
    weights += 3 * WIDTH
    inner = tl.load(weights + unit[:, None] * WIDTH + unit[None, :])
    weights += WIDTH * WIDTH
    # in float32: TF32, the default, would be off by up to 0.002
    hidden = tl.dot(hidden, inner, input_precision="ieee") + tl.load(weights + unit)[None, :]
    result = tl.sum(tl.maximum(hidden, 0.0) * tl.load(weights + WIDTH + unit)[None, :], 1)
    far = tl.load(weights + 2 * WIDTH + 1)  # behind the last layer's weights and its bias
    return result + tl.load(weights + 2 * WIDTH) + tl.maximum(radius - _RIM, 0.0) * far


@triton.jit
def _edge(nodes, first, share):
    """Values (M,) between nodes and the ones behind them."""
    a = tl.load(nodes + first)
    return a + (tl.load(nodes + first + 1) - a) * share


@triton.jit
def _between(nodes, first, wide, across, down):
    """Values (M,) between nodes and the ones behind and below them."""
    a, b = _edge(nodes, first, across), _edge(nodes, first + wide, across)
    return a + (b - a) * down


@triton.jit
def _grid(x, y, nodes, side):
    """Distances (M,) by a grid of nodes over [-1, 1]^2, and beyond it the least that they can be."""
    inside_x = tl.minimum(tl.maximum(x, -1.0), 1.0)
    inside_y = tl.minimum(tl.maximum(y, -1.0), 1.0)
    half = (side - 1).to(tl.float32) * 0.5
    place_x, place_y = (inside_x + 1.0) * half, (inside_y + 1.0) * half
    row, column = tl.minimum(place_x.to(tl.int32), side - 2), tl.minimum(place_y.to(tl.int32), side - 2)
    across, down = place_y - column.to(tl.float32), place_x - row.to(tl.float32)
    result = _between(nodes, row * side + column, side, across, down)
    beyond = (x - inside_x) * (x - inside_x) + (y - inside_y) * (y - inside_y)
    return tl.where(beyond > 0.0, tl.sqrt_rn(result * result + beyond), result)


@triton.jit
def _texture(x, y, numbers, steps, high, wide):
    """Colours of a picture, which repeats: numbers are a map, steps of colour, and three planes of texels."""
    u, v = _affine(x, y, numbers)
    numbers += 6
    nodes = numbers + 4 * steps  # a step is its kind and three numbers; texels follow the steps
    # the planes have one more texel around the picture, from its other side: hence - 2 and + 0.5
    place_x = (u - tl.floor(u)) * (wide - 2).to(tl.float32) + 0.5
    place_y = (v - tl.floor(v)) * (high - 2).to(tl.float32) + 0.5
    column = tl.minimum(tl.maximum(place_x.to(tl.int32), 0), wide - 2)
    line = tl.minimum(tl.maximum(place_y.to(tl.int32), 0), high - 2)
    across, down, first = place_x - column.to(tl.float32), place_y - line.to(tl.float32), line * wide + column
    red = _between(nodes, first, wide, across, down)
    green = _between(nodes + high * wide, first, wide, across, down)
    blue = _between(nodes + 2 * high * wide, first, wide, across, down)
    for _ in range(steps):
        kind, amount = tl.load(numbers), tl.load(numbers + 1)
        if kind == _COLOR:
            red, green, blue = red * amount, green * tl.load(numbers + 2), blue * tl.load(numbers + 3)
        elif kind == _GRAYSCALE:
            luma = _RED * red + _GREEN * green + _BLUE * blue
            red += amount * (luma - red)
            green += amount * (luma - green)
            blue += amount * (luma - blue)
        else:
            red, green, blue = _turned(red, green, blue, amount)
        red, green, blue = _unit(red), _unit(green), _unit(blue)
        numbers += 4
    return red, green, blue


@triton.jit
def _turned(red, green, blue, turns):
    """Colours with another hue of HSV."""
    value, least = tl.maximum(tl.maximum(red, green), blue), tl.minimum(tl.minimum(red, green), blue)
    chroma = value - least
    sixth = 1.0 / tl.maximum(chroma, 1e-12)
    others = tl.where(value == green, (blue - red) * sixth + 2.0, (red - green) * sixth + 4.0)
    hue = tl.where(value == red, (green - blue) * sixth, others) / 6.0 + turns
    hue = (hue - tl.floor(hue)) * 6.0
    red = least + chroma * _unit(tl.abs(hue - 3.0) - 1.0)
    green = least + chroma * _unit(2.0 - tl.abs(hue - 2.0))
    return red, green, least + chroma * _unit(2.0 - tl.abs(hue - 4.0))


@triton.jit
def _object(x, y, row, part, weights, OUTER: tl.constexpr, INNER: tl.constexpr, WIDTH: tl.constexpr):
    """Distances and colours (M,) of an object at world points."""
    # a row: a map (6 numbers), warps (3 each), a map, warps, the scale of distances, and a colour
    x, y = _affine(x, y, row)
    row += 6
    for _ in range(OUTER):  # unrolled the code would be ten times as long
        x, y = _warp(x, y, row)
        row += 3
    x, y = _affine(x, y, row)
    row += 6
    for _ in range(INNER):
        x, y = _warp(x, y, row)
        row += 3
    shape, side = weights + tl.load(part), tl.load(part + 1)
    if side > 0:
        distance = _grid(x, y, shape, side)
    else:
        distance = _learned(x, y, shape, WIDTH)
    wide = tl.load(part + 5)
    if wide > 0:
        red, green, blue = _texture(
            x, y, weights + tl.load(part + 2), tl.load(part + 3), tl.load(part + 4), wide
        )
    else:
        nothing = 0.0 * x
        red, green, blue = nothing + tl.load(row + 1), nothing + tl.load(row + 2), nothing + tl.load(row + 3)
    return distance * tl.load(row), red, green, blue


@triton.jit
def _level(stack, here):
    """One (M,) of the levels of a stack."""
    return tl.sum(tl.where(here, stack, 0.0), 0)


@triton.jit
def _mean(x, SAMPLES: tl.constexpr):
    """Means of pixels' samples."""
    return tl.sum(tl.reshape(x, (x.shape[0] // SAMPLES, SAMPLES)), 1) / SAMPLES


@triton.jit(do_not_specialize=["width", "height", "across"])
def draw_blocks(
    out,  # (height, width, CHANNELS): over a background, else premultiplied colour and coverage
    starts,  # (blocks + 1,): where in `objects` those of each block begin
    objects,  # (pairs,): rows, in the order in which they join; those from N on are groups that end
    levels,  # (pairs,): of the states that they join, 0 for the stream's own
    rows,  # (2 N + groups, ROW): the way to the leaf, scale, colour, cell
    parts,  # (2 N, 6): where in `weights` its shape begins; the side of its grid, 0 for a decoder; where its
    # texture begins, how many steps that has, and its lines and columns, 0 for none
    weights,
    background,  # (3,)
    width,
    height,
    across,  # blocks in a row
    left,  # world coordinates of the middle of the first pixel
    top,
    px,  # world units
    empty,  # the state before the first object
    slope,  # of coverage
    SIDE: tl.constexpr,  # of a block, pixels
    SAMPLES: tl.constexpr,  # of a pixel: 1 or 4
    CHANNELS: tl.constexpr,
    ROW: tl.constexpr,
    OUTER: tl.constexpr,  # warps
    INNER: tl.constexpr,
    CELL: tl.constexpr,  # where in a row it begins
    WIDTH: tl.constexpr,  # of decoders
    LINES: tl.constexpr,  # of the gate of colour
    LEVELS: tl.constexpr,  # states, a power of two
    LEAVES: tl.constexpr,  # rows of objects
):
    block = tl.program_id(0)
    pixel = tl.arange(0, SIDE * SIDE * SAMPLES) // SAMPLES
    column, line = (block % across) * SIDE + pixel % SIDE, (block // across) * SIDE + pixel // SIDE
    which = tl.arange(0, SIDE * SIDE * SAMPLES) % SAMPLES
    off = 0.25 if SAMPLES == 4 else 0.0  # pixels from the centre, to either side in both directions
    world_x = left + (column.to(tl.float32) + off * (2 * (which % 2) - 1).to(tl.float32)) * px
    world_y = top - (line.to(tl.float32) + off * (2 * (which // 2) - 1).to(tl.float32)) * px

    nothing = tl.zeros((SIDE * SIDE * SAMPLES,), tl.float32)
    flat = tl.zeros((LEVELS, SIDE * SIDE * SAMPLES), tl.float32)
    states, reds, greens, blues = flat + empty, flat, flat, flat
    place = tl.arange(0, LEVELS)[:, None]
    for pair in range(tl.load(starts + block), tl.load(starts + block + 1)):
        number = tl.load(objects + pair)
        row = rows + number * ROW
        part = parts + number * 6
        cell = row + CELL
        at = tl.load(levels + pair)
        here, above = place == at, place == at + 1
        state, red = _level(states, here), _level(reds, here)
        green, blue = _level(greens, here), _level(blues, here)
        if number >= LEAVES:  # a group joins what it stands in as an object
            distance = _level(states, above) * tl.load(row)
            own_red, own_green, own_blue = _level(reds, above), _level(greens, above), _level(blues, above)
            states = tl.where(above, empty, states)
            reds, greens = tl.where(above, 0.0, reds), tl.where(above, 0.0, greens)
            blues = tl.where(above, 0.0, blues)
        else:
            distance, own_red, own_green, own_blue = _object(
                world_x, world_y, row, part, weights, OUTER, INNER, WIDTH
            )

        # the cell: lines in what it is shown and what it remembers, the first of them the gate of the state
        take = _unit(tl.load(cell) * distance + tl.load(cell + 1) * state + tl.load(cell + 2))
        paint = nothing
        for _ in tl.static_range(LINES):
            cell += 3
            level = tl.load(cell) * distance + tl.load(cell + 1) * state + tl.load(cell + 2)
            paint = tl.maximum(paint, level)
        paint = tl.minimum(paint, 1.0)
        candidate, bump = tl.load(cell + 3) * distance, tl.load(cell + 4)
        state = state + take * (candidate - state) - take * (1.0 - take) * bump
        red += paint * (own_red - red)
        green += paint * (own_green - green)
        blue += paint * (own_blue - blue)
        states, reds = tl.where(here, state, states), tl.where(here, red, reds)
        greens, blues = tl.where(here, green, greens), tl.where(here, blue, blues)

    bottom = place == 0
    state, red = _level(states, bottom), _level(reds, bottom)
    green, blue = _level(greens, bottom), _level(blues, bottom)
    alpha = _unit(0.5 - state * slope)
    red, green = _mean(red * alpha, SAMPLES), _mean(green * alpha, SAMPLES)
    blue, alpha = _mean(blue * alpha, SAMPLES), _mean(alpha, SAMPLES)
    pixel = tl.arange(0, SIDE * SIDE)
    column, line = (block % across) * SIDE + pixel % SIDE, (block // across) * SIDE + pixel // SIDE
    inside = (column < width) & (line < height)
    out += (line * width + column) * CHANNELS
    if CHANNELS == 4:
        tl.store(out + 3, alpha, inside)
    else:
        red += (1.0 - alpha) * tl.load(background)
        green += (1.0 - alpha) * tl.load(background + 1)
        blue += (1.0 - alpha) * tl.load(background + 2)
    tl.store(out, red, inside)
    tl.store(out + 1, green, inside)
    tl.store(out + 2, blue, inside)


WIDTHS = 16, 32  # of decoders: the least of a product in Triton, and the most for which there is room
ALIGNED = 4  # words: Triton compiles a kernel once more for arrays that begin elsewhere
KINDS = list(STEPS)  # of steps of colour, by the place at which the kernel knows them
WARPS = 8  # of 32 threads, for the 256 samples of a block


@lru_cache
def ready() -> bool:
    """True where Triton can start kernels: it looks for a device, and builds a library with a C compiler."""
    try:
        return triton.runtime.driver.active.get_current_target() is not None
    except (ImportError, OSError, RuntimeError, SubprocessError):
        return False


def draw_on_device(network: Framed, program: Program, samples: str = "adaptive") -> Drawing | None:
    """Draw a Program as `draw_objects` does, with four samples a pixel where that is adaptive; None of what
    the kernel does not know: solids, gradients, outlines, leaves with skins, what is not opaque, 16 samples,
    decoders of more than 32 units, features beside a distance, a state of more than one number, and frames
    that need float64. Raises `ProgramError` as `draw` does.
    """
    if samples == "draft":
        result = draw_on_device(network, halved(program), "one")
        return result and replace(result, image=enlarged(result.image, program.canvas))
    config = network.config
    if program.stage or not config.features == config.state == 1 or config.decoder_width > WIDTHS[1]:
        return None
    versions = [(id(p), 0 if p.is_inference() else p._version) for p in network.parameters()]
    host = on_host(network, tuple(versions))
    field = Field(host, program.vectors, program.tokens, program.brought(), program.paints())
    gradient = any(texture.texels is None for texture in field.textures)
    more = field.clear or (program.samples != 4 and samples != "one") or (field.outline >= 0).any()
    if field.frames.wild.any() or field.skins is not None or gradient or more:
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
    """A picture (H, W, 3), or without a background premultiplied (H, W, 4), that the device of ``like`` has
    begun to draw, of a field on the host and pairs of its objects and the raster's largest blocks.
    """
    (width, height), across = grid.canvas, grid.wide // LEVELS[0]
    blocks = across * grid.high // LEVELS[0]
    block, objects, levels = _ordered(field, pairs)
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
        CELL=field.layout.geometry - field.layout.places.frame.start + 4,  # behind scale and colour
        WIDTH=wide,
        LINES=config.paint_lines,
        LEVELS=1 << int(levels.max(initial=0)).bit_length(),
        LEAVES=2 * len(field.tokens),
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
    result = FramedArrays(network.config, {k: v.cpu().numpy() for k, v in network.state_dict().items()})
    result.layout = network.layout
    return result


def _ordered(field: Field, pairs: Pairs) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Blocks, rows and levels of pairs and of the groups that end between them. Behind the rows of N objects
    are those of objects that begin a state as they are, and groups'.
    """
    if not field.groups.deepest:
        return pairs.block, pairs.object, 0 * pairs.object
    meetings, _ = meetings_of(pairs)
    nest, count, blocks = nesting(meetings, field.groups), len(field.tokens), len(meetings.columns)
    result = list[tuple[np.ndarray, ...]]()  # columns, rows, levels, moments
    for moment, (which, _, at, ending, fresh) in enumerate(nest.turns):
        objects = 2 * count + which if ending is not None else meetings.pairs.object[which] + count * fresh
        level, column = np.divmod(np.arange(nest.states)[at], blocks)
        result.append((column, objects, level, np.full(len(column), moment)))
    columns, rows, levels, moments = (np.concatenate(parts) for parts in zip(*result, strict=True))
    block = meetings.columns[columns]
    by = np.lexsort((moments, block))
    return block[by], rows[by], levels[by]


def _rows(field: Field) -> np.ndarray:
    """Rows of the kernel's table: objects, these as first in a state, and groups."""
    count, layout = len(field.tokens), field.layout
    way = field.vectors[:, layout.places.frame.start : layout.geometry]
    whole = np.concatenate([way, field.frames.scale[:, None], field.colours.T], 1)
    groups = np.zeros((len(field.groups.joins), whole.shape[1]))
    groups[:, 0] = 1 / field.unit
    every = np.arange(count)
    parts = [(whole, field.cells(every)), (whole, field.cells(every, opened=True)), (groups, field.joins())]
    result = []
    for row, cell in parts:
        lines = np.concatenate([cell.lines, cell.bias[:, None]], 1)  # (1 + L, 3, N)
        gates = [lines.reshape(3 * len(lines), len(row)).T, cell.candidate[0].T, cell.bump.T]
        result.append(np.concatenate([row, *gates], 1, dtype=np.float32))
    return np.concatenate(result)


def _weights(field: Field, wide: int) -> tuple[np.ndarray, np.ndarray]:
    """The kernel's ``parts``, of each row of an object (2 N, 6), and its ``weights``."""
    shapes = [s.nodes if isinstance(s, GridShape) else _decoder(s, wide) for s in field.shapes]  # type: ignore[arg-type]
    textures = [_texture_table(texture) for texture in field.textures]
    weights = [np.empty(0, np.float32), *shapes, *textures]
    begins = np.cumsum([part.size for part in weights])
    sides = [shape.side if isinstance(shape, GridShape) else 0 for shape in field.shapes]
    looks = [(len(texture.steps), *texture.sides) for texture in field.textures]
    shape = np.stack([begins[: len(shapes)], np.array(sides, int)], 1)
    texture = np.concatenate([begins[len(shapes) : -1, None], np.reshape(looks, (-1, 3))], 1)
    none = np.zeros((1, 4))  # which the last place is, and so that of `NO_TEXTURE`
    parts = [shape[field.shape], np.concatenate([texture, none])[field.texture]]
    whole = np.concatenate(parts, 1).astype(np.int32)
    return np.concatenate([whole] * 2), np.concatenate(weights)


def _texture_table(texture: Texture) -> np.ndarray:
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
