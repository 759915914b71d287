"""Scenes of solids that are lifted by hand, after the solid layout's description."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from scenelang.compiler.graph import Fold, Leaf, Link, Look, Move, Node
from scenelang.compiler.lifting import SOLID_LAYOUT as LAYOUT
from scenelang.compiler.lifting import Parts, inverse_frame
from scenelang.compiler.program import Paint
from scenelang.compiler.steps import Affine, Displace, Step, Twist, Warp, composed
from scenelang.compiler.weights import shipped_weights
from scenelang.drawing.neural.files import solid_arrays
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.network import SolidArrays, SolidNetwork
from scenelang.language.words import BLEND, TOKENS, Combine

LEAVES, MATERIALS = ("sphere", "torus"), ("diffuse", "volumetric")


class Object(NamedTuple):
    """An object; steps are nearest the leaf first: displacement, turns, maps, turns, maps.

    With a paint, whose texture is moved, in place of the colour. The width of its blend is the usual one
    where it is 0.
    """

    leaf: str
    steps: Sequence[Step] = ()
    material: str = "diffuse"
    rgb: tuple[float, float, float] = (0.8, 0.5, 0.3)
    token: Combine = "union"
    k: float = 0.0
    paint: Paint | None = None
    texture: tuple[Affine, ...] = ()


@lru_cache
def network() -> SolidArrays:
    """The shipped network."""
    return solid_arrays(shipped_weights("solids3d"), len(LEAVES), len(MATERIALS))


def weights() -> dict[str, np.ndarray]:
    """Of the shipped network, by their names in its file."""
    net = network()
    named = {k: v for k, v in vars(net).items() if isinstance(v, np.ndarray)}
    groups = ("decoder_w", "decoder_b", "segment_w", "segment_b")
    return named | {f"{group}.{i}": getattr(net, group)[i] for group in groups for i in range(3)}


def moved(x: float, y: float, z: float) -> Affine:
    return Affine((1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z))


def scaled(x: float, y: float, z: float) -> Affine:
    return Affine((x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0))


def turned(angle: float) -> Affine:
    """About the direction (1, 2, 3)."""
    a = np.array([1.0, 2.0, 3.0]) / 14**0.5
    cross = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    matrix = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return Affine(tuple(np.column_stack([matrix, np.zeros(3)]).ravel().tolist()))


def vector(o: Object, net: SolidNetwork) -> np.ndarray:
    """The 64 numbers of an object."""
    maps, turns = [np.eye(4)], [[]]  # maps and turns take turns, nearest the leaf first
    bulge = 0.0, 0.0
    for step in o.steps:
        if isinstance(step, Displace):
            bulge = step.amount, step.frequency
        elif isinstance(step, Affine):
            maps[-1] = np.vstack([np.reshape(step.rows, (3, 4)), (0, 0, 0, 1)]) @ maps[-1]
        else:
            if (maps[-1] != np.eye(4)).any():
                maps.append(np.eye(4))
                turns.append([])
            slot = (step.twirl, step.bend[0], 0.0) if isinstance(step, Warp) else (0.0, 0.0, step.twist)
            turns[-1].insert(0, slot)
    if len(maps) == 1:
        maps, turns = [np.eye(4), maps[0]], [turns[0], []]
    middle, last = (inverse_frame(tuple(matrix[:3].ravel().tolist()), 3) for matrix in maps)
    inner, outer = (np.resize([*np.ravel(slots), *[0.0] * 6], 6) for slots in turns)
    rows = np.reshape(composed(o.texture), (3, 4))[:2, [0, 1, 3]]
    parts = Parts(
        code=net.xp.to_numpy(net.codes)[LEAVES.index(o.leaf)],
        one=1.0,
        frame=last,
        outer=outer,
        middle=middle,
        inner=inner,
        bulge=bulge,
        width=o.k,
        texture=np.linalg.inv(np.vstack([rows, (0, 0, 1)]))[:2].ravel(),
        rgb=o.rgb,
        material=net.xp.to_numpy(net.material_codes)[MATERIALS.index(o.material)],
    )
    return LAYOUT.pack(1, **parts._asdict())[0].astype(np.float32)


def field(objects: Sequence[Object], net: SolidNetwork | None = None) -> SolidField:
    """The field of a stream of objects."""
    net = net or network()
    vectors = np.reshape([vector(o, net) for o in objects], (-1, 64)).astype(np.float32)
    tokens = np.array([TOKENS[o.token] for o in objects], np.int8)
    return SolidField(net, vectors, tokens, paints=[o.paint for o in objects])


MIXED = (
    Object(
        "torus",
        (Displace(0.05, 6.0), Twist(0.8), Warp(0.5, (0.0, 0.0)), scaled(0.9, 0.7, 0.8), turned(1.0)),
    ),
    Object(
        "sphere",
        (scaled(0.5, 0.3, 0.4), Warp(0.0, (0.7, 0.0)), moved(0.3, 0.2, 0.1)),
        token="smooth",
        k=0.3,
    ),
    Object("torus", (scaled(0.5, 0.5, 0.5), turned(2.0), moved(0.0, 0.4, 0.3)), token="subtract"),
    Object("sphere", (scaled(1.1, 1.0, 1.2),), token="intersect"),
)
"""Objects of every kind about the origin."""


def graph(objects: Sequence[Object]) -> Fold:
    """The same stream as a graph, for the reference."""
    return Fold("scene", tuple(link(o.token, o.k, leaf(o)) for o in objects))


def leaf(o: Object) -> Leaf:
    """An object as a graph has it."""
    return Leaf(o.leaf, look(o), tuple(map(Move, o.steps)))


def link(token: Combine, k: float, node: Node) -> Link:
    """With the width that 0 stands for."""
    return Link(token, node, k or (BLEND if token == "smooth" else 0.0))


def look(o: Object) -> Look:
    """What an object looks like."""
    if o.paint is None:
        return Look(o.material, rgb=o.rgb)
    return Look(o.material, o.paint.steps, element=o.paint.element, texture=o.texture)


def psnr(a: np.ndarray, b: np.ndarray) -> float:
    """In dB."""
    return float(-10 * np.log10(np.square(np.asarray(a, float) - b).mean() + 1e-12))
