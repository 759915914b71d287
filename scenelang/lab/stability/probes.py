"""What the stability suite varies: one quantity at a time, from what was trained to far beyond.

A probe makes a random scene for a value of its quantity; the same index gives the same random numbers at
every value, so that a curve differs by the quantity alone. The base is that of the set `shapes2d`, or of
another dimension where a `Kit` says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from scenelang import words
from scenelang.elements.element import TEXELS
from scenelang.measure import varied
from scenelang.measure.sets import SETS, Rng, SetConfig, random_object, random_scene
from scenelang.measure.varied import LARGE as LARGE
from scenelang.measure.varied import Base
from scenelang.scene.schema import (
    Bend,
    Chain,
    Material,
    Object,
    Rotate,
    Scale,
    Scene,
    Transform,
    Translate,
    Twirl,
)

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
    """What the suite measures models of a dimension with.

    Args:
        probes: by name.
        apart: a number of objects that do not overlap.
        animated: a number of frames of one scene that moves a little.
    """

    probes: dict[str, Probe]
    apart: Callable[[Rng], list[Object]]
    animated: Callable[[Rng, int], list[Scene]]


def _scene(rng: Rng, **changes: object) -> Scene:
    return random_scene(rng, replace(BASE, **changes))  # type: ignore[arg-type]


def common(base: Base, deformed: Base, warp: float) -> dict[str, Probe]:
    """The probes of any dimension.

    Args:
        base: makes scenes.
        deformed: the like of deformed objects.
        warp: its strongest deformations.
    """
    return {
        "objects": Probe(
            "objects of a scene", "objects", (1, 2, 4, 8, 16, 32, 64, 128), 4,
            lambda rng, count: base(rng, objects=(int(count),) * 2),
        ),
        "operators": Probe(
            "operators in a row: smooth, subtract, intersect", "operators", tuple(range(1, 9)), 3,
            partial(varied.operators, base),
        ),
        "blends": Probe(
            "smooth unions in a row", "smooth unions", (1, 2, 4, 8, 16, 32, 64), 4,
            partial(varied.blends, base),
        ),
        "contrast": Probe(
            "blends of white and darker, large objects", "difference of the colours",
            (0, 0.125, 0.25, 0.5, 0.75, 1), 0.25, partial(varied.contrast, base),
        ),
        "deep": Probe(
            "blends of white and black", "times the size", (0.3, 1, 1.5, 2, 3, 4), 1,
            lambda rng, size: varied.contrast(base, rng, 1.0, size),
        ),
        "affine": Probe(
            "affine maps, each lifted by itself", "affine maps", (3, 4, 8, 16, 32, 64), 3,
            partial(varied.affine, base), folded=False,
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
            "thin objects", "ratio of the scales", (1, 3, 10, 30, 100, 300), 3, partial(varied.thin, base)
        ),
        "shear": Probe("sheared objects", "shear", (0, 0.5, 1, 2, 4, 8), 0, partial(varied.sheared, base)),
        "order": Probe(
            "orders of transformations", "0 as trained, 1 affine, 2 warps last, 3 mixed",
            (0, 1, 2, 3), 0, partial(varied.order, deformed),
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
    found = []
    config = SetConfig(warp=0.0, deformed=False)
    for i in range(count):
        node = random_object(rng, config)
        turn = next(t for t in node.transforms if isinstance(t, Rotate))
        found.append(node.model_copy(update={"transforms": (Scale.uniform(size), turn, cell_of(i, count))}))
    return found


def union_of(nodes: list[Object]) -> Scene:
    """A union in order."""
    return Scene(nodes=(Chain(nodes),))


def animated(rng: Rng, frames: int) -> list[Scene]:
    """Frames of a base scene whose objects turn by 3 degrees, drift by a pixel and sway a little each."""
    scene = _scene(rng)
    (chain,) = scene.nodes
    drifts = [(float(rng.normal()), float(rng.normal())) for _ in chain.children]  # type: ignore[union-attr]
    return [
        varied.rebuilt(scene, lambda i, node, f=f: [_moved(t, f, *drifts[i]) for t in node.transforms])  # type: ignore[misc]
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
        varied.rebuilt(
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
