"""Scenes of solids by hand, for tests: a leaf from its steps, folds from words."""

from __future__ import annotations

from scenelang.compiler import steps as affine
from scenelang.compiler.graph import Fold, Leaf, Link, Look, Move, Node
from scenelang.compiler.spaces import Triple
from scenelang.compiler.steps import Affine, Step


def leaf(geometry: str, material: str, rgb: Triple, *steps: Step) -> Leaf:
    """An object of one linear colour."""
    return Leaf(geometry, Look(material, rgb=rgb), tuple(map(Move, steps)))


def fold(*links: Node | tuple[str, Node] | tuple[str, Node, float], steps: tuple[Step, ...] = ()) -> Fold:
    """Children with their words, a union where there is none, and widths of blends."""
    whole = [link if isinstance(link, tuple) else ("union", link) for link in links]
    return Fold("scene", tuple(Link(*link) for link in whole), tuple(map(Move, steps)))


def scaled(x: float, y: float | None = None, z: float | None = None) -> Affine:
    return Affine(affine.scaling(x, x if y is None else y, x if z is None else z))


def moved(x: float, y: float, z: float) -> Affine:
    return Affine(affine.translation(x, y, z))


def turned(angle_rad: float, *axis: float) -> Affine:
    return Affine(affine.rotation(angle_rad, (axis[0], axis[1], axis[2])))


def sheared(axes: str, k: float) -> Affine:
    return Affine(affine.shearing(axes, k))


GOLD, SKY, RED = (0.8, 0.53, 0.12), (0.07, 0.21, 1.0), (0.7, 0.05, 0.04)
USUAL = fold(
    leaf("sphere", "diffuse", GOLD, scaled(0.6), moved(0, 0.6, 0)),
    leaf("torus", "diffuse", SKY, scaled(1.2, 1.2, 0.4), turned(1.22, 1, 0, 0)),
    leaf("sphere", "diffuse", RED, scaled(0.9, 0.2, 0.5), sheared("xy", 0.6), moved(0.5, -0.8, 0.5)),
)
