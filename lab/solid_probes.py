"""Probes of the stability suite for solids. The base is the set `solids3d`, on 64 x 64 pixels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import takewhile

import numpy as np

from lab.probes import Kit, Probe, blends, cell_of, common, rebuilt
from lab.sets.plane import Rng
from lab.sets.solids import SOLID_SETS, WARP, random_solid
from scenelang.compiler.geometries import GEOMETRIES
from scenelang.language.scene import (
    Camera,
    Chain,
    Displace,
    Light,
    Link,
    Material,
    Object,
    Rotate,
    Scale,
    Scene,
    SceneNode,
    Transform,
    Translate,
)
from scenelang.language.words import BLEND

BASE = replace(SOLID_SETS["solids3d"], canvas=(64, 64))
EYE = Camera().eye
AWAY = math.hypot(*EYE)
BALL = 0.9  # radius of hollow balls


def scene(rng: Rng, **changes: object) -> Scene:
    """A scene of the base set, of which some is changed."""
    return random_solid(rng, replace(BASE, **changes))  # type: ignore[arg-type]


def deformed(rng: Rng, **changes: object) -> Scene:
    """The like with deformed objects."""
    return scene(rng, **{"warp": WARP, **changes})


def crowd(rng: Rng, count: float) -> Scene:
    """So many objects, from five on the smaller the more."""
    return scene(rng, objects=(int(count),) * 2, size=min(1.0, (4 / count) ** (1 / 3)))


def thin(rng: Rng, thickness: float) -> Scene:
    """Opaque objects squeezed to that thickness where they are thinnest."""

    def squeezed(_: int, node: Object) -> list[Transform]:
        y = thickness / GEOMETRIES[node.geometry].thickness
        return [t.model_copy(update={"y": y}) if isinstance(t, Scale) else t for t in node.transforms]

    return rebuilt(scene(rng, media=0.0), squeezed)


def bulged(rng: Rng, amount: float, frequency: float) -> Scene:
    """All objects displaced alike."""
    return rebuilt(scene(rng), lambda _, node: [Displace(amount, frequency), *node.transforms])


def _beside(rng: Rng, *before: SceneNode | Link, **settings: object) -> Scene:
    """A base scene with objects before its own, and settings."""
    usual = scene(rng)
    return usual.model_copy(update={"nodes": (Chain([*before, *links(usual)]),), **settings})


def links(made: Scene) -> Sequence[Link]:
    """Links of a scene of one chain."""
    (chain,) = made.nodes
    assert isinstance(chain, Chain)
    return chain.children


def _look(rng: Rng, kind: str | None = None) -> Material | None:
    """The material of some object, or of that kind."""
    node = links(scene(rng, media=float(kind == "volumetric") if kind else BASE.media))[0].node
    return node.material


def _direction(rng: Rng) -> np.ndarray:
    way = rng.normal(size=3)
    return np.asarray(way / math.sqrt(float(way @ way)))


def shell(rng: Rng, thickness: float) -> Scene:
    """A hollow ball that is cut open, and what lies in and around it."""
    cut = Translate(*(BALL * _direction(rng)).tolist())
    hollow = [
        Link("subtract", Object("sphere", Scale(BALL - thickness))),
        Link("subtract", Object("sphere", (Scale(0.6), cut))),
    ]
    return _beside(rng, Object("sphere", Scale(BALL), _look(rng)), *hollow)


def lit(rng: Rng, away: float) -> Scene:
    """A light this far from a ball, no brighter than that what is next to it shows."""
    radius, place = float(rng.uniform(0.35, 0.85)), rng.uniform(-0.5, 0.5, 3)
    ball = Object("sphere", (Scale(radius), Translate(*place.tolist())), _look(rng, "diffuse"))
    lamp = place + (radius + away) * _direction(rng)
    return _beside(rng, ball, light=Light(tuple(lamp.tolist()), away))


def close(rng: Rng, away: float) -> Scene:
    """An eye this far from an opaque ball that it looks past, half a unit nearer than usual."""
    eye, ahead = np.array(EYE) * (1 - 0.5 / AWAY), -np.array(EYE) / AWAY
    aside = np.cross(ahead, _direction(rng))
    radius, towards = float(rng.uniform(0.35, 0.85)), ahead + aside / math.sqrt(float(aside @ aside))
    place = eye + (radius + away) * towards / math.sqrt(2)
    ball = Object("sphere", (Scale(radius), Translate(*place.tolist())), _look(rng, "diffuse"))
    return _beside(rng, ball, camera=Camera(tuple(eye.tolist())))


def in_mist(rng: Rng, radius: float) -> Scene:
    """The eye in the middle of a medium, the base scene before it."""
    return _beside(rng, Object("sphere", (Scale(radius), Translate(*EYE)), _look(rng, "volumetric")))


def shadow(rng: Rng) -> Scene:
    """A solid, and a medium between it and the light: the paper's Figure 5."""
    (receiver,), (medium,) = (
        [link.node for link in links(scene(rng, objects=(1, 1), media=media, spread=0.3))]
        for media in (0.0, 1.0)
    )
    assert isinstance(receiver, Object)
    assert isinstance(medium, Object)
    towards = float(rng.uniform(0.3, 0.5)) * np.array(Light().position) + rng.uniform(-0.15, 0.15, 3)
    moves = (*medium.transforms, Translate(*towards.tolist()))
    between = Object(medium.geometry, moves, medium.material)
    return Scene(nodes=(receiver, between), model="solids3d", canvas=BASE.canvas)


def seen(rng: Rng, camera: Camera) -> Scene:
    """A base scene, seen from elsewhere."""
    return scene(rng).model_copy(update={"camera": camera})


def high(angle: float) -> tuple[float, float, float]:
    """An eye at the usual distance, so many radians up."""
    return 0.0, AWAY * math.sin(angle), AWAY * math.cos(angle)


DEPTH = 3 * 2 * 0.6  # optical depth of a medium of middling scale
MOST = {"operators": 6, "blends": 8, "size": 4, "shear": 4, "canvas": 256}
"""Largest values of probes for which the exact picture of solids is not empty and does not take too long."""


MORE = {"warp": (5.0,)}


def _within(name: str, probe: Probe) -> Probe:
    most = MOST.get(name, math.inf)
    return replace(
        probe,
        values=(*takewhile(lambda value: value <= most, probe.values), *MORE.get(name, ())),
        healthy=128 if name == "canvas" else probe.healthy,
    )


PROBES: dict[str, Probe] = {
    **{
        name: _within(name, probe)
        for name, probe in common(scene, deformed, WARP).items()
        if name != "thin"
    },
    "objects": Probe(
        "objects of a scene, the smaller the more", "objects", (1, 2, 4, 16, 64, 100), 4, crowd
    ),
    "thickness": Probe(
        "thin solids, opaque", "thickness", (0.003, 0.005, 0.01, 0.015, 0.02, 0.03, 0.05, 0.1, 0.3), 0.3,
        thin,
    ),
    "width": Probe(
        "widths of a blend", "k", (0.01, 0.05, 0.15, 0.3, 0.6, 1.2), BLEND,
        lambda rng, k: blends(scene, rng, 2, k=k),
    ),
    "amount": Probe(
        "displacements of frequency 5", "amount", (0.01, 0.02, 0.05, 0.1, 0.2, 0.3), 0.05,
        partial(bulged, frequency=5.0),
    ),
    "frequency": Probe(
        "displacements by 0.05", "frequency", (2, 4, 8, 12, 16, 24), 4,
        lambda rng, frequency: bulged(rng, 0.05, frequency),
    ),
    "shell": Probe("hollow balls", "thickness", (0.01, 0.02, 0.05, 0.1, 0.3), 0.1, shell),
    "depth": Probe(
        "media by what lies in them", "optical depth", (0.4, 1, 3.6, 7, 14), 3.6,
        lambda rng, depth: scene(rng, size=depth / DEPTH, media=1.0),
    ),
    "mist": Probe("an eye in a medium", "its radius", (0.1, 0.3, 0.6, 1, 2), 0.3, in_mist),
    "distance": Probe(
        "distances of the eye", "times the usual", (0.25, 0.5, 1, 2, 4, 8), 1,
        lambda rng, times: seen(rng, Camera((0.0, times * EYE[1], times * EYE[2]))),
    ),
    "fov": Probe(
        "angles of view", "degrees", (5, 15, 37, 60, 90, 120, 150), 37,
        lambda rng, fov: seen(rng, Camera(fov=math.radians(fov))),
    ),
    "height": Probe(
        "heights of the eye", "degrees", (-5, 10, 30, 60, 90), 10,
        lambda rng, angle: seen(rng, Camera(high(math.radians(angle)))),
    ),
    "close": Probe(
        "an eye near an object", "distance", (0.003, 0.01, 0.03, 0.1, 0.3, 1), 1, close
    ),
    "light": Probe("a light near an object", "distance", (0.003, 0.01, 0.03, 0.1, 0.3, 1), 1, lit),
}  # fmt: skip


def _apart(rng: Rng, count: int = 9) -> list[Object]:
    nodes = [link.node for link in links(scene(rng, objects=(count, count)))]
    return [
        Object(node.geometry, (Scale(0.28), node.transforms[1], cell_of(i, count)), node.material)
        for i, node in enumerate(nodes)
        if isinstance(node, Object)
    ]


def _animated(rng: Rng, frames: int) -> list[Scene]:
    """Frames of a base scene, the eye going round it by 2 degrees a frame while the objects turn by 3."""
    first = scene(rng)

    def turned(frame: int) -> Scene:
        def moves(_: int, node: Object) -> list[Transform]:
            scale, turn, move = node.transforms
            return [scale, turn, Rotate.degrees(3.0 * frame, (0.0, 1.0, 0.0)), move]

        a = math.radians(2.0 * frame)
        eye = EYE[2] * math.sin(a), EYE[1], EYE[2] * math.cos(a)
        return rebuilt(first, moves).model_copy(update={"camera": Camera(eye)})

    return [turned(frame) for frame in range(frames)]


SOLIDS = Kit(PROBES, _apart, _animated)
