"""Training data against the slow oracle, and a loop that can be killed and go on."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch

from lab.training.checkpoint import load_tensors, pack_training, unpack_training
from lab.training.config import Phase, TrainConfig
from lab.training.loop import train
from lab.training.scenes import GEOMETRIES, Batch, SceneConfig, random_batch
from scenelang.drawing.neural.load import load_model
from scenelang.drawing.neural.network import FramedConfig
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


def test_training_learns(tmp_path: Path) -> None:
    """A few steps on the leaves already lower the loss by a third."""
    config = TrainConfig(
        model="shapes2d",
        seed=0,
        rate=0.01,
        phases=(Phase(150, 0, 4),),
        network=FramedConfig(),
        scenes=SceneConfig(points=64),
    )
    losses: list[float] = []
    train(config, tmp_path, report=lambda i, n, s, parts: losses.extend(parts.values()), report_every=25)
    assert losses[-1] < losses[0] * 2 / 3


def test_a_decoder_gets_the_cell_of_a_model(tmp_path: Path) -> None:
    """Trained on the leaves alone, it draws with the colours and gates of the shipped one."""
    config = replace(
        tiny_config(), network=FramedConfig(decoder_width=8), phases=(Phase(3, 0, 2),), cell="shapes2d"
    )
    train(config, tmp_path)
    found, _ = load_tensors(tmp_path / "weights.safetensors")
    donor = load_model("shapes2d").framed.state_dict()
    same = {
        name for name in found if found[name].shape == donor[name].shape and found[name].equal(donor[name])
    }
    assert {"cell_lines", "cell_bias", "albedo", "material_codes", "read_slope"} <= same
    assert not same & {"codes", "far"}
    assert found["decoder_w.1"].shape == (5, 8, 8)


def test_a_fused_optimiser_goes_on_in_the_layout_of_its_parameters() -> None:
    """Its averages are read as they lie, so they must lie as the parameters do."""

    def made() -> tuple[torch.nn.Conv2d, torch.optim.Adam]:
        torch.manual_seed(1)
        network = torch.nn.Conv2d(3, 4, 3).to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        return network, torch.optim.Adam(network.parameters(), lr=0.1, fused=True)

    def step(network: torch.nn.Conv2d, optimiser: torch.optim.Adam, seed: int) -> None:
        x = torch.randn(2, 3, 5, 5, generator=torch.Generator().manual_seed(seed))
        optimiser.zero_grad()
        network(x).square().sum().backward()
        optimiser.step()

    network, optimiser = made()
    step(network, optimiser, 1)
    packed = pack_training(network, optimiser, torch.Generator())
    kept = {name: tensor.clone(memory_format=torch.contiguous_format) for name, tensor in packed.items()}
    step(network, optimiser, 2)
    other, again = made()
    unpack_training(kept, other, again, torch.Generator())
    step(other, again, 2)
    assert torch.equal(other.weight, network.weight)
