"""Nodes of the light: fixed points on the surfaces of objects and on the ground.

Points on an object lie where fixed chords of the ball around it meet its own surface, so that they move with
it, and are drawn onto the surface of all objects. A node fades where another object covers it, and nothing
jumps. Uniform chords meet equal areas equally often (Cauchy and Crofton).

Letters: J nodes, the first ones on objects, N objects.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scenelang.compiler.spaces import Stage
from scenelang.drawing.arrays import Array
from scenelang.drawing.kernel import load_kernel
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.tables import inverses

ROOTS = (0.8566748838545029, 0.733891856627126, 0.6287067210378087, 0.5385972572236101)  # of x^5 = x + 1
SCATTER = np.array([37.719, 78.233, 12.99])  # of places, into turns of rays
COARSE, FINE = 18, 400  # parts of a chord that are not looked into, of objects, and of those that glow
CHORDS, GLOWING = 24000, 400  # of those that glow, and nodes of the light on each
NODES, LEAST, MOST = 200, (60, 80), 400  # on all objects, on one at least, in hollows, and at most
ALL = 2400  # at most
HOLLOW = 8  # times as many where something may be hollow
COVERED = 0.06  # world units by which a surface is covered where its nodes have faded
NEWTON = 2
INSIDE = 1e-3  # world units behind a surface where its material is asked for
FLAT = 0.01  # of distances; less is none
BEFORE = 0.02  # world units before a surface where nothing must be, lest a node fades
SIDES = 24, 40  # nodes of the ground along one axis, and where something may be hollow
FAR, WARP = 20.0, 4.5  # world units to the last ones; they lie at FAR sinh(WARP u) / sinh(WARP)


class Nodes(NamedTuple):
    """Points that light comes from and goes to."""

    p: Array  # (3, J)
    n: Array  # (3, J) unit normals
    colour: Array  # (3, J) linear
    glow: Array  # (3, J) linear
    weight: Array  # (J,) in (0, 1]; less where they are nearly covered
    area: Array  # (J,) of the surface that each stands for; 0 on the ground
    # (8, J) places behind the maps of their objects, numbers of these, 1 for nodes of the light and
    # 0 for those of what glows alone, and normals behind the maps
    place: Array


def spread(index: np.ndarray, count: int = 4) -> np.ndarray:
    """Points (count, K) of the unit cube that lie evenly (a Kronecker sequence)."""
    return np.asarray((0.5 + np.outer(ROOTS[:count], index)) % 1.0)


def sphere(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Unit directions (3, K) of places (K,) of the unit square, equal areas of equal areas."""
    z, angle = 2 * u - 1, 2 * np.pi * v
    return np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z])


def chords(count: int, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Where lines begin that meet a ball about the origin evenly, and all the way through it (3, K)."""
    u, v, r, turn = spread(np.arange(count))
    way = sphere(u, v)
    least = np.eye(3)[abs(way).argmin(0)].T
    side = np.cross(way, least, axis=0)
    side /= np.linalg.norm(side, axis=0)
    off = np.cos(2 * np.pi * turn) * side + np.sin(2 * np.pi * turn) * np.cross(way, side, axis=0)
    half = np.sqrt(1 - r) * radius
    return np.sqrt(r) * radius * off - way * half, 2 * half * way


def on_objects(field: SolidField, stage: Stage, many: bool) -> Nodes:
    """Nodes on objects, ``many`` as hollows want; many chords find even the thin ones that glow."""
    xp, like = field.xp, field.network.codes
    rows = field.objects.rows
    sizes = rows["extent"].astype(np.float64)
    glows = np.asarray(xp.to_numpy(field.glow(field.looks))).max(0, initial=0.0) > 0
    more = HOLLOW if many else 1
    shares = more * NODES * sizes**2 / max(float((sizes**2).sum()), 1e-9)
    counts = _bounded(np.ceil(shares.clip(LEAST[many], more * MOST)), ALL)
    balls = rows["reach"] * (1.0 + (rows["radius"] - 1.0).clip(None, 0.2)) + rows["moved"]
    tried = np.where(glows, _bounded(CHORDS * glows, CHORDS * ALL // NODES), counts)
    every = [np.concatenate(chords(n, ball)) for n, ball in zip(tried.tolist(), balls, strict=True) if n]
    lines = np.concatenate([np.zeros((6, 0)), *every], 1).astype(np.float32)
    objects = np.repeat(np.arange(len(sizes)), tried)
    linear = rows["map"][:, :9].reshape(-1, 3, 3).astype(np.float64)
    back = inverses(linear)
    ends = np.stack([lines[:3].T - rows["map"][objects, 9:], lines[3:].T], 2)
    world = (back[objects] @ ends).astype(np.float32).transpose(2, 1, 0)  # begins and ways (3, K)
    rates = rows["rate"][objects] * np.linalg.norm(lines[3:], axis=0)
    begin, way = world
    parts = 1 / np.where(glows, FINE, COARSE)[objects]
    line, along = load_kernel().crossings(field.tables, objects, begin, way, rates, parts)
    owner, at = objects[line], lines[:3, line] + lines[3:, line] * along
    # each stands for as much of the surface behind the map
    area = (2 * np.pi * balls**2 / tried.clip(1))[owner].astype(np.float32)
    found = np.bincount(owner, minlength=len(sizes))
    number = line - (np.cumsum(tried) - tried)[owner]  # of an object's chords
    kept = ~glows[owner] | (number % (found // GLOWING).clip(1)[owner] == 0)
    place = xp.array(np.concatenate([at, owner[None], kept[None]]).astype(np.float32), like)
    p = np.ascontiguousarray(begin[:, line] + way[:, line] * along)
    shrunk = back * abs(np.linalg.det(linear))[:, None, None]  # of areas, with normals
    across = np.moveaxis(shrunk.astype(np.float32)[owner], 0, -1)  # (3, 3, K)
    return _settled(field, stage, p, across, area, place)


def _bounded(counts: np.ndarray, most: int) -> np.ndarray:
    """Whole numbers like these whose sum is no more; of very many some are 0."""
    part = min(1.0, most / max(float(counts.sum()), 1.0))
    whole: np.ndarray = np.diff(np.floor(np.cumsum(counts) * part), prepend=0.0)
    return whole.astype(int)


def _settled(field: SolidField, stage: Stage, p: Array, across: Array, area: Array, place: Array) -> Nodes:
    """Nodes at points (3, K) drawn onto the surface, whose normals maps pull ``across`` (3, 3, K); without
    those that are covered.
    """
    xp, weight = field.xp, None
    reach = 0 * p[0] + 4 * COVERED
    for _ in range(NEWTON):
        met = field.near(p, reach, gradient=True)
        if weight is None:
            weight = (1 - abs(met.distance) / COVERED).clip(0.0)
        square = (met.gradient * met.gradient).sum(0).clip(1e-6)
        p = p - met.gradient * (met.distance.clip(-COVERED, COVERED) / square)
    g = met.gradient
    slope = xp.sqrt((g * g).sum(0))  # of what is scaled unevenly, less than 1
    n = g / slope.clip(1e-9)
    inside = field.near(p - INSIDE * n, reach, every=True)
    material = field.material(inside)
    weight = weight * (inside.distance < 0) * ~material.medium * (slope > FLAT)
    if len(field) > 1 and not field.media:  # where two touch nobody sees their nodes
        before = field.near(p + BEFORE * n, reach)
        weight = weight * (before.distance / (BEFORE * slope.clip(FLAT))).clip(0.0, 1.0)
    if stage.ground is not None:
        weight = weight * ((p[1] - stage.ground.y) / COVERED).clip(0.0, 1.0)
    kept = xp.where(weight > 0)
    pulled = (across * n[:, None]).sum(0)
    length = xp.sqrt((pulled * pulled).sum(0)).clip(1e-9)
    area, place = weight * area / length, xp.concat([place, pulled / length], 0)
    parts = (p, n, material.colour, material.glow, weight, area, place)
    return Nodes(*(xp.take(part, kept) for part in parts))


def on_ground(field: SolidField, stage: Stage, many: bool) -> Nodes:
    """Nodes on the ground (`SIDES`²), row by row along z; none without a ground."""
    side = SIDES[many]
    xp, like, ground = field.xp, field.network.codes, stage.ground
    u = np.linspace(-1.0, 1.0, side)
    x = FAR * np.sinh(WARP * u) / np.sinh(WARP)
    p = np.zeros((3, 0 if ground is None else side * side), np.float32)
    n, colour = 0 * p, 0 * p
    n[1] = 1.0
    if ground is not None:
        p[0], p[1], p[2] = np.tile(x, side), ground.y, np.repeat(x, side)
        colour[:] = np.asarray(ground.rgb, np.float32)[:, None]
    p, n, colour = (xp.array(part, like) for part in (p, n, colour))
    d = field.near(p, 0 * p[0] + COVERED).distance if p.shape[1] else p[0]
    place = xp.concat([p, xp.full((5, p.shape[1]), 1.0, p)], 0)
    return Nodes(p, n, colour, 0 * p, (d / COVERED).clip(0.0, 1.0), 0 * p[0], place)
