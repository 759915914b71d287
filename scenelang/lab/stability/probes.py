"""What the stability suite varies: one quantity at a time, from what was trained to far beyond.

A probe makes a random scene for a value of its quantity; the same index gives the same random numbers at
every value, so that a curve differs by the quantity alone. The base is that of the set `shapes2d`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scenelang.measure.sets import SETS, Rng, SetConfig, random_object, random_scene
from scenelang.scene.schema import (
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
from scenelang.words import Combine

BASE = SETS["shapes2d"]
LARGE = 3.0  # times the size of the base set's objects
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


def _scene(rng: Rng, **changes: object) -> Scene:
    return random_scene(rng, replace(BASE, **changes))  # type: ignore[arg-type]


def _of(rng: Rng, count: float, **changes: object) -> Scene:
    """So many objects."""
    return _scene(rng, objects=(int(count),) * 2, **changes)


def _operators(rng: Rng, count: float) -> Scene:
    """One object and so many operators after it, none of them a plain union."""
    scene = _of(rng, count + 1, unions=0.0)
    words: tuple[Combine, ...] = ("smooth", "subtract", "intersect")
    # intersections leave little of a picture: objects are larger, so that something is there to be wrong
    return _joined(scene, lambda i: "union" if i == 0 else words[int(rng.integers(3))], 1.6)


def _blends(rng: Rng, count: float, larger: float = 1.0) -> Scene:
    return _joined(_of(rng, count + 1), lambda i: "smooth" if i else "union", larger)


def _contrast(rng: Rng, contrast: float, size: float = LARGE) -> Scene:
    """One `smooth` of three objects, a white one and two that are darker."""
    scene = _blends(rng, 2, size)
    white = int(rng.integers(3))

    def grey(i: int) -> Material:
        level = 1.0 if i == white else 1.0 - contrast
        return Material(name="flat", ops=(Color(rgb=(level, level, level)),))

    (chain,) = scene.nodes
    assert isinstance(chain, Chain)
    links = [
        link.model_copy(update={"node": link.node.model_copy(update={"material": grey(i)})})
        for i, link in enumerate(chain.children)
    ]
    return scene.model_copy(update={"nodes": (Chain(children=tuple(links)),)})


def _rebuilt(
    scene: Scene,
    moves: Callable[[int, Object], Sequence[Transform]],
    word: Callable[[int, Combine], Combine] = lambda _, op: op,
) -> Scene:
    """A scene of one chain of objects, with other transforms and other words between them."""
    (chain,) = scene.nodes
    assert isinstance(chain, Chain)
    links = []
    for i, link in enumerate(chain.children):
        assert isinstance(link.node, Object)
        node = link.node.model_copy(update={"transforms": tuple(moves(i, link.node))})
        links.append(Link(op=word(i, link.op), node=node))
    return scene.model_copy(update={"nodes": (Chain(children=tuple(links)),)})


def _joined(scene: Scene, word: Callable[[int], Combine], larger: float) -> Scene:
    def moves(_: int, node: Object) -> list[Transform]:
        return [
            Scale(x=t.x * larger, y=t.y * larger, z=1.0) if isinstance(t, Scale) else t
            for t in node.transforms
        ]

    return _rebuilt(scene, moves, lambda i, _: word(i))


def _thin(rng: Rng, ratio: float) -> Scene:
    def moves(_: int, node: Object) -> list[Transform]:
        return [Scale(x=t.x, y=t.x / ratio, z=1.0) if isinstance(t, Scale) else t for t in node.transforms]

    return _rebuilt(_scene(rng), moves)


def _sheared(rng: Rng, k: float) -> Scene:
    def moves(_: int, node: Object) -> list[Transform]:
        *first, rotate, translate = node.transforms
        return [*first, Shear(axes="xy", k=k), rotate, translate]

    return _rebuilt(_scene(rng), moves)


def _order(rng: Rng, kind: float) -> Scene:
    """0: as trained; 1: affine maps in any order after the deformations; 2: deformations after them, about
    the origin of the world; 3: a deformation between affine maps."""

    def moves(_: int, node: Object) -> list[Transform]:
        twirl, bend, scale, rotate, translate = node.transforms
        some = [scale, rotate, translate]
        if kind == 1:
            return [twirl, bend, *(some[i] for i in rng.permutation(3))]
        if kind == 2:
            return [*some, twirl, bend]
        if kind == 3:
            return [twirl, scale, bend, rotate, translate]
        return list(node.transforms)

    return _rebuilt(_scene(rng), moves)


PROBES: dict[str, Probe] = {
    "objects": Probe("objects of a scene", "objects", (1, 2, 4, 8, 16, 32, 64, 128), 4, _of),
    "operators": Probe(
        "operators in a row: smooth, subtract, intersect", "operators", tuple(range(1, 9)), 3, _operators
    ),
    "blends": Probe("smooth unions in a row", "smooth unions", (1, 2, 4, 8, 16, 32, 64), 4, _blends),
    "contrast": Probe(
        "blends of white and darker, three times the base set's size", "difference of the colours",
        (0, 0.125, 0.25, 0.5, 0.75, 1), 0.25, _contrast,
    ),
    "deep": Probe(
        "blends of white and black", "times the size", (0.3, 1, 1.5, 2, 3, 4), 1,
        lambda rng, size: _contrast(rng, 1.0, size),
    ),
    "affine": Probe(
        "affine maps of each object, each lifted by itself", "affine maps", (3, 4, 8, 16, 32, 64), 3,
        lambda rng, steps: _scene(rng, affine_steps=max(3, int(steps))), folded=False,
    ),
    "warp": Probe(
        "deformations beyond the base set's ±0.8", "times the range", (0.5, 1, 1.5, 2, 2.5, 3), 1,
        lambda rng, factor: _scene(rng, warp=BASE.warp * factor),
    ),
    "size": Probe(
        "sizes beyond the base set's", "times the size", (0.03, 0.1, 0.3, 1, 2, 4, 8), 1,
        lambda rng, factor: _scene(rng, size=factor),
    ),
    "thin": Probe("thin objects", "ratio of the scales", (1, 3, 10, 30, 100, 300), 3, _thin),
    "shear": Probe("sheared objects", "shear", (0, 0.5, 1, 2, 4, 8), 0, _sheared),
    "order": Probe(
        "orders of transformations", "order (0 as trained, 1 affine shuffled, 2 deformed last, 3 mixed)",
        (0, 1, 2, 3), 0, _order,
    ),
    "canvas": Probe(
        "canvas sizes", "pixels along a side", (32, 64, 128, 256, 512, 1024), 256,
        lambda rng, side: _scene(rng, canvas=(int(side),) * 2),
    ),
}  # fmt: skip


def apart(rng: Rng, count: int = 9) -> list[Object]:
    """Objects that do not overlap, in cells of a grid: what order they come in makes no difference."""
    side = math.isqrt(count - 1) + 1
    cell = 2.0 / side
    found = []
    config = SetConfig(warp=0.0, deformed=False)
    for i in range(count):
        node = random_object(rng, config)
        turn = next(t for t in node.transforms if isinstance(t, Rotate))
        place = Translate(x=(i % side + 0.5) * cell - 1, y=(i // side + 0.5) * cell - 1)
        found.append(node.model_copy(update={"transforms": (Scale.uniform(0.42 * cell), turn, place)}))
    return found


def union_of(nodes: list[Object]) -> Scene:
    """A union in order."""
    links = tuple(Link(op="union", node=node) for node in nodes)
    return Scene(model="shapes2d", nodes=(Chain(children=links),))


def animated(rng: Rng, frames: int) -> list[Scene]:
    """Frames of a base scene whose objects turn by 3 degrees, drift by a pixel and sway a little each."""
    scene = _scene(rng)
    (chain,) = scene.nodes
    drifts = [(float(rng.normal()), float(rng.normal())) for _ in chain.children]  # type: ignore[union-attr]
    return [
        _rebuilt(scene, lambda i, node, f=f: [_moved(t, f, *drifts[i]) for t in node.transforms])  # type: ignore[misc]
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


def rng_of(seed: int, index: int, attempt: int = 0) -> Rng:
    """Random numbers of a scene."""
    return np.random.default_rng([seed, 77, index, attempt])
