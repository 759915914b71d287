"""Training configurations: typed, frozen, read from JSON, saved with the weights."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter
from pydantic.dataclasses import dataclass as checked

from lab.training.scenes import SceneConfig
from scenelang.assets.files import read_regular
from scenelang.drawing.neural.network import FramedConfig
from scenelang.drawing.solid.network import SolidConfig

CONFIGS = Path(__file__).parent / "configs"
_MOST_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class Phase:
    """A stretch of training with its own streams."""

    iterations: int  # optimiser steps
    objects: int  # most objects of a stream; 0 trains on the leaves alone, without frames or cell
    streams: int  # streams B of a batch; for leaves alone the factor on the number of points of each
    decoder_rate: float = 1.0  # the decoder's learning rate as a share of the cell's; 0 leaves it as it is
    rate: float = 1.0  # the phase's highest learning rate as a share of the whole training's
    forced: bool = False  # start every step from the exact state instead of the network's own


@checked(frozen=True, config={"extra": "forbid"})
class TrainConfig:
    """Everything that decides what a training yields, besides the code."""

    model: str  # name of the model that the weights are for
    seed: int  # seeds parameters and scenes
    rate: float  # highest learning rate; every phase warms up over 200 steps and falls by a cosine
    phases: tuple[Phase, ...]  # run one after the other
    network: FramedConfig  # sizes of the renderer
    scenes: SceneConfig  # the training distribution
    # name of a model whose cell and colours the weights get, so that the phases train the decoder alone: a
    # cell works on distances, whichever decoder they come from
    cell: str | None = None

    @property
    def iterations(self) -> int:
        return sum(phase.iterations for phase in self.phases)

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


@checked(frozen=True, config={"extra": "forbid"})
class SolidsConfig:
    """Everything that decides what a training of solids yields, besides the code."""

    model: str  # name of the model that the weights are for
    seed: int  # seeds parameters and points
    cell: int  # steps of Adam for the cell
    network: SolidConfig  # sizes


def config_data(name: str) -> bytes:
    """The text of a configuration, by path or by the name of a shipped one."""
    path = Path(name)
    if not path.suffix and (CONFIGS / f"{name}.json").exists():
        path = CONFIGS / f"{name}.json"
    return read_regular(path, _MOST_BYTES)


def is_solids(data: bytes) -> bool:
    """Return whether a configuration is a `SolidsConfig`."""
    return b'"solids3d"' in data


def read_solids_config(name: str) -> SolidsConfig:
    """As `read_config`, of solids."""
    return TypeAdapter[SolidsConfig](SolidsConfig).validate_json(config_data(name))


def read_config(name: str) -> TrainConfig:
    """Read a configuration by path or shipped name; raises OSError or `pydantic.ValidationError`."""
    return TypeAdapter[TrainConfig](TrainConfig).validate_json(config_data(name))
