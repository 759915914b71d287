"""The framed network for the page's shader: GLSL with its sizes, and its weights as arrays.

A decoder's hidden units that are at most zero at all points of its disc are left out: the answers stay the
same, with a third of the multiplications. The proof is a grid of points and bounds of a unit's change between
them.
"""

from __future__ import annotations

from collections.abc import Set
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import HARD
from scenelang.compiler.graph import LUMA
from scenelang.compiler.program import STEPS, ProgramError
from scenelang.drawing.neural import field
from scenelang.drawing.neural.network import EMPTY, EXTENT, RADIUS, Cell, FramedArrays
from scenelang.language.words import TOKENS
from scenelang.web.arrays import ArrayStore, web

NODES: Final = 129  # along a side of the grid for bounds of decoders
QUARTERED: Final = 7  # times that squares are quartered to prove that a unit is never above zero
INSIDE: Final = 0.01  # leaf units: least depth inside of points that count as covered
UNKNOWN: Final = 1e9  # leaf units: a bound that rules nothing out

Floats = npt.NDArray[np.float64]


class LeafDecoder(NamedTuple):
    """A decoder for shaders, in leaf units."""

    first: Floats  # (n, 3) of the units of the first layer: factors of x and y, and bias
    second: Floats  # (m, 1 + n) of those of the second: bias, and factors of the first
    last: Floats  # (m + 1,) factors of these, and bias
    far: float  # growth beyond the rim
    # (3,): it is no nearer than |q.x|, |q.y| and |q| less these, times `far` where that is below 1
    bounds: tuple[float, ...]
    inner: float  # radius of a disc within the shape, 0 where none is known


def shader(network: FramedArrays, store: ArrayStore, skinned: Set[int] = frozenset()) -> dict[str, Any]:
    """The parts ``shader`` and ``network`` of a view, ``skinned`` the geometries with `grow` or `shell`.

    Raises `ProgramError` if the network knows more than distances.
    """
    config = network.config
    if not config.features == config.state == 1:
        raise ProgramError("a network that knows more than distances, which no page draws")
    cells = field.rounded(Cell(*network.cell_weights()), config.state)
    cell = Cell(*(np.delete(part, field.ROUNDED + TOKENS["smooth"], 0) for part in cells))
    lines = np.concatenate([cell[0], cell[1][..., None]], 2)  # (kinds, 1 + L, 3)
    ends = np.concatenate([cell[2][:, 0], cell[3][:, 0]], 1)  # (kinds, 2)
    table = np.zeros((len(lines), config.paint_lines + 2, 4), np.float32)
    table[:, :-1, :3], table[:, -1, :2] = lines, ends
    unit = float(np.linalg.norm(cells[2][TOKENS["union"], 0]))
    levels = network.levels() if skinned else {}
    short = [levels.get(code.tobytes()) if i in skinned else None for i, code in enumerate(network.codes)]
    sizes = {
        **{name.upper(): token for name, token in TOKENS.items()},
        **{"KINDS": len(lines), "LINES": config.paint_lines, "RIM": RADIUS, "UNIT": unit},
        **{"BLEND": field.BLEND, "FARTHER": field.FARTHER, "FARTHEST": field.FARTHEST},
        **{"SLOPE": float(np.exp(network.read_slope)) / 4, "LUMA": f"vec3{LUMA}", "HARD": HARD},
        **{name.upper(): float(at) for at, name in enumerate(STEPS)},
    }
    defines = "".join(f"#define {name} {value}\n" for name, value in sizes.items())
    text = "".join(f"precision highp {kind};\n" for kind in ("float", "int", "sampler2D"))
    return {
        "shader": {"fragment": text + defines + web("angles.glsl") + web("plane.glsl")},
        "network": {
            "cell": store.add(table.reshape(-1)),
            **{"empty": EMPTY, "blend": field.BLEND, "slack": field.SLACK},
            **{"farther": field.FARTHER, "farthest": field.FARTHEST},
            "paintSteps": list(STEPS),
            "decoders": [
                {
                    "units": [len(leaf.first), len(leaf.second)],
                    "weights": store.add(np.concatenate([*map(np.ravel, leaf[:3])], dtype=np.float32)),
                    "far": leaf.far,
                    "bounds": leaf.bounds,
                    "inner": leaf.inner,
                    **({} if grid is None else _level(grid, store)),
                }
                for leaf, grid in zip(leaves(network), short, strict=True)
            ],
        },
    }


def _level(grid: npt.NDArray[np.float32], store: ArrayStore) -> dict[str, Any]:
    """The entry of a decoder's grid (n, n), which is added where its leaf has a skin."""
    step = float(abs(grid).max()) / 127 or 1.0
    values = store.add(np.round(grid / step).astype(np.int8).reshape(-1))
    return {"level": {"values": values, "side": len(grid), "step": step, "extent": EXTENT}}


@lru_cache(maxsize=8)
def leaves(network: FramedArrays) -> list[LeafDecoder]:
    """The decoders of all geometries of a network."""
    axis = np.linspace(-RADIUS, RADIUS, NODES)
    p = np.stack(np.meshgrid(axis, axis)).reshape(2, -1)
    off = (axis[1] - axis[0]) * 0.5**0.5  # largest distance of a point to the nearest node
    far, result = float(network.far[0]), []
    for code, decoder in zip(network.codes, network.decoders(network.codes), strict=True):
        layers = [(np.asarray(w, np.float64), np.asarray(b, np.float64)) for w, b in decoder.layers]
        slopes = network.slopes.get(code.tobytes())
        bounds: tuple[float, ...] = (UNKNOWN,) * 3
        inner = 0.0
        if slopes is not None and far > 0:
            radius = np.hypot(*p)
            middle = network.decode(p, radius, 1.0, decoder)[0]
            rise, seen = slopes.rise(p, np.full(p.shape[1], off)), radius <= RADIUS + off
            gaps = [n - (middle - rise) / min(far, 1.0) for n in (*abs(p), radius)]
            bounds = tuple([float(gap[seen].max()) + off for gap in gaps])
            inner = max(0.0, float(radius[middle + rise > -INSIDE].min()) - off)
        (w, b), (v, c), (u, d) = layers
        first = b + RADIUS * np.hypot(*w.T) > 0  # without the units that are nowhere above zero
        w, b, v = w[first], b[first], v[:, first]
        second = _firing(w, b, v, c)
        kept = np.column_stack([w, b]), np.column_stack([c, v])[second], np.append(u[0, second], d[0])
        result.append(LeafDecoder(*kept, far, bounds, inner))
    return result


def _firing(w: Floats, b: Floats, v: Floats, c: Floats) -> npt.NDArray[np.bool_]:
    """Mask (m,) of units of the second layer that are not proved to be at most zero in all of the disc.

    Squares without a proof are quartered.
    """
    half = RADIUS / 16
    axis = np.arange(half - RADIUS, RADIUS, 2 * half)
    p = np.stack(np.meshgrid(axis, axis)).reshape(2, -1)
    fires = np.zeros(len(c), bool)
    for _ in range(QUARTERED):
        off = half * 2**0.5
        p = p[:, np.hypot(*p) < RADIUS + off]
        steep = off * np.hypot(*w.T)[:, None]  # by how much units of the first layer change in a square
        hidden = w @ p + b[:, None]
        on, mixed = (hidden > steep).astype(float), (abs(hidden) <= steep) * steep
        # units that are above zero in all of a square add up before their length is taken
        rise = off * np.hypot(*((v * along) @ on for along in w.T)) + abs(v) @ mixed
        inner = v @ np.maximum(hidden, 0.0) + c[:, None]
        fires |= ((inner > 0) & (np.hypot(*p) <= RADIUS)).any(1)
        left = (inner + rise > 0) & ~fires[:, None]
        half /= 2
        corners = np.array([[-1, 1, -1, 1], [-1, -1, 1, 1]]) * half
        p = (p[:, left.any(0), None] + corners[:, None]).reshape(2, -1)
    fires |= left.any(1)
    return fires
