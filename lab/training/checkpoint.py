"""Checkpoints and weights: safetensors with a JSON header, written whole or not at all."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import torch
from safetensors.torch import save
from torch import Tensor, nn

from scenelang.assets.files import read_regular, write_whole
from scenelang.assets.tensors import TensorError, read_tensors
from scenelang.compiler.weights import ModelError

_MOST_BYTES = 1 << 30


def save_tensors(path: Path, tensors: dict[str, Tensor], header: dict[str, Any]) -> None:
    """Write tensors with a JSON header under the key ``scenelang``."""
    plain = {k: v.detach().cpu().contiguous() for k, v in sorted(tensors.items())}
    write_whole(path, save(plain, {"scenelang": json.dumps(header, sort_keys=True)}))


def load_tensors(path: Path, device: str = "cpu") -> tuple[dict[str, Tensor], dict[str, Any]]:
    """Tensors and header of a file of `save_tensors`; OSError if unreadable, `ModelError` if damaged."""
    data = read_regular(path, _MOST_BYTES)
    try:
        result = read_tensors(data, _MOST_BYTES)
        arrays = result.arrays(finite=False)
    except TensorError as error:
        raise ModelError(f"`{path}` is damaged: {error}") from None
    return {name: torch.from_numpy(array).to(device) for name, array in arrays.items()}, result.header


def pack_training(
    network: nn.Module, optimiser: torch.optim.Adam, scenes: torch.Generator
) -> dict[str, Tensor]:
    """Everything a training needs to go on exactly where it was."""
    out = {f"network.{k}": v for k, v in network.state_dict().items()}
    for i, state in enumerate(optimiser.state[p] for g in optimiser.param_groups for p in g["params"]):
        out |= {f"adam.{i}.{k}": v for k, v in state.items()}
    out["random"] = scenes.get_state()
    return out


def unpack_training(
    tensors: dict[str, Tensor], network: nn.Module, optimiser: torch.optim.Adam, scenes: torch.Generator
) -> None:
    """The inverse of `pack_training`, in place; raises `ModelError` for the tensors of another training."""
    try:
        network.load_state_dict(
            {k.removeprefix("network."): v for k, v in tensors.items() if k.startswith("network.")}
        )
        parameters = [p for g in optimiser.param_groups for p in g["params"]]
        for i, parameter in enumerate(parameters):
            state = {
                k: tensors[f"adam.{i}.{k}"]
                for k in ("step", "exp_avg", "exp_avg_sq")
                if f"adam.{i}.{k}" in tensors
            }
            for k in state.keys() - {
                "step"
            }:  # a fused optimiser takes averages for laid out as the parameter is
                state[k] = torch.empty_like(parameter).copy_(state[k])
            if state:
                optimiser.state[parameter].update(state)
        scenes.set_state(tensors["random"].cpu())
    except (KeyError, RuntimeError, TypeError) as error:
        raise ModelError(f"a damaged checkpoint: {' '.join(str(error).split())[:300]}") from None


def check_config(path: Path, saved: Any, own: Any) -> None:
    """Raise ValueError for a checkpoint of another configuration; settings that have gone do not count."""
    if not _same(saved, json.loads(json.dumps(own))):
        raise ValueError(f"{path} was trained with another configuration")


def _same(saved: Any, own: Any) -> bool:
    if isinstance(own, dict):
        return isinstance(saved, dict) and all(k in saved and _same(saved[k], v) for k, v in own.items())
    if isinstance(own, list):
        return isinstance(saved, list) and len(saved) == len(own) and all(map(_same, saved, own))
    return bool(saved == own)
