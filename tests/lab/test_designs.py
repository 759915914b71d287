"""The paper's designs: their pictures and liftings, and long trainings of them."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
import torch

import scenelang as nsg
from lab.designs.long import LongConfig, LongPhase, LongTraining, _make, export_long, trained_model
from lab.designs.pictures import PictureConfig, SceneBatch, exact_vectors, frames, pictures, random_scenes
from lab.designs.students import LiftingConfig, StreamingStudent, StudentConfig, make_student
from lab.designs.windows import draw, grid, maps, prefixes, windows
from lab.designs.winograd import Winograd
from lab.sets.scenes import draw_scene
from lab.training.scenes import GEOMETRIES
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.lifting import lift_geometry, lift_material, read_lifting
from scenelang.compiler.lower import lower
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.steps import Affine, Warp
from scenelang.drawing.exact.picture import reference_image
from scenelang.drawing.neural.load import load_model
from scenelang.drawing.neural.paper import ReadingConfig, StreamingConfig
from scenelang.language.diagnostics import Diagnostics
from scenelang.language.scene import Bend, Chain, Color, Link, Material, Matrix, Object, Scene, Twirl

WIDTH = 0.08  # of 256 filters 20, which carry what a vector holds


def config(lifting: str = "exact", *phases: LongPhase, renderer: str = "streaming") -> LongConfig:
    student = StudentConfig(
        renderer,  # type: ignore[arg-type]
        lifting,  # type: ignore[arg-type]
        learned=LiftingConfig(32, 32, 8),
        streaming=StreamingConfig(resolution=8, width=WIDTH),
        reading=ReadingConfig(hidden=8, reads=2),
    )
    usual = (LongPhase(3, 2, 1e-3, side=4), LongPhase(9, 2, 1e-3, side=8, window=4, last=0.1))
    return LongConfig(student, phases or usual, every=4)


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
        found = [maps(student, scenes, 32, c, w) for c, w in ((None, 0), (corner, 8))]
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
        found = draw(student, scenes, 8, maps(student, scenes, 8, None, 0))
        for count in range(1, 5):
            scenes.count = torch.full((4,), count)
            torch.testing.assert_close(found[:, count - 1], student.image(scenes, 8), atol=1e-5, rtol=1e-4)


def test_fewer_multiplications_convolve_as_many_do() -> None:
    torch.manual_seed(6)
    plain = torch.nn.Conv2d(3, 8, 5, 1, 2)
    x = torch.randn(130, 3, 8, 8, requires_grad=True)  # of more tiles than are transformed at a time
    found, expected = Winograd(plain)(x), plain(x)
    g = torch.randn_like(expected)
    asked = (x, plain.weight, plain.bias)
    slopes = [torch.autograd.grad(y, asked, g) for y in (found, expected)]
    for a, b in ((found, expected), *zip(*slopes, strict=True)):
        torch.testing.assert_close(a, b, atol=1e-4 * float(b.detach().std()), rtol=1e-4)


def test_reading_may_begin_with_leaf_coordinates() -> None:
    """`Reading.frames` holds the inverse frames of exact vectors at the start."""
    student = StudentConfig("reading", "exact", reading=ReadingConfig(hidden=8, reads=2, leaves=1))
    network, scenes = _make(LongConfig(student, ())), some(3)
    with torch.no_grad():
        found = network.renderer.frames(network.lifting.lift(scenes)).view(3, 4, 2, 3)
    torch.testing.assert_close(found, frames(scenes))


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


def test_weights_draw_scenes_as_they_were_trained_to(tmp_path: Path) -> None:
    """Through the compiler, on a canvas that the shipped model of the name does not draw."""
    training = LongTraining(config("exact", LongPhase(1, 2, 1e-3, side=8)), tmp_path)
    list(training.run())
    export_long(training, "shapes2d-streaming", tmp_path / "w.safetensors")
    model = trained_model(tmp_path / "w.safetensors")
    side = nsg.Object(geometry="star", transforms=(nsg.Scale(x=0.4, y=0.3), nsg.Translate(x=0.2, y=-0.1)))
    program, picture = draw_scene(model, nsg.Scene(canvas=(8, 8), nodes=(side,)))
    assert len(program) == 1
    affine = torch.tensor([[0.4, 0, 0, 0.2], [0, 0.3, 0, -0.1], [0, 0, 1, 0], [0, 0, 0, 1]])
    scenes = SceneBatch(
        leaf=torch.tensor([[GEOMETRIES.index("star")]]),
        twirl=torch.zeros(1, 1),
        bend=torch.zeros(1, 1),
        affine=affine.view(1, 1, 4, 4),
        rgb=torch.ones(1, 1, 3),
        tokens=torch.zeros(1, 1, dtype=torch.int64),
        count=torch.ones(1, dtype=torch.int64),
    )
    with torch.no_grad():
        exact = training.averaged.image(scenes, 8)[0].permute(1, 2, 0).clamp(0, 1)
    np.testing.assert_allclose(np.asarray(picture)[..., :3], exact.numpy(), atol=5e-3)


WORDS = ("union", "smooth", "subtract", "intersect")


def some(count: int) -> SceneBatch:
    return random_scenes(count, PictureConfig(), torch.Generator().manual_seed(11))


def as_scene(scenes: SceneBatch, index: int, side: int) -> Scene:
    """One of them as a Scene."""
    links = []
    for i in range(int(scenes.count[index])):
        rows = scenes.affine[index, i].double().tolist()
        node = Object(
            geometry=GEOMETRIES[int(scenes.leaf[index, i])],
            transforms=(
                Twirl(k=float(scenes.twirl[index, i])),
                Bend(k=float(scenes.bend[index, i])),
                Matrix(rows=rows),
            ),
            material=Material(name="flat", ops=(Color(rgb=tuple(scenes.rgb[index, i].tolist())),)),
        )
        links.append(Link(op=WORDS[int(scenes.tokens[index, i])], node=node))
    return Scene(model="shapes2d", canvas=(side, side), nodes=(Chain(children=tuple(links)),))


def test_pictures_are_those_of_the_reference_and_vectors_those_of_the_compiler() -> None:
    scenes, model = some(8), load_model("shapes2d")
    found = pictures(scenes, 32).permute(0, 2, 3, 1).numpy()
    vectors = exact_vectors(scenes, model.network.codes, model.network.material_codes).numpy()
    for index in range(8):
        scene = as_scene(scenes, index, 32)
        exact = np.asarray(reference_image(lower(scene, load_manifest("shapes2d"), None, Diagnostics())))
        # a sample on an outline may fall to either side in float32
        assert np.mean(np.abs(found[index] - exact) > 1e-4) < 0.002
        program = compile_scene(scene, without=("drop_unseen", "drop_hidden"))
        np.testing.assert_allclose(vectors[index, : len(program)], program.vectors, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("renderer", ["streaming", "reading"])
def test_padding_does_not_show(renderer: str) -> None:
    """What lies behind the objects in use changes nothing, whoever draws."""
    torch.manual_seed(4)
    student = make_student(config("learned", renderer=renderer).student)
    scenes, other = some(6), random_scenes(6, PictureConfig(), torch.Generator().manual_seed(12))
    mixed = SceneBatch(
        *(
            torch.where(scenes.used.view(*scenes.used.shape, *(1,) * (a.dim() - 2)), a, b)
            if a.dim() > 1
            else a
            for a, b in ((getattr(scenes, k), getattr(other, k)) for k in SceneBatch.__slots__)
        )
    )
    with torch.no_grad():
        torch.testing.assert_close(student.image(scenes, 8), student.image(mixed, 8))


def test_the_compiler_lifts_as_training_does() -> None:
    torch.manual_seed(5)
    student = make_student(StudentConfig("reading", "learned"))
    lifting = read_lifting({k: v.numpy() for k, v in student.state_dict().items()})
    scenes = random_scenes(3, PictureConfig(), torch.Generator().manual_seed(4))
    with torch.no_grad():
        expected = student.lifting.lift(scenes).numpy()
    for b, n in ((0, 0), (1, 0), (2, 0)):
        rows = tuple(scenes.affine[b, n].double().flatten()[:12].tolist())
        twirl, bend = scenes.twirl[b, n].item(), scenes.bend[b, n].item()
        chain = [Warp(twirl, (0.0, 0.0)), Warp(0.0, (bend, 0.0)), Affine(rows)]
        g = lift_geometry(lifting, [chain], [int(scenes.leaf[b, n])])
        m = lift_material(lifting, [scenes.rgb[b, n].tolist()], [0])
        np.testing.assert_allclose(np.concatenate([g, m], 1)[0], expected[b, n], rtol=1e-4, atol=1e-5)
