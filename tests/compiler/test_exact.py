"""Lifted vectors against products of matrices, points carried back, and the trained networks."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from lab.designs.students import Encoders, LiftingConfig
from lab.matrices import affine_matrix, leaf_vector, warp_matrix
from scenelang.compiler import steps
from scenelang.compiler.chain import Levels
from scenelang.compiler.lifting import (
    GEOMETRY_INPUTS,
    PLANE_LAYOUT,
    SOLID_LAYOUT,
    WIDTH,
    Layout,
    Parts,
    lift_colours,
    lift_geometry,
    lift_many,
    lift_material,
    read_lifting,
)
from scenelang.compiler.steps import Affine, Rows, Step, Warp
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.arrays_torch import TORCH
from scenelang.drawing.exact.field import carry_back, distance_scale
from scenelang.drawing.neural.frames import Frames

CODE = (0.5, -1.0, 2.0, 3.0)


def random_rows(rng: np.random.Generator) -> Rows:
    a = rng.uniform(-1, 1, (3, 4))
    a[:, :3] += np.eye(3) * 1.5
    return tuple(a.ravel().tolist())


def random_levels(rng: np.random.Generator, inner: int, outer: int, strength: float = 1.0) -> Levels:
    def warps(count: int) -> tuple[Warp, ...]:
        return tuple(
            Warp(
                float(rng.uniform(-strength, strength)),
                (float(rng.uniform(-strength, strength)), float(rng.uniform(-strength, strength))),
            )
            for _ in range(count)
        )

    return Levels(warps(inner), random_rows(rng), warps(outer), random_rows(rng))


def steps_of(levels: Levels) -> tuple[Step, ...]:
    return (*levels.inner, Affine(levels.middle), *levels.outer, Affine(levels.affine))


def matrices(levels: Levels, layout: Layout = PLANE_LAYOUT) -> list[np.ndarray]:
    """The matrices of a chain, nearest the leaf first: g = M_n … M_1 leaf_vector(code)."""
    return [
        *(warp_matrix(w, layout.places.inner, layout) for w in levels.inner),
        affine_matrix(levels.middle, layout.places.middle, layout),
        *(warp_matrix(w, layout.places.outer, layout) for w in levels.outer),
        affine_matrix(levels.affine, layout.places.frame, layout),
    ]


SIZES = [(i, o) for i in range(PLANE_LAYOUT.inner + 1) for o in range(PLANE_LAYOUT.outer + 1)]


@pytest.mark.parametrize(("inner", "outer"), SIZES)
def test_vector_carries_points_back_as_the_reference_does(inner: int, outer: int) -> None:
    rng = np.random.default_rng(100 + inner * 10 + outer)
    levels = random_levels(rng, inner, outer)
    p = rng.uniform(-2, 2, (2, 50))
    frames, objects = Frames(lift_many([levels], [CODE])), np.zeros(50, int)
    want = np.array(carry_back(steps_of(levels), p))
    found, radius = frames.blocks(objects, p, np.zeros(50))
    np.testing.assert_allclose(found, want, rtol=1e-9, atol=1e-9)
    assert not radius.any()
    # in float32, angles are off by as much as they are large
    off = 1e-6 * (1 + abs(want).max()) * (1 + abs(frames.numbers).max()) ** 2
    short = p.astype(np.float32)
    np.testing.assert_allclose(frames.local(NUMPY, objects, short), want, rtol=0, atol=off)
    np.testing.assert_allclose(frames.local(TORCH, objects, torch.from_numpy(short)), want, rtol=0, atol=off)
    assert frames.scale == pytest.approx(distance_scale(steps_of(levels)), rel=1e-9)


def test_objects_of_different_chains_are_carried_together() -> None:
    """Steps that only few, or most, of them have."""
    levels = [random_levels(np.random.default_rng(i), *size) for i, size in enumerate(SIZES[:3])]
    for objects in ([0, 1, 2], [2], [2, 2, 2, 1]):
        p = np.random.default_rng(1).uniform(-1, 1, (2, 4, len(objects))).astype(np.float32)
        found = Frames(lift_many(levels, [CODE] * 3)).local(NUMPY, np.array(objects), p)
        for i, at in enumerate(objects):
            np.testing.assert_allclose(found[..., i], carry_back(steps_of(levels[at]), p[..., i]), atol=1e-3)


@pytest.mark.parametrize(("inner", "outer"), SIZES)
@pytest.mark.parametrize("size", [0.02, 0.5])
def test_discs_are_carried_into_discs(inner: int, outer: int, size: float) -> None:
    rng = np.random.default_rng(3 * inner + outer)
    levels = random_levels(rng, inner, outer)
    p = rng.uniform(-2, 2, (2, 400))
    angle, share = rng.uniform(0, 2 * np.pi, 400), np.sqrt(rng.uniform(0, 1, 400))
    near = p + size * share * np.stack([np.cos(angle), np.sin(angle)])
    frames = Frames(lift_many([levels], [CODE]))
    q, radius = frames.blocks(np.zeros(400, int), p, np.full(400, size))
    assert (np.hypot(*(np.array(carry_back(steps_of(levels), near)) - q)) <= radius * (1 + 1e-9)).all()


@pytest.mark.parametrize(("inner", "outer"), SIZES)
@pytest.mark.parametrize("radius", [1.0, 3.0])
def test_boxes_hold_discs(inner: int, outer: int, radius: float) -> None:
    rng = np.random.default_rng(7 * inner + outer)
    levels = random_levels(rng, inner, outer)
    frames = Frames(lift_many([levels], [CODE]))
    (xmin, ymin), (xmax, ymax) = (corner[:, 0] for corner in frames.boxes(np.array([radius])))
    x, y = rng.uniform(-2, 2, (2, 20000)) * max(xmax - xmin, ymax - ymin)
    within = np.hypot(*carry_back(steps_of(levels), (x, y))) <= radius
    outside = (x < xmin) | (x > xmax) | (y < ymin) | (y > ymax)
    assert within.any()
    assert not (within & outside).any()


def test_material_vector_multiplies_the_albedo() -> None:
    parts = PLANE_LAYOUT.unpack(lift_colours([(0.2, 0.4, 0.6)], [np.arange(12.0)])[0])
    assert parts.rgb.tolist() == [0.2, 0.4, 0.6]
    assert parts.material.tolist() == [*range(12)]
    assert parts.texture.tolist() == [1, 0, 0, 0, 1, 0]


@pytest.mark.parametrize("layout", [PLANE_LAYOUT, SOLID_LAYOUT], ids=["plane", "solid"])
def test_parts_come_out_as_they_went_in_and_share_no_place(layout: Layout) -> None:
    sizes = [np.arange(WIDTH)[at].shape for at in layout.places]
    parts = Parts(*[np.random.default_rng(1).random((5, *size)) for size in sizes])
    packed = layout.pack(5, **parts._asdict())
    for name, value in layout.unpack(packed)._asdict().items():
        assert (value == getattr(parts, name)).all(), name
        assert np.shares_memory(value, packed) or not value.size
    used = WIDTH - (layout.dimension == 2)
    assert np.count_nonzero(packed[0]) == sum(value[0].size for value in parts) == used


def test_vectors_are_products_of_matrices() -> None:
    for layout, inner, outer in ((SOLID_LAYOUT, 2, 2), *((PLANE_LAYOUT, *size) for size in SIZES)):
        levels = random_levels(np.random.default_rng(inner * 10 + outer), inner, outer)
        g = leaf_vector(CODE, layout)
        for matrix in matrices(levels, layout):
            g = matrix @ g
        np.testing.assert_allclose(lift_many([levels], [CODE], layout)[0], g, rtol=1e-12, atol=1e-12)
        d = layout.dimension
        for rows, slot in ((levels.affine, layout.places.frame), (levels.middle, layout.places.middle)):
            map_ = np.vstack([np.reshape(rows, (3, 4)), [0, 0, 0, 1]])
            keep = [*range(d), 3]
            found = g[slot].reshape(d, d + 1) @ map_[np.ix_(keep, keep)]
            np.testing.assert_allclose(found, np.eye(d + 1)[:d], atol=1e-12)


def encoders(geometry: int = 8, material: int = 4) -> Encoders:
    torch.manual_seed(2)
    network = Encoders(LiftingConfig(geometry, material, 16), 3, 2).double()
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.normal_(std=0.4)
    return network


def tensors(network: Encoders) -> dict[str, np.ndarray]:
    return {f"lifting.{k}": v.detach().numpy() for k, v in network.state_dict().items()}


def test_without_torch_it_gives_the_same() -> None:
    network = encoders()
    lifting = read_lifting(tensors(network))
    rng = np.random.default_rng(0)
    for kind, inputs in GEOMETRY_INPUTS.items():
        numbers = rng.normal(size=(5, inputs))
        with torch.no_grad():
            expected = network.geometry[kind](torch.from_numpy(numbers)).numpy()
        np.testing.assert_allclose(lifting.matrices(kind, numbers), expected, atol=1e-12)


def test_a_chain_is_a_product_nearest_the_leaf_first() -> None:
    lifting = read_lifting(tensors(encoders()))
    move, turn = steps.translation(0.2, -0.3), steps.rotation(0.7)
    chains = [
        [Warp(0.5, (0.0, 0.0)), Affine(move), Affine(turn)],
        [Affine(turn)],
        [],
        [Warp(0.0, (0.3, 0.0))],
    ]
    found = lift_geometry(lifting, chains, [0, 1, 2, 1])

    def full(rows: steps.Rows) -> list[float]:
        return [*rows, 0.0, 0.0, 0.0, 1.0]

    (twirl,), (bend,) = lifting.matrices("twirl", [[0.5]]), lifting.matrices("bend", [[0.3]])
    (first,), (second,) = lifting.matrices("affine", [full(move)]), lifting.matrices("affine", [full(turn)])
    np.testing.assert_allclose(found[0], second @ first @ twirl @ lifting.codes[0])
    np.testing.assert_allclose(found[1], second @ lifting.codes[1])
    np.testing.assert_allclose(found[2], lifting.codes[2])
    np.testing.assert_allclose(found[3], bend @ lifting.codes[1])


def test_a_colour_acts_on_the_material() -> None:
    lifting = read_lifting(tensors(encoders()))
    rgb = [[0.1, 0.5, 0.9], [1.0, 1.0, 1.0]]
    found = lift_material(lifting, rgb, [1, 0])
    matrices = lifting.matrices("color", rgb)
    np.testing.assert_allclose(found[0], matrices[0] @ lifting.material_codes[1])
    np.testing.assert_allclose(found[1], matrices[1] @ lifting.material_codes[0])
