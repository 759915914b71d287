"""Every pass keeps what solids are and look like, on random trees against the exact field."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest

from scenelang.compiler.graph import Fold, Graph, Leaf, Link, verify
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.passes import PASSES, check_eye
from scenelang.compiler.rewrites import Context, drop_hidden, drop_unseen, flatten
from scenelang.compiler.spaces import Camera, Ground, Light, Stage
from scenelang.drawing.exact.solid import ExactField, solid_image
from scenelang.language import scene as schema
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.words import COMBINE

SOLIDS = load_manifest("solids3d")
CHECKS = {"check_eye", "check_levels", "check_media", "check_seen", "check_trained"}


def random_transform(rng: random.Random) -> schema.Transform:
    k = rng.uniform(-1, 1)
    s = rng.uniform(0.6, 1.2)
    axis = rng.choice([(0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 2.0, -1.0)])
    return rng.choice(
        [
            schema.Translate(k / 2, rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5)),
            schema.Rotate(angle=3 * k, axis=axis),
            schema.Scale(s, 0.8, rng.choice([s, -s])),
            schema.Scale.uniform(s),
            schema.Shear(rng.choice(["xz", "zy"]), k / 2),
            schema.Twirl(k),
            schema.Bend(k),
            schema.Twist(k),
        ]
    )


def random_leaf(rng: random.Random, spread: float) -> schema.Object:
    moves: list[schema.Transform] = [schema.Displace(0.1 * rng.uniform(-1, 1), 4.0)] * (rng.random() < 0.2)
    moves += [random_transform(rng) for _ in range(rng.randrange(3))]
    moves.append(schema.Scale.uniform(rng.choice([0.15, 0.4, 0.7])))
    moves.append(schema.Translate(*(rng.uniform(-spread, spread) for _ in range(3))))
    rgb = (rng.random(), rng.random(), rng.random())
    name = rng.choice(["diffuse", "volumetric"])
    return schema.Object(rng.choice(["sphere", "torus"]), moves, schema.Material(name, schema.Color(rgb)))


def random_node(rng: random.Random, depth: int, spread: float = 1.2) -> schema.SceneNode:
    if depth == 0 or rng.random() < 0.3:
        return random_leaf(rng, spread)
    near = spread if rng.random() < 0.5 else 0.3 * spread
    children = [random_node(rng, depth - 1, near) for _ in range(rng.choice([0, 1, 2, 2, 2, 3]))]
    moves = [random_transform(rng) for _ in range(rng.randrange(2))]
    if rng.random() < 0.4:
        return schema.Group(children, moves)
    return schema.Boolean(rng.choice(COMBINE), children, moves)


def widened(graph: Graph, rng: random.Random) -> Graph:
    """The same with blends of many widths."""

    def width(op: str) -> float:
        return rng.choice([0.15, 0.05, 0.4] if op == "smooth" else [0.0, 0.0, 0.2]) * (op != "union")

    def node(fold: Fold) -> Fold:
        links = [
            Link(x.op, x.node if isinstance(x.node, Leaf) else node(x.node), width(x.op)) for x in fold.links
        ]
        return Fold(fold.kind, tuple(links), fold.moves, fold.span)

    return graph.rooted(node(graph.root))


def stages_of(scene: schema.Scene, rng: random.Random) -> tuple[list[Graph], bool]:
    diagnostics = Diagnostics()
    graph = lower(scene, SOLIDS, None, diagnostics)
    assert not diagnostics.errors
    stages, context, holds = [widened(graph, rng)], Context(SOLIDS, diagnostics), set()
    for step in PASSES:
        if step.name not in CHECKS:
            stages.append(step.run(stages[-1], context))
            holds |= step.establishes
            if not diagnostics.errors:
                verify(stages[-1], step.name, holds)
    return stages, not diagnostics.errors


def test_random_trees_keep_their_picture() -> None:
    accepted = covered = shorter = 0
    for seed in range(40):
        rng = random.Random(seed)
        scene = schema.Scene(nodes=[random_node(rng, 3) for _ in range(rng.randrange(1, 4))])
        (first, *others), fits = stages_of(scene, rng)
        if not fits:
            continue
        accepted += 1
        p = np.random.default_rng(seed).uniform(-1.3, 1.3, (3, 2500))
        p = p[:, p[1] >= first.window()[1]]
        wanted = ExactField(first.root).at(p)
        covered += (wanted.d < 0).sum()
        shorter += len(others[-3].root.links) > len(others[-1].root.links)
        # each pass by itself, and their whole
        for graph in others if seed % 4 == 0 else others[-1:]:
            found = ExactField(graph.root).at(p)
            clear = abs(wanted.d) > 1e-9
            assert ((found.d < 0) == (wanted.d < 0))[clear].all()
            inside = clear & (wanted.d < -1e-9) & np.ones(p.shape[1], bool)
            for a, b in ((found.rgb, wanted.rgb), (found.medium, wanted.medium)):
                a, b = (np.broadcast_to(v, (*v.shape[:-1], p.shape[1])) for v in map(np.atleast_1d, (a, b)))
                assert np.allclose(a[..., inside], b[..., inside], atol=1e-6)
    assert accepted > 20
    assert covered > 500
    assert shorter > 0


def test_eyes_inside_are_reported() -> None:
    """Where the exact field says so."""
    seen = {"opaque": 0, "clear": 0}
    for seed in range(40):
        rng = random.Random(seed)
        scene = schema.Scene(nodes=[random_leaf(rng, 0.3) for _ in range(2)])
        chain = schema.Chain(
            [schema.Link(rng.choice(COMBINE) if i else "union", n) for i, n in enumerate(scene.nodes)]
        )
        graph = widened(lower(schema.Scene(nodes=chain), SOLIDS, None, Diagnostics()), rng)
        context = Context(SOLIDS, Diagnostics())
        for step in PASSES[: [step.run for step in PASSES].index(flatten) + 1]:
            graph = step.run(graph, context)
        eye = rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3)
        found = ExactField(graph.root).at(np.reshape(eye, (3, 1)))
        opaque = bool(found.d[0] < 0.0) and not np.atleast_1d(found.medium)[0]
        check_eye(replace(graph, stage=Stage(Camera(eye))), context)
        assert [d.code for d in context.diagnostics] == ["E0408"] * opaque
        seen["opaque" if opaque else "clear"] += 1
    assert min(seen.values()) > 3


def test_what_is_left_out_is_seen_nowhere() -> None:
    """Not even by its shadow: cameras and lights anywhere, above and below the ground."""
    fewer = 0
    for seed in range(40):
        rng = random.Random(seed)

        def place(size: float, rng: random.Random = rng) -> tuple[float, float, float]:
            return rng.uniform(-size, size), rng.uniform(-size, size), rng.uniform(-size, size)

        ground = Ground(rng.uniform(-1, 0.6)) if rng.random() < 0.8 else None
        stage = Stage(Camera(place(4), place(0.3)), (Light(place(3)),), ground)
        nodes = [random_leaf(rng, 1.2) for _ in range(5)] + [random_node(rng, 1)]
        graph = replace(lower(schema.Scene(nodes=nodes), SOLIDS, None, Diagnostics()), stage=stage)
        context = Context(SOLIDS, Diagnostics())
        for step in PASSES[: [step.run for step in PASSES].index(flatten) + 1]:
            graph = step.run(graph, context)
        left = drop_hidden(drop_unseen(graph, context), context)
        if context.diagnostics.errors or len(left.root.links) == len(graph.root.links):
            continue
        try:
            wanted = solid_image(graph.root, stage, (12, 12), per_side=1)
        except ValueError:  # the eye is inside something opaque
            continue
        fewer += 1
        assert np.allclose(solid_image(left.root, stage, (12, 12), per_side=1), wanted, atol=2e-3)
    assert fewer > 3


def test_what_is_below_the_ground_is_left_out() -> None:
    low, high = (
        schema.Object("sphere", (schema.Scale.uniform(0.3), schema.Translate(0, y, 0))) for y in (-2, 0)
    )
    scene = schema.Scene(nodes=[low, high])
    (*_, last), _ = stages_of(scene, random.Random(0))
    assert len(last.root.links) == 1
    assert Graph(last.root, last.canvas, None, last.space, Stage(ground=None)).window()[1] == -np.inf


def test_what_is_in_a_later_sphere_is_left_out() -> None:
    small = schema.Object("torus", (schema.Scale.uniform(0.4), schema.Twist(2.0)))
    scene = schema.Scene(nodes=[small, schema.Object("sphere", schema.Scale.uniform(0.9))])
    (*_, last), _ = stages_of(scene, random.Random(0))
    assert [row.leaf.geometry for row in last.rows()] == ["sphere"]


def test_colours_are_linear() -> None:
    red = schema.Material("diffuse", (schema.Color((0.5, 0.0, 0.0)), schema.Grayscale(1.0)))
    (first, *_), _ = stages_of(schema.Scene(nodes=schema.Object("sphere", (), red)), random.Random(0))
    leaf = first.root.links[0].node
    assert isinstance(leaf, Leaf)
    grey = 0.2126 * ((0.5 + 0.055) / 1.055) ** 2.4
    assert leaf.look.colour() == pytest.approx((grey, grey, grey))
