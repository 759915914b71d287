"""Scenes of solids by hand: graphs, streams of objects, and trees of booleans."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import radians
from typing import NamedTuple

import numpy as np
import torch

from scenelang.compiler import steps as affine
from scenelang.compiler.graph import Fold, Leaf, Link, Look, Move, Node
from scenelang.compiler.groups import BEGINS, ENDS
from scenelang.compiler.lifting import SOLID_LAYOUT as LAYOUT
from scenelang.compiler.lifting import Parts, inverse_frame
from scenelang.compiler.program import Paint
from scenelang.compiler.spaces import Camera, Ground, Light, Stage, Triple
from scenelang.compiler.steps import Affine, Displace, Grow, Shell, Step, Twist, Warp, composed
from scenelang.compiler.weights import open_weights, shipped_weights
from scenelang.drawing.kernel import Asked
from scenelang.drawing.neural.files import solid_arrays
from scenelang.drawing.neural.load import Solids
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.network import SolidArrays, SolidNetwork
from scenelang.drawing.solid.plain import solid_field
from scenelang.language import words
from scenelang.language.words import BLEND, COMBINE, TOKENS, Combine


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


def turned(angle_rad: float, x: float = 1.0, y: float = 2.0, z: float = 3.0) -> Affine:
    return Affine(affine.rotation(angle_rad, (x, y, z)))


def sheared(axes: str, k: float) -> Affine:
    return Affine(affine.shearing(axes, k))


LEAVES, MATERIALS = (*words.LEAVES[3],), ("diffuse", "volumetric")


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
    return {name: value.copy() for name, value in open_weights(shipped_weights("solids3d")).arrays.items()}


def torch_network() -> Solids:
    """The shipped network in torch."""
    net = Solids(network().config, len(LEAVES), len(MATERIALS))
    net.load_state_dict({name: torch.from_numpy(value) for name, value in weights().items()})
    return net.requires_grad_(False)


def vector(o: Object, net: SolidNetwork) -> np.ndarray:
    """The 64 numbers of an object."""
    maps, turns = [np.eye(4)], [[]]  # maps and turns take turns, nearest the leaf first
    bulge, grow, shell, order = (0.0, 0.0), 0.0, 0.0, 0
    for step in o.steps:
        if isinstance(step, Displace):
            bulge, order = (step.amount, step.frequency), order + 2 * (shell > 0)
        elif isinstance(step, Grow):
            grow, order = step.r, order + (shell > 0)
        elif isinstance(step, Shell):
            shell = step.w
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
        clear=0.0,
        material=net.xp.to_numpy(net.material_codes)[MATERIALS.index(o.material)],
        grow=grow,
        shell=shell,
        order=order,
    )
    return LAYOUT.pack(1, **parts._asdict())[0].astype(np.float32)


def field(objects: Sequence[Object], net: SolidNetwork | None = None) -> SolidField:
    """The field of a stream of objects."""
    net = net or network()
    vectors = np.reshape([vector(o, net) for o in objects], (-1, 64)).astype(np.float32)
    tokens = np.array([TOKENS[o.token] for o in objects], np.int8)
    return solid_field(net, vectors, tokens, paints=[o.paint for o in objects])


def everywhere(solids: SolidField, p: np.ndarray, reach: float = 1e6) -> Asked:
    """What a field answers at points (3, M), within a reach or where every object is met."""
    xp, like = solids.xp, solids.network.codes
    with xp.inference():
        return solids.near(xp.array(np.float32(p), like), reach, gradient=True, every=True)


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
    Object("torus", (scaled(0.5), turned(2.0), moved(0.0, 0.4, 0.3)), token="subtract"),
    Object("sphere", (scaled(1.1, 1.0, 1.2),), token="intersect"),
)
"""Objects of every kind about the origin."""


def graph(objects: Sequence[Object]) -> Fold:
    """The same stream as a graph, for the reference."""
    return Fold("scene", tuple(link(o.token, o.k, leaf_of(o)) for o in objects))


def leaf_of(o: Object) -> Leaf:
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


GOLD, SKY, RED = (0.8, 0.53, 0.12), (0.07, 0.21, 1.0), (0.7, 0.05, 0.04)
USUAL = fold(
    leaf("sphere", "diffuse", GOLD, scaled(0.6), moved(0, 0.6, 0)),
    leaf("torus", "diffuse", SKY, scaled(1.2, 1.2, 0.4), turned(1.22, 1, 0, 0)),
    leaf("sphere", "diffuse", RED, scaled(0.9, 0.2, 0.5), sheared("xy", 0.6), moved(0.5, -0.8, 0.5)),
)
ASIDE = fold(
    leaf("torus", "diffuse", SKY, scaled(1.1, 0.7, 0.9), turned(2.1, 1, 2, 0.5), sheared("yz", 0.4)),
    leaf("sphere", "diffuse", GOLD, scaled(0.6, 0.2, 0.4), turned(0.7, 0, 0, 1), moved(0.9, 0.3, -0.4)),
)
"""Other solids; `FROM_ASIDE` sees them from aside with a wide view, by a light close to a surface."""
FROM_ASIDE = Stage(
    Camera((2.2, 2.6, -1.7), (0.3, -0.2, 0.1), radians(80)),
    (Light((0.75, 0.7, -0.4), 0.4, (1.0, 0.7, 0.4)),),
    Ground(-1.1, (0.3, 0.5, 0.6)),
    (0.4, 0.1, 0.2),
    (0.4, 0.1, 0.2),
)


class Join(NamedTuple):
    """An operand of a tree with the operator and width by which it joins those before it."""

    op: Combine
    node: Tree | Object
    k: float = 0.0


class Tree(tuple[Join, ...]):
    """Operands from the left."""


class Row(NamedTuple):
    """An object of a stream."""

    o: Object
    op: Combine
    k: float
    begins: bool = False
    ends: int = 0

    @property
    def token(self) -> int:
        return TOKENS[self.op] | BEGINS * self.begins | self.ends << ENDS


def rows(node: Tree | Object) -> list[Row]:
    """The stream of a tree: operands that are trees are groups, but for the first, which goes on."""
    if isinstance(node, Object):
        return [Row(node, "union", 0.0)]
    found = rows(node[0].node)
    for op, operand, k in node[1:]:
        more = rows(operand)
        more[0] = more[0]._replace(op=op, k=k)
        if isinstance(operand, Tree):
            more[0], last = more[0]._replace(begins=True), more[-1]
            more[-1] = more[-1]._replace(ends=last.ends + 1)
        found += more
    return found


def tree_field(tree: Tree | Sequence[Row], net: SolidNetwork | None = None) -> SolidField:
    """The field of a tree, or of its rows."""
    net, stream = net or network(), rows(tree) if isinstance(tree, Tree) else tree
    vectors = np.array([vector(row.o._replace(k=0.0), net) for row in stream])
    vectors[:, LAYOUT.places.width] = [row.k for row in stream]
    return solid_field(net, vectors, np.array([row.token for row in stream], np.int8))


def tree_graph(node: Tree) -> Fold:
    """The same as a graph, for the reference."""
    nodes = [leaf_of(at) if isinstance(at := join.node, Object) else tree_graph(at) for join in node]
    return Fold("scene", tuple(link(join.op, join.k, at) for join, at in zip(node, nodes, strict=True)))


def random_tree(rng: np.random.Generator, depth: int, media: float = 0.0) -> Tree:
    """Up to so deep; operators are equally likely, and a third of all cuts have rounded edges."""

    def node(left: int) -> Tree | Object:
        if left == 0 or (left < depth and rng.random() < 0.4):
            steps = (
                scaled(*rng.uniform(0.35, 0.75, 3)),
                turned(rng.uniform(0, 6)),
                moved(*rng.uniform(-0.5, 0.5, 3)),
            )
            kind = MATERIALS[int(rng.random() < media)]
            return Object(str(rng.choice(LEAVES[:2])), steps, kind, tuple(rng.uniform(0.1, 0.9, 3).tolist()))
        joins = []
        for at in range(int(rng.integers(2, 4))):
            op: Combine = "union" if at == 0 else COMBINE[rng.integers(4)]
            wide = op != "union" and rng.random() < 1 / 3
            joins.append(Join(op, node(left - 1), float(np.float32(rng.uniform(0.05, 0.5))) if wide else 0.0))
        return Tree(joins)

    found = node(depth)
    assert isinstance(found, Tree)
    return found
