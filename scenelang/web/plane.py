"""The framed network for the page's shader: GLSL with its sizes and decoders, and the cell as an array."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np

from scenelang.assets.element import HARD
from scenelang.compiler.graph import LUMA
from scenelang.compiler.program import STEPS, ProgramError
from scenelang.drawing.neural import field
from scenelang.drawing.neural.network import EMPTY, RADIUS, Cell, Decoder, FramedArrays
from scenelang.drawing.neural.units import GROUPS, RADIAL, SECTORS, UP, LeafUnits, mirrors
from scenelang.language.words import TOKENS
from scenelang.web.arrays import ArrayStore, web
from scenelang.web.solid import unit_lines

NODES: Final = 257  # along a side of the grid for bounds of decoders
INSIDE: Final = 0.01  # leaf units: least depth inside of points that count as covered
UNKNOWN: Final = 1e9  # leaf units: a bound that rules nothing out


class LeafDecoder(NamedTuple):
    """A decoder for shaders, in leaf units."""

    text: list[str]  # statements that return a distance at a point q
    products: int
    bounds: tuple[float, ...]  # (3,): it is no nearer than |q.x|, |q.y| and |q| less these
    inner: float  # radius of a disc within the shape, 0 where none is known


def shader(network: FramedArrays, store: ArrayStore) -> dict[str, Any]:
    """The parts ``shader`` and ``network`` of a view; `ProgramError` where it knows more than distances."""
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
    sizes = {
        **{name.upper(): token for name, token in TOKENS.items()},
        **{"KINDS": len(lines), "LINES": config.paint_lines, "UNIT": unit},
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
                {"text": "\n".join(text), "products": products, "bounds": bounds, "inner": inner}
                for text, products, bounds, inner in leaves(network)
            ],
        },
    }


@lru_cache(maxsize=8)
def leaves(network: FramedArrays) -> list[LeafDecoder]:
    """The decoders of all geometries of a network."""
    axis = np.linspace(-RADIUS, RADIUS, NODES)
    p = np.stack(np.meshgrid(axis, axis)).reshape(2, -1)
    off = (axis[1] - axis[0]) * 0.5**0.5  # largest distance of a point to the nearest node
    radius, result = np.hypot(*p), []
    for decoder in network.decoders(network.codes):
        if not isinstance(decoder, LeafUnits):
            result.append(LeafDecoder(*_layers(decoder), (UNKNOWN,) * 3, 0.0))
            continue
        middle, rise = decoder.distance(p), decoder.steepest * off
        bounds = tuple(float((n - (middle - rise)).max()) + off for n in (*abs(p), radius))
        inner = max(0.0, float(radius[middle + rise > -INSIDE].min()) - off)
        result.append(LeafDecoder(*_units(decoder), bounds, inner))
    return result


def _units(decoder: LeafUnits) -> tuple[list[str], int]:
    """Statements that return an answer of norm units at q, and how many products it takes."""
    layers, lines, products = decoder.layers, ["vec2 s = abs(q);"], decoder.layers.products
    names = {RADIAL: "length(q)", 1: "s.x", 2: "s.y", UP: "q.y"}
    for (first, second), n in zip(GROUPS[UP:], SECTORS, strict=True):
        names |= {first: f"f{n}.x", second: f"f{n}.y"}
        if first in layers.features or second in layers.features:
            lines.append(f"vec2 f{n} = vec2(q.y, s.x);")
            for cos, sin, beyond in mirrors(n):
                past = f"max({cos!r} * f{n}.y - {sin!r} * f{n}.x, 0.0)"
                lines.append(f"f{n} += {past} * vec2({2 * sin!r}, {-2 * cos!r});")
                lines += [f"f{n}.y = abs(f{n}.y);"] * beyond
                products += 4
    lines += unit_lines(layers, [names[i] for i in layers.features])
    taken = " - u0" if layers.notch else ""
    return [*lines, f"return far + min(deep, 0.0){taken} - {float(layers.radius)!r};"], products


def _layers(decoder: Decoder) -> tuple[list[str], int]:
    """As `_units`, of a decoder of before with rectified units."""
    lines = [f"float r = length(q), grown = max(r - {RADIUS}, 0.0);", f"q *= {RADIUS} / max(r, {RADIUS});"]
    inputs, products = ["q.x", "q.y"], 0
    for (w, b), name in zip(decoder.layers, "abc", strict=True):
        for k, (row, bias) in enumerate(zip(w.tolist(), b.tolist(), strict=True)):
            total = " + ".join([repr(bias), *(f"{x} * {v!r}" for x, v in zip(inputs, row, strict=True))])
            lines.append(f"float {name}{k} = {total if name == 'c' else f'max({total}, 0.0)'};")
        inputs, products = [f"{name}{k}" for k in range(len(b))], products + w.size
    return [*lines, f"return c0 + grown * {float(decoder.far.item())!r};"], products
