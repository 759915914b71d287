"""The training of solids learns, and goes on where it was stopped."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from lab.training.config import SolidsConfig, config_data, is_solids, read_solids_config
from lab.training.leaves import half_rays
from lab.training.solids import fit_cell, fit_decoders, polish_decoders, train_solids
from scenelang.drawing.neural.files import load_arrays, solid_arrays
from scenelang.drawing.neural.load import Solids
from scenelang.drawing.solid.network import SolidArrays, SolidConfig

TINY = SolidsConfig("solids3d", 3, 4, 4, 20, 4, SolidConfig(width=4, segment=4))


def test_a_stopped_training_goes_on_as_if_it_had_not(tmp_path: Path) -> None:
    told = []
    assert not train_solids(TINY, tmp_path / "two", budget_s=1e-9)
    while not train_solids(TINY, tmp_path / "two", budget_s=1e-3, report=lambda *a: told.append(a[:2])):
        pass
    assert train_solids(TINY, tmp_path / "one")
    one, two = (
        solid_arrays((tmp_path / name / "weights.safetensors").read_bytes(), 2, 2) for name in ("one", "two")
    )
    assert (one.codes == two.codes).all()
    assert (one.decoder_w[1] == two.decoder_w[1]).all()
    assert (one.segment_w[1] == two.segment_w[1]).all()
    assert told[0] == (0, 32)
    assert told[-1] == (32, 32)
    with pytest.raises(ValueError, match="another configuration"):
        train_solids(replace(TINY, seed=4), tmp_path / "one")


def test_another_width_takes_over_all_but_the_decoders(tmp_path: Path) -> None:
    narrow = SolidConfig(width=4, segment=32)
    assert train_solids(SolidsConfig("narrow", 3, 0, 4, 20, 0, narrow, "solids3d"), tmp_path)
    mine = solid_arrays((tmp_path / "weights.safetensors").read_bytes(), 2, 2)
    theirs = load_arrays("solids3d").network
    assert isinstance(theirs, SolidArrays)
    assert (mine.cell_lines == theirs.cell_lines).all()
    assert mine.look(mine.material_codes) == pytest.approx(theirs.look(theirs.material_codes))
    rays = np.random.default_rng(1).random((5, 100), np.float32)
    for code, other in zip(mine.codes, theirs.codes, strict=True):
        found, wanted = (
            mine.field(rays, mine.segment(code), False),
            theirs.field(rays, theirs.segment(other), False),
        )
        assert found == pytest.approx(wanted, abs=1e-4)


def test_every_part_of_the_training_learns() -> None:
    torch.manual_seed(1)
    network, g = Solids(SolidConfig(width=8), 2, 2), torch.Generator().manual_seed(1)
    assert fit_cell(network, 300, g) < fit_cell(Solids(SolidConfig(), 2, 2), 1, g) / 2
    before = fit_decoders(network, 150, g)
    assert before < 0.5 * fit_decoders(Solids(SolidConfig(width=8), 2, 2), 1, g)
    first = polish_decoders(network, 1, g, 500)
    last = polish_decoders(network, 12, g, 500)
    assert all(last[leaf] < 0.5 * first[leaf] for leaf in first)


def test_half_rays_are_as_long_in_a_sphere_as_in_closed_form() -> None:
    told, length = half_rays("sphere", 500, torch.Generator().manual_seed(1))
    p = torch.stack([told[0], 0 * told[0], told[1]])
    ahead = (p * told[2:]).sum(0)
    chord = (ahead.square() - p.square().sum(0) + 1).clip(0.0).sqrt() - ahead
    assert (length - chord).abs().max() < 1e-4


def test_the_configurations_are_known() -> None:
    for name, width in (("solids3d", 8), ("solids3d-w4", 4), ("solids3d-w16", 16)):
        assert is_solids(config_data(name))
        assert read_solids_config(name).network == SolidConfig(width=width, segment=32)
