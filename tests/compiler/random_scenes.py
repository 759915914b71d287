"""Random Scene trees for property tests."""

from __future__ import annotations

import random
from typing import Any

from scenelang.language import scene as schema

GEOMETRIES = ("square", "triangle", "star", "pentagon")


def random_transform(rng: random.Random, warps: bool, room: float = 1.0) -> schema.Transform:
    """Any transform that a 2D model has, mild enough to stay invertible."""
    kind = rng.choice(["translate", "rotate", "scale", "uniform", "shear", "flip"] + ["warp"] * 2 * warps)
    if kind == "translate":
        return schema.Translate(x=rng.uniform(-room, room), y=rng.uniform(-room, room))
    if kind == "rotate":
        return schema.Rotate(angle=rng.uniform(-4, 4), axis=(0.0, 0.0, rng.choice([1.0, -2.0])))
    if kind == "scale":
        return schema.Scale(x=rng.uniform(0.4, 1.3), y=rng.uniform(0.4, 1.3), z=rng.uniform(-1, 1))
    if kind == "uniform":
        s = rng.uniform(0.5, 1.2)
        return schema.Scale(x=s, y=s, z=s)
    if kind == "shear":
        return schema.Shear(axes=rng.choice(["xy", "yx"]), k=rng.uniform(-0.6, 0.6))
    if kind == "flip":
        return schema.Scale(x=-1.0, y=1.0, z=1.0)
    k = rng.uniform(-1.2, 1.2)
    return schema.Twirl(k=k) if rng.random() < 0.5 else schema.Bend(k=k)


def random_material(rng: random.Random) -> schema.Material | None:
    """A colour, or none."""
    if rng.random() < 0.2:
        return None
    rgb = (rng.random(), rng.random(), rng.random())
    return schema.Material(name="flat", ops=(schema.Color(rgb=rgb),))


def random_leaf(rng: random.Random, warps: bool, spread: float = 1.0) -> schema.Object:
    """A leaf with a few transforms, usually small enough for others to miss it."""
    moves = [random_transform(rng, warps, 0.3) for _ in range(rng.randrange(3))]
    s = rng.choice([0.05, 0.15, 0.3, 0.5])
    moves.append(schema.Scale(x=s, y=s, z=1.0))
    moves.append(schema.Translate(x=rng.uniform(-spread, spread), y=rng.uniform(-spread, spread)))
    if warps and rng.random() < 0.15:
        moves.append(random_transform(rng, True, 0.2))
    return schema.Object(
        geometry=rng.choice(GEOMETRIES), transforms=tuple(moves), material=random_material(rng)
    )


def random_node(rng: random.Random, depth: int, warps: bool, spread: float = 1.0) -> schema.SceneNode:
    """A leaf, or a group, chain or boolean of up to three, some of them empty."""
    if depth == 0 or rng.random() < 0.3:
        return random_leaf(rng, warps, spread)
    count = rng.choice([0, 1, 2, 2, 2, 3])
    near = spread if rng.random() < 0.5 else 0.3 * spread
    children = tuple(random_node(rng, depth - 1, warps, near) for _ in range(count))
    moves = tuple(random_transform(rng, warps, 0.4) for _ in range(rng.choice([0, 0, 1, 2])))
    if near < spread:
        moves = (*moves, schema.Translate(x=rng.uniform(-1, 1), y=rng.uniform(-1, 1)))
    kind = rng.choice(["group", "chain", "union", "union", "smooth", "subtract", "subtract", "intersect"])
    material = random_material(rng) if rng.random() < 0.2 else None
    if kind == "group":
        return schema.Group(children=children, transforms=moves, material=material)
    if kind == "chain":
        ops = ["union"] + [
            rng.choice(["union", "union", "smooth", "subtract", "intersect"]) for _ in children[1:]
        ]
        links = tuple(
            schema.Link(op=op, node=child, k=random_width(rng, op))
            for op, child in zip(ops, children, strict=False)
        )
        return schema.Chain(children=links, transforms=moves, material=material)
    return schema.Boolean(
        op=kind, children=children, transforms=moves, material=material, k=random_width(rng, kind)
    )


def random_width(rng: random.Random, op: str) -> float | None:
    """The width of a blend, of a third of what may have one."""
    return rng.uniform(0.05, 0.5) if op != "union" and rng.random() < 1 / 3 else None


def random_scene(seed: int, warps: bool = True) -> schema.Scene:
    """A scene of one to three trees, on canvases of several shapes."""
    rng = random.Random(seed)
    canvas = rng.choice([(256, 256), (320, 192), (64, 200)])
    nodes = tuple(random_node(rng, rng.choice([1, 2, 3]), warps) for _ in range(rng.choice([1, 1, 2, 3])))
    return schema.Scene(nodes=nodes, canvas=canvas)


def blob_scene(seed: int) -> schema.Scene:
    """Small chains of `smooth` leaves, near each other and near the edge of the canvas."""
    rng = random.Random(seed)

    def leaf(x: float, y: float) -> schema.Object:
        s = rng.uniform(0.05, 0.25)
        moves = (
            schema.Rotate(angle=rng.uniform(0, 6)),
            schema.Scale(x=s, y=s * rng.uniform(0.3, 1.0), z=1.0),
            schema.Rotate(angle=rng.uniform(0, 6)),
            schema.Translate(x=x + rng.uniform(-0.3, 0.3), y=y + rng.uniform(-0.3, 0.3)),
        )
        return schema.Object(geometry=rng.choice(GEOMETRIES), transforms=moves, material=random_material(rng))

    def blob(x: float, y: float) -> schema.Chain:
        words = ["smooth", "smooth", "union", "subtract"]
        ops = ["union"] + [rng.choice(words) for _ in range(rng.choice([1, 1, 2, 3]))]
        return schema.Chain(children=tuple(schema.Link(op=op, node=leaf(x, y)) for op in ops))

    apart = rng.uniform(0.3, 1.3)
    x, y = rng.choice([(0.0, 0.0), (0.9, 0.0), (-1.1, 0.9), (1.3, -1.2)])
    nodes = (
        blob(x - apart / 2, y),
        blob(x + apart / 2, y),
        *(leaf(x, y - 0.6) for _ in range(rng.randrange(2))),
    )
    if rng.random() < 0.5:
        tail = schema.Link(op=rng.choice(["smooth", "subtract", "union"]), node=leaf(0.7 * x, 0.7 * y))
        head = schema.Link(op="union", node=schema.Group(children=nodes))
        return schema.Scene(nodes=(schema.Chain(children=(head, tail)),))
    return schema.Scene(nodes=nodes)


EYE = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
NOTHING: tuple[schema.Transform, ...] = (
    schema.Translate(x=0.0, y=0.0),
    schema.Rotate(angle=0.0),
    schema.Scale(x=1.0, y=1.0, z=1.0),
    schema.Shear(axes="xy", k=0.0),
    schema.Matrix(rows=EYE),
    schema.Twirl(k=0.0),
    schema.Bend(k=0.0),
)
"""Transforms that leave everything where it is."""

SMALL = {(256, 256): (64, 64), (320, 192): (80, 48), (64, 200): (16, 50)}
"""Canvases of the same shapes whose every sample can be looked at."""


def full_scene(seed: int) -> schema.Scene:
    """A `random_scene` with all that passes look for.

    Transforms that do nothing and whole matrices among the others, objects drawn twice, objects off the
    canvas, and small ones under a large one.
    """
    rng = random.Random(f"full {seed}")
    scene = random_scene(rng.randrange(1 << 30), warps=rng.random() < 0.7)
    nodes = [_enriched(node, rng) for node in scene.nodes]
    for extra in range(len(nodes), 0, -1):
        draw = rng.random()
        if draw < 0.2:
            away = schema.Translate(x=rng.choice([-4.0, 4.0]), y=rng.uniform(-3.0, 3.0))
            nodes.insert(extra, schema.Group(children=(random_leaf(rng, False),), transforms=(away,)))
        elif draw < 0.4:
            nodes[extra:extra] = _hidden(rng)
    return scene.model_copy(update={"nodes": tuple(nodes), "canvas": SMALL[scene.canvas]})


def _hidden(rng: random.Random) -> list[schema.SceneNode]:
    """A small leaf, and a larger one over it."""
    at = schema.Translate(x=rng.uniform(-0.6, 0.6), y=rng.uniform(-0.6, 0.6))
    turn, size = schema.Rotate(angle=rng.uniform(0, 6)), rng.uniform(0.3, 0.6)
    return [
        schema.Object(
            geometry=rng.choice(GEOMETRIES),
            transforms=(schema.Scale(x=s, y=s, z=1.0), turn, at),
            material=random_material(rng),
        )
        for s in (0.2 * size, size)
    ]


def _moves(moves: tuple[schema.Transform, ...], rng: random.Random) -> tuple[schema.Transform, ...]:
    """With transforms that do nothing, and a matrix, in between."""
    out = list(moves)
    while rng.random() < 0.35:
        out.insert(rng.randint(0, len(out)), rng.choice(NOTHING))
    if rng.random() < 0.15:
        a, b, c, d = (rng.uniform(-0.3, 0.3) for _ in range(4))
        rows = ((1 + a, b, 0.0, c), (b, 1 - a, 0.0, d), *EYE[2:])
        out.insert(rng.randint(0, len(out)), schema.Matrix(rows=rows))
    return tuple(out)


def _enriched(node: schema.SceneNode, rng: random.Random) -> schema.SceneNode:
    changes: dict[str, object] = {"transforms": _moves(node.transforms, rng)}
    if isinstance(node, schema.Chain):
        links = [link.model_copy(update={"node": _enriched(link.node, rng)}) for link in node.children]
        changes["children"] = _doubled(links, rng)
    elif not isinstance(node, schema.Object):
        changes["children"] = _doubled([_enriched(child, rng) for child in node.children], rng)
    return node.model_copy(update=changes)


def _doubled(children: list[Any], rng: random.Random) -> tuple[Any, ...]:
    """With one of them drawn twice, now and then."""
    if children and rng.random() < 0.15:
        children.append(rng.choice(children))
    return tuple(children)
