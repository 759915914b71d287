"""Long trainings of the paper's renderers: in phases of counted steps, with a curve, over many sessions.

A phase has a resolution, so that `streaming` grows as in the paper. Two things are not the paper's: every
prefix of a stream is drawn and asked for, which costs no more than the last one alone; and the ConvLSTM may
run over a window of each picture near an object. Steps alone decide what a training yields.

Letters: B scenes, N objects, R pixels along a side.
"""

from __future__ import annotations

import copy
import hashlib
import math
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import torch
from pydantic import TypeAdapter
from pydantic.dataclasses import dataclass as checked
from torch import Tensor, nn

from lab.about import about
from lab.designs.pictures import PictureConfig, SceneBatch, exact_vectors, random_scenes, shown
from lab.designs.students import (
    ExactCodes,
    ReadingStudent,
    StreamingStudent,
    Student,
    StudentConfig,
    carry_frames,
    carry_leaves,
    make_student,
)
from lab.designs.windows import draw, grid, maps, prefixes, windows
from lab.designs.winograd import Winograd
from lab.training.checkpoint import check_config, load_tensors, pack_training, save_tensors, unpack_training
from lab.training.config import config_data
from scenelang.assets.files import read_regular
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.weights import MOST_BYTES, codes_of, open_weights
from scenelang.drawing.neural.load import RENDERER, Model, load_network
from scenelang.drawing.neural.paper import Level, Reading, Streaming

WARM_UP = 100  # steps at the start of a phase
UNSEEN, SEEN_AT_ONCE = 128, 16  # scenes of the curve
LEAST_COVER = 0.02  # share of the canvas
FLOOR = 3e-4  # of the variance that the likelihood takes from a picture


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


@dataclass(frozen=True, slots=True)
class LongConfig:
    """Everything that decides what a training yields, besides the code and what it begins from."""

    student: StudentConfig  # lifting, renderer, sizes
    phases: tuple[LongPhase, ...]  # run one after the other
    seed: int = 1  # of parameters and scenes
    data: PictureConfig = field(default_factory=PictureConfig)  # distribution of the scenes
    average: float = 0.998  # decay of the averaged weights, which are what is evaluated and kept
    every: int = 500  # steps between points of the curve

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


@checked(frozen=True, config={"extra": "forbid"})
class LongFile:
    """A model, and how it is trained."""

    model: str
    long: LongConfig


def read_long(name: str) -> LongFile:
    """Read a configuration by path or by the name of a shipped one; raises as `read_config` does."""
    return TypeAdapter[LongFile](LongFile).validate_json(config_data(name))


class CurvePoint(NamedTuple):
    """A point of the curve."""

    step: int
    seconds: float  # of processor time since the first weights
    side: int
    psnr: float  # mean over unseen scenes, dB, of the averaged weights


class LongTraining:
    """A training in a folder that can be stopped, killed and taken up again, or ``begin`` from weights."""

    def __init__(self, config: LongConfig, folder: Path, begin: Path | None = None) -> None:
        torch.manual_seed(config.seed)
        self.config, self.folder = config, folder
        self.student = _make(config)
        self.step, self.seconds, self.loss = 0, 0.0, math.nan
        self.side = 0  # resolution of the last step
        self._young = 0  # steps since the average began
        self.curve: list[CurvePoint] = []
        self.teacher: ExactCodes | None = None
        self.begun = ""  # SHA-256 of the weights that it began from
        checkpoint = folder / "checkpoint.safetensors"
        if begin is not None and not checkpoint.exists():
            self._begin(begin)
        self.averaged = copy.deepcopy(self.student).requires_grad_(False)
        self._networks = nn.ModuleDict({"student": self.student, "averaged": self.averaged})
        self.parameters = [p for p in self.student.parameters() if p.requires_grad]
        self.optimiser = torch.optim.Adam(self.parameters, lr=0.0, betas=(0.9, 0.99), fused=True)
        self.generator = torch.Generator().manual_seed(config.seed)
        if checkpoint.exists():
            self._resume(checkpoint)

    @property
    def steps(self) -> int:
        return sum(phase.steps for phase in self.config.phases)

    def run(self, seconds: float = math.inf, save_every_s: float = 60.0) -> Iterator[float]:
        """Train until all steps are done, or for so many seconds of processor time; yields losses."""
        used, saved = 0.0, time.monotonic()
        while self.step < self.steps and used <= seconds:
            started = time.process_time()
            phase, into = self._phase()
            self._enter(phase, into)
            self.optimiser.param_groups[0]["lr"] = _rate(phase, into)
            loss = self._loss(phase)
            self.optimiser.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            nn.utils.clip_grad_norm_(self.parameters, 1.0)
            self.optimiser.step()
            self._average()
            self.step, self.loss = self.step + 1, loss.item()
            due = self.step % self.config.every == 0 or self.step == self.steps
            if due and phase.side:
                spent = self.seconds + time.process_time() - started
                psnr = round(self.measure(), 3)
                self.curve.append(CurvePoint(self.step, round(spent, 1), self.measured_side, psnr))
            spent = time.process_time() - started
            self.seconds, used = self.seconds + spent, used + spent
            yield self.loss
            if time.monotonic() - saved > save_every_s:
                self.save()
                saved = time.monotonic()
        self.save()

    @property
    def measured_side(self) -> int:
        """Resolution R of the curve's pictures: that of the last step; of what has none, of `streaming`."""
        if self.side and isinstance(self.averaged, StreamingStudent):
            return self.side
        return self.config.student.streaming.resolution

    @torch.no_grad()
    def measure(self, count: int = UNSEEN) -> float:
        """Mean PSNR (dB) of the averaged weights over unseen scenes that cover at least 2 % of the canvas."""
        side = self.measured_side
        generator = torch.Generator().manual_seed(999)
        result: list[Tensor] = []
        while sum(len(part) for part in result) < count:
            scenes = random_scenes(SEEN_AT_ONCE, self.config.data, generator)
            exact = prefixes(scenes, *grid(SEEN_AT_ONCE, side), side)[
                torch.arange(SEEN_AT_ONCE), scenes.count - 1
            ]
            covered = (exact.amin(1) < 1).flatten(1).float().mean(1) >= LEAST_COVER
            error = (self.averaged.image(scenes, side).clamp(0, 1) - exact).square().mean((1, 2, 3))
            result.append(-10 * error[covered].clamp_min(1e-5).log10())
        return float(torch.cat(result)[:count].mean())

    def _phase(self) -> tuple[LongPhase, int]:
        into = self.step
        for phase in self.config.phases:
            if into < phase.steps:
                return phase, into
            into -= phase.steps
        raise AssertionError

    def _enter(self, phase: LongPhase, into: int) -> None:
        if into == 0 and isinstance(self.student, StreamingStudent):
            if self.side and phase.side > self.side:
                for student in (self.student, self.averaged):
                    assert isinstance(student, StreamingStudent)
                    _grow(student, self.side, phase.side)
            self._young = 0
        if phase.side:
            self.side = phase.side

    def _loss(self, phase: LongPhase) -> Tensor:
        scenes = random_scenes(phase.scenes, self.config.data, self.generator)
        if phase.side == 0:
            return self._lifting_loss(scenes)
        if isinstance(self.student, ReadingStudent):
            x, y = torch.rand((2, phase.scenes, phase.side), generator=self.generator) * 2 - 1
            gap = self.student.points(scenes, x, y) - shown(scenes, x, y)
            loss: Tensor = gap.square().mean() + 0.1 * gap.abs().mean()
            return loss
        assert isinstance(self.student, StreamingStudent)
        side, window = phase.side, phase.window
        corner = windows(scenes, side, window, self.generator) if window else None
        x, y = grid(phase.scenes, side, corner, window)
        seen = maps(self.student, scenes, side, corner, window)
        exact = prefixes(scenes, x, y, window or side)
        result = draw(self.student, scenes, side, seen)
        error = (result - exact).square().flatten(2).mean(2)  # (B, N)
        return (error + FLOOR).log().mean() if phase.variance == "own" else 20 * error.mean()

    def _lifting_loss(self, scenes: SceneBatch) -> Tensor:
        """Squared error of a learned lifting's vectors against exact ones, of which it has the length."""
        assert self.teacher is not None
        with torch.no_grad():
            wanted = exact_vectors(scenes, self.teacher.codes, self.teacher.material_codes)
            spread = wanted.flatten(0, 1).std(0).clamp(0.05, 0.5)  # of frames, errors in leaf units show
        return ((self.student.lifting.lift(scenes) - wanted) / spread).square().mean()

    @torch.no_grad()
    def _average(self) -> None:
        decay = min(self.config.average, (1 + self._young) / (10 + self._young))
        self._young += 1
        new = [p.detach() for p in self.student.parameters()]
        torch._foreach_lerp_(list(self.averaged.parameters()), new, 1 - decay)

    def save(self) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        header = {
            "format": 1,
            "config": self.config.to_json(),
            "step": self.step,
            "side": self.side,
            "young": self._young,
            "seconds": self.seconds,
            "curve": self.curve,
            "begun": self.begun,
        }
        tensors = pack_training(self._networks, self.optimiser, self.generator)
        if self.teacher is not None:
            tensors |= {f"teacher.{k}": v for k, v in self.teacher.state_dict().items()}
        save_tensors(self.folder / "checkpoint.safetensors", tensors, header)

    def _resume(self, path: Path) -> None:
        tensors, header = load_tensors(path)
        check_config(path, header["config"], self.config.to_json())
        self._teach({k.removeprefix("teacher."): v for k, v in tensors.items() if k.startswith("teacher.")})
        unpack_training(tensors, self._networks, self.optimiser, self.generator)
        self.step, self.side, self._young = header["step"], header["side"], header["young"]
        self.seconds, self.curve = header["seconds"], [CurvePoint(*point) for point in header["curve"]]
        self.begun = header["begun"]

    def _begin(self, path: Path) -> None:
        """Take over weights, their time and their curve; of another lifting's the renderer alone."""
        tensors, header = load_tensors(path)
        tensors = {k: v.float() for k, v in tensors.items()}
        own = self.student.state_dict()
        same = header["config"]["student"]["lifting"] == self.config.student.lifting
        if not same:
            self._teach(
                {k.removeprefix("lifting."): v for k, v in tensors.items() if k.startswith("lifting.")}
            )
        taken = {k: v for k, v in tensors.items() if k in own and (same or not k.startswith("lifting."))}
        if any(own[k].shape != v.shape for k, v in taken.items()):
            raise ValueError(f"{path} holds weights of another network")
        self.student.load_state_dict(own | taken)
        self.begun = hashlib.sha256(read_regular(path, MOST_BYTES)).hexdigest()
        self.seconds = float(header["seconds"])
        self.curve = [CurvePoint(*point) for point in header.get("curve", [])]

    def _teach(self, codes: dict[str, Tensor]) -> None:
        if codes:
            self.teacher = ExactCodes()
            self.teacher.load_state_dict(codes)


def _make(config: LongConfig) -> Student:
    student = make_student(config.student, grown=True)
    network, exact = student.renderer, isinstance(student.lifting, ExactCodes)
    if isinstance(student.lifting, ExactCodes):
        with torch.no_grad():
            student.lifting.codes.copy_(torch.eye(4))
    if isinstance(network, Streaming):
        sides = {str(phase.side) for phase in config.phases} | {str(network.config.resolution)}
        for name in set(network.stages) - sides:
            del network.stages[name]
        for level in network.stages.values():
            assert isinstance(level, Level)
            level.cell.gates = Winograd(level.cell.gates)
        if exact:
            carry_frames(network)
        network.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    elif isinstance(network, Reading) and exact and network.config.leaves:
        carry_leaves(network)
    return student


@torch.no_grad()
def _grow(student: StreamingStudent, old: int, new: int) -> None:
    """Let a level of as many filters begin with the cell and the pixel generator of an earlier one."""
    config, stages = student.renderer.config, student.renderer.stages
    if config.filters(old) == config.filters(new):
        stages[str(new)].load_state_dict(stages[str(old)].state_dict())


def _rate(phase: LongPhase, into: int) -> float:
    fall = phase.last + (1 - phase.last) * 0.5 * (1 + math.cos(math.pi * into / phase.steps))
    return phase.rate * min(1.0, (into + 1) / WARM_UP) * fall


def export_long(training: LongTraining, model: str, path: Path) -> None:
    """Write averaged weights in half precision, with the curve: another training can go on from them."""
    header = {
        "model": model,
        "config": training.config.to_json(),
        "iteration": training.step,
        "seconds": round(training.seconds, 1),
        "curve": training.curve,
        "begun": training.begun,
        "device": "cpu",
    }
    student = training.averaged
    levels, last = "none", ""
    if isinstance(student, StreamingStudent):
        levels = f"{RENDERER}stages."
        last = f"{levels}{student.renderer.config.resolution}."
    kept = {
        name: tensor.detach().half().cpu().contiguous()
        for name, tensor in student.state_dict().items()
        if not name.startswith(levels) or name.startswith(last)
    }
    save_tensors(path, kept, {"format": 1, **header, **about()})


def trained_model(path: Path) -> Model:
    """The model of exported weights, whatever ships under its name."""
    data = read_regular(path, MOST_BYTES)
    header = open_weights(data).header
    student = header["config"]["student"]
    side = student["streaming"]["resolution"]
    sizes = ((side, side),) if student["renderer"] == "streaming" else ()
    manifest = replace(
        load_manifest("shapes2d" if student["lifting"] == "exact" else "shapes2d-reading"),
        geometries=load_manifest("shapes2d-streaming").geometries,
        renderer=student["renderer"],
        sizes=sizes,
        white=True,
    )
    return Model(manifest, load_network(data, manifest), codes_of(manifest, data), header)
