"""Probes of the stability suite: each varies one quantity from its trained range to far beyond.

The same index gives the same random numbers at every value, so that a curve differs by the quantity alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from lab.sets.plane import SETS, Rng, SetConfig, long_chain, random_object, random_scene
from scenelang.assets.element import TEXELS
from scenelang.language import words
from scenelang.language.scene import (
    Bend,
    Chain,
    Color,
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
)
from scenelang.language.words import BLEND, Combine

LARGE = 3.0  # times the size of the base set's objects
Base = Callable[..., Scene]
"""A random scene of a base set from random numbers and, by name, what of the set is other."""


def rebuilt(
    scene: Scene,
    moves: Callable[[int, Object], Sequence[Transform]] = lambda _, node: node.transforms,
    word: Callable[[int, Combine], Combine] = lambda _, op: op,
    look: Callable[[int, Object], Material | None] = lambda _, node: node.material,
    k: float = BLEND,
) -> Scene:
    """A scene of one chain of objects, with other transforms, words, materials, and widths of blends."""
    (chain,) = scene.nodes
    assert isinstance(chain, Chain)
    links = []
    for i, link in enumerate(chain.children):
        assert isinstance(link.node, Object)
        node = Object(link.node.geometry, moves(i, link.node), look(i, link.node))
        links.append(Link(op := word(i, link.op), node, k=k if op == "smooth" else None))
    return scene.model_copy(update={"nodes": (Chain(links),)})


def _larger(factor: float) -> Callable[[int, Object], list[Transform]]:
    def larger(t: Transform) -> Transform:
        if not isinstance(t, Scale):
            return t
        return Scale(t.x * factor, t.y * factor, t.z if t.z == 1.0 else t.z * factor)

    return lambda _, node: [larger(t) for t in node.transforms]


def operators(base: Base, rng: Rng, count: float) -> Scene:
    """One object and so many operators after it, none of them a plain union."""
    scene = base(rng, objects=(int(count) + 1,) * 2, unions=0.0)
    words: tuple[Combine, ...] = ("smooth", "subtract", "intersect")
    # intersections leave little of a picture: objects are larger, so that something is there to be wrong
    return rebuilt(scene, _larger(1.6), lambda i, _: "union" if i == 0 else words[int(rng.integers(3))])


def blends(base: Base, rng: Rng, count: float, larger: float = 1.0, k: float = BLEND) -> Scene:
    """One object and so many others, each joined by `smooth`."""
    scene = base(rng, objects=(int(count) + 1,) * 2)
    return rebuilt(scene, _larger(larger), lambda i, _: "smooth" if i else "union", k=k)


def contrast(base: Base, rng: Rng, contrast: float, size: float = LARGE) -> Scene:
    """One `smooth` of three objects, a white one and two that are darker."""
    scene = blends(base, rng, 2, size)
    white = int(rng.integers(3))

    def grey(i: int, node: Object) -> Material:
        level = 1.0 if i == white else 1.0 - contrast
        assert node.material is not None
        return Material(name=node.material.name, ops=(Color(rgb=(level, level, level)),))

    return rebuilt(scene, look=grey)


def thin(base: Base, rng: Rng, ratio: float) -> Scene:
    def moves(_: int, node: Object) -> list[Transform]:
        return [
            t.model_copy(update={"y": t.x / ratio}) if isinstance(t, Scale) else t for t in node.transforms
        ]

    return rebuilt(base(rng), moves)


def sheared(base: Base, rng: Rng, k: float) -> Scene:
    def moves(_: int, node: Object) -> list[Transform]:
        *first, rotate, translate = node.transforms
        return [*first, Shear(axes="xy", k=k), rotate, translate]

    return rebuilt(base(rng), moves)


def order(base: Base, rng: Rng, kind: float) -> Scene:
    """0: as trained; 1: affine maps in any order after the deformations; 2: deformations after them, about
    the origin of the world; 3: a deformation between affine maps."""

    def moves(_: int, node: Object) -> list[Transform]:
        *warps, scale, rotate, translate = (t for t in node.transforms if t.kind != "displace")
        some = [scale, rotate, translate]
        if kind == 1:
            return [*warps, *(some[i] for i in rng.permutation(3))]
        if kind == 2:
            return [*some, *warps]
        if kind == 3:
            return [*warps[:-1], scale, *warps[-1:], rotate, translate]
        return [*warps, *some]

    return rebuilt(base(rng), moves)


def affine(base: Base, rng: Rng, steps: float) -> Scene:
    def moves(_: int, node: Object) -> list[Transform]:
        *warps, scale, rotate, translate = node.transforms
        return [*warps, *long_chain(rng, max(3, int(steps)), scale, [rotate, translate])]

    return rebuilt(base(rng), moves)


BASE = SETS["shapes2d"]
_BEYOND = 3.0  # scale of a square that covers the canvas however it is turned
Make = Callable[[Rng, float], Scene]


@dataclass(frozen=True, slots=True)
class Probe:
    """One quantity and its scenes."""

    title: str  # what a chart is headed
    quantity: str  # what the axis says
    values: tuple[float, ...]  # of the quantity, ascending
    healthy: float  # the value that the others are compared with
    make: Make  # a scene for a value
    # whether the compiler may fold affine maps; else the lifting multiplies every one of them
    folded: bool = True
    # whether it shows what sampling costs: it is compared with many samples a pixel, moving ones too
    sampled: bool = False


@dataclass(frozen=True, slots=True)
class Kit:
    """Probes and counts for models of a dimension."""

    probes: dict[str, Probe]
    apart: Callable[[Rng], list[Object]]  # a number of objects that do not overlap
    animated: Callable[[Rng, int], list[Scene]]  # frames of one scene that moves a little


def _scene(rng: Rng, **changes: object) -> Scene:
    return random_scene(rng, replace(BASE, **changes))  # type: ignore[arg-type]


def common(base: Base, deformed: Base, warp: float) -> dict[str, Probe]:
    """The probes of any dimension: of base scenes, and deformed ones up to ``warp``."""
    return {
        "objects": Probe(
            "objects of a scene", "objects", (1, 2, 4, 8, 16, 32, 64, 128), 4,
            lambda rng, count: base(rng, objects=(int(count),) * 2),
        ),
        "operators": Probe(
            "operators in a row: smooth, subtract, intersect", "operators", tuple(range(1, 9)), 3,
            partial(operators, base),
        ),
        "blends": Probe(
            "smooth unions in a row", "smooth unions", (1, 2, 4, 8, 16, 32, 64), 4,
            partial(blends, base),
        ),
        "contrast": Probe(
            "blends of white and darker, large objects", "difference of the colours",
            (0, 0.125, 0.25, 0.5, 0.75, 1), 0.25, partial(contrast, base),
        ),
        "deep": Probe(
            "blends of white and black", "times the size", (0.3, 1, 1.5, 2, 3, 4), 1,
            lambda rng, size: contrast(base, rng, 1.0, size),
        ),
        "affine": Probe(
            "affine maps, each lifted by itself", "affine maps", (3, 4, 8, 16, 32, 64), 3,
            partial(affine, base), folded=False,
        ),
        "warp": Probe(
            "deformations beyond the base set's ±0.8", "times the range", (0.5, 1, 1.5, 2, 2.5, 3), 1,
            lambda rng, factor: deformed(rng, warp=warp * factor),
        ),
        "size": Probe(
            "sizes beyond the base set's", "times the size", (0.03, 0.1, 0.3, 1, 2, 4, 8), 1,
            lambda rng, factor: base(rng, size=factor),
        ),
        "thin": Probe(
            "thin objects", "ratio of the scales", (1, 3, 10, 30, 100, 300), 3, partial(thin, base)
        ),
        "shear": Probe("sheared objects", "shear", (0, 0.5, 1, 2, 4, 8), 0, partial(sheared, base)),
        "order": Probe(
            "orders of transformations", "0 as trained, 1 affine, 2 warps last, 3 mixed",
            (0, 1, 2, 3), 0, partial(order, deformed),
        ),
        "canvas": Probe(
            "canvas sizes", "pixels along a side", (32, 64, 128, 256, 512, 1024), 256,
            lambda rng, side: base(rng, canvas=(int(side),) * 2),
        ),
    }  # fmt: skip


def cell_of(i: int, count: int) -> Translate:
    """To the middle of a cell of a grid with so many."""
    side = math.isqrt(count - 1) + 1
    cell = 2.0 / side
    return Translate(x=(i % side + 0.5) * cell - 1, y=(i // side + 0.5) * cell - 1)


def apart(rng: Rng, count: int = 9) -> list[Object]:
    """Objects that do not overlap, in cells of a grid: what order they come in makes no difference."""
    size = 0.42 * (2.0 / (math.isqrt(count - 1) + 1))
    result = []
    config = SetConfig(warp=0.0, deformed=False)
    for i in range(count):
        node = random_object(rng, config)
        turn = next(t for t in node.transforms if isinstance(t, Rotate))
        result.append(node.model_copy(update={"transforms": (Scale.uniform(size), turn, cell_of(i, count))}))
    return result


def union_of(nodes: list[Object]) -> Scene:
    """A union in order."""
    return Scene(nodes=(Chain(nodes),))


def animated(rng: Rng, frames: int) -> list[Scene]:
    """Frames of a base scene whose objects turn by 3 degrees, drift by a pixel and sway a little each."""
    scene = _scene(rng)
    (chain,) = scene.nodes
    drifts = [(float(rng.normal()), float(rng.normal())) for _ in chain.children]  # type: ignore[union-attr]
    return [
        rebuilt(scene, lambda i, node, f=f: [_moved(t, f, *drifts[i]) for t in node.transforms])  # type: ignore[misc]
        for f in range(frames)
    ]


def _moved(move: Transform, frame: int, dx: float, dy: float) -> Transform:
    if isinstance(move, Rotate):
        return Rotate(angle=move.angle + math.radians(3.0 * frame))
    if isinstance(move, Translate):
        return Translate(x=move.x + dx * frame / 128, y=move.y + dy * frame / 128)
    if isinstance(move, Twirl):
        return Twirl(k=move.k + 0.02 * math.sin(frame))
    if isinstance(move, Bend):
        return Bend(k=move.k + 0.02 * math.cos(frame))
    return move


def _interleaved(rng: Rng, steps: float) -> Scene:
    return _scene(rng, affine_steps=max(3, int(steps)))


def _texels(rng: Rng, texels: float) -> Scene:
    """A square beyond a small canvas, with so many texels of a texture to a pixel."""
    side = 48
    material = Material(
        words.TEXTURES[int(rng.integers(len(words.TEXTURES)))],
        (
            Scale.uniform(TEXELS / (texels * side * _BEYOND)),
            Rotate(angle=float(rng.uniform(-math.pi, math.pi))),
            Translate(x=float(rng.uniform(-1, 1)), y=float(rng.uniform(-1, 1))),
        ),
    )
    moves = Scale.uniform(_BEYOND), Rotate(angle=float(rng.uniform(-math.pi, math.pi)))
    scene = union_of([Object("square", moves, material)])
    return scene.model_copy(update={"model": "shapes2d", "canvas": (side, side)})


def drifting(scene: Scene, frames: int) -> list[Scene]:
    """Frames of a scene of one chain whose objects drift by a third of a pixel each."""
    step = 2 / min(scene.canvas)
    return [
        rebuilt(
            scene,
            lambda _, node, f=f: [*node.transforms, Translate(x=0.31 * step * f, y=0.17 * step * f)],  # type: ignore[misc]
        )
        for f in range(frames)
    ]


PROBES = common(_scene, _scene, BASE.warp)
PROBES["affine"] = replace(PROBES["affine"], make=_interleaved)
FLAT = Kit(PROBES, apart, animated)
TEXTURES = replace(
    FLAT,
    probes={
        **PROBES,
        "texels": Probe(
            "textures drawn large and small, against 64 samples a pixel", "texels to a pixel",
            (0.02, 0.1, 0.5, 1, 2, 3, 4, 5, 6, 8, 16), 1, _texels, sampled=True,
        ),
    },
)  # fmt: skip


def rng_of(seed: int, index: int, attempt: int = 0) -> Rng:
    """Random numbers of a scene."""
    return np.random.default_rng([seed, 77, index, attempt])
