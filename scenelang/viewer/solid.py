"""The solid network for the page's shader: its layers as GLSL, its numbers as one array.

Each shape's decoder and each token's cell is prepared here, as a renderer would: weights linear in a code,
gains behind their exponential. What the scene decides, its rows, is the page's (``web/solid.js``). The other
half of the shader, the same for every network, is ``web/solid.glsl`` (the field and the way along rays) and
``web/light.glsl``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from scenelang.graph.stage import AMBIENT, EXTINCTION, FADE, LIFT, NEAREST
from scenelang.program.program import ProgramError
from scenelang.renderers.network import TOKENS
from scenelang.renderers.solid.network import BLEND, EMPTY, RADIUS, SolidArrays
from scenelang.renderers.solid.passes import SLACK
from scenelang.viewer.script import web
from scenelang.viewer.store import Store

MOST: Final = 1024
"""Numbers of a block of uniforms that every browser takes, in fours."""
_CONSTANTS: Final = {
    "EMPTY": EMPTY,
    "RADIUS": RADIUS,
    "EXTINCTION": EXTINCTION,
    "FADE": FADE,
    "NEAREST": NEAREST,
    "LIFT": LIFT,
    "AMBIENT_EVEN": AMBIENT[0],
    "AMBIENT_UP": AMBIENT[1],
}


def shader(network: SolidArrays, store: Store) -> dict[str, Any]:
    """The parts ``shader`` and ``network`` of a view.

    Raises:
        ProgramError: the network is too large for a page.
    """
    quads, geometries = _quads(network), len(network.codes)
    paint, kind = network.config.paint_lines, network.config.kind_lines
    decoders = [network.decoder(code) for code in network.codes]
    parts = [_numbers(layers, quads) for layers in decoders]
    uniforms = np.concatenate([*parts, *(_cell_numbers(network, token) for token in range(TOKENS))])
    if len(uniforms) > MOST:
        raise ProgramError("a network with more weights than a page's shader holds")
    sizes = {"DECODER": len(parts[0]), "CELLS": geometries * len(parts[0]), "CELL": 2 + paint + kind}
    lines = [f"const float {name} = {value!r};" for name, value in _CONSTANTS.items()]
    lines += [f"const int {name} = {value};" for name, value in {**sizes, "GEOMETRIES": geometries}.items()]
    lines += [f"layout(std140) uniform Network {{ vec4 network[{len(uniforms)}]; }};"]
    text = "\n".join([*lines, _decoder(quads), _cell(paint, kind)])
    width = network.config.width
    return {
        "shader": {"source": web("solid.glsl").replace("//network//", text) + web("light.glsl")},
        "network": {
            "uniforms": store.add(uniforms.astype(np.float32).reshape(-1)),
            "boxes": store.add(
                np.array([network.box(layers) for layers in decoders], np.float32).reshape(-1)
            ),
            "geometries": geometries,
            "blend": BLEND,
            "slack": SLACK,
            "far": RADIUS,
            "products": width * (width + 4) + 2 * (1 + paint + kind),
        },
    }


def _quads(network: SolidArrays) -> int:
    return -(-network.config.width // 4)


def _numbers(layers: Sequence[tuple[np.ndarray, np.ndarray]], quads: int) -> np.ndarray:
    """Weights of a decoder by columns (K, 4), each layer's biases behind them, filled with zeros."""
    columns = []
    for (w, b), inputs in zip(layers[:-1], (3, 4 * quads), strict=True):
        full = np.zeros((inputs + 1, 4 * quads))
        full[: w.shape[1], : len(w)], full[-1, : len(b)] = w.T, b
        columns.append(full.reshape(-1, 4))
    (w, b), last = layers[-1], np.zeros((quads + 1) * 4)
    last[: w.shape[1]], last[4 * quads] = w[0], b[0]
    return np.concatenate([*columns, last.reshape(-1, 4)])


def _cell_numbers(network: SolidArrays, token: int) -> np.ndarray:
    """A token's cell (K, 4): what is made of a distance and the bump; then each line's own, past and bias."""
    cell = network.cell(token, BLEND)[-1]
    lines = np.concatenate([cell.own, cell.past, cell.bias, 0 * cell.bias], 1)
    return np.concatenate([[[cell.candidate.item(), cell.bump.item(), 0.0, 0.0]], lines])


def _sum(start: str, factors: Sequence[str], first: int, stride: int) -> str:
    """A sum of columns times factors, in GLSL; the columns begin at ``at``."""
    return " + ".join([start, *(f"{f} * network[at + {first + i * stride}]" for i, f in enumerate(factors))])


def _decoder(quads: int) -> str:
    """GLSL of the decoder, with its derivative: of weights that begin at ``at``."""
    every, axes = range(quads), "xyzw"
    second = 4 * quads
    third = second + (4 * quads + 1) * quads
    first = [_sum(f"network[at + {3 * quads + k}]", ["q.x", "q.y", "q.z"], k, quads) for k in every]
    units = [f"h{k}.{axis}" for k in every for axis in axes]
    hidden = [_sum(f"network[at + {third - quads + k}]", units, second + k, quads) for k in every]
    last = " + ".join(
        [f"network[at + {third + quads}].x", *(f"dot(i{k}, network[at + {third + k}])" for k in every)]
    )
    plain, sloped = [], []
    for layer, name in ((first, "h"), (hidden, "i")):
        for k, line in enumerate(layer):
            plain += [f"vec4 {name}{k} = {line};", f"{name}{k} /= 1.0 + exp(-{name}{k});"]
            a, s = f"{name}{k}a", f"{name}{k}s"
            sloped += [f"vec4 {a} = {line}, {s} = 1.0 / (1.0 + exp(-{a})), {name}{k} = {a} * {s};"]
            sloped += [f"{s} *= 1.0 + {a} - {name}{k};"]
    sloped += [f"i{k}s *= network[at + {third + k}];" for k in every]
    for k in every:
        dots = [
            " + ".join(f"dot(network[at + {second + (4 * k + j) * quads + m}], i{m}s)" for m in every)
            for j in range(4)
        ]
        sloped.append(f"h{k}s *= vec4({', '.join(dots)});")
    dots = [" + ".join(f"dot(network[at + {j * quads + k}], h{k}s)" for k in every) for j in range(3)]
    sloped.append(f"g = vec3({', '.join(dots)});")
    return _function("float decoder(int at, vec3 q)", [*plain, f"return {last};"]) + _function(
        "float decoder(int at, vec3 q, out vec3 g)", [*sloped, f"return {last};"]
    )


def _cell(paint: int, kind: int) -> str:
    """GLSL of the cell's gates, of weights that begin at ``at``; distances in widths of the usual blend."""

    def gate(line: int) -> str:
        row = f"network[at + {line + 1}]"
        return f"clamp(dot({row}.xyz, vec3(d, before, 1.0)), 0.0, 1.0)"

    def largest(lines: range) -> str:
        found = gate(lines[0])
        for line in lines[1:]:
            found = f"max({found}, {gate(line)})"
        return found

    head = "(int at, float d, float before)"
    return "".join(
        _function(f"float {name}{head}", [f"return {text};"])
        for name, text in (
            ("taking", gate(0)),
            ("painting", largest(range(1, 1 + paint))),
            ("kind", largest(range(1 + paint, 1 + paint + kind))),
        )
    )


def _function(head: str, lines: Sequence[str]) -> str:
    return "\n".join([f"{head} {{", *(f"  {line}" for line in lines), "}", ""])
