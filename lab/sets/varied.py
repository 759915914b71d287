"""Scenes of a base set in which one quantity is another, of any dimension.

The same random numbers give scenes that differ by the quantity alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from lab.sets.sets import Rng, long_chain
from scenelang.scene.schema import Chain, Color, Link, Material, Object, Scale, Scene, Shear, Transform
from scenelang.words import BLEND, Combine

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
