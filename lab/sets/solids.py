"""Seeded random scenes of solids to evaluate on, as Scenes: they go through the whole compiler.

``solids3d`` is the base set: 1 to 3 spheres and tori, diffuse or volumetric, scaled by 0.35 to 0.85 per axis,
turned about any axis and moved by ±1.2 (y: -0.5 to 0.9), in that order, colours uniform in 0.1 to 1 as
written, all unions, on the default stage. The others change one thing each, ``mixed`` several; ``leaves3d``
has the leaves with edges, and capsules. ``meshes3d`` has 1 to 4 of the meshes that ship, diffuse; they are
scaled, turned and moved in random order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from lab.sets.plane import Rng, any_tree, random_gradient, random_skin
from scenelang.language.scene import (
    Bend,
    Brought,
    Camera,
    Chain,
    Color,
    Displace,
    Ground,
    Light,
    Link,
    Material,
    Object,
    Rotate,
    Scale,
    Scene,
    Shear,
    Transform,
    Translate,
    Twirl,
    Twist,
    load_elements,
)
from scenelang.language.words import COMBINE, LEAVES

Triple = tuple[float, float, float]
AXES = "xy", "xz", "yx", "yz", "zx", "zy"
SIDES = 0.35, 0.85  # smallest and largest scale
EDGED = "box", "cylinder", "cone", "capsule", "octahedron"
WARP = 0.8  # of deformed objects


@dataclass(frozen=True, slots=True)
class SolidSet:
    """Distribution of the scenes of a set."""

    objects: tuple[int, int] = (1, 3)  # fewest and most
    media: float = 0.5  # share of objects
    warp: float = 0.0  # largest twirl, bend and twist, each in half of the objects; displaced too; 0: none
    unions: float = 1.0  # share of scenes; in the others half of the blends have another width
    shuffled: bool = False  # scale, rotate, translate, shear in any order, a twirl before, a bend among them
    size: float = 1.0  # factor on scales
    spread: float = 1.0  # factor on translations
    staged: bool = False  # a random camera, light, ground and sky
    canvas: tuple[int, int] = (128, 128)  # pixels
    meshes: str = ""  # a file of elements whose solids take the place of spheres and tori
    skins: bool = False  # whether objects grow, or are shells, or both
    trees: bool = False  # any trees of booleans; see `lab.sets.plane.any_tree`
    gradients: bool = False  # in place of plain colours
    leaves: tuple[str, ...] = ("sphere", "torus")


SOLID_SETS: dict[str, SolidSet] = {
    "solids3d": SolidSet(),
    "diffuse": SolidSet(media=0.0),
    "media": SolidSet(media=1.0),
    "deformed": SolidSet(warp=WARP),
    "booleans": SolidSet(unions=0.0, objects=(2, 4), spread=0.5),
    "trees": SolidSet(trees=True, media=0.3, spread=0.5),
    "shuffled": SolidSet(shuffled=True),
    "skins": SolidSet(skins=True, unions=0.5, size=0.7, canvas=(256, 256), leaves=(*LEAVES[3],)),
    "wide": SolidSet(canvas=(160, 96)),
    "staged": SolidSet(staged=True),
    "many": SolidSet(objects=(16, 16), media=0.3, size=0.6),
    "crowd": SolidSet(objects=(100, 100), media=0.3, size=0.35),
    "mixed": SolidSet(objects=(1, 4), warp=WARP, unions=0.4, spread=0.6, staged=True),
    "leaves3d": SolidSet(media=0.3, canvas=(256, 256), leaves=EDGED),
    "gradients": SolidSet(media=0.3, gradients=True, canvas=(256, 256), leaves=(*LEAVES[3],)),
    "trees3d": SolidSet(trees=True, skins=True, media=0.3, spread=0.5, size=0.7, leaves=(*LEAVES[3],)),
    "meshes3d": SolidSet(objects=(1, 4), media=0.0, meshes="std/meshes"),
}


def _triple(rng: Rng, low: float, high: float) -> Triple:
    x, y, z = rng.uniform(low, high, 3).tolist()
    return x, y, z


def _warps(rng: Rng, most: float) -> list[Transform]:
    twirl, bend, twist = rng.uniform(-most, most, 3).tolist()
    bulge = Displace(0.05, float(rng.uniform(3, 8)))
    every: list[Transform] = [bulge, Twirl(k=twirl), Bend(k=bend), Twist(k=twist)]
    return [transform for transform in every if most and rng.random() < 0.5]


def _moves(rng: Rng, config: SolidSet) -> list[Transform]:
    x, y, z = (config.size * side for side in _triple(rng, *SIDES))
    turn = Rotate(angle=float(rng.uniform(0, math.tau)), axis=_triple(rng, -1, 1))
    move = Translate(*(config.spread * rng.uniform((-1.2, -0.5, -1.2), (1.2, 0.9, 1.2))).tolist())
    maps: list[Transform] = [Scale(x, y, z), turn, move]
    if config.meshes:
        return [maps[i] for i in rng.permutation(3)]
    if not config.shuffled:
        return [*_warps(rng, config.warp), *maps]
    maps.append(Shear(AXES[int(rng.integers(6))], float(rng.uniform(-0.6, 0.6))))  # type: ignore[arg-type]
    maps = [maps[i] for i in rng.permutation(4)]
    twirl, bend = rng.uniform(-WARP, WARP, 2).tolist()
    return [Twirl(k=twirl), *maps[:2], Bend(k=bend), *maps[2:]]


def _stage(rng: Rng) -> dict[str, object]:
    turn, height = float(rng.uniform(-math.pi, math.pi)), float(rng.uniform(0.3, 3.0))
    eye = (5.8 * math.sin(turn), height, 5.8 * math.cos(turn))
    fov = math.radians(float(rng.uniform(30, 50)))
    ground = Ground(float(rng.uniform(-1.2, -0.8)), _triple(rng, 0.3, 0.9))
    sky = (_triple(rng, 0.2, 1.0), "default", "default", None)[int(rng.integers(4))]
    return {
        "camera": Camera(eye, _triple(rng, -0.2, 0.2), fov=fov),
        "light": Light(_triple(rng, 2.0, 4.0), float(rng.uniform(15, 40)), _triple(rng, 0.6, 1.0)),
        "ground": ground if rng.random() < 0.8 else None,
        "background": sky,
    }


def random_solid(rng: Rng, config: SolidSet) -> Scene:
    """One scene of a set; it may be that hardly anything of it is seen."""
    unions = rng.random() < config.unions
    zoo = load_elements(config.meshes, "zoo") if config.meshes else None
    brought = Brought.of((zoo,)).geometries if zoo is not None else {}
    geometries = [name for name, it in brought.items() if it.dimension == 3] or config.leaves

    def solid() -> Object:
        kind = "volumetric" if rng.random() < config.media else "diffuse"
        if config.gradients:
            name, stops = random_gradient(rng)
            material = Material(name, (*stops, Rotate(angle=float(rng.uniform(0, math.tau)))), shading=kind)
        else:
            material = Material(kind, Color(_triple(rng, 0.1, 1.0)))
        moves = [*(random_skin(rng) if config.skins else ()), *_moves(rng, config)]
        return Object(geometries[int(rng.integers(len(geometries)))], moves, material)

    if config.trees:
        return Scene(model="solids3d", canvas=config.canvas, nodes=(any_tree(rng, solid),))
    links: list[Link] = []
    for _ in range(int(rng.integers(config.objects[0], config.objects[1] + 1))):
        item = solid()
        word = "union" if unions or not links else COMBINE[int(rng.integers(4))]
        other = word == "smooth" and rng.random() < 0.5
        links.append(Link(word, item, k=float(rng.uniform(0.05, 0.5)) if other else None))
    others = _stage(rng) if config.staged else {"elements": zoo} if zoo is not None else {}
    return Scene(model="solids3d", canvas=config.canvas, nodes=Chain(links), **others)
