"""Training any student on pictures for a stated budget of processor time.

Each renderer is trained the way it asks for. `streaming` sees whole exact pictures and the paper's loss, a
Gaussian negative log likelihood whose standard deviation is annealed; it may grow, resolution by resolution
(Table 3 of the paper's supplement; Karras et al. 2018). `reading` answers random points of many scenes, by
squared and absolute error against one exact sample each.
`framed` is asked for coverage, distance and colour at points (`losses.py`); where its frames are exact it
learns the leaves alone first, then every step by itself, then whole streams.

Time is the process's processor time, which other work on the machine changes little.
"""

from __future__ import annotations

import copy
import json
import math
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import torch
from pydantic import TypeAdapter
from pydantic.dataclasses import dataclass as checked
from torch import Tensor, nn

from lab.designs.ablations import make_student
from lab.designs.pictures import (
    PictureConfig,
    Scenes,
    pictures,
    random_scenes,
    shown,
    stretch,
    trace_exactly,
)
from lab.designs.students import (
    FramedStudent,
    PointStudent,
    RendererName,
    StreamingStudent,
    Student,
    StudentConfig,
)
from lab.training.checkpoint import load_tensors, pack_training, save_tensors, unpack_training
from lab.training.config import config_data
from lab.training.losses import leaf_loss, trace_loss
from lab.training.scenes import Batch, SceneConfig, leaf_batch, points_of
from scenelang.renderers.streaming import SMALLEST

LEAVES_ALONE = 0.4  # share of the budget in which exact frames train on the leaves alone
RATES: dict[RendererName, float] = {"framed": 1e-2, "streaming": 1e-3, "reading": 2e-3}
"""Learning rate that each renderer trains best at, of those tried."""
FORCED = 0.7  # share of the budget up to which framed streams start every step from the exact state
WARM_UP = 0.02  # share of the budget
SIGMA = (0.3, 0.1)  # standard deviation of the likelihood, first and last; annealed geometrically


@dataclass(frozen=True, slots=True)
class StudyConfig:
    """Everything that decides what a study yields, besides the code and the machine."""

    student: StudentConfig  # lifting, renderer, sizes
    seconds: float  # budget of processor time
    # learning rate; falls to √0.1 of it after `drop` of the budget, as in the paper, then to a hundredth by
    # a cosine over the last tenth
    rate: float = 1e-3
    drop: float = 0.43  # share of the budget
    scenes: int = 16  # scenes B of a batch
    points: int = 64  # points P of a scene, for renderers that answer points
    grow: bool = True  # train at 4 x 4 first and double; else at the last resolution alone
    fixed: int = 0  # train on this many fixed scenes; 0 draws new ones for every batch
    seed: int = 1  # of parameters and scenes
    data: PictureConfig = field(default_factory=PictureConfig)  # distribution of the scenes
    average: float = 0.995  # decay of the averaged weights that are evaluated
    # let each level of growing begin as the one below, enlarged; else as noise, as the paper does
    warm: bool = False

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


@checked(frozen=True, config={"extra": "forbid"})
class StudentFile:
    """A model of another renderer or lifting, trained by a study: its name, and what is trained."""

    model: str
    study: StudyConfig


def read_student(name: str) -> StudentFile:
    """Read a configuration by path or by the name of a shipped one.

    Raises:
        OSError: there is no such file, or it cannot be read.
        pydantic.ValidationError: a key is unknown or a value has the wrong type.
    """
    return TypeAdapter[StudentFile](StudentFile).validate_json(config_data(name))


class Progress(NamedTuple):
    """Where a study is."""

    step: int  # optimiser steps done
    seconds: float  # processor time spent
    loss: float  # of the last batch


def rate_at(share: float, config: StudyConfig) -> float:
    """Learning rate at a share of the budget."""
    rate = config.rate * min(1.0, share / WARM_UP + 0.02)
    if share > config.drop:
        rate *= math.sqrt(0.1)
    if share > 0.9:
        rate *= 0.1 + 0.9 * 0.5 * (1 + math.cos(math.pi * (share - 0.9) / 0.1))
    return rate


def level_at(share: float, final: int, grow: bool) -> tuple[int, float]:
    """Resolution and blend at a share of the budget.

    Half of the budget is the last resolution's, a quarter the one's before, and so on down to 4 x 4. As in
    the paper a new level is blended in over as long as it then trains alone.
    """
    if not grow or final == 4:
        return final, 1.0
    levels = int(math.log2(final)) - 1  # 4, 8, …, final
    weights = [2.0**i for i in range(levels)]
    start = 0.0
    for i, weight in enumerate(weights):
        width = weight / sum(weights)
        if share < start + width or i == levels - 1:
            into = (share - start) / width
            return 4 * 2**i, 1.0 if i == 0 else min(1.0, 2 * into)
        start += width
    raise AssertionError


class Study:
    """A training that can be stopped and taken up again.

    Args:
        config: what to train.
        folder: gets ``checkpoint.safetensors``; None keeps nothing.
        device: torch device.
    """

    def __init__(
        self,
        config: StudyConfig,
        folder: Path | None = None,
        device: str = "cpu",
    ) -> None:
        torch.manual_seed(config.seed)
        self.config, self.folder = config, folder
        self.student: Student = make_student(config.student, grown=config.grow).to(device)
        if isinstance(self.student, StreamingStudent):
            self.student.renderer.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        self.averaged = copy.deepcopy(self.student).requires_grad_(False)
        self._networks = nn.ModuleDict({"student": self.student, "averaged": self.averaged})
        self.parameters = [p for p in self.student.parameters() if p.requires_grad]
        self.optimiser = torch.optim.Adam(self.parameters, lr=config.rate, betas=(0.9, 0.99))
        self.generator = torch.Generator(device).manual_seed(config.seed)
        self.progress = Progress(0, 0.0, math.nan)
        self._young = 0  # steps since the last level was blended in
        self._level = SMALLEST  # of growing
        self.fixed: Scenes | None = None
        if config.fixed:
            self.fixed = random_scenes(config.fixed, config.data, torch.Generator(device).manual_seed(7))
        if folder is not None and (folder / "checkpoint.safetensors").exists():
            self._resume(folder / "checkpoint.safetensors", device)

    def run(self, seconds: float = math.inf, save_every_s: float = 60.0) -> Iterator[Progress]:
        """Train until the budget is spent, or so many more seconds of it; yields after every step.

        Checkpoints are ``save_every_s`` apart at most; early ones come when the time of this run has doubled.
        """
        used = unsaved = 0.0
        while self.progress.seconds < self.config.seconds:
            started = time.process_time()  # of the step alone: whoever iterates may evaluate between
            share = self.progress.seconds / self.config.seconds
            for group in self.optimiser.param_groups:
                group["lr"] = rate_at(share, self.config)
            loss = self._loss(share)
            self.optimiser.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(self.parameters, 1.0)
            self.optimiser.step()
            self._average()
            spent = time.process_time() - started
            self.progress = Progress(self.progress.step + 1, self.progress.seconds + spent, loss.item())
            used, unsaved = used + spent, unsaved + spent
            yield self.progress
            if unsaved > min(save_every_s, used - unsaved) or used > seconds:
                self.save()
                unsaved = 0.0
            if used > seconds:
                return
        self.save()

    def _loss(self, share: float) -> Tensor:
        config = self.config
        if self.fixed is not None:
            rows = torch.randperm(config.fixed, generator=self.generator)[: config.scenes]
            scenes = self.fixed.pick(rows)
        else:
            scenes = random_scenes(config.scenes, config.data, self.generator)
        if isinstance(self.student, FramedStudent):
            return self._framed_loss(self.student, scenes, share)
        if isinstance(self.student, PointStudent):
            size = (2, len(scenes.leaf), config.points)
            x, y = torch.rand(size, generator=self.generator, device=scenes.leaf.device) * 2 - 1
            gap = self.student.points(scenes, x, y) - shown(scenes, x, y)
            loss: Tensor = gap.square().mean() + 0.1 * gap.abs().mean()
            return loss
        assert isinstance(self.student, StreamingStudent)
        r, blend = level_at(share, config.student.streaming.resolution, config.grow)
        if blend < 1.0:
            self._young = 0
        if r > self._level and config.grow:
            self._begin(r)
        target = pictures(scenes, r)
        found = self.student.image(scenes, r, blend)
        sigma = SIGMA[0] * (SIGMA[1] / SIGMA[0]) ** share
        likelihood: Tensor = (found - target).square().mean() / (2 * sigma**2) + math.log(sigma)
        return likelihood

    def _framed_loss(self, student: FramedStudent, scenes: Scenes, share: float) -> Tensor:
        p = self.config.points
        if share < LEAVES_ALONE and student.leaves_first:
            leaves = leaf_batch(4 * p, self.generator)
            return leaf_loss(student.renderer, leaves, student.leaf_codes, student.unasked)[0]
        maps, singular = scenes.affine[..., :2, [0, 1, 3]], stretch(scenes)
        near = SceneConfig(points=p, extent=1.0)
        points = points_of(
            maps, scenes.leaf, scenes.count, scenes.twirl, scenes.bend, singular, near, self.generator
        )
        x, y = points[:, :p].unbind(-1)
        distance, steps = trace_exactly(scenes, x, y)
        batch = Batch(
            q=points,  # not looked at: the student finds leaf coordinates by itself
            scale=singular,
            leaf=scenes.leaf,
            rgb=scenes.rgb,
            tokens=scenes.tokens,
            count=scenes.count,
            distance=distance,
            depth=torch.stack([depth for depth, _ in steps], 1),
            colour=torch.stack([colour.expand(*depth.shape, 3) for depth, colour in steps], 1),
        )
        given = (batch.depth, batch.colour) if student.forced and share < FORCED else None
        return trace_loss(student.trace(scenes, x, y, given), batch, student.unasked)[0]

    def _begin(self, resolution: int) -> None:
        """Enter a level of growing."""
        self._level = resolution
        if not self.config.warm:
            return
        for student in (self.student, self.averaged):
            assert isinstance(student, StreamingStudent)
            student.renderer.enlarge(resolution)

    @torch.no_grad()
    def _average(self) -> None:
        # young averages forget faster, so that what a level starts from does not linger
        decay = min(self.config.average, (1 + self._young) / (10 + self._young))
        self._young += 1
        for kept, new in zip(self.averaged.parameters(), self.student.parameters(), strict=True):
            kept.lerp_(new, 1 - decay)

    def save(self) -> None:
        """Write the checkpoint."""
        if self.folder is None:
            return
        self.folder.mkdir(parents=True, exist_ok=True)
        header = {
            "format": 1,
            "config": self.config.to_json(),
            "step": self.progress.step,
            "young": self._young,
            "level": self._level,
            "seconds": self.progress.seconds,
        }
        tensors = pack_training(self._networks, self.optimiser, self.generator)
        save_tensors(self.folder / "checkpoint.safetensors", tensors, header)

    def _resume(self, path: Path, device: str) -> None:
        tensors, header = load_tensors(path, device)
        if header["config"] != json.loads(json.dumps(self.config.to_json())):
            raise ValueError(f"{path} was trained with another configuration")
        unpack_training(tensors, self._networks, self.optimiser, self.generator)
        self.progress = Progress(header["step"], header["seconds"], math.nan)
        self._young, self._level = header["young"], header["level"]
