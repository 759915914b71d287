"""Trees of booleans in space: rounded cuts, states of groups, and what rays meet, against slow folds."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.spaces import Light, Stage
from scenelang.drawing.closed import ClosedSolids
from scenelang.drawing.exact.solid import ExactField, solid_image
from scenelang.drawing.solid.draw import draw_solids
from scenelang.drawing.solid.network import Wanted
from tests.drawing.solids import (
    Join,
    Object,
    Tree,
    everywhere,
    field,
    moved,
    network,
    random_tree,
    scaled,
    torch_network,
    tree_field,
    tree_graph,
    turned,
)
from tests.pictures import psnr_db

STAGE = Stage(lights=(Light((1.5, 3.0, 2.5), 16.0),))
LEAST = 2e-3  # world units from a surface where sides are told apart
EYE = np.array([0.5, 1.2, 6.0], np.float32)
BALL, RING = Object("sphere", (scaled(0.7),)), Object("torus", (turned(0.5), moved(0.3, 0, 0)))


CLOSED, TORCH = ClosedSolids("solids3d"), torch_network()


def around(seed: int, count: int, reach: float = 1.2) -> np.ndarray:
    """Points (3, M) around the origin."""
    return np.random.default_rng(seed).uniform(-reach, reach, (3, count)).astype(np.float32)


def rays(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (3, M) from the eye to points, and their lengths (M,)."""
    t = np.linalg.norm(p - EYE[:, None], axis=0)
    return (p - EYE[:, None]) / t, t


def tree_of(seed: int, least: int = 1) -> Tree:
    """A random tree; with media where the seed is odd."""
    rng = np.random.default_rng(seed)
    return random_tree(rng, int(rng.integers(least, 5)), (0.0, 0.5)[seed % 2])


@pytest.mark.parametrize("library", ["numpy", "torch"])
def test_what_is_not_met_changes_nothing(library: str) -> None:
    """Where rays meet some objects of a tree: signs, colours, kinds and owners of the exact field."""
    count = astray = 0
    seeds = 60 if library == "numpy" else 12
    for seed in range(seeds):
        tree, p = tree_of(seed, 2), around(seed, 3000)
        exact = ExactField(tree_graph(tree)).at(p.astype(float))
        rgb, medium, owner = (np.broadcast_to(v, p.shape) for v in (exact.rgb, exact.medium, exact.owner))
        solids = tree_field(tree, CLOSED if library == "numpy" else TORCH)
        xp, like, (way, t) = solids.xp, solids.network.codes, rays(p)
        way, eye, limit = (xp.array(v, like) for v in (way, EYE, t + 10))
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


def test_a_group_that_meets_nothing_has_no_state() -> None:
    """One that draws goes on in what is empty; a cut on nothing is nothing and leaves the colour as it is."""
    away = Object("sphere", (scaled(0.3), moved(0, 0, -2)))
    way, t = rays(p := around(4, 200, 0.5))
    group = Tree((Join("union", BALL), Join("subtract", RING)))
    for joins, depth in (
        ((Join("union", away), Join("union", group)), 1),
        ((Join("union", BALL), Join("subtract", group)), 2),
    ):
        solids = tree_field(Tree(joins))
        met, passes = solids.passes(EYE, way, t)
        assert solids.pairs(passes, t[met]).depth == depth
    assert tree_field(Tree((Join("union", RING), Join("subtract", BALL), Join("union", away)))).draws is False
    nothing = Tree((Join("union", away), Join("subtract", RING)))
    cut = tree_field(Tree((Join("union", RING), Join("subtract", nothing))))
    met, passes = cut.passes(EYE, way, t)
    near, whole = cut.meet(passes, t[met], Wanted.ALL), everywhere(field([RING]), p[:, met])
    some = near.distance < 1
    assert some.sum() > 50
    assert near.distance[some] == pytest.approx(whole.distance[some], abs=1e-5)
    assert near.register[:, some] == pytest.approx(whole.register[:, some], abs=1e-5)


@pytest.mark.parametrize("op", ["union", "smooth", "subtract", "intersect"])
@pytest.mark.parametrize("kinds", [("diffuse", "volumetric"), ("volumetric", "diffuse")])
def test_steps_in_media_pass_no_change_of_kind(op: str, kinds: tuple[str, str]) -> None:
    """Nowhere within the bound on how far the material is the same is it another."""
    a, b = kinds
    mist = BALL._replace(material=a, steps=(scaled(1.2),))
    inner = Tree((Join("union", RING._replace(material=b)), Join(op, BALL._replace(material=a), 0.2)))
    solids = tree_field(Tree((Join("union", mist), Join("union", inner), Join("smooth", RING, 0.2))))
    way, t = rays(around(6, 1500, 1.0))
    met, passes = solids.passes(EYE, way, t + 5)
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
    mists = [Object("sphere", (scaled(0.35), moved(x, 0, 0)), "volumetric") for x in (-0.8, 0.0, 0.8)]
    cut = Tree((Join("union", mists[1]), Join("subtract", mists[1]._replace(steps=(scaled(0.2),)))))
    for group in (Tree(Join("union", mist) for mist in mists[1:]), cut):
        tree = Tree((Join("union", mists[0]), Join("union", group)))
        solids, marched = tree_field(tree), tree_field(tree)
        marched.answered = False
        assert solids.segments
        mine, other = (draw_solids(each, STAGE, (48, 40))[0] for each in (solids, marched))
        assert psnr_db(mine, other) > 45
        assert psnr_db(mine, solid_image(tree_graph(tree), STAGE, (48, 40))) > 45


def test_pictures_of_trees_are_those_of_the_reference() -> None:
    """Diffuse and volumetric; those of closed forms differ by what samples of a pixel do."""
    learned, closed = [], []
    for seed in range(4):
        tree = tree_of(seed)
        exact = solid_image(tree_graph(tree), STAGE, (48, 48))
        for found, net in ((learned, network()), (closed, CLOSED)):
            found.append(min(50.0, psnr_db(draw_solids(tree_field(tree, net), STAGE, (48, 48))[0], exact)))
    assert np.mean(learned) > 47
    assert min(closed) > 43


def ball(x: float, y: float, radius: float = 0.9) -> Object:
    return Object("sphere", (scaled(radius), moved(x, y, 0)))


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
    p = around(8, 20000, 2.0)
    exact = ExactField(tree_graph(tree)).at(p.astype(float)).d
    solids = tree_field(tree, CLOSED)
    way, t = rays(p)
    met, passes = solids.passes(EYE, way, t + 5)
    d = np.full(len(t), 1.0)
    d[met] = solids.meet(passes, t[met], Wanted.DISTANCE).distance
    clear = abs(exact) > LEAST
    assert ((d < 0) == (exact < 0))[clear].all()
    assert (exact < 0).sum() > 100


LEFT = {
    "beads": """intersect { sphere { scale(1.1); }
        union { sphere { scale(0.2); translate(-0.6, 0.2, 0.5); }
            sphere { scale(0.25); translate(0.5, 0.1, 0.6); } } }""",
    "hole": """subtract { sphere;
        subtract { sphere { scale(0.9); translate(0.25, 0.25, 0.6); }
            sphere { scale(0.16); translate(0, 0.2, 0.35); }
            sphere { scale(0.1); translate(0.3, 0.45, 0.35); } } }""",
    "mist": """intersect { sphere { material volumetric; }
        union { sphere { scale(0.4); translate(-0.6, 0.2, 0.5); }
            subtract { sphere { scale(0.6); translate(0.5, 0.1, 0.3); }
                sphere { scale(0.2); translate(0.5, 0.3, 0.6); } } } }
        sphere { scale(0.3); translate(-0.2, -0.3, 0.3); }""",
}


def scene_of(name: str) -> nsg.Scene:
    return nsg.loads(f"canvas(64, 48); camera(eye = [0, 1.2, 4]); {LEFT[name]}")


@pytest.mark.parametrize("name", LEFT)
def test_steps_end_where_groups_may_add(name: str) -> None:
    """Rays meet what groups leave where nothing is left of all that the rays have met before."""
    scene = scene_of(name)
    exact = np.asarray(nsg.render(scene, backend="reference"))
    assert psnr_db(np.asarray(nsg.render(scene)), exact) > 45
