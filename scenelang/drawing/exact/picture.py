"""The exact picture of a scene and its outputs, in float64: the definition that accuracy is measured against.

It is drawn from the graph as written, before any pass, so that it checks the compiler too.

Solids under a sky follow the rendering equation of docs/language.md, by random paths. A path starts at the
eye and turns at surfaces, and in media where it has flown as far as they let it. At each turn what is there
sends of itself and what comes from every lamp are added. Numbers of a path's first turn are spread evenly
over the paths of a sample, by additive recurrences, the others are random, from a fixed seed.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isqrt
from typing import Any, NamedTuple

import numpy as np

from scenelang.compiler.graph import Graph, Node, leaves
from scenelang.compiler.spaces import LIFT, Light, Stage
from scenelang.drawing.exact.field import Array, Brought, evaluate, parts, sample_points
from scenelang.drawing.exact.outline import of_element
from scenelang.drawing.exact.solid import (
    OPAQUE,
    TILE,
    ExactField,
    aimed,
    facing,
    heaven,
    length,
    seen_along,
    sideways,
    solid_image,
    visible,
    ways,
)
from scenelang.drawing.image import DEEP, Image, Outputs, from_samples
from scenelang.drawing.size import sized_root


def reference_image(
    graph: Graph,
    *,
    per_side: int | None = None,
    brought: Brought | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Image:
    """Draw the exact picture of a lowered graph: (H, W, 3), or (H, W, 4) with straight alpha where the
    background is none.

    A pixel has ``per_side`` samples along each side, by default as the scene says; ``brought`` are shapes of
    elements;
    ``progress`` is called with the share done. Raises `ValueError` where the eye is inside something opaque,
    or a shape is known only by what was made of it.
    """
    brought = true_shapes(graph, brought)
    per_side = per_side or isqrt(graph.samples)
    if (stage := graph.stage) is not None:
        how: Any = {"per_side": per_side, "brought": brought, "light": sky_light if stage.sky else None}
        return solid_image(graph.root, stage, graph.canvas, progress=progress, **how)
    width, height = graph.canvas
    colour = np.empty((height, width, 3))
    alpha = np.empty((height, width))
    done = 0
    for node, rows, columns in parts(graph.root, graph.canvas, brought):
        clear, p = translucent(node), sample_points(graph.canvas, rows, per_side, columns)
        d, c = evaluate(node, p, clear=clear, brought=brought)
        inside = (d < 0).reshape(len(rows), per_side, len(columns), per_side)
        shown = np.where(inside[..., None], c.reshape(*inside.shape, -1), 0.0)
        part = slice(rows.start, rows.stop), slice(columns.start, columns.stop)
        colour[part] = shown[..., :3].mean((1, 3))
        alpha[part] = (shown[..., 3] if clear else inside).mean((1, 3))
        done += len(rows) * len(columns)
        progress(done / (width * height))
    if graph.background is None:
        return from_samples(colour, alpha)
    return from_samples(colour + (1 - alpha)[..., None] * np.asarray(graph.background), None)


def translucent(node: Node) -> bool:
    """Return whether some object of a node is not opaque."""
    return any(leaf.look.opacity < 1.0 for leaf in leaves(node))


def true_shapes(graph: Graph, brought: Brought | None) -> Brought:
    """True shapes of the elements that a graph shows, those of outlines from their curves; raises
    `ValueError` where another one is not given.
    """
    result = dict(brought or {})
    for leaf in leaves(graph.root):
        if (element := graph.elements.get(name := leaf.geometry)) is not None and name not in result:
            if not element.curved:
                raise ValueError(f"the exact shape of `{name}` is not known")
            result[name] = of_element(element)
    return result


def graph_outputs(graph: Graph, brought: Brought | None = None) -> Outputs:
    """All outputs that a lowered graph has; raises as `reference_image`."""
    brought = true_shapes(graph, brought)
    width, height = graph.canvas
    result = np.zeros((6, height, width))  # depth, normal, object and alpha
    side = isqrt(graph.samples)
    if graph.stage is None:
        for node, rows, columns in parts(graph.root, graph.canvas, brought):
            part = slice(rows.start, rows.stop), slice(columns.start, columns.stop)
            p = sample_points(graph.canvas, rows, 1, columns)
            d, owner = evaluate(node, p, owners=True, brought=brought)
            result[4][part] = np.where(d < 0, owner[:, 0], 0).reshape(len(rows), len(columns))
            p = sample_points(graph.canvas, rows, side, columns)
            d, owner = evaluate(node, p, owners=True, brought=brought)
            covered = np.where(d < 0, owner[:, 2], 0.0).reshape(len(rows), side, len(columns), side)
            result[5][part] = covered.mean((1, 3))
        return Outputs(object=result[4].astype(np.int32), alpha=result[5].astype(np.float32))
    step = max(1, TILE // (graph.samples * width))
    root, stage, by = sized_root(graph.root, graph.stage)
    field = ExactField(root, brought)
    for top in range(0, height, step):
        rows = range(top, min(top + step, height))
        centres = _shown(field, stage, ways(stage, graph.canvas, rows, 1))
        view = seen_along(field, stage, ways(stage, graph.canvas, rows, side))[1]
        alpha = 1.0 - (view.last != OPAQUE) * np.exp(-view.total)  # the share that objects hide
        result[:5, rows.start : rows.stop] = centres.reshape(-1, len(rows), width)
        result[5, rows.start : rows.stop] = alpha.reshape(len(rows), side, width, side).mean((1, 3))
    depth, normal = (result[0] / by).astype(np.float32), np.moveaxis(result[1:4], 0, 2).astype(np.float32)
    return Outputs(depth, normal, result[4].astype(np.int32), result[5].astype(np.float32))


def _shown(field: ExactField, stage: Stage, d: Array) -> Array:
    """Depth, normal and object (5, M) along unit directions d (3, M)."""
    o, view = seen_along(field, stage, d)
    end = view.end
    forward = np.asarray(stage.camera.axes()[0])
    out = np.zeros((5, len(end)))
    out[2, end < np.inf] = 1.0
    ray = np.nonzero(view.last == OPAQUE)[0]
    inside, first = np.unique(view.ray, return_index=True)
    enter, leave = view.enter[first], view.leave[first]
    t = np.minimum((enter + leave) / 2.0, enter + DEEP)
    out[4, inside] = field.at(o[:, inside] + t * d[:, inside]).owner
    state, out[1:4, ray] = facing(field, o[:, ray] + end[ray] * d[:, ray], d[:, ray])
    out[4, ray] = state.owner
    out[0] = np.where(end < np.inf, (forward @ d) * np.where(end < np.inf, end, 1.0), np.inf)
    return out


PATHS = 16  # of a sample
LONGEST = 4_000  # turns of a path
SAFE = 3  # turns before a path may end by chance
SURFACE, MIST = 0.98, 0.99  # colours count at most so much

_EVEN = np.array([[0.7320508, 0.7548777, 0.5698403, 0.2360680, 0.6180340, 0.4142136, 0.6457513, 0.3166248]]).T
_NUMBERS = len(_EVEN)  # that a turn takes: flight, a way of two and of the lobe or not, the same for the lamp
_SEED = 20


def sky_light(field: ExactField, stage: Stage, d: Array, paths: int = PATHS) -> Array:
    """Light and alpha as `radiance`, under a sky: two findings (2, 4, M), each by half of the ``paths``."""
    random = np.random.default_rng([_SEED, *np.ascontiguousarray(d[:, 0]).view(np.uint64)])
    shift, found = random.random((_NUMBERS, d.shape[1])), np.zeros((2, 4, d.shape[1]))
    for count in range(paths):
        even = (shift + count * _EVEN) % 1.0
        found[count % 2] += paths_light(field, stage, d, random, even) / (paths / 2)
    return found


def paths_light(field: ExactField, stage: Stage, d: Array, random: np.random.Generator, even: Array) -> Array:
    """Light and alpha (4, M), as `radiance`, that one path along each unit direction d (3, M) finds; ``even``
    (`_NUMBERS`, M) are the numbers of its first turn.
    """
    sky: Any = stage.sky
    out, ray, weight = np.zeros((4, d.shape[1])), np.arange(d.shape[1]), np.ones((3, d.shape[1]))
    seen, o = stage, None
    power = 0.0 if stage.transparent else 1.0  # of what the eye sees behind everything
    for turn in range(LONGEST):
        o, view = seen_along(field, stage, d, o if turn else None)
        numbers = random.random((_NUMBERS, len(ray))) if turn else even
        gone = (view.end == np.inf) & (view.last != OPAQUE)
        if not turn:
            out[3] = np.where(gone, 1.0 - (1.0 - power) * np.exp(-view.total), 1.0)
        t = view.flown(-np.log1p(-numbers[0]))
        flying, inner = t < view.end, view.first == OPAQUE
        gone &= ~flying
        out[:3, ray[gone]] += weight[:, gone] * power * heaven(seen, d[:, gone])
        going = np.nonzero(~gone & ~inner)[0]
        ray, weight, d, numbers = ray[going], weight[:, going], d[:, going], numbers[:, going]
        flying, solid = flying[going], (view.last == OPAQUE)[going] & ~flying[going]
        p = o[:, going] + np.minimum(t, view.end)[going] * d
        place, glow = _met(field, stage, p, d, flying, solid)
        fade = stage.ground.fade if stage.ground else 1.0
        clear = np.where(flying | solid, 1.0, np.exp(-(p[0] ** 2 + p[2] ** 2) / fade**2))
        far = (power if turn else 1.0) * np.reshape(seen.horizon, (3, 1))
        out[:3, ray] += weight * ((1.0 - clear) * far + glow)
        weight = weight * clear
        o = np.where(flying, p, p + LIFT * place.normal)
        for light in stage.lights:
            out[:3, ray] += weight * _from_lamp(field, light, o, place, numbers)
        d, share = place.onward(numbers[1:4])
        weight = weight * share
        best = weight.max(0, initial=0.0)
        lives = np.minimum(best, 1.0) if turn >= SAFE else (best > 0.0).astype(float)
        going = np.nonzero(random.random(len(ray)) < lives)[0]
        ray, o, d, weight = ray[going], o[:, going], d[:, going], weight[:, going] / lives[going]
        seen, power = sky, sky.power
        if not len(ray):
            break
    return out


class Place(NamedTuple):
    """Points (M,) where paths turn: colour that counts, unit normal and unit way back (3, M), roughness as of
    a look, 0 for diffuse, and whether they are in a medium.

    Source: Walter et al., Microfacet Models for Refraction through Rough Surfaces, 2007; Schlick, An
    Inexpensive BRDF Model, 1994; Dupuy and Benyoub, Sampling Visible GGX Normals with Spherical Caps, 2023.
    """

    rgb: Array
    normal: Array
    back: Array
    rough: Array
    medium: Array

    def base(self) -> tuple[Array, Array, Array]:
        """Cosine of the way back (M,), colour under a lobe (3, M) and the chance to draw the lobe (M,)."""
        cos = np.maximum((self.normal * self.back).sum(0), 1e-6)
        shine = _fresnel(0.04, cos)
        colour = np.where(self.rough < 0.0, 0.0, self.rgb * (1.0 - shine))
        share = np.clip(shine / (shine + colour.max(0)), 0.1, 0.9)
        return cos, colour, np.where(self.rough < 0.0, 1.0, np.where(self.rough > 0.0, share, 0.0))

    def answer(self, d: Array) -> tuple[Array, Array]:
        """Share (3, M) of light along unit ways d (3, M) that goes back, pi f cos, of media a quarter of the
        colour; and, where it is glossy, how dense `onward` draws these ways (M,).
        """
        lit = np.maximum((self.normal * d).sum(0), 0.0)
        share = self.rgb * np.where(self.medium, 0.25, lit)
        if not self.rough.any():
            return share, lit
        cos, colour, chance = self.base()
        half = self.back + d
        half /= np.maximum(length(half), 1e-12)
        square, up = self.rough**4, (half * self.normal).sum(0)
        spread = np.maximum(square, 1e-9) / (np.pi * (up * up * (square - 1.0) + 1.0) ** 2 + 1e-300)
        lobe = spread * _lobe_shown(cos, square) / (4.0 * cos)
        shine = _fresnel(np.where(self.rough < 0.0, self.rgb, 0.04), (half * d).sum(0))
        glossy = np.pi * lobe * _lobe_shown(lit, square) * shine + colour * lit
        return np.where(self.rough, glossy * (lit > 0.0), share), chance * lobe + (1 - chance) * lit / np.pi

    def onward(self, numbers: Array) -> tuple[Array, Array]:
        """Unit ways (3, M) by numbers (3, M) in [0, 1), and what the light from there counts (3, M)."""
        axes = np.stack([*sideways(self.normal), self.normal])
        cos = np.where(self.medium, 1.0 - 2.0 * numbers[1], np.sqrt(1.0 - numbers[1]))
        d = np.einsum("kim,km->im", axes, _about(cos, np.sqrt(np.maximum(1.0 - cos * cos, 0.0)), numbers[0]))
        if not self.rough.any():
            return d, self.rgb
        # Facets that the way back sees are even on a cap of the ball that they are when stretched.
        stretch = np.stack([self.rough**2, self.rough**2, np.ones_like(self.rough)])
        v = stretch * np.einsum("kim,im->km", axes, self.back)
        v /= length(v)
        z = (1.0 - numbers[1]) * (1.0 + v[2]) - v[2]
        half = stretch * (_about(z, np.sqrt(np.clip(1.0 - z * z, 0.0, 1.0)), numbers[0]) + v)
        half = np.einsum("kim,km->im", axes, half / np.maximum(length(half), 1e-300))
        lobe = 2.0 * (half * self.back).sum(0) * half - self.back
        d = np.where(numbers[2] < self.base()[2], lobe, d)
        d /= length(d)
        share, density = self.answer(d)
        return d, np.where(self.rough, share / np.maximum(np.pi * density, 1e-300), self.rgb)


def _about(cos: Array, sin: Array, turn: Array) -> Array:
    """Vectors (3, M) about the third axis."""
    return np.stack([sin * np.cos(2.0 * np.pi * turn), sin * np.sin(2.0 * np.pi * turn), cos])


def _fresnel(straight: Any, cos: Array) -> Array:
    """Schlick's share of light that a surface reflects, of ``straight`` along its normal."""
    return straight + (1.0 - straight) * (1.0 - np.clip(cos, 0.0, 1.0)) ** 5


def _lobe_shown(cos: Array, square: Array) -> Array:
    """Share of a surface's facets that a way of a cosine sees, after Smith; ``square`` is alpha²."""
    return 2.0 * cos / (cos + np.sqrt(square + (1.0 - square) * cos * cos) + 1e-300)


def _met(field: ExactField, stage: Stage, p: Array, d: Array, flying: Array, solid: Array) -> Any:
    """Points in media where ``flying``, on solids, otherwise the ground, and what they send (3, M)."""
    place = Place(np.empty(p.shape), np.zeros(p.shape), -d, np.zeros(len(flying)), flying)
    glow = np.zeros(p.shape)
    place.normal[1] = 1.0
    if stage.ground:
        place.rgb[:] = np.minimum(np.reshape(stage.ground.rgb, (3, 1)), SURFACE)
    for at, most in ((np.nonzero(flying)[0], MIST), (np.nonzero(solid)[0], SURFACE)):
        if most == MIST:
            state = field.at(p[:, at])
        else:
            state, place.normal[:, at] = facing(field, p[:, at], d[:, at])
            place.rough[at] = field.rough[state.owner]
        place.rgb[:, at] = np.minimum(state.rgb, most)
        if field.glows:
            glow[:, at] = state.glow
    return place, glow


def _from_lamp(field: ExactField, light: Light, o: Array, place: Place, numbers: Array) -> Array:
    """Light (3, M) of a lamp that points o send back.

    Where it is glossy half of the ways are the lobe's: each is weighed by the density of both (Veach and
    Guibas, Optimally Combining Sampling Techniques, 1995).
    """
    to, way, divisor = aimed(light, o, numbers[4], numbers[5])
    meets = np.ones(len(divisor), bool)
    if light.radius and place.rough.any():
        glossy = place.rough != 0.0
        lobe = place.onward(numbers[[4, 5, 7]])[0]
        middle = np.reshape(light.position, (3, 1)) - o
        along = (middle * lobe).sum(0)
        root = light.radius**2 - (middle * middle).sum(0) + along**2
        chosen = glossy & (numbers[6] < 0.5)
        meets = ~chosen | ((root > 0.0) & (along > 0.0))
        way = np.where(chosen, lobe, way)
        to = np.where(chosen, o + (along - np.sqrt(np.maximum(root, 0.0))) * lobe, to)
        both = (divisor + np.pi * light.radius**2 * place.answer(way)[1]) / 2.0
        divisor = np.where(glossy, both, divisor)
    share = place.answer(way)[0] * meets * (light.power / divisor)
    lit = np.nonzero(share.any(0))[0]
    share[:, lit] *= visible(field, o[:, lit], to[:, lit])
    return share * np.reshape(light.rgb, (3, 1))
