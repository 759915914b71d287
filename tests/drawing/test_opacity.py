"""Opacity in the plane, against the formulas of the language written once more in loops."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from lab.sets.plane import SETS, random_scene
from scenelang.compiler.emit import tokens_of
from scenelang.compiler.graph import Leaf, Node, leaves
from scenelang.compiler.groups import BEGINS, ENDS, OPERATOR, read_groups, widths_of
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.program import Program, parse_program, program_bytes
from scenelang.drawing.exact.field import carry_back, distance_scale, evaluate, leaf_distance, sample_points
from scenelang.drawing.metrics import psnr
from scenelang.drawing.neural.draw import draw
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.files import load_arrays
from scenelang.drawing.neural.load import load_model
from scenelang.drawing.neural.meetings import Interval, Pairs, meetings_of, nesting
from scenelang.drawing.proof import Joins, blended, enclosed
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.nodes import Link, Material, Object
from scenelang.language.scene import Scene
from tests.compiler.prove import stages
from tests.compiler.random_scenes import full_scene
from tests.groups import random_tokens
from tests.pictures import Array

RNG = np.random.default_rng
NETWORK = load_arrays("shapes2d").network
MANIFEST = load_manifest("shapes2d")


def join(state: Any, operand: Any, op: int, width: float) -> Any:
    """(D, Q) behind an operand (d, q) at one point; either may be None, the empty set."""
    if operand is None:
        return state
    if state is None:
        return operand if op < 2 else None
    (big_d, big_q), (d, q) = state, operand
    if op == 0:
        if d < max(big_d, 0.0):
            below = big_q if big_d < 0 else np.zeros(4)
            big_q = q + (1 - q[3]) * below
        return min(big_d, d), big_q
    if op == 1:
        k = width or 0.15
        h = min(max(0.5 + 0.5 * (big_d - d) / k, 0.0), 1.0)
        return (1 - h) * big_d + h * d - k * h * (1 - h), (1 - h) * big_q + h * q
    d = -d if op == 2 else d
    if not width:
        return max(big_d, d), big_q
    h = min(max(0.5 + 0.5 * (d - big_d) / width, 0.0), 1.0)
    return (1 - h) * big_d + h * d + width * h * (1 - h), big_q


WORDS = "union", "smooth", "subtract", "intersect"


def tree_at(node: Node, p: Array, outer: tuple[Any, ...] = ()) -> Any:
    """(D, Q) of a node at one point (2, 1)."""
    steps = (*(move.step for move in node.moves), *outer)
    if isinstance(node, Leaf):
        d = float(leaf_distance(node.geometry, carry_back(steps, p))[0] * distance_scale(steps))
        return d, node.look.opacity * np.array([*node.look.colour(), 1.0])
    state = None
    for index, link in enumerate(node.links):
        given = tree_at(link.node, p, steps)
        state = given if index == 0 else join(state, given, WORDS.index(link.op), link.k)
    return state


def see_through(scene: Scene, rng: np.random.Generator, share: float = 0.6) -> Scene:
    """The scene with opacities in some of its objects."""

    def changed(node: Any) -> Any:
        if isinstance(node, Link):
            return node.model_copy(update={"node": changed(node.node)})
        if not isinstance(node, Object):
            return node.model_copy(update={"children": tuple(map(changed, node.children))})
        if rng.random() > share:
            return node
        look = node.material or Material("flat")
        opacity = float(rng.choice([rng.uniform(0.1, 0.9), 0.0, 0.5], p=[0.8, 0.05, 0.15]))
        return node.model_copy(update={"material": look.model_copy(update={"opacity": opacity})})

    return scene.model_copy(update={"nodes": tuple(map(changed, scene.nodes))})


def lowered(scene: Scene) -> Any:
    return lower(scene, MANIFEST, None, Diagnostics())


def test_the_reference_is_the_formulas() -> None:
    seen = 0
    for seed in range(10):
        rng = RNG(seed)
        graph = lowered(see_through(random_scene(rng, SETS["trees"]), rng))
        p = rng.uniform(-1, 1, (2, 50))
        big_d, big_q = evaluate(graph.root, p, clear=True)
        for at in range(p.shape[1]):
            d, q = tree_at(graph.root, p[:, at : at + 1])
            assert big_d[at] == pytest.approx(d, abs=1e-12)
            np.testing.assert_allclose(big_q[at], q, atol=1e-12)
            seen += d < 0 and 0.01 < q[3] < 0.99
    assert seen > 25


def test_passes_keep_what_is_seen_through() -> None:
    """Also unions that were one operand, and rows that a translucent one covers."""
    changed = 0
    for seed in range(20):
        scene = see_through(full_scene(seed), RNG(seed))
        found = stages(scene)
        p = sample_points(scene.canvas, range(scene.canvas[1]), 2)[:, ::7]
        near = np.full(p.shape[1], np.inf)
        for leaf in leaves(found[-1][1].root):
            steps = tuple(move.step for move in leaf.moves)
            own = abs(leaf_distance(leaf.geometry, carry_back(steps, p)) * distance_scale(steps))
            near = np.minimum(near, own)
        before, was = evaluate(found[0][1].root, p, clear=True)
        for (name, graph), (_, last) in zip(found[1:], found, strict=False):
            if graph == last:
                continue
            changed += 1
            after, now = evaluate(graph.root, p, clear=True)
            look = (near > 1e-7) & (abs(before) > 1e-7)
            assert ((before < 0) == (after < 0))[look].all(), (seed, name)
            inside = look & (before < 0)
            np.testing.assert_allclose(was[inside], now[inside], atol=1e-7, err_msg=f"{seed} {name}")
    assert changed > 50


def glass(tokens: list[int], rng: np.random.Generator, widths: Array) -> Program:
    """A Program of random colours and opacities, joined as tokens say."""
    text = "square { scale(0.3); } " * len(tokens)
    program = nsg.compile(nsg.loads(text), model="shapes2d", without=("drop_hidden",))
    vectors, places = program.vectors.copy(), Field(NETWORK, program.vectors, program.tokens).layout.places
    vectors[:, places.rgb] = rng.uniform(0, 1, (len(tokens), 3))
    vectors[:, places.clear] = rng.choice([0.0, 0.3, 0.8], len(tokens))
    vectors[:, places.width] = widths
    return replace(program, tokens=np.array(tokens, np.int8), vectors=vectors)


def recursion(d: Array, q: Array, tokens: list[int], widths: Array, kept: Array) -> Any:
    """(D, Q) of a stream at a point, of distances (N,) and premultiplied colours (N, 4)."""
    stack: list[Any] = [(None, 0, 0.0)]
    for row, token in enumerate(tokens):
        leaf, op = (d[row], q[row]) if kept[row] else None, token & OPERATOR
        if token & BEGINS:
            stack.append((leaf, op, widths[row]))
        else:
            state, outer, around = stack.pop()
            stack.append((join(state, leaf, op, widths[row]), outer, around))
        for _ in range(token >> ENDS):
            inner, op, width = stack.pop()
            state, outer, around = stack.pop()
            stack.append((join(state, inner, op, width), outer, around))
    return stack[0][0]


@pytest.mark.parametrize("seed", range(5))
def test_the_cell_carries_what_is_seen(seed: int) -> None:
    rng, count, columns = RNG(seed), 8, 200
    tokens = random_tokens(rng, count, deepest=3 if seed else 0)
    widths = np.where(np.array(tokens) & OPERATOR > 0, rng.choice([0.0, 0.1, 0.3], count), 0.0)
    program = glass(tokens, rng, widths)
    field = Field(NETWORK, program.vectors, program.tokens)
    d = rng.normal(0, 0.25, (count, columns))
    memory, _ = field.fold(d[:, None].astype(np.float32), np.arange(count))
    shown = np.asarray(field.picture(memory))
    places = field.layout.places
    opacity = 1.0 - program.vectors[:, places.clear].astype(float)
    q = np.column_stack([program.vectors[:, places.rgb] * opacity[:, None], opacity])
    off = []
    for column in range(columns):
        state = recursion(d[:, column], q, tokens, widths, np.ones(count, bool))
        wanted = np.zeros(4) if state is None or state[0] >= 0 else state[1]
        off.append(abs(shown[:, column] - wanted).max())
    assert np.mean(np.array(off) < 0.02) > 0.97  # the others lie where two distances are as good as equal


@pytest.mark.parametrize("behind", [np.zeros(4), np.array([0.2, 0.9, 0.5])], ids=["clear", "colour"])
@pytest.mark.parametrize("kind", ["blends", "sharp", "groups"])
def test_no_sample_leaves_its_interval(kind: str, behind: Array) -> None:
    rng, blocks = RNG(3), 120
    counts = rng.integers(1, 7, blocks)
    block = np.repeat(np.arange(blocks), counts)
    whole = [random_tokens(rng, int(count), 3 * (kind == "groups")) for count in counts]
    tokens = np.array([token for part in whole for token in part])
    if kind == "sharp":
        tokens = np.where((tokens & OPERATOR) == 1, tokens - 1, tokens)
    widths = widths_of(tokens & OPERATOR, np.zeros(len(tokens)))
    groups = read_groups(tokens.astype(np.int8))
    middle = rng.normal(0, 0.3, len(block)) * rng.choice([0.1, 1], len(block))
    rise = rng.choice([0, 1e-3, 0.05, 0.4], len(block))
    opacity = rng.choice([1.0, 0.4], len(block))
    q = np.vstack([rng.choice(2, (3, len(block))) * opacity, opacity])
    never = np.zeros(len(block), bool)
    meetings, source = meetings_of(Pairs.of(block, np.arange(len(block))))
    joins = Joins(groups.tokens, np.where(groups.first, 0.0, widths), never).some(source)
    if kind == "sharp":
        joins = joins._replace(free=~blended(meetings, (widths > 0)[source]))
    nest = nesting(meetings, groups) if kind == "groups" else None
    outer = Joins(groups.joins, widths[groups.rows], never[groups.rows])
    some, colour = Interval((middle - rise)[source], (middle + rise)[source]), Interval(*[q[:, source]] * 2)
    shown, changing = enclosed(meetings, some, colour, joins, behind, nest, outer)
    left, sure = np.empty(len(block), bool), 0
    left[source] = changing
    for column, number in enumerate(meetings.columns):
        pairs = np.flatnonzero(block == number)
        for _ in range(25):
            d = middle[pairs] + rise[pairs] * rng.uniform(-1, 1, len(pairs))
            own = d, q[:, pairs].T, tokens[pairs].tolist(), widths[pairs]
            seen = []
            for kept in (np.ones(len(pairs), bool), left[pairs]):
                state = recursion(*own, kept)
                top = np.zeros(4) if state is None or state[0] >= 0 else state[1]
                seen.append(top[: len(behind)] + (1 - top[3]) * behind)
            assert (seen[0] - shown.high[:, column]).max() < 1e-9
            assert (shown.low[:, column] - seen[0]).max() < 1e-9
            np.testing.assert_allclose(*seen, atol=1e-9)
        sure += bool((shown.high - shown.low)[:, column].max() < 1e-9)
    assert sure > 0.3 * blocks


def test_pictures() -> None:
    """Random trees and textures with groups: near the exact picture by every way to draw."""
    torch, found = load_model("shapes2d").framed, []
    for seed in range(6):
        rng = RNG([7, seed])
        scene = see_through(random_scene(rng, SETS["trees" if seed % 2 else "textures2d"]), rng)
        scene = scene.sized((64, 64)).model_copy(update={"background": None if seed % 3 == 0 else "default"})
        program = nsg.compile(scene)
        image = np.asarray(draw(NETWORK, program).image)
        assert abs(image - np.asarray(draw(torch, program).image)).mean() < 2e-4
        assert abs(image - np.asarray(draw(NETWORK, program, skip=False).image)).mean() < 2e-4
        exact = nsg.render(scene, backend="reference")
        found.append(psnr(image, np.asarray(exact), 50))
        formulas = np.asarray(nsg.render(scene, backend="exact"))
        assert psnr(formulas, np.asarray(exact), 80) > 45
    assert np.mean(found) > 46
    assert min(found) > 38


def test_owners_show_most() -> None:
    """The object of a pixel is the one that most of its colour is of."""
    wrong = total = 0
    for seed in range(6):
        rng = RNG([9, seed])
        scene = see_through(random_scene(rng, SETS["trees"]), rng).sized((64, 64))
        exact, found = (
            nsg.render_outputs(scene, ["object", "alpha"], backend=backend)
            for backend in ("reference", "neural")
        )
        clear = nsg.render(scene.model_copy(update={"background": None}), backend="reference")
        np.testing.assert_allclose(exact.alpha, np.asarray(clear)[..., 3], atol=1e-6)
        assert abs(exact.alpha - found.alpha).mean() < 0.01
        total += (exact.object > 0).sum()
        wrong += ((found.object != exact.object) & (exact.object > 0)).sum()
    assert wrong < 0.01 * total
    two = "square { scale(0.6); material flat { opacity(%s); } } star { material flat { opacity(%s); } }"
    for below, above, owner in ((0.9, 0.4, 1), (0.9, 0.6, 2), (1, 0.45, 1), (0.2, 0.3, 2)):
        scene = nsg.loads(two % (below, above)).sized((33, 33))
        for backend in ("reference", "neural"):
            assert nsg.render_outputs(scene, ["object"], backend=backend).object[16, 16] == owner


def test_a_program_with_opacity_is_format_5_and_comes_back() -> None:
    scene = nsg.loads("square { material flat { color(#d33); opacity(0.25); } } star { scale(0.5); }")
    program = nsg.compile(scene)
    assert rb"\"format\":5," in program_bytes(program)
    again = parse_program(program_bytes(program))
    assert again.digest() == program.digest()
    assert np.array_equal(nsg.render(again), nsg.render(program))
    opaque = scene.model_copy(update={"nodes": scene.nodes[1:]})
    assert rb"\"format\":1," in program_bytes(nsg.compile(opaque))
    assert tokens_of(lowered(opaque).rows()).tolist() == [0]


def test_proofs_hold() -> None:
    for seed in range(3):
        rng = RNG([11, seed])
        scene = see_through(random_scene(rng, SETS["trees"]), rng).sized((48, 48))
        scene = scene.model_copy(
            update={"samples": 16 if seed else 4, "background": None if seed > 1 else "default"}
        )
        image, proof = nsg.prove(scene)
        exact = np.array(nsg.render(scene, backend="reference"), float)
        shown = np.array(image, float)
        if shown.shape[2] == 4:
            exact[..., :3] *= exact[..., 3:]
            shown[..., :3] *= shown[..., 3:]
        assert (abs(shown - exact).max(2) <= proof.bound + 1e-6).all()
        assert np.mean(proof.bound < 1 / 255) > 0.85
