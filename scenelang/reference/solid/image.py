"""The exact picture of a solid scene, in float64: light, shadows and media, after docs/language.md."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scenelang.graph.nodes import Fold
from scenelang.graph.stage import AMBIENT, EXTINCTION, FADE, LIFT, NEAREST, Ground, Light, Stage
from scenelang.image import Image, from_light
from scenelang.reference.field import Array, Brought
from scenelang.reference.samples import sample_points
from scenelang.reference.solid.body import length
from scenelang.reference.solid.field import OPAQUE, Field, State
from scenelang.reference.solid.rays import Changes, Ints, march

TILE = 1 << 15  # samples at a time
TOLERANCE = 2e-4
"""A part of a ray in a medium is halved until its scattered light changes by less."""

HALVINGS = 9

_INSIDE = 1e-7  # how far behind a surface its colour is asked for
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4) + np.array([[1.0], [0.0]])


def solid_image(
    root: Fold,
    stage: Stage,
    canvas: tuple[int, int],
    *,
    per_side: int = 2,
    brought: Brought | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Image:
    """Draw the exact picture of a scene of solids.

    Args:
        root: of a lowered graph, its looks in linear colours.
        stage: the rest of the scene.
        canvas: width and height in pixels.
        per_side: samples along each side of a pixel; 2 is the definition (4 spp).
        brought: shapes of elements.
        progress: called with the share done, in [0, 1].

    Returns:
        (H, W, 3), or (H, W, 4) with straight alpha where the stage is transparent.

    Raises:
        ValueError: the stage has a fault, or the eye is inside something opaque.
    """
    if fault := stage.camera.fault() or stage.light.fault():
        raise ValueError(fault)
    field = Field(root, brought)
    width, height = canvas
    step = max(1, TILE // (width * per_side * per_side))
    picture = np.empty((4, height, width))
    for top in range(0, height, step):
        rows = range(top, min(top + step, height))
        samples = radiance(field, stage, ways(stage, canvas, rows, per_side))
        picture[:, top : rows.stop] = samples.reshape(4, len(rows), per_side, width, per_side).mean((2, 4))
        progress(rows.stop / height)
    return from_light(picture, stage.transparent)


def radiance(field: Field, stage: Stage, d: Array) -> Array:
    """Linear light, premultiplied, and alpha (4, M), that comes to the eye along unit directions d (3, M)."""
    behind = np.concatenate([_sky(stage, d), np.full((1, d.shape[1]), not stage.transparent)])
    o, end, changes = seen_along(field, stage, d)
    if stage.ground:
        seen = np.nonzero((end < np.inf) & (changes.last != OPAQUE))[0]
        behind[:3, seen] = _ground(field, stage, stage.ground, o[:, seen] + end[seen] * d[:, seen])
        behind[3, seen] = 1.0
    hit = changes.after == OPAQUE
    seen, end[changes.ray[hit]] = changes.ray[hit], changes.t[hit]
    behind[:3, seen] = _surface(field, stage.light, o[:, seen] + end[seen] * d[:, seen], d[:, seen])
    behind[3, seen] = 1.0
    if not field.media:
        return behind
    ray, enter, leave = changes.media(end)
    depth = EXTINCTION * (leave - enter)
    before = np.cumsum(depth) - depth
    before -= before[np.searchsorted(ray, ray)]  # of the ray's own
    light = _scattered(field, stage.light, o[:, ray], d[:, ray], enter, depth, np.exp(-before))
    through = np.exp(-np.bincount(ray, depth, d.shape[1]))
    out = behind * through
    for row, values in zip(out, light, strict=False):
        row += np.bincount(ray, values, d.shape[1])
    out[3] += 1.0 - through
    return out


def seen_along(field: Field, stage: Stage, d: Array) -> tuple[Array, Array, Changes]:
    """Of rays along d (3, M) where each begins (3, M), where the ground ends it (M,), and what it meets."""
    o = np.broadcast_to(np.reshape(stage.camera.eye, (3, 1)), d.shape)
    end = np.full(d.shape[1], np.inf)
    if stage.ground and stage.camera.eye[1] > stage.ground.y:
        down = np.nonzero(d[1] < 0.0)[0]
        end[down] = (stage.ground.y - stage.camera.eye[1]) / d[1, down]
    changes = march(field, o, d, end, exact=True)
    if (changes.first == OPAQUE).any():
        raise ValueError("the eye is inside an opaque object")
    return o, end, changes


def ways(stage: Stage, canvas: tuple[int, int], rows: range, per_side: int) -> Array:
    """Unit directions (3, M) of the samples of some pixel rows, row by row of samples."""
    forward, right, up = (np.reshape(axis, (3, 1)) for axis in stage.camera.axes())
    x, y = sample_points(canvas, rows, per_side)
    way: Array = forward / np.tan(stage.camera.fov_rad / 2.0) + x * right + y * up
    return way / length(way)


def facing(field: Field, p: Array, d: Array) -> tuple[State, Array]:
    """What holds just behind surface points met along d, and unit normals towards where d comes from."""
    state = field.at(p + _INSIDE * d, gradient=True)
    normal = state.slope / np.maximum(length(state.slope), 1e-12)
    return state, np.where((normal * d).sum(0) > 0.0, -normal, normal)


def _sky(stage: Stage, d: Array) -> Array:
    if stage.transparent:
        return np.zeros(d.shape)
    horizon, zenith = np.reshape(stage.horizon, (3, 1)), np.reshape(stage.zenith, (3, 1))
    return horizon + (zenith - horizon) * np.clip(d[1] / 0.5, 0.0, 1.0)


def _ground(field: Field, stage: Stage, ground: Ground, p: Array) -> Array:
    """Light from points of the ground, faded into the horizon."""
    upright = np.broadcast_to([[0.0], [1.0], [0.0]], p.shape)
    shade = np.reshape(ground.rgb, (3, 1)) * _received(field, stage.light, p, upright)
    clear = np.exp(-(p[0] ** 2 + p[2] ** 2) / FADE)
    return clear * shade + (1.0 - clear) * np.reshape(stage.horizon, (3, 1))


def _surface(field: Field, light: Light, p: Array, d: Array) -> Array:
    """Light from points of solids to where the directions d come from."""
    state, normal = facing(field, p, d)
    return state.rgb * _received(field, light, p, normal)


def _received(field: Field, light: Light, p: Array, normal: Array) -> Array:
    """Light (3, M) that surfaces of a normal receive, ambient and direct."""
    way = np.reshape(light.position, (3, 1)) - p
    r = np.maximum(length(way), NEAREST)
    direct = light.power * np.maximum((normal * way).sum(0) / r, 0.0) / r**2
    lit = np.nonzero(direct > 0.0)[0]
    direct[lit] *= _visible(field, light, p[:, lit] + LIFT * normal[:, lit])
    return np.reshape(light.rgb, (3, 1)) * direct + AMBIENT[0] + AMBIENT[1] * normal[1]


def _visible(field: Field, light: Light, p: Array) -> Array:
    """Transmittance (M,) from points to the light."""
    way = np.reshape(light.position, (3, 1)) - p
    r = length(way)
    changes = march(field, p, way / np.maximum(r, 1e-300), r)
    clear = (changes.last != OPAQUE).astype(np.float64)
    if not field.media:
        return clear
    ray, enter, leave = changes.media(r)
    return clear * np.exp(-EXTINCTION * np.bincount(ray, leave - enter, len(r)))


def _scattered(
    field: Field, light: Light, o: Array, d: Array, enter: Array, depth: Array, weight: Array
) -> Array:
    """Light (3, K) that parts of rays inside media scatter to where the rays come from.

    Args:
        o, d: the rays, (3, K).
        enter: where each part begins.
        depth: optical depth of each part.
        weight: transmittance from the eye to where it begins.
    """
    opaque = -np.expm1(-depth)

    def part(at: Ints, low: Array, high: Array) -> Array:
        """Gauss-Legendre quadrature over what shares ``low`` to ``high`` of a part's opacity."""
        share = low + (high - low) / 2.0 * _NODES[:, None]
        t = (enter[at] - np.log1p(-share * opaque[at]) / EXTINCTION).ravel()
        p = np.tile(o[:, at], len(_NODES)) + t * np.tile(d[:, at], len(_NODES))
        r = np.maximum(length(np.reshape(light.position, (3, 1)) - p), NEAREST)
        direct = light.power / (4.0 * r**2) * _visible(field, light, p)
        source = field.at(p).rgb * (np.reshape(light.rgb, (3, 1)) * direct + AMBIENT[0])
        mean = np.einsum("cnk,n->ck", source.reshape(3, len(_NODES), -1), _WEIGHTS)
        return mean * (high - low) / 2.0 * opaque[at] * weight[at]

    at, low = np.arange(len(enter)), np.zeros(len(enter))
    high = low + 1.0
    value, total = part(at, low, high), np.zeros((3, len(enter)))
    for left in reversed(range(HALVINGS)):
        middle = (low + high) / 2.0
        halves = part(np.tile(at, 2), np.concatenate([low, middle]), np.concatenate([middle, high]))
        both = halves.reshape(3, 2, -1).sum(1)
        rough = (abs(both - value).max(0) > TOLERANCE) & (left > 0)
        for row, values in zip(total, both[:, ~rough], strict=True):
            row += np.bincount(at[~rough], values, len(row))
        value, rough = halves[:, np.tile(rough, 2)], np.nonzero(rough)[0]
        at = np.tile(at[rough], 2)
        low, high = (
            np.concatenate([low[rough], middle[rough]]),
            np.concatenate([middle[rough], high[rough]]),
        )
    return total
