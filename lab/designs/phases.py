"""Configurations of long trainings."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from pydantic import TypeAdapter
from pydantic.dataclasses import dataclass as checked

from lab.designs.pictures import PictureConfig
from lab.designs.students import StudentConfig
from lab.training.config import config_data


@dataclass(frozen=True, slots=True)
class LongPhase:
    """A stretch of training."""

    steps: int  # optimiser steps
    scenes: int  # scenes B of a batch
    rate: float  # learning rate after a short warm-up
    last: float = 1.0  # share of it at the end, by a cosine
    side: int = 64  # resolution R; of `reading` points of a scene; 0 fits a learned lifting to the exact one
    window: int = 0  # side of a window of a picture that is drawn, a multiple of 4; 0 draws all of it
    # variance of the likelihood: `one` for all pictures, or each picture's `own`, at its maximum
    variance: Literal["one", "own"] = "one"
    # weight of the distances of single objects, of their feature maps by a linear readout that is not kept
    alone: float = 0.0
    drawn: bool = True  # else single objects are all that is asked for, which is a fifth of the work
    perceptual: float = 0.0  # weight of LPIPS beside the likelihood, of one prefix of each stream


@dataclass(frozen=True, slots=True)
class LongConfig:
    """Everything that decides what a training yields, besides the code and what it begins from."""

    student: StudentConfig  # lifting, renderer, sizes
    phases: tuple[LongPhase, ...]  # run one after the other
    seed: int = 1  # of parameters and scenes
    data: PictureConfig = field(default_factory=PictureConfig)  # distribution of the scenes
    average: float = 0.998  # decay of the averaged weights, which are what is evaluated and kept
    halves: bool = True  # convolutions of 16 x 16 and more in bfloat16
    every: int = 500  # steps between points of the curve

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


@checked(frozen=True, config={"extra": "forbid"})
class LongFile:
    """A model, and how it is trained."""

    model: str
    long: LongConfig


def read_long(name: str) -> LongFile:
    """Read a configuration by path or by the name of a shipped one; raises as `read_student` does."""
    return TypeAdapter[LongFile](LongFile).validate_json(config_data(name))
