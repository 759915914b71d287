"""The training of solids learns, and goes on where it was stopped."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from scenelang.models.solid import solid_arrays
from scenelang.renderers.solid.network import SolidConfig
from scenelang.renderers.solid.parameters import Solids
from scenelang.training.config import SolidsConfig, config_data, is_solids, read_solids_config
from scenelang.training.solids import fit_cell, fit_decoders, polish_decoders, train_solids

TINY = SolidsConfig("solids3d", 3, 4, 4, 20, SolidConfig(width=4))


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
    assert told[0] == (0, 28)
    assert told[-1] == (28, 28)
    with pytest.raises(ValueError, match="another configuration"):
        train_solids(replace(TINY, seed=4), tmp_path / "one")


def test_every_part_of_the_training_learns() -> None:
    torch.manual_seed(1)
    network, g = Solids(SolidConfig(width=8), 2, 2), torch.Generator().manual_seed(1)
    assert fit_cell(network, 300, g) < fit_cell(Solids(SolidConfig(), 2, 2), 1, g) / 2
    before = fit_decoders(network, 150, g)
    assert before < 0.5 * fit_decoders(Solids(SolidConfig(width=8), 2, 2), 1, g)
    first = polish_decoders(network, 1, g, 500)
    last = polish_decoders(network, 12, g, 500)
    assert all(last[leaf] < 0.5 * first[leaf] for leaf in first)


def test_the_shipped_configuration_is_known() -> None:
    assert is_solids(config_data("solids3d"))
    assert read_solids_config("solids3d").network == SolidConfig()
