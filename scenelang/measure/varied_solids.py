"""Scenes of the set `solids3d`, smaller, in which one quantity is another that only solids have."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scenelang.graph.geometries import GEOMETRIES
from scenelang.measure.sets import Rng
from scenelang.measure.solid_sets import SOLID_SETS, WARP, random_solid
from scenelang.measure.varied import rebuilt
from scenelang.scene.schema import (
    Camera,
    Chain,
    Displace,
    Light,
    Link,
    Material,
    Object,
    Scale,
    Scene,
    SceneNode,
    Transform,
    Translate,
)

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
    """Those of a scene of one chain."""
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
