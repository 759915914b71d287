"""The training loop: resumes, survives being killed, stops at a time budget."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch

from lab.about import revision
from lab.training.checkpoint import check_config, load_tensors, pack_training, save_tensors, unpack_training
from lab.training.config import TrainConfig
from lab.training.losses import image_loss, leaf_loss
from lab.training.network import Trainee
from lab.training.scenes import GEOMETRIES, leaf_batch, random_batch
from scenelang.assets.files import read_regular, write_whole
from scenelang.drawing.neural.load import load_model

WARM_UP = 200
_MOST_LOG = 1 << 26  # bytes
Report = Callable[[int, int, float, dict[str, float]], None]


def train(
    config: TrainConfig,
    folder: Path,
    *,
    budget_s: float = math.inf,
    device: str = "cpu",
    report: Report = lambda *_: None,
    save_every_s: float = 60.0,
    report_every: int = 500,
) -> bool:
    """Train, or go on from the checkpoint in ``folder``; true when done, false when time is over.

    The folder gets ``checkpoint.safetensors``, ``log.jsonl``, from which what the log tells of steps after
    the checkpoint is cut off, and, at the end, ``weights.safetensors``. Checkpoints are at most
    ``save_every_s`` apart, sooner at the start: whenever the time has doubled. ``report`` is called with
    iteration, iterations, seconds spent and mean loss parts, none at the start. ValueError for a checkpoint
    of another configuration.
    """
    folder.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(config.seed)
    network = Trainee(config.network, len(GEOMETRIES), 1).to(device)
    decoder, cell = network.parts()
    optimiser = torch.optim.Adam(
        [{"params": cell}, {"params": decoder}], lr=config.rate, betas=(0.9, 0.99), fused=True
    )
    scenes = torch.Generator(device).manual_seed(config.seed)
    done, spent_s = 0, 0.0
    sums: dict[str, float] = {}
    checkpoint = folder / "checkpoint.safetensors"
    if checkpoint.exists():
        tensors, header = load_tensors(checkpoint, device)
        check_config(checkpoint, header["config"], config.to_json())
        unpack_training(tensors, network, optimiser, scenes)
        done, spent_s, sums = header["iteration"], header["seconds"], header.get("sums", {})
    _cut(folder / "log.jsonl", done)
    report(done, config.iterations, spent_s, {})

    def save(name: str, tensors: dict[str, torch.Tensor], **more: Any) -> None:
        seconds = spent_s + time.perf_counter() - started
        header = {
            "format": 1,
            "model": config.model,
            "config": config.to_json(),
            "iteration": done,
            "seconds": round(seconds, 1),
            "device": device,
            "threads": torch.get_num_threads(),
            "torch": torch.__version__.split("+")[0],
            "revision": revision(),
        }
        save_tensors(folder / name, tensors, header | more)

    started = saved = time.perf_counter()
    while done < config.iterations:
        phase, into = _phase_at(config, done)
        share = config.rate * phase.rate * schedule(into, phase.iterations)
        optimiser.param_groups[0]["lr"] = share
        optimiser.param_groups[1]["lr"] = share * phase.decoder_rate
        for parameter in decoder:
            parameter.requires_grad_(phase.decoder_rate > 0)
        if phase.objects:
            batch = random_batch(phase.streams, phase.objects, config.scenes, scenes)
            loss, parts = image_loss(network, batch, forced=phase.forced)
        else:
            loss, parts = leaf_loss(network, leaf_batch(phase.streams * config.scenes.points, scenes))
        optimiser.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        done += 1
        sums = {k: sums.get(k, 0.0) + v / report_every for k, v in parts.items()}
        now = time.perf_counter()
        if done % report_every == 0:
            with (folder / "log.jsonl").open("a") as log:
                log.write(json.dumps({"iteration": done, "seconds": spent_s + now - started, **sums}) + "\n")
            report(done, config.iterations, spent_s + now - started, sums)
            sums = {}
        out_of_time = now - started > budget_s
        due = now - saved > min(save_every_s, saved - started)
        if due or out_of_time or done == config.iterations:
            save("checkpoint.safetensors", pack_training(network, optimiser, scenes), sums=sums)
            saved = now
        if out_of_time:
            break
    if done < config.iterations:
        return False
    if config.cell is not None:
        take_cell(network, config.cell)
    save("weights.safetensors", dict(network.state_dict()))
    return True


def _cut(log: Path, done: int) -> None:
    """Leave of a log what it tells of the first ``done`` iterations."""
    lines = read_regular(log, _MOST_LOG).splitlines(keepends=True) if log.exists() else []
    kept = []
    for line in lines:
        try:
            if json.loads(line)["iteration"] > done:
                break
        except (ValueError, TypeError, KeyError):  # half a line of a run that was killed
            break
        kept.append(line)
    write_whole(log, b"".join(kept))


def take_cell(network: Trainee, model: str) -> None:
    """Give a network a shipped model's cell, materials and slopes; RuntimeError where sizes differ."""
    given = load_model(model).framed.state_dict()
    decoder, _ = network.parts()
    own = {id(parameter) for parameter in decoder}
    names = [name for name, parameter in network.named_parameters() if id(parameter) not in own]
    network.load_state_dict({name: given[name] for name in names}, strict=False)


def _phase_at(config: TrainConfig, iteration: int) -> tuple[Any, int]:
    for phase in config.phases:
        if iteration < phase.iterations:
            return phase, iteration
        iteration -= phase.iterations
    raise IndexError(iteration)


def schedule(iteration: int, iterations: int) -> float:
    """Warm-up, then half a cosine down to one hundredth."""
    warm = min(1.0, (iteration + 1) / WARM_UP)
    return warm * (0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * iteration / iterations)))
