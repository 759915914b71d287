"""Long trainings: windows, prefixes, killing, going on, and frames carried through deconvolutions."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

import scenelang as nsg
from lab.designs.long import LongConfig, LongPhase, LongTraining, export_long, read_long, trained_model
from lab.designs.pictures import PictureConfig, Scenes, exact_vectors, pictures, random_scenes
from lab.designs.students import CARRIED, LiftingConfig, StreamingStudent, StudentConfig, carry_frames
from lab.designs.windows import (
    draw,
    grid,
    maps,
    prefixes,
    windows,
)
from lab.sets.scenes import draw_scene
from lab.training.checkpoint import load_tensors
from lab.training.config import CONFIGS
from lab.training.scenes import GEOMETRIES
from scenelang.drawing.neural.paper import ReadingConfig, Streaming, StreamingConfig

WIDTH = 0.08  # of 256 filters 20, which carry what a vector holds


def some(count: int) -> Scenes:
    return random_scenes(count, PictureConfig(), torch.Generator().manual_seed(11))


def config(lifting: str = "exact", *phases: LongPhase, renderer: str = "streaming") -> LongConfig:
    student = StudentConfig(
        renderer,  # type: ignore[arg-type]
        lifting,  # type: ignore[arg-type]
        learned=LiftingConfig(32, 32, 8),
        streaming=StreamingConfig(resolution=8, width=WIDTH),
        reading=ReadingConfig(hidden=8, reads=2),
    )
    usual = (LongPhase(3, 2, 1e-3, side=4), LongPhase(9, 2, 1e-3, side=8, window=4, last=0.1))
    return LongConfig(student, phases or usual, every=4, halves=False)


def test_deconvolutions_begin_by_carrying_leaf_coordinates() -> None:
    torch.manual_seed(1)
    network = Streaming(StreamingConfig(resolution=16, width=WIDTH))
    carry_frames(network)
    scenes = some(3)
    x = exact_vectors(scenes, torch.eye(4), torch.zeros(1, 12)).view(12, 64, 1, 1)
    with torch.no_grad():
        for layer in network.deconvolutions:
            x = torch.relu(layer(x))
    for b, n, row, column in itertools.product(range(3), range(4), (0, 7, 15), (0, 8, 15)):
        at = torch.tensor([(column + 0.5) / 8 - 1, 1 - (row + 0.5) / 8, 0.0, 1.0], dtype=torch.float64)
        q = torch.linalg.solve(scenes.affine[b, n].double(), at)[:2].float()
        found = x[4 * b + n, :CARRIED, row, column]
        torch.testing.assert_close(
            torch.stack([found[0] - found[1], found[2] - found[3]]), q, atol=1e-4, rtol=1e-4
        )
        torch.testing.assert_close(found[14:17], scenes.rgb[b, n])
    with pytest.raises(ValueError, match="carry"):
        carry_frames(Streaming(StreamingConfig(resolution=16, width=1 / 32)))


def test_prefixes_are_the_pictures_of_shorter_streams() -> None:
    scenes = some(5)
    found = prefixes(scenes, *grid(5, 8), 8)
    for count in range(1, 5):
        scenes.count = torch.full((5,), count)
        torch.testing.assert_close(found[:, count - 1], pictures(scenes, 8), atol=1e-6, rtol=0)


def test_windows_are_parts_of_whole_pictures() -> None:
    torch.manual_seed(2)
    student = StreamingStudent(
        StudentConfig("streaming", "exact", streaming=StreamingConfig(resolution=32, width=1 / 64))
    )
    scenes, g = some(9), torch.Generator().manual_seed(3)
    corner = windows(scenes, 32, 8, g)
    assert corner.shape == (9, 2)
    assert not (corner % 4).any()
    corner[:2] = torch.tensor([[0, 0], [24, 24]])
    with torch.no_grad():
        found = [maps(student, scenes, 32, c, w, halves=False) for c, w in ((None, 0), (corner, 8))]
    exact, part = prefixes(scenes, *grid(9, 32), 32), prefixes(scenes, *grid(9, 32, corner, 8), 8)
    for b, (row, column) in enumerate(corner.tolist()):
        at = (..., slice(row, row + 8), slice(column, column + 8))
        torch.testing.assert_close(found[1][b], found[0][b][at], atol=1e-6, rtol=1e-5)
        torch.testing.assert_close(part[b], exact[b][at], atol=1e-6, rtol=0)


def test_a_picture_is_the_renderers() -> None:
    """What is trained on whole pictures is what `Streaming.forward` draws."""
    torch.manual_seed(2)
    student = StreamingStudent(
        StudentConfig("streaming", "exact", streaming=StreamingConfig(resolution=8, width=WIDTH))
    )
    scenes = some(4)
    with torch.no_grad():
        found = draw(student, scenes, 8, maps(student, scenes, 8, None, 0, halves=False), halves=False)
        for count in range(1, 5):
            scenes.count = torch.full((4,), count)
            torch.testing.assert_close(found[:, count - 1], student.image(scenes, 8), atol=1e-5, rtol=1e-4)


def test_it_goes_on_where_it_was(tmp_path: Path) -> None:
    straight = LongTraining(config(), tmp_path / "a")
    whole = list(straight.run())
    assert len(whole) == straight.steps == 12
    first = LongTraining(config(), tmp_path / "b")
    part = list(itertools.islice(first.run(save_every_s=0.0), 6))  # saved after five; the sixth is lost
    second = LongTraining(config(), tmp_path / "b")
    assert second.step == 5
    assert part + list(second.run())[1:] == whole
    assert [(p.step, p.side, p.psnr) for p in second.curve] == [
        (p.step, p.side, p.psnr) for p in straight.curve
    ]
    assert [p.step for p in second.curve] == [4, 8, 12]
    with pytest.raises(ValueError, match="another configuration"):
        LongTraining(config("learned"), tmp_path / "b")


def test_weights_go_on_with_time_and_curve(tmp_path: Path) -> None:
    first = LongTraining(config(), tmp_path / "a")
    list(first.run())
    export_long(first, "x", tmp_path / "w.safetensors")
    kept = load_tensors(tmp_path / "w.safetensors")[0]
    assert not [name for name in kept if ".stages.4." in name]
    second = LongTraining(
        config("exact", LongPhase(2, 2, 1e-4, side=8)), tmp_path / "b", tmp_path / "w.safetensors"
    )
    for name, value in kept.items():
        assert torch.equal(second.student.state_dict()[name].half(), value), name
    list(second.run())
    assert second.curve[: len(first.curve)] == first.curve
    assert second.curve[-1].seconds > first.curve[-1].seconds
    assert abs(second.curve[-1].psnr - first.curve[-1].psnr) < 0.5
    wide = StudentConfig("streaming", "exact", streaming=StreamingConfig(resolution=8, width=0.1))
    with pytest.raises(ValueError, match="another network"):
        LongTraining(replace(second.config, student=wide), tmp_path / "c", tmp_path / "w.safetensors")


def test_a_learned_lifting_is_fitted_to_the_exact_one(tmp_path: Path) -> None:
    """It takes the renderer's weights over, and turns into the lifting that these were trained with."""
    first = LongTraining(config("exact", LongPhase(1, 2, 1e-3, side=8)), tmp_path / "a")
    list(first.run())
    export_long(first, "x", tmp_path / "w.safetensors")
    lifting = LongPhase(150, 16, 3e-3, side=0)
    training = LongTraining(
        config("learned", lifting, LongPhase(1, 2, 0.0, side=8)), tmp_path / "b", tmp_path / "w.safetensors"
    )
    losses = list(itertools.islice(training.run(save_every_s=0.0), 100))
    assert sum(losses[-10:]) < 0.3 * sum(losses[:10])
    again = LongTraining(training.config, tmp_path / "b")  # which knows what to fit without the weights
    losses += list(again.run())
    assert again.step == 151
    own, taken = again.student.state_dict(), load_tensors(tmp_path / "w.safetensors")[0]
    name = "renderer.deconvolutions.2.weight"
    torch.testing.assert_close(own[name], taken[name].float())


@pytest.mark.parametrize("lifting", ["exact", "learned"])
def test_weights_draw_scenes_as_they_were_trained_to(lifting: str, tmp_path: Path) -> None:
    """Through the compiler, on a canvas that the shipped model of the name does not draw."""
    training = LongTraining(config(lifting, LongPhase(1, 2, 1e-3, side=8)), tmp_path)
    list(training.run())
    export_long(training, "shapes2d-streaming", tmp_path / "w.safetensors")
    model = trained_model(tmp_path / "w.safetensors")
    side = nsg.Object(geometry="star", transforms=(nsg.Scale(x=0.4, y=0.3), nsg.Translate(x=0.2, y=-0.1)))
    program, picture = draw_scene(model, nsg.Scene(canvas=(8, 8), nodes=(side,)))
    assert len(program) == 1
    affine = torch.tensor([[0.4, 0, 0, 0.2], [0, 0.3, 0, -0.1], [0, 0, 1, 0], [0, 0, 0, 1]])
    scenes = Scenes(
        leaf=torch.tensor([[GEOMETRIES.index("star")]]),
        twirl=torch.zeros(1, 1),
        bend=torch.zeros(1, 1),
        affine=affine.view(1, 1, 4, 4),
        rgb=torch.ones(1, 1, 3),
        tokens=torch.zeros(1, 1, dtype=torch.int64),
        count=torch.ones(1, dtype=torch.int64),
    )
    if lifting == "learned":  # training lifts by twirls and bends of nothing too, the compiler does not
        return
    with torch.no_grad():
        exact = training.averaged.image(scenes, 8)[0].permute(1, 2, 0).clamp(0, 1)
    np.testing.assert_allclose(np.asarray(picture)[..., :3], exact.numpy(), atol=5e-3)


def test_shipped_configurations_are_read() -> None:
    for path in sorted(p.stem for p in CONFIGS.glob("*.json") if '"long"' in p.read_text()):
        file = read_long(path)
        assert file.model in ("shapes2d-streaming", "shapes2d-reading")
        assert all(phase.window % 4 == 0 for phase in file.long.phases)
