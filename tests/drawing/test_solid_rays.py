"""What rays save: boxes around leaves, and decoders that are asked without the cell."""

from __future__ import annotations

import numpy as np
import pytest

from scenelang.assets.pyramid import unpacked
from scenelang.assets.zoo import load_zoo
from scenelang.compiler.spaces import Stage
from scenelang.compiler.steps import Displace, Twist
from scenelang.drawing.solid.draw import draw_solids
from scenelang.drawing.solid.network import Wanted, element_box, surrounding
from scenelang.language import library
from tests.drawing.solids import LEAVES, MIXED, Object, field, moved, network, scaled, turned

APART = [
    Object("torus", (scaled(0.9, 0.6, 0.9), turned(0.7), moved(-0.8, 0.2, 0))),
    Object("sphere", (Displace(0.05, 5.0), scaled(0.5, 0.5, 0.5), moved(0.9, 0.3, 0.4)), "volumetric"),
    Object("torus", (Twist(0.8), scaled(0.6, 0.6, 0.6), moved(0.2, -0.4, 0.9)), rgb=(0.2, 0.5, 0.8)),
]


@pytest.mark.parametrize("leaf", LEAVES)
def test_boxes_are_those_of_the_leaf(leaf: str) -> None:
    net = network()
    found = net.box(net.decoder(net.codes[LEAVES.index(leaf)]))
    half = [1.0, 0.3 if leaf == "torus" else 1.0, 1.0]
    assert (abs(found) >= np.array(half) - 0.002).all()
    assert (abs(found) <= np.array(half) + 0.03).all()


def test_boxes_hold_what_lies_apart_and_askew() -> None:
    centres = np.array([[0.4, -0.6, 0.3], [-0.5, 0.1, 0.35], [0.0, 0.7, 0.0]])
    radii = np.array([0.2, 0.15, 0.1])
    low, high = surrounding(
        lambda q: (np.linalg.norm(q.T[:, None] - centres, axis=2) - radii).min(1).astype(np.float32)
    )
    for box, sides in ((low, centres.T - radii), (-high, -centres.T - radii)):
        assert (box <= sides.min(1)).all()
        assert (box >= sides.min(1) - 0.03).all()


def test_boxes_of_elements_hold_all_nodes_inside() -> None:
    path = library.find("std/meshes")
    assert path is not None
    bunny = load_zoo(path).geometries["bunny"]
    grid, box = unpacked(bunny), element_box(bunny)
    places = np.stack(np.nonzero(grid <= 0)) * (2 / (len(grid) - 1)) - 1
    assert (places.min(1) >= box[0]).all()
    assert (places.max(1) <= box[1]).all()
    assert (box[1] - box[0]).min() < 1.5


@pytest.mark.parametrize("objects", [APART, MIXED])
def test_asking_a_decoder_alone_is_asking_the_cell(objects: list[Object]) -> None:
    """Pictures are the same where nothing is known of the cell, so that it is asked for each object."""
    alone, asked = field(objects), field(objects)
    assert alone.open
    assert (alone.group >= 0).any()
    asked.open, asked.group = False, 0 * asked.group - 1
    (mine, work), (other, more) = (draw_solids(solids, Stage(), (64, 48)) for solids in (alone, asked))
    assert abs(mine - other).max() < 2e-4
    assert work.met == pytest.approx(more.met, rel=0.05)


def test_gates_that_may_not_be_open_are_asked() -> None:
    net, reach = network(), np.ones(1, np.float32)
    cell = net.cell(0, 0.15)[Wanted.ALL]
    assert net.alone(reach, cell) > 0
    for gates in (slice(0, 1), slice(1, 3), slice(3, 5)):  # of distance, colour and medium
        bias = cell.bias.copy()
        bias[gates] -= 1e9
        assert net.alone(reach, cell._replace(bias=bias)) == 0
    assert net.alone(1e9 * reach, cell) == 0
