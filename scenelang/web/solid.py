"""The solid network for the page's shader: its layers as GLSL, its numbers as one array.

Each shape's decoder and each token's cell is prepared here, as a renderer would.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import accumulate, pairwise
from typing import Any, Final

import numpy as np

from scenelang.assets.element import HARD
from scenelang.compiler.groups import INTERSECT, SUBTRACT
from scenelang.compiler.spaces import AMBIENT, EXTINCTION, FADE, LIFT, NEAREST, Stage, stage_data
from scenelang.drawing.arrays import Smooth
from scenelang.drawing.neural.network import TOKENS
from scenelang.drawing.solid.network import BLEND, EMPTY, RADIUS, SolidArrays, SolidCell
from scenelang.drawing.solid.norms import Norms
from scenelang.drawing.tables import LOOSE, SLACK
from scenelang.web.arrays import ArrayStore, web

FILES: Final = ("solid.glsl", "fold.glsl", "rays.glsl", "look.glsl", "lamps.glsl", "light.glsl")
"""Files of ``viewer/``, in order."""
_CONSTANTS: Final = {
    **{"EMPTY": EMPTY, "RADIUS": RADIUS, "EXTINCTION": EXTINCTION, "NEAREST": NEAREST},
    **{"LIFT": LIFT, "AMBIENT_EVEN": AMBIENT[0], "AMBIENT_UP": AMBIENT[1], "HARD": HARD},
}


def shader(network: SolidArrays, store: ArrayStore) -> dict[str, Any]:
    """The parts ``shader`` and ``network`` of a view."""
    config, decoders = network.config, [network.decoder(code) for code in network.codes]
    paint, kind = config.paint_lines, config.kind_lines
    products = [d.products if isinstance(d, Norms) else sum(w.size for w, _ in d) for d in decoders]
    kinds = [*(network.cell(token, BLEND) for token in range(TOKENS))]
    kinds += [network.cut(token, BLEND) for token in (SUBTRACT, INTERSECT)]
    cells = np.concatenate([_cell(each[-1]) for each in kinds])
    cells[TOKENS * (2 + paint + kind) :].reshape(2, -1, 4)[:, 2:] = 0.0, 0.0, -1.0, 0.0  # colours are kept
    sizes = {"CELL": 2 + paint + kind, "GEOMETRIES": len(decoders)}
    parts = [web("angles.glsl"), *(f"const float {name} = {value!r};" for name, value in _CONSTANTS.items())]
    parts += [f"const int {name} = {value};" for name, value in sizes.items()]
    usual = stage_data(Stage())
    usual["lights"] = [{**usual.pop("light"), "radius": 0.0}]
    usual["ground"]["fade"], usual["camera"]["exposure"] = FADE, 1.0
    parts += ["#ifndef LAMPS\n#define LAMPS 1\n#endif", _struct("Stage", usual)]
    said = "of each join what is made of a distance, a bump; then lines"
    parts += [f"uniform vec4 cells[{len(cells)}]; // {said}"]
    parts += [_decoders(decoders, sloped=False), _decoders(decoders, sloped=True), _gates(paint, kind)]
    boxes = np.array([network.box(layers) for layers in decoders], np.float32)
    return {
        "shader": {"source": "".join(map(web, FILES)).replace("//network//", "\n".join(parts))},
        "network": {
            "cells": store.add(cells.astype(np.float32).reshape(-1)),
            "boxes": store.add(boxes.reshape(-1)),
            "geometries": len(decoders),
            **{"blend": BLEND, "extinction": EXTINCTION, "slack": SLACK, "loose": LOOSE, "far": RADIUS},
            "products": max(products) + 2 * (1 + paint + kind),
        },
    }


def _struct(name: str, part: dict[str, Any]) -> str:
    """GLSL of the type of a part of the stage, behind those of its own parts; lists are of lamps."""
    inner = [_struct(field.title(), value) for field, value in part.items() if isinstance(value, dict)]
    inner += [_struct("Light", each) for value in part.values() if isinstance(value, list) for each in value]
    types = {tuple: "vec3", float: "float", bool: "bool", list: "Light"}
    lines = [
        f"{types.get(type(value), field.title())} {field}{'[LAMPS]' * isinstance(value, list)};"
        for field, value in part.items()
    ]
    return "\n".join([*inner, f"struct {name} {{ {' '.join(lines)} bool on; }};"])


def _cell(cell: SolidCell) -> np.ndarray:
    """A cell (K, 4): its factor of a distance and its bump; then each line's own, past and bias."""
    lines = np.concatenate([cell.own, cell.past, cell.bias, 0 * cell.bias], 1)
    return np.concatenate([[[cell.candidate.item(), cell.bump.item(), 0.0, 0.0]], lines])


def _gates(paint: int, kind: int) -> str:
    """GLSL of the cell's gates, of lines behind the place ``at``; distances in widths of the usual blend."""

    def largest(first: int, count: int) -> str:
        gates = [f"dot(cells[at + {first + i}].xyz, vec3(d, before, 1.0))" for i in range(count)]
        return f"return clamp({_highest(gates)}, 0.0, 1.0);"

    parts = {"taking": (1, 1), "painting": (2, paint), "kind": (2 + paint, kind)}
    head = "(int at, float d, float before)"
    return "".join(f"float {name}{head} {{\n  {largest(*lines)}\n}}\n" for name, lines in parts.items())


def _decoders(decoders: Sequence[Smooth | Norms], sloped: bool) -> str:
    """GLSL of the decoders, those of shapes that a scene shows; if sloped with their gradients.

    Weights are literals: compilers make three times as much of these as of uniforms.
    """
    lines = []
    for shape, layers in enumerate(decoders):
        made = _norms(layers, sloped) if isinstance(layers, Norms) else _decoder(layers, sloped)
        body = [f"    {line}" for line in made]
        lines += [f"#ifdef SHAPE_{shape}", f"  if (shape == {shape}) {{", *body, "  }", "#endif"]
    head = f"float decoder(int shape, vec3 q{', out vec3 g' if sloped else ''}) {{"
    return "\n".join([head, *(["  g = vec3(0.0);"] if sloped else []), *lines, "  return EMPTY;", "}"])


def _decoder(layers: Smooth, sloped: bool) -> list[str]:
    """Statements that return an answer; units go with their gradients, which may be left unused."""
    lines, inputs = ["vec4 x = vec4(q.x, 1, 0, 0), y = vec4(q.y, 0, 1, 0), z = vec4(q.z, 0, 0, 1);"], [*"xyz"]
    for (w, b), name in zip(layers, "abc", strict=True):
        for k, (row, bias) in enumerate(zip(w.tolist(), b.tolist(), strict=True)):
            terms = [f"{x} * {v!r}" for x, v in zip(inputs, row, strict=True)]
            lines.append(f"vec4 {name}{k} = vec4({bias!r}, 0, 0, 0) + {' + '.join(terms)};")
            if name != "c":
                lines.append(f"{name}{k} = swish({name}{k});")
        inputs = [f"{name}{k}" for k in range(len(b))]
    return [*lines, *(["g = c0.yzw;"] if sloped else []), "return c0.x;"]


def unit_lines(layers: Norms, names: Sequence[str]) -> list[str]:
    """Statements of levels ``l0`` and so on, cut at zero but inside, by the names of features; of lengths
    ``u0`` and so on of units, the first of a notch if there is one; of the highest unit and the depth.
    """
    levels = [
        " + ".join([repr(float(b)), *(f"{x} * {v!r}" for x, v in zip(names, row.tolist(), strict=True) if v)])
        for row, b in zip(layers.w, layers.b, strict=True)
    ]
    lines = [f"float l{i} = {level};" for i, level in enumerate(levels)]
    sizes = (layers.notch, *layers.units) if layers.notch else layers.units
    lines += [f"l{i} = max(l{i}, 0.0);" for i in range(sum(sizes))]
    for k, (first, end) in enumerate(pairwise(accumulate(sizes, initial=0))):
        squares = [f"l{i} * l{i}" for i in range(first, end)]
        lines.append(f"float u{k} = sqrt({' + '.join(squares)});")
    lengths = [f"u{k}" for k in range(bool(layers.notch), len(sizes))]
    lines.append(f"float far = {_highest(lengths) if lengths else '0.0'};")
    inner = [f"l{i}" for i in range(sum(sizes), len(levels))]
    return [*lines, f"float deep = {_highest(inner) if inner else '0.0'};"]


def _norms(layers: Norms, sloped: bool) -> list[str]:
    """Statements that return the answer of norm units, as `norms.answers`."""
    names = ("s.x", "s.y", "s.z", "across", "q.y", "most", "least")
    lines = [
        "vec3 s = abs(q);",
        "float across = length(q.xz), most = max(max(s.x, s.y), s.z), least = min(min(s.x, s.y), s.z);",
        *unit_lines(layers, [names[i] for i in layers.features]),
    ]
    if sloped:
        lines.append("vec3 a = vec3(0.0); float about = 0.0, up = 0.0, top = 0.0, low = 0.0;")
        places = ("a.x", "a.y", "a.z", "about", "up", "top", "low")
        ends = enumerate(pairwise(accumulate(layers.units, initial=0)))
        units = ((k, i) for k, (first, end) in ends for i in range(first, end))
        rates = [f"u{k} == far ? l{i} / max(far, 1e-18) : 0.0" for k, i in units]
        inner = (f"l{i}" for i in range(sum(layers.units), len(layers.b)))
        rates += [f"(deep < 0.0 || far == 0.0) && {name} == deep ? 1.0 : 0.0" for name in inner]
        for rate, row in zip(rates, layers.w.tolist(), strict=True):
            terms = [f"{places[i]} += r * {v!r};" for i, v in zip(layers.features, row, strict=True) if v]
            lines.append(f"{{ float r = {rate}; {' '.join(terms)} }}")
        lines.append("a += top * vec3(equal(s, vec3(most))) + low * vec3(equal(s, vec3(least)));")
        lines.append("g = mix(a, -a, vec3(lessThan(q, vec3(0.0)))) + vec3(0.0, up, 0.0);")
        lines.append("g.xz += q.xz * (about / max(across, 1e-18));")
    return [*lines, f"return far + min(deep, 0.0) - {float(layers.radius)!r};"]


def _highest(names: Sequence[str]) -> str:
    return reduce(lambda a, b: f"max({a}, {b})", names)
