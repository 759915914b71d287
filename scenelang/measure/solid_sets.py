"""Seeded random scenes of solids to evaluate on.

``diffuse`` is the base set: 1 to 4 spheres and tori, scaled by 0.3 to 0.9 per axis, turned about any axis
and moved by up to 1, in that order, colours uniform in 0.1 to 1 as written, all unions, on the default stage.
The others change one thing each, ``mixed`` several.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from scenelang.graph import affine
from scenelang.graph.looks import Look
from scenelang.graph.nodes import Fold, Leaf, Link, Move
from scenelang.graph.stage import Camera, Ground, Light, Stage, Triple, decoded
from scenelang.graph.steps import Affine, Displace, Step, Twist, Warp
from scenelang.image import Image
from scenelang.measure.sets import Rng
from scenelang.reference.solid.image import solid_image
from scenelang.words import COMBINE

PROBE = 20  # pixels along a side of the picture that tells how much a scene covers


@dataclass(frozen=True, slots=True)
class SolidConfig:
    """What the scenes of a set are like.

    Args:
        objects: fewest and most objects.
        media: share of objects that are volumetric.
        warp: largest twirl, bend and twist, each there in half of the objects, as is a displacement; 0: none.
        unions: share of scenes that are unions only.
        shuffled: scale, rotate, translate and shear in random order, a twirl before and a bend among them.
        spread: factor on translations.
        staged: a random camera, light, ground and sky.
        canvas: pixels.
    """

    objects: tuple[int, int] = (1, 4)
    media: float = 0.0
    warp: float = 0.0
    unions: float = 1.0
    shuffled: bool = False
    spread: float = 1.0
    staged: bool = False
    canvas: tuple[int, int] = (128, 128)


SOLID_SETS: dict[str, SolidConfig] = {
    "diffuse": SolidConfig(),
    "media": SolidConfig(media=0.6),
    "deformed": SolidConfig(warp=0.8),
    "booleans": SolidConfig(unions=0.0, objects=(2, 4), spread=0.5),
    "shuffled": SolidConfig(shuffled=True),
    "wide": SolidConfig(canvas=(160, 96)),
    "staged": SolidConfig(staged=True),
    "mixed": SolidConfig(media=0.4, warp=0.8, unions=0.4, spread=0.6, staged=True),
}


@dataclass(frozen=True, slots=True)
class SolidScene:
    """A scene of solids with all that its picture hangs on."""

    root: Fold
    stage: Stage
    canvas: tuple[int, int]

    def exact(self) -> Image:
        """Its exact picture."""
        return solid_image(self.root, self.stage, self.canvas)


def _triple(rng: Rng, low: float, high: float) -> Triple:
    x, y, z = rng.uniform(low, high, 3).tolist()
    return x, y, z


def _warps(rng: Rng, most: float) -> list[Step]:
    twirl, bend, twist = rng.uniform(-most, most, 3).tolist()
    bulge = Displace(0.05, float(rng.uniform(3, 8)))
    every: list[Step] = [bulge, Warp(twirl, (0.0, 0.0)), Warp(0.0, (bend, 0.0)), Twist(twist)]
    return [step for step in every if most and rng.random() < 0.5]


def _steps(rng: Rng, config: SolidConfig) -> list[Step]:
    maps = [
        affine.scaling(*_triple(rng, 0.3, 0.9)),
        affine.rotation(float(rng.uniform(0, math.tau)), _triple(rng, -1, 1)),
        affine.translation(*(config.spread * rng.uniform((-1.0, -0.7, -1.0), 1.0)).tolist()),
    ]
    if config.shuffled:
        axes = "xy", "xz", "yx", "yz", "zx", "zy"
        maps.append(affine.shearing(axes[int(rng.integers(6))], float(rng.uniform(-0.6, 0.6))))
        maps = [maps[i] for i in rng.permutation(4)]
        twirl, bend = rng.uniform(-0.8, 0.8, 2).tolist()
        among = [Affine(rows) for rows in maps]
        return [Warp(twirl, (0.0, 0.0)), *among[:2], Warp(0.0, (bend, 0.0)), *among[2:]]
    return [*_warps(rng, config.warp), *map(Affine, maps)]


def _stage(rng: Rng) -> Stage:
    turn, height = float(rng.uniform(-math.pi, math.pi)), float(rng.uniform(0.3, 3.0))
    eye = (5.8 * math.sin(turn), height, 5.8 * math.cos(turn))
    light = Light(_triple(rng, 2.0, 4.0), float(rng.uniform(15, 40)), decoded(_triple(rng, 0.6, 1.0)))
    ground = Ground(float(rng.uniform(-1.2, -0.8)), decoded(_triple(rng, 0.3, 0.9)))
    sky = decoded(_triple(rng, 0.2, 1.0))
    plain = Stage(horizon=sky, zenith=sky) if rng.random() < 0.5 else Stage()
    camera = Camera(eye, _triple(rng, -0.2, 0.2), math.radians(float(rng.uniform(30, 50))))
    return replace(plain, camera=camera, light=light, ground=ground if rng.random() < 0.8 else None)


def random_solid(rng: Rng, config: SolidConfig) -> SolidScene:
    """One scene of a set; it may be that hardly anything of it is seen."""
    count = int(rng.integers(config.objects[0], config.objects[1] + 1))
    unions = rng.random() < config.unions
    links: list[Link] = []
    for _ in range(count):
        material = "volumetric" if rng.random() < config.media else "diffuse"
        look = Look(material, rgb=decoded(_triple(rng, 0.1, 1.0)))
        geometry = ("sphere", "torus")[int(rng.integers(2))]
        leaf = Leaf(geometry, look, tuple(map(Move, _steps(rng, config))))
        links.append(Link("union" if unions or not links else COMBINE[int(rng.integers(4))], leaf))
    stage = _stage(rng) if config.staged else Stage()
    return SolidScene(Fold("scene", tuple(links)), stage, config.canvas)


def solid_scenes(name: str, seed: int) -> Callable[[int], SolidScene]:
    """A function from index to scene; scenes that cover under 2 % of the canvas are drawn again.

    Args:
        name: of a set in `SOLID_SETS`.
        seed: of the set; training uses other streams of random numbers.
    """
    config = SOLID_SETS[name]

    def scene(index: int) -> SolidScene:
        for attempt in range(1000):
            made = random_solid(np.random.default_rng([seed, index, attempt]), config)
            alone = replace(made.stage, ground=None, transparent=True)
            if solid_image(made.root, alone, (PROBE, PROBE))[..., 3].mean() >= 0.02:
                return made
        raise RuntimeError(f"no scene of set {name} covers enough")

    return scene
