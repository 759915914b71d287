"""The compiler's learned lifting against the trained networks, and what a chain of it is."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from lab.designs.students import Encoders, LiftingConfig
from scenelang.compiler import steps
from scenelang.compiler.lifting import GEOMETRY_INPUTS, lift_geometry, lift_material, read_lifting
from scenelang.compiler.steps import Affine, Warp


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


def test_a_merged_warp_has_no_encoder() -> None:
    lifting = read_lifting(tensors(encoders()))
    with pytest.raises(ValueError, match="no encoder"):
        lift_geometry(lifting, [[Warp(0.1, (0.2, 0.0))]], [0])
