"""Trees of booleans in space: rounded cuts, states of groups, and what rays meet, against slow folds."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.spaces import Light, Stage
from scenelang.drawing.closed import ClosedSolids
from scenelang.drawing.exact.solid import ExactField, solid_image
from scenelang.drawing.solid.draw import draw_solids
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
LEAST, GAP = 2e-3, 0.009  # world units from a surface where sides are told apart
EYE = np.array([0.5, 1.2, 6.0], np.float32)
BALL, RING = Object("sphere", (scaled(0.7),)), Object("torus", (turned(0.5), moved(0.3, 0, 0)))


CLOSED, TORCH = ClosedSolids("solids3d"), torch_network()


def around(seed: int, count: int, reach: float = 1.2) -> np.ndarray:
    """Points (3, M) around the origin."""
    return np.random.default_rng(seed).uniform(-reach, reach, (3, count)).astype(np.float32)


def tree_of(seed: int, least: int = 1) -> Tree:
    """A random tree; with media where the seed is odd."""
    rng = np.random.default_rng(seed)
    return random_tree(rng, int(rng.integers(least, 5)), (0.0, 0.5)[seed % 2])


@pytest.mark.parametrize("library", ["numpy", "torch"])
def test_what_is_not_met_changes_nothing(library: str) -> None:
    """Where points meet some objects of a tree: signs, colours, kinds and owners of the exact field."""
    count = astray = 0
    seeds = 60 if library == "numpy" else 12
    for seed in range(seeds):
        tree, p = tree_of(seed, 2), around(seed, 3000)
        exact = ExactField(tree_graph(tree)).at(p.astype(float))
        rgb, medium, owner = (np.broadcast_to(v, p.shape) for v in (exact.rgb, exact.medium, exact.owner))
        solids = tree_field(tree, CLOSED if library == "numpy" else TORCH)
        found = everywhere(solids, p, LEAST)
        d, register, owned = (solids.xp.to_numpy(v) for v in (found.distance, found.register, found.owner))
        clear, inside = abs(exact.d) > LEAST, exact.d < -LEAST
        assert ((d < 0) == (exact.d < 0))[clear].all()
        wrong = abs(register[:3] - rgb).max(0) > 0.02
        wrong |= (register[3] > 0.5) != medium[0]
        wrong |= owned != owner[0]
        count += inside.sum()
        astray += wrong[inside].sum()
    assert count > 50 * seeds
    assert astray <= (0.001 if library == "numpy" else 0.03) * count  # leaves are learned


def test_a_group_of_nothing_takes_nothing_away() -> None:
    """A cut on nothing is nothing, and leaves the colour as it is."""
    away = Object("sphere", (scaled(0.3), moved(0, 0, -2)))
    p = around(4, 200, 0.5)
    assert tree_field(Tree((Join("union", RING), Join("subtract", BALL), Join("union", away)))).draws is False
    nothing = Tree((Join("union", away), Join("subtract", RING)))
    cut = tree_field(Tree((Join("union", RING), Join("subtract", nothing))))
    near, whole = everywhere(cut, p, 1.0), everywhere(field([RING]), p)
    some = near.distance < 1
    assert some.sum() > 50
    assert near.distance[some] == pytest.approx(whole.distance[some], abs=1e-5)
    assert near.register[:, some] == pytest.approx(whole.register[:, some], abs=1e-5)


@pytest.mark.parametrize("op", ["union", "smooth", "subtract", "intersect"])
@pytest.mark.parametrize("kinds", [("diffuse", "volumetric"), ("volumetric", "diffuse")])
def test_steps_in_media_pass_no_change_of_kind(op: str, kinds: tuple[str, str]) -> None:
    """Rays are in media where points on them are, and end where these are in what is opaque."""
    a, b = kinds
    mist = BALL._replace(material=a, steps=(scaled(1.2),))
    inner = Tree((Join("union", RING._replace(material=b)), Join(op, BALL._replace(material=a), 0.2)))
    solids = tree_field(Tree((Join("union", mist), Join("union", inner), Join("smooth", RING, 0.2))))
    way = around(6, 300, 1.0) - EYE[:, None]
    way /= np.linalg.norm(way, axis=0)
    trail = solids.march(EYE, way, np.full(300, 9.0, np.float32), gap=GAP)
    t = np.linspace(4, 9, 800, dtype=np.float32)
    found = everywhere(solids, (EYE[:, None, None] + way[:, :, None] * t).reshape(3, -1), LEAST)
    inside = (found.distance < 0).reshape(300, -1)
    medium = inside & (found.register[-1] > 0.5).reshape(300, -1)
    before = t < trail.hit[:, None]
    assert (inside & ~medium & before & (t < trail.hit[:, None] - 2 * GAP)).mean() < 1e-4
    assert (medium & before).sum(1) * (t[1] - t[0]) == pytest.approx(trail.length, abs=4 * GAP)
    assert ((trail.length > 0.1) | (trail.hit < 9)).sum() > 100
    assert a == "diffuse" or (trail.length > 0.1).sum() > 100


def test_pictures_of_trees_are_those_of_the_reference() -> None:
    """Diffuse and volumetric; those of closed forms differ by what samples of a pixel do."""
    learned, closed = [], []
    for seed in range(4):
        tree = tree_of(seed)
        exact = solid_image(tree_graph(tree), STAGE, (28, 28))
        for found, net in ((learned, network()), (closed, CLOSED)):
            found.append(min(50.0, psnr_db(draw_solids(tree_field(tree, net), STAGE, (28, 28))[0], exact)))
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
    d = everywhere(solids, p, LEAST).distance
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
