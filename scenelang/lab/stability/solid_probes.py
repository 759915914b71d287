"""What the stability suite varies of solids. The base is the set `solids3d`, on 64 x 64 pixels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import takewhile

import numpy as np

from scenelang.lab.stability.probes import Kit, Probe, blends, cell_of, common, rebuilt
from scenelang.measure.sets import Rng
from scenelang.measure.solid_sets import SOLID_SETS, WARP, random_solid
from scenelang.scene.schema import (
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
from scenelang.words import BLEND

BASE = replace(SOLID_SETS["solids3d"], canvas=(64, 64))
EYE = Camera().eye
AWAY = math.hypot(*EYE)
DEPTH = 3 * 2 * 0.6  # optical depth of a medium of middling scale
BALL = 0.9  # radius of hollow balls
MOST = {"operators": 6, "blends": 8, "size": 4, "thin": 100, "shear": 4, "canvas": 256}
"""Of probes of both dimensions, beyond which the exact picture of solids takes too long, or is empty."""


def _scene(rng: Rng, **changes: object) -> Scene:
    return random_solid(rng, replace(BASE, **changes))  # type: ignore[arg-type]


def _deformed(rng: Rng, **changes: object) -> Scene:
    return _scene(rng, **{"warp": WARP, **changes})


def _crowd(rng: Rng, count: float) -> Scene:
    return _scene(rng, objects=(int(count),) * 2, size=min(1.0, (4 / count) ** (1 / 3)))


def _bulged(rng: Rng, amount: float, frequency: float) -> Scene:
    return rebuilt(_scene(rng), lambda _, node: [Displace(amount, frequency), *node.transforms])


def _beside(rng: Rng, *before: SceneNode | Link, **settings: object) -> Scene:
    """A base scene with objects before its own, and settings."""
    scene = _scene(rng)
    return scene.model_copy(
        update={"nodes": (Chain([*before, *_links(scene)]), *scene.nodes[1:]), **settings}
    )


def _links(scene: Scene) -> Sequence[Link]:
    (chain,) = scene.nodes
    assert isinstance(chain, Chain)
    return chain.children


def _look(rng: Rng, kind: str | None = None) -> Material | None:
    """The material of some object, or of that kind."""
    node = _links(_scene(rng, media=float(kind == "volumetric") if kind else BASE.media))[0].node
    return node.material


def _direction(rng: Rng) -> np.ndarray:
    way = rng.normal(size=3)
    return np.asarray(way / math.sqrt(float(way @ way)))


def _shell(rng: Rng, thickness: float) -> Scene:
    """A hollow ball that is cut open, and what lies in and around it."""
    cut = Translate(*(BALL * _direction(rng)).tolist())
    hollow = [
        Link("subtract", Object("sphere", Scale(BALL - thickness))),
        Link("subtract", Object("sphere", (Scale(0.6), cut))),
    ]
    return _beside(rng, Object("sphere", Scale(BALL), _look(rng)), *hollow)


def _lit(rng: Rng, away: float) -> Scene:
    """A light this far from a ball, no brighter than that what is next to it shows."""
    radius, place = float(rng.uniform(0.35, 0.85)), rng.uniform(-0.5, 0.5, 3)
    ball = Object("sphere", (Scale(radius), Translate(*place.tolist())), _look(rng, "diffuse"))
    lamp = place + (radius + away) * _direction(rng)
    return _beside(rng, ball, light=Light(tuple(lamp.tolist()), away))


def _in_mist(rng: Rng, radius: float) -> Scene:
    """The eye in the middle of a medium, the base scene before it."""
    return _beside(rng, Object("sphere", (Scale(radius), Translate(*EYE)), _look(rng, "volumetric")))


def _seen(rng: Rng, camera: Camera) -> Scene:
    return _scene(rng).model_copy(update={"camera": camera})


def _high(angle: float) -> tuple[float, float, float]:
    return 0.0, AWAY * math.sin(angle), AWAY * math.cos(angle)


def _within(name: str, probe: Probe) -> Probe:
    most = MOST.get(name, math.inf)
    return replace(
        probe,
        values=tuple(takewhile(lambda value: value <= most, probe.values)),
        healthy=128 if name == "canvas" else probe.healthy,
    )


PROBES: dict[str, Probe] = {
    **{name: _within(name, probe) for name, probe in common(_scene, _deformed, WARP).items()},
    "objects": Probe(
        "objects of a scene, the smaller the more", "objects", (1, 2, 4, 16, 64), 4, _crowd
    ),
    "width": Probe(
        "widths of a blend", "k", (0.01, 0.05, 0.15, 0.3, 0.6, 1.2), BLEND,
        lambda rng, k: blends(_scene, rng, 2, k=k),
    ),
    "amount": Probe(
        "displacements of frequency 5", "amount", (0.01, 0.02, 0.05, 0.1, 0.2, 0.3), 0.05,
        partial(_bulged, frequency=5.0),
    ),
    "frequency": Probe(
        "displacements by 0.05", "frequency", (2, 4, 8, 12, 16, 24), 4,
        lambda rng, frequency: _bulged(rng, 0.05, frequency),
    ),
    "shell": Probe("hollow balls", "thickness", (0.01, 0.02, 0.05, 0.1, 0.3), 0.1, _shell),
    "depth": Probe(
        "media by what lies in them", "optical depth", (0.4, 1, 3.6, 7, 14), 3.6,
        lambda rng, depth: _scene(rng, size=depth / DEPTH, media=1.0),
    ),
    "mist": Probe("an eye in a medium", "its radius", (0.1, 0.3, 0.6, 1, 2), 0.3, _in_mist),
    "distance": Probe(
        "distances of the eye", "times the usual", (0.25, 0.5, 1, 2, 4, 8), 1,
        lambda rng, times: _seen(rng, Camera((0.0, times * EYE[1], times * EYE[2]))),
    ),
    "fov": Probe(
        "angles of view", "degrees", (5, 15, 37, 60, 90, 120, 150), 37,
        lambda rng, fov: _seen(rng, Camera(fov=math.radians(fov))),
    ),
    "height": Probe(
        "heights of the eye", "degrees", (-5, 10, 30, 60, 90), 10,
        lambda rng, angle: _seen(rng, Camera(_high(math.radians(angle)))),
    ),
    "light": Probe("a light near an object", "distance", (0.003, 0.01, 0.03, 0.1, 0.3, 1), 1, _lit),
}  # fmt: skip


def _apart(rng: Rng, count: int = 9) -> list[Object]:
    nodes = [link.node for link in _links(_scene(rng, objects=(count, count)))]
    return [
        Object(node.geometry, (Scale(0.28), node.transforms[1], cell_of(i, count)), node.material)
        for i, node in enumerate(nodes)
        if isinstance(node, Object)
    ]


def _animated(rng: Rng, frames: int) -> list[Scene]:
    """Frames of a base scene, the eye going round it by 2 degrees a frame while the objects turn by 3."""
    scene = _scene(rng)

    def turned(frame: int) -> Scene:
        def moves(_: int, node: Object) -> list[Transform]:
            scale, turn, move = node.transforms
            return [scale, turn, Rotate.degrees(3.0 * frame, (0.0, 1.0, 0.0)), move]

        a = math.radians(2.0 * frame)
        eye = EYE[2] * math.sin(a), EYE[1], EYE[2] * math.cos(a)
        return rebuilt(scene, moves).model_copy(update={"camera": Camera(eye)})

    return [turned(frame) for frame in range(frames)]


SOLIDS = Kit(PROBES, _apart, _animated)
