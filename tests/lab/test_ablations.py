"""The renderer without one of its parts: each variant lacks that part, trains, and is measured alike."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import asdict, replace
from pathlib import Path

import pytest
import torch
from torch import Tensor

from lab.designs.ablations import VARIANTS, make_student
from lab.designs.pictures import PictureConfig, Scenes, random_scenes
from lab.designs.students import FramedStudent, StudentConfig
from lab.designs.studies import Study, StudyConfig
from lab.experiments.runs import SEEDS, TRIED, ablation_runs
from lab.training.losses import leaf_loss, trace_loss
from lab.training.scenes import SceneConfig, leaf_batch, random_batch
from scenelang.renderers.network import FramedConfig

RUNS = ablation_runs(1e6, 1)
BY_NAME = {name: study for name, _, study in RUNS}


def some(count: int = 4) -> Scenes:
    return random_scenes(count, PictureConfig(), torch.Generator().manual_seed(11))


def points(count: int, p: int = 40) -> tuple[Tensor, Tensor]:
    x, y = torch.rand(2, count, p, generator=torch.Generator().manual_seed(3)) * 2 - 1
    return x, y


def make(name: str) -> FramedStudent:
    torch.manual_seed(5)
    student = make_student(BY_NAME[name].student)
    assert isinstance(student, FramedStudent)
    return student


def test_runs_differ_in_one_thing() -> None:
    whole = BY_NAME["framed"]
    for name, group, study in RUNS:
        assert (study.seconds, study.rate, study.scenes, study.points) == (1e6, 1e-2, 16, 64)
        assert study.data == whole.data
        if group == "whole":
            assert replace(study, seed=1) == replace(whole, seed=1)
            continue
        assert study.seed == 1
        sizes, other = asdict(FramedConfig()), asdict(study.student.framed)
        changed = {key for key in sizes if sizes[key] != other[key]}
        assert changed == ({group} if group in TRIED else set())
        if group == "parts":
            assert study.student.variant == name
    assert [study.seed for name, _, study in RUNS if name == "framed"] == list(range(1, 1 + SEEDS))
    assert len({(name, study.seed) for name, _, study in RUNS}) == len(RUNS)
    assert {name for name, group, _ in RUNS if group == "parts"} == VARIANTS.keys() - {"code"}


def test_sizes_hold_the_shipped_one() -> None:
    for size, values in TRIED.items():
        assert getattr(FramedConfig(), size) in values


def test_a_configuration_survives_json() -> None:
    """A checkpoint's header has it, and is compared when a training goes on."""
    for _, _, study in RUNS:
        again = json.loads(json.dumps(study.to_json()))
        assert again["student"]["variant"] == study.student.variant


@pytest.mark.parametrize("name", sorted({name for name, _, _ in RUNS}))
def test_each_learns_a_few_scenes(name: str) -> None:
    """By steps, not by time; the shares of the budget at which leaves are learned alone are not passed."""
    study = Study(replace(BY_NAME[name], fixed=2, scenes=2, points=32, rate=5e-3))
    losses = [p.loss for p in itertools.islice(study.run(), 60)]
    assert all(map(math.isfinite, losses))
    assert sum(losses[-10:]) < 0.95 * sum(losses[:10])


@pytest.mark.parametrize("name", sorted(VARIANTS.keys() - {"code"}))
def test_streams_reach_every_parameter(name: str) -> None:
    """All that a variant keeps is used: no parameter is left over from the part that went."""
    student = make(name)
    x, y = points(4)
    trace = student.trace(some(), x, y)
    (trace.alone.sum() + trace.margin.sum() + trace.colour.sum()).backward()
    idle = {n for n, p in student.named_parameters() if p.requires_grad and p.grad is None}
    assert not idle


def test_without_a_register_colour_is_in_the_state() -> None:
    student = make("no register")
    x, y = points(4)
    first = student.trace(some(), x, y).colour
    with torch.no_grad():
        student.renderer.readout.zero_()
    torch.testing.assert_close(student.trace(some(), x, y).colour, torch.zeros_like(first))


def test_without_scale_the_cell_sees_leaf_units() -> None:
    """The shipped cell sees world units: the same leaf at another size gives it other numbers."""
    scenes = some()
    larger = replace_affine(scenes, 2.0)
    x, y = points(4)
    for name, same in (("no distance scale", True), ("framed", False)):
        student = make(name)
        margin = student.trace(scenes, x, y).margin[:, 0]
        other = student.trace(larger, 2 * x, 2 * y).margin[:, 0]
        assert torch.allclose(margin, other, atol=1e-4) is same


def replace_affine(scenes: Scenes, factor: float) -> Scenes:
    """The same scenes `factor` times as large."""
    copy = scenes.pick(torch.arange(len(scenes.leaf)))
    copy.affine = copy.affine.clone()
    copy.affine[..., :2, :] *= factor
    return copy


def test_without_a_frame_points_are_the_world_s() -> None:
    scenes = some()
    x, y = points(4)
    student = make("no frame")
    g = student.lifting.lift(scenes)[..., :32]
    q, scale, code = student.read(g, scenes, x, y)
    torch.testing.assert_close(q, torch.stack([x, y], 1)[:, None].expand(-1, 4, -1, -1))
    assert (scale == 1).all()
    assert code.shape[-1] == 32
    torch.testing.assert_close(code, g)


def test_a_token_as_input_chooses_no_weights() -> None:
    lines, bias = make("token as input").renderer.cell_weights()
    assert (lines == lines[:1]).all()
    assert len(bias) == 4  # the token's one-hot vector, times its weights


def test_a_hidden_layer_of_no_weight_changes_nothing() -> None:
    """Beside it the cell is the shipped one: with its output silenced the two answer alike."""
    x, y = points(4)
    hidden, whole = make("hidden layer"), make("framed")
    with torch.no_grad():
        hidden.renderer.cell_w2.zero_()
        found = hidden.trace(some(), x, y)
        own = hidden.state_dict()
        whole.load_state_dict({name: own[name] for name in whole.state_dict()})
        torch.testing.assert_close(whole.trace(some(), x, y).margin, found.margin)


def test_only_some_start_from_the_exact_state() -> None:
    forced = {name: make(name).forced for name in VARIANTS if name != "code"}
    assert {name for name, given in forced.items() if not given} == {"never forced", "pictures alone"}


def test_pictures_alone_never_ask_for_distances() -> None:
    """A network that is right about every sign and wrong about every distance loses nothing by it."""
    batch = random_batch(4, 3, SceneConfig(points=32), torch.Generator().manual_seed(2))
    for name, same in (("pictures alone", True), ("framed", False)):
        student = make(name)
        codes = student.leaf_codes[batch.leaf]
        trace = student.renderer.trace(batch.q, batch.scale, codes, batch.rgb, batch.tokens)
        loss = trace_loss(trace, batch, student.unasked)[0]
        trace.distance, trace.depth = 3 * trace.distance, 3 * trace.depth
        assert torch.allclose(trace_loss(trace, batch, student.unasked)[0], loss) is same
        leaves = leaf_batch(32, torch.Generator().manual_seed(2))
        parts = leaf_loss(student.renderer, leaves, student.leaf_codes, student.unasked)[1]
        assert ("shape" not in parts) is same


def test_codes_of_the_shipped_size_draw_what_the_shipped_renderer_draws() -> None:
    whole = make("framed")
    config = StudentConfig("framed", "exact", variant="code")
    other = make_student(config)
    assert isinstance(other, VARIANTS["code"])
    other.load_state_dict(whole.state_dict() | {"table": whole.lifting.codes.detach()})
    with torch.no_grad():
        torch.testing.assert_close(other.image(some(), 16), whole.image(some(), 16))


def test_a_variant_resumes(tmp_path: Path) -> None:
    config: StudyConfig = replace(BY_NAME["code size 2"], points=16, scenes=2)
    first = Study(config, tmp_path)
    for _ in itertools.islice(first.run(), 3):
        pass
    first.save()
    assert Study(config, tmp_path).progress.step == 3


def test_an_unknown_variant_is_refused() -> None:
    with pytest.raises(KeyError, match="no such part"):
        make_student(StudentConfig("framed", "exact", variant="no such part"))
