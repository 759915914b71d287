"""Trees of booleans in space: rounded cuts, states of groups, and what rays meet, against slow folds."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
import torch

from scenelang.compiler.graph import Fold
from scenelang.compiler.spaces import Light, Stage
from scenelang.drawing.closed import ClosedSolids
from scenelang.drawing.exact.solid import Field, solid_image
from scenelang.drawing.neural.load import Solids
from scenelang.drawing.solid.draw import draw_solids
from scenelang.drawing.solid.field import Meeting, SolidField
from scenelang.drawing.solid.network import SolidNetwork, Wanted
from scenelang.drawing.solid.passes import SLACK
from scenelang.language.words import BLEND, TOKENS
from tests.drawing.solids import Object, field, moved, network, psnr, scaled, turned
from tests.drawing.test_renderers_solids import everywhere
from tests.drawing.trees import Answer, Join, Tree, fold, random_tree, tree_field, tree_graph

STAGE = Stage(light=Light((1.5, 3.0, 2.5), 16.0))
LEAST = 2e-3  # world units from a surface where sides are told apart
EYE = np.array([0.5, 1.2, 6.0], np.float32)
BALL, RING = Object("sphere", (scaled(0.7, 0.7, 0.7),)), Object("torus", (turned(0.5), moved(0.3, 0, 0)))


def torch_network() -> Solids:
    """The shipped network in torch."""
    net = network()
    other = Solids(net.config, 2, 2)
    with torch.no_grad():
        for name, parameter in other.named_parameters():
            group, _, index = name.partition(".")
            value = getattr(net, group)
            parameter.copy_(torch.from_numpy(value[int(index)] if index else value))
    return other.requires_grad_(False)


CLOSED, TORCH = ClosedSolids("solids3d"), torch_network()


def points(seed: int, count: int) -> np.ndarray:
    """Points (3, M) around the origin."""
    return np.random.default_rng(seed).uniform(-1.2, 1.2, (3, count)).astype(np.float32)


def tree_of(seed: int, least: int = 1) -> Tree:
    """A random tree; with media where the seed is odd."""
    rng = np.random.default_rng(seed)
    return random_tree(rng, int(rng.integers(least, 5)), (0.0, 0.5)[seed % 2])


@pytest.mark.parametrize("library", ["numpy", "torch"])
@pytest.mark.parametrize("token", ["subtract", "intersect"])
def test_rounded_cuts_are_those_of_the_formula(token: str, library: str) -> None:
    """Distances, colours and gradients over distances of all sizes and widths from thin to wide."""
    net = network() if library == "numpy" else TORCH
    xp, like, n, h = net.xp, net.codes, 3000, 1e-4
    rng = np.random.default_rng(3)
    for k in (0.01, 0.05, 0.15, 0.5, 2.0):
        past, own = (k * rng.uniform(-2, 2, (2, n))).astype(np.float32)
        e = -own if token == "subtract" else own
        share = np.clip(0.5 - 0.5 * (e - past) / k, 0, 1)
        exact = share * past + (1 - share) * e + k * share * (1 - share)
        memory, look = np.concatenate([past[None], np.zeros((4, n))]).astype(np.float32), np.ones((4, 1))
        for wanted, count in zip(Wanted, (1, 2, 5), strict=True):
            cell = net.cut(TOKENS[token], k)[wanted]
            state = xp.array(np.concatenate([memory[:1], memory[len(memory) - count + 1 :]]), like)
            d = xp.array(own, like)
            found, take = net.join(d, state, xp.array(look.astype(np.float32), like), cell, wanted)
            after = np.asarray(xp.to_numpy(found))
            assert abs(after[0] - exact).max() < 1e-3 * k
            assert abs(after[1:]).max(initial=0) < 1e-6  # what is cut keeps its colour and kind
            by_own, by_past = (np.asarray(xp.to_numpy(v)) for v in net.partials(d, state[0], take, cell))
            clear = abs(abs(e - past) - k) > 3 * h * k + 2e-3 * k  # off the ends of the edge
            for slope, moves in ((by_own, (h * k, 0)), (by_past, (0, h * k))):
                near = _rounded(past + moves[1], own + moves[0], k, token)
                back = _rounded(past - moves[1], own - moves[0], k, token)
                assert abs(slope - (near - back) / (2 * h * k))[clear].max() < 4e-3


def _rounded(past: np.ndarray, own: np.ndarray, k: float, token: str) -> np.ndarray:
    e = (-own if token == "subtract" else own).astype(np.float64)
    share = np.clip(0.5 - 0.5 * (e - past) / k, 0, 1)
    return np.asarray(share * past + (1 - share) * e + k * share * (1 - share))


@pytest.mark.parametrize("library", ["numpy", "torch"])
def test_states_are_those_of_the_recursion(library: str) -> None:
    """Where every object is met: distances, colours, kinds and gradients; the leaves' own are the field's."""
    net: SolidNetwork = network() if library == "numpy" else TORCH
    deepest = 0
    for seed in range(14 if library == "numpy" else 5):
        tree, p = tree_of(seed, 2), points(seed, 800)
        exact = fold(tree, partial(_alone, p=p, notes={}))
        solids = tree_field(tree, net)
        solids.far, deepest = True, max(deepest, solids.tree.deepest)
        found = _told(solids, everywhere(solids, p, gradient=True))
        inside = exact.d < -2e-3
        assert abs(found.d - exact.d).max() < 5e-4
        assert (abs(found.rgb - exact.rgb)[:, inside].max(0) > 5e-3).sum() <= 0.01 * inside.sum()
        assert (found.medium == exact.medium)[inside].all()
        assert (np.linalg.norm(found.slope - exact.slope, axis=0) > 0.02).mean() < 0.01
    assert deepest > 2


def _alone(o: Object, p: np.ndarray, notes: dict[Object, Answer]) -> Answer:
    """What the field answers for an object alone."""
    if o not in notes:
        solids = field([o])
        solids.far = True
        notes[o] = _told(solids, everywhere(solids, p, gradient=True))
    return notes[o]


def _told(solids: SolidField, found: Meeting) -> Answer:
    d, register, slope = (np.asarray(solids.xp.to_numpy(v), np.float64) for v in found[:3])
    return Answer(d, register[-1] > 0.5, register[:3], slope)


@pytest.mark.parametrize("library", ["numpy", "torch"])
def test_what_is_not_met_changes_nothing(library: str) -> None:
    """Where rays meet some objects of a tree: signs, colours, kinds and owners of the exact field."""
    count = astray = 0
    seeds = 60 if library == "numpy" else 12
    for seed in range(seeds):
        tree, p = tree_of(seed, 2), points(seed, 3000)
        exact = Field(tree_graph(tree)).at(p.astype(float))
        rgb, medium, owner = (np.broadcast_to(v, p.shape) for v in (exact.rgb, exact.medium, exact.owner))
        solids = tree_field(tree, CLOSED if library == "numpy" else TORCH)
        xp, like, t = solids.xp, solids.network.codes, np.linalg.norm(p - EYE[:, None], axis=0)
        way, eye, limit = (xp.array(v, like) for v in ((p - EYE[:, None]) / t, EYE, t + 10))
        with xp.inference():
            met, passes = solids.passes(eye, way, limit)
            at, there = xp.to_numpy(met), xp.take(xp.array(t, like), met)
            away = np.setdiff1d(np.arange(len(t)), at)
            assert (exact.d[away] > -LEAST).all()
            if not len(at):
                continue
            found = solids.meet(passes, there, Wanted.ALL)
            owned = solids.meet(passes, there, Wanted.KIND, owners=True).owner
        d, register, owned = (xp.to_numpy(v) for v in (found.distance, found.register, owned))
        clear, inside = abs(exact.d[at]) > LEAST, exact.d[at] < -LEAST
        assert ((d < 0) == (exact.d[at] < 0))[clear].all()
        wrong = abs(register[:3] - rgb[:, at]).max(0) > 0.02
        wrong |= (register[3] > 0.5) != medium[0, at]
        wrong |= owned != owner[0, at]
        count += inside.sum()
        astray += wrong[inside].sum()
    assert count > 50 * seeds
    assert astray <= (0.001 if library == "numpy" else 0.03) * count  # leaves are learned


def test_balls_of_flat_streams_are_what_blends_reach() -> None:
    """As before there were groups, to the last bit; and points have one state."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        objects = [
            Object("sphere", (scaled(*rng.uniform(0.3, 0.8, 3)), moved(*rng.uniform(-1, 1, 3))), token=token)
            for token in ("union", *rng.choice([*TOKENS], 7).tolist())
        ]
        objects = [o._replace(k=float(rng.choice([0.0, 0.3])) * (o.token == "smooth")) for o in objects]
        solids = field(objects)
        deepest = max(solid.frame.scale for solid in solids.solids)
        smooths, widest = 0, 0.0
        for o, solid in reversed(list(zip(objects, solids.solids, strict=True))):
            if o.token == "smooth":
                smooths, widest = smooths + 1, max(widest, float(np.float32(o.k)) or BLEND)
            blends = widest * (1 + smooths / 4) + (deepest if smooths and o.token == "subtract" else 0.0)
            assert solid.radius == 1 + SLACK + blends / solid.frame.scale
            assert solid.draws == (o.token in ("union", "smooth"))
            assert solid.clips == (o.token == "intersect")
        p = rng.uniform(-1, 1, (3, 50)).astype(np.float32)
        t = np.linalg.norm(p - EYE[:, None], axis=0)
        met, passes = solids.passes(EYE, (p - EYE[:, None]) / t, t)
        if len(met):
            pairs = solids.pairs(passes, t[met])
            assert pairs.depth == 1
            assert not any(pairs.closings)


def test_a_group_that_meets_nothing_has_no_state() -> None:
    """One that draws goes on in what is empty; a cut on nothing is nothing."""
    away = Object("sphere", (scaled(0.3, 0.3, 0.3), moved(0, 0, -2)))
    p = np.random.default_rng(4).uniform(-0.5, 0.5, (3, 200)).astype(np.float32)
    t = np.linalg.norm(p - EYE[:, None], axis=0)
    way = (p - EYE[:, None]) / t
    group = Tree((Join("union", BALL), Join("subtract", RING)))
    first, second = (tree_field(Tree(joins)) for joins in (
        (Join("union", away), Join("union", group)), (Join("union", BALL), Join("subtract", group))
    ))  # fmt: skip
    for solids, depth in ((first, 1), (second, 2)):
        met, passes = solids.passes(EYE, way, t)
        assert solids.pairs(passes, t[met]).depth == depth
    alone = tree_field(Tree((Join("union", RING), Join("subtract", BALL), Join("union", away))))
    cut = tree_field(
        Tree((Join("union", RING), Join("subtract", Tree((Join("union", away), Join("subtract", RING))))))
    )
    met, passes = cut.passes(EYE, way, t)
    assert alone.draws is False
    near = cut.meet(passes, t[met], Wanted.ALL)
    whole = everywhere(field([RING]), p[:, met])
    some = near.distance < 1
    assert some.sum() > 50
    assert near.distance[some] == pytest.approx(whole.distance[some], abs=1e-5)
    # a cut with nothing in it leaves the colour as it is
    assert near.register[:, some] == pytest.approx(whole.register[:, some], abs=1e-5)


@pytest.mark.parametrize("op", ["union", "smooth", "subtract", "intersect"])
@pytest.mark.parametrize("kinds", [("diffuse", "volumetric"), ("volumetric", "diffuse")])
def test_steps_in_media_pass_no_change_of_kind(op: str, kinds: tuple[str, str]) -> None:
    """Nowhere within the bound on how far the material is the same is it another."""
    rng, (a, b) = np.random.default_rng(6), kinds
    mist = BALL._replace(material=a, steps=(scaled(1.2, 1.2, 1.2),))
    inner = Tree((Join("union", RING._replace(material=b)), Join(op, BALL._replace(material=a), 0.2)))
    solids = tree_field(Tree((Join("union", mist), Join("union", inner), Join("smooth", RING, 0.2))))
    p = rng.uniform(-1, 1, (3, 1500)).astype(np.float32)
    t = np.linalg.norm(p - EYE[:, None], axis=0)
    met, passes = solids.passes(EYE, (p - EYE[:, None]) / t, t + 5)
    t = t[met]
    here = solids.meet(passes, t, Wanted.KIND, change=True)
    dense = (here.distance < 0) & (here.register[0] > 0.5)
    changes = 0
    for share in (-0.9, -0.5, 0.5, 0.9):
        there = solids.meet(passes, t + share * here.change, Wanted.KIND)
        same = (there.distance < 0) & (there.register[0] > 0.5)
        assert same[dense].all()
        further = solids.meet(passes, t + share * (here.change + 0.3), Wanted.KIND)
        changes += ((further.distance < 0) & (further.register[0] < 0.5))[dense].sum()
    assert dense.sum() > 50
    assert changes > 20


def test_segments_answer_for_groups_that_are_unions() -> None:
    """What is drawn is what is marched, and rays that pass what cuts are marched."""
    mists = [
        Object("sphere", (scaled(0.35, 0.35, 0.35), moved(x, 0, 0)), "volumetric") for x in (-0.8, 0.0, 0.8)
    ]
    cut = Tree((Join("union", mists[1]), Join("subtract", mists[1]._replace(steps=(scaled(0.2, 0.2, 0.2),)))))
    for group in (Tree(Join("union", mist) for mist in mists[1:]), cut):
        tree = Tree((Join("union", mists[0]), Join("union", group)))
        solids, marched = tree_field(tree), tree_field(tree)
        marched.segments = []
        assert solids.segments
        mine, other = (draw_solids(each, STAGE, (48, 40))[0] for each in (solids, marched))
        assert psnr(mine, other) > 45
        assert psnr(mine, solid_image(_root(tree), STAGE, (48, 40))) > 45


def _root(tree: Tree) -> Fold:
    found = tree_graph(tree)
    assert isinstance(found, Fold)
    return found


@pytest.mark.parametrize("seeds", [range(6), pytest.param(range(6, 66), marks=pytest.mark.slow)])
def test_pictures_of_trees_are_those_of_the_reference(seeds: range) -> None:
    """Diffuse and volumetric; those of closed forms differ by what samples of a pixel do."""
    learned, closed = [], []
    for seed in seeds:
        tree = tree_of(seed)
        exact = solid_image(_root(tree), STAGE, (64, 64))
        for found, net in ((learned, network()), (closed, CLOSED)):
            found.append(min(50.0, psnr(draw_solids(tree_field(tree, net), STAGE, (64, 64))[0], exact)))
    assert np.mean(learned) > 47
    assert np.quantile(learned, 0.05) > 40
    assert min(closed) > 43


def test_both_libraries_draw_trees_alike() -> None:
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    fields = (tree_field(tree_of(3), net) for net in (network(), TORCH))
    mine, theirs = (draw_solids(solids, STAGE, (24, 24))[0] for solids in fields)
    torch.set_num_threads(threads)
    assert psnr(mine, theirs) > 55


def ball(x: float, y: float, radius: float = 0.9) -> Object:
    return Object("sphere", (scaled(radius, radius, radius), moved(x, y, 0)))


BOTH = Tree((Join("union", ball(0.4, 0)), Join("intersect", ball(-0.4, 0))))
INNER = Tree((Join("union", BOTH), Join("union", ball(1.5, 0))))
OUTER = Tree((Join("union", ball(0, 0.5)), Join("intersect", INNER)))
HOLE = Tree((Join("union", ball(0, 0, 1.5)), Join("subtract", ball(0.8, 0, 0.2))))


@pytest.mark.parametrize(
    "tree",
    [
        Tree((Join("union", ball(0, 0)), Join("union", ball(1.8, 0)), Join("intersect", OUTER))),
        Tree((Join("union", ball(0, 0)), Join("intersect", HOLE, 0.5))),
    ],
)
def test_balls_hold_what_an_intersection_ends(tree: Tree) -> None:
    """Intersections in one another whose leaves lie apart; a rounded edge along a hole in a group."""
    p = np.random.default_rng(8).uniform(-2, 2, (3, 20000)).astype(np.float32)
    exact = Field(_root(tree)).at(p.astype(float)).d
    solids = tree_field(tree, CLOSED)
    t = np.linalg.norm(p - EYE[:, None], axis=0)
    met, passes = solids.passes(EYE, (p - EYE[:, None]) / t, t + 5)
    d = np.full(len(t), 1.0)
    d[met] = solids.meet(passes, t[met], Wanted.DISTANCE).distance
    clear = abs(exact) > LEAST
    assert ((d < 0) == (exact < 0))[clear].all()
    assert (exact < 0).sum() > 100
