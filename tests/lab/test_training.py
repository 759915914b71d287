"""Training data against the slow oracle, and loops that can be killed and go on."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from lab.training.checkpoint import load_tensors
from lab.training.config import Phase, SolidsConfig, TrainConfig
from lab.training.loop import train
from lab.training.norms import NormStart, fitted
from lab.training.scenes import GEOMETRIES, Batch, SceneConfig, random_batch
from lab.training.solids import fit_cell, train_solids
from scenelang.compiler.geometries import GEOMETRIES as GEOMETRY
from scenelang.drawing.arrays import NUMPY
from scenelang.drawing.neural.files import solid_arrays
from scenelang.drawing.neural.load import Solids, load_model
from scenelang.drawing.neural.network import FramedConfig
from scenelang.drawing.solid.network import SolidConfig
from scenelang.drawing.solid.norms import answers, norms
from tests.drawing import oracle

WORDS = ("union", "smooth", "subtract", "intersect")


def tiny_config(iterations: int = 6) -> TrainConfig:
    return TrainConfig(
        model="shapes2d",
        seed=3,
        rate=0.01,
        phases=(Phase(iterations, 0, 1), Phase(iterations, 3, 4, 0.1)),
        network=FramedConfig(decoder_width=8),
        scenes=SceneConfig(points=16),
    )


def test_batches_show_what_the_oracle_shows() -> None:
    batch = random_batch(8, 4, SceneConfig(points=32), torch.Generator().manual_seed(2))
    wrong = looked = 0
    for b in range(8):
        for p in range(32):
            state = (float("inf"), (0.0, 0.0, 0.0))
            for n in range(int(batch.count[b])):
                corners = oracle.outline(GEOMETRIES[batch.leaf[b, n]])
                d = oracle.polygon_distance(corners, *batch.q[b, n, :, p].tolist()) * float(batch.scale[b, n])
                c = tuple(batch.rgb[b, n].tolist())
                state = (d, c) if n == 0 else oracle.step(state, d, c, WORDS[batch.tokens[b, n]])
                if abs(state[0]) < 1e-4 or abs(d) < 1e-4:
                    break  # float32 may fall on the other side
                assert bool(batch.distance[b, n, p] < 0) == (d < 0)
                assert bool(batch.depth[b, n, p] < 0) == (state[0] < 0)
                looked += 1
                if state[0] < 0:
                    gap = max(
                        abs(x - y) for x, y in zip(batch.colour[b, n, p].tolist(), state[1], strict=True)
                    )
                    wrong += gap > 2e-3
    assert looked > 300
    assert wrong == 0


def test_a_training_that_was_stopped_goes_on_as_if_it_had_not(tmp_path: Path) -> None:
    config = tiny_config()
    assert train(config, tmp_path / "whole", report_every=4)
    halted = 0
    while not train(config, tmp_path / "parts", budget_s=0.0, report_every=4):
        halted += 1
    assert halted >= 5
    whole, _ = load_tensors(tmp_path / "whole" / "weights.safetensors")
    parts, header = load_tensors(tmp_path / "parts" / "weights.safetensors")
    assert header["iteration"] == config.iterations
    for name, tensor in whole.items():
        assert torch.equal(tensor, parts[name]), name


class Killed(BaseException):
    """Raised where a process would be killed."""


def told(folder: Path) -> list[dict[str, float]]:
    """The log, without its times."""
    lines = [json.loads(line) for line in (folder / "log.jsonl").read_text().splitlines()]
    return [{key: value for key, value in line.items() if key != "seconds"} for line in lines]


def test_a_killed_training_leaves_a_checkpoint_and_one_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed long before the interval ends; the log is that of a training that was not."""
    config = replace(tiny_config(), phases=(Phase(12, 3, 4),))
    train(config, tmp_path / "whole", report_every=2)
    at, calls = 9, 0

    def killed(*arguments: Any) -> Batch:
        nonlocal calls
        calls += 1
        if calls > at:
            raise Killed
        return random_batch(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr("lab.training.loop.random_batch", killed)
        patch.setattr("time.perf_counter", lambda: float(calls))
        with pytest.raises(Killed):
            train(config, tmp_path / "parts", report_every=2)
    with (tmp_path / "parts" / "log.jsonl").open("a") as log:
        log.write('{"iterat')
    reached: list[int] = []
    train(config, tmp_path / "parts", report_every=2, report=lambda i, *_: reached.append(i))
    assert at / 2 <= reached[0] <= at
    assert told(tmp_path / "parts") == told(tmp_path / "whole")


def test_a_decoder_gets_the_cell_of_a_model(tmp_path: Path) -> None:
    """Trained on the leaves alone, it draws with the colours and gates of the shipped one."""
    config = replace(
        tiny_config(), network=FramedConfig(decoder_width=8), phases=(Phase(3, 0, 2),), cell="shapes2d"
    )
    train(config, tmp_path)
    found, _ = load_tensors(tmp_path / "weights.safetensors")
    donor = load_model("shapes2d").framed.state_dict()
    same = {
        name
        for name in found.keys() & donor.keys()
        if found[name].shape == donor[name].shape and found[name].equal(donor[name])
    }
    assert {"cell_lines", "cell_bias", "albedo", "material_codes", "read_slope"} <= same
    assert "codes" not in same
    assert found["decoder_w.1"].shape == (5, 8, 8)


NORMS = SolidConfig(units=2, hidden=8)
TINY = SolidsConfig("solids3d", 3, 4, NORMS)


def test_a_stopped_training_goes_on_as_if_it_had_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told = []
    monkeypatch.setattr("lab.training.solids.fitted", lambda leaf, seed: (NormStart(leaf, seed), 1.0))
    assert not train_solids(TINY, tmp_path / "two", budget_s=1e-9)
    while not train_solids(TINY, tmp_path / "two", budget_s=1e-3, report=lambda *a: told.append(a[:2])):
        pass
    assert train_solids(TINY, tmp_path / "one")
    one, two = (
        solid_arrays((tmp_path / name / "weights.safetensors").read_bytes(), 7, 2) for name in ("one", "two")
    )
    assert (one.codes == two.codes).all()
    assert (one.lines == two.lines).all()
    assert told[0] == (0, 11)
    assert told[-1] == (11, 11)
    with pytest.raises(ValueError, match="another configuration"):
        train_solids(replace(TINY, seed=4), tmp_path / "one")


def test_every_part_of_the_training_learns() -> None:
    torch.manual_seed(1)
    network, g = Solids(NORMS, 7, 2), torch.Generator().manual_seed(1)
    assert fit_cell(network, 300, g) < fit_cell(Solids(SolidConfig(), 2, 2), 1, g) / 2


@pytest.mark.parametrize("leaf", ["torus", "octahedron"])
def test_norm_units_come_out_right(leaf: str) -> None:
    start, error = fitted(leaf, 1)
    assert error < 1e-7
    lines, radius = start.placed(2)
    decoder = norms(NUMPY, lines, np.float64(radius), 3.0)
    p = np.random.default_rng(1).uniform(-1.5, 1.5, (3, 1000))
    np.testing.assert_allclose(answers(NUMPY, p, decoder, False)[0], GEOMETRY[leaf].distance(p), atol=1e-6)
