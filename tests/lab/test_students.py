"""Pictures of random scenes, liftings and renderers as they are trained, against the compiler's own path."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from lab.designs.ablations import make_student
from lab.designs.encoders import LiftingConfig
from lab.designs.pictures import PictureConfig, Scenes, exact_vectors, pictures, random_scenes
from lab.designs.students import FramedStudent, StudentConfig, largest_stretch, read_points
from lab.training.scenes import GEOMETRIES
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.graph.lower import lower
from scenelang.models.load import load_model
from scenelang.models.manifest import load_manifest
from scenelang.program.compile import compile_scene
from scenelang.reference.image import reference_image
from scenelang.renderers.reading import ReadingConfig
from scenelang.renderers.streaming import StreamingConfig
from scenelang.scene.schema import Bend, Chain, Color, Link, Material, Matrix, Object, Scene, Twirl

WORDS = ("union", "smooth", "subtract", "intersect")


def some(count: int) -> Scenes:
    return random_scenes(count, PictureConfig(), torch.Generator().manual_seed(11))


def as_scene(scenes: Scenes, index: int, side: int) -> Scene:
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


def test_pictures_are_those_of_the_reference() -> None:
    scenes = some(8)
    found = pictures(scenes, 32).permute(0, 2, 3, 1).numpy()
    for index in range(8):
        scene = as_scene(scenes, index, 32)
        exact = np.asarray(reference_image(lower(scene, load_manifest("shapes2d"), None, Diagnostics())))
        # a sample on an outline may fall to either side in float32
        assert np.mean(np.abs(found[index] - exact) > 1e-4) < 0.002


def test_exact_vectors_are_those_of_the_compiler() -> None:
    scenes = some(8)
    model = load_model("shapes2d")
    found = exact_vectors(scenes, model.network.codes, model.network.material_codes).numpy()
    for index in range(8):
        program = compile_scene(as_scene(scenes, index, 32), without=("drop_unseen", "drop_hidden"))
        np.testing.assert_allclose(found[index, : len(program)], program.vectors, rtol=1e-4, atol=1e-4)


def test_a_framed_student_draws_what_the_shipped_renderer_draws() -> None:
    scenes = some(6)
    model = load_model("shapes2d")
    student = FramedStudent(StudentConfig("framed", "exact"))
    student.renderer.load_state_dict(model.network.state_dict())
    with torch.no_grad():
        student.lifting.codes.copy_(model.network.codes)
        student.lifting.material_codes.copy_(model.network.material_codes)
        found, exact = student.image(scenes, 48), pictures(scenes, 48)
    assert float((found - exact).square().mean()) < 1e-4


def test_frames_are_read_out_of_vectors() -> None:
    scenes = some(4)
    student = FramedStudent(StudentConfig("framed", "exact"))
    x, y = torch.rand(2, 4, 7, generator=torch.Generator().manual_seed(1)) * 2 - 1
    with torch.no_grad():
        q, scale = read_points(student.lifting.lift(scenes)[..., :32], x, y)
    for b in range(4):
        for n in range(4):
            world = scenes.affine[b, n].double().numpy()
            points = np.stack([x[b].numpy(), y[b].numpy(), 0 * x[b].numpy(), 1 + 0 * x[b].numpy()])
            px, py = (np.linalg.inv(world) @ points)[:2]
            # the last transformation first: bend, then twirl
            for turn in (float(scenes.bend[b, n]) * px, float(scenes.twirl[b, n]) * np.hypot(px, py)):
                cos, sin = np.cos(turn), np.sin(turn)
                px, py = cos * px + sin * py, -sin * px + cos * py
            np.testing.assert_allclose(q[b, n].numpy(), np.stack([px, py]), atol=2e-4)
            smallest = np.linalg.svd(world[:2, :2], compute_uv=False)[1]
            assert float(scale[b, n]) == pytest.approx(smallest, rel=1e-4)


def test_largest_stretch_is_a_singular_value() -> None:
    m = torch.randn(50, 2, 2, generator=torch.Generator().manual_seed(3), dtype=torch.float64)
    torch.testing.assert_close(largest_stretch(m), torch.linalg.svdvals(m)[..., 0], atol=1e-6, rtol=1e-6)


@pytest.mark.parametrize("lifting", ["exact", "learned"])
@pytest.mark.parametrize("renderer", ["framed", "streaming", "reading"])
def test_padding_does_not_show(renderer: str, lifting: str) -> None:
    """What lies behind the objects in use changes nothing, whoever draws."""
    torch.manual_seed(4)
    config = StudentConfig(
        renderer,  # type: ignore[arg-type]
        lifting,  # type: ignore[arg-type]
        learned=LiftingConfig(32, 32, 8),
        streaming=StreamingConfig(resolution=8, width=1 / 32),
        reading=ReadingConfig(hidden=8, reads=2),
    )
    student = make_student(config)
    scenes, other = some(6), random_scenes(6, PictureConfig(), torch.Generator().manual_seed(12))
    mixed = Scenes(
        *(
            torch.where(scenes.used.view(*scenes.used.shape, *(1,) * (a.dim() - 2)), a, b)
            if a.dim() > 1
            else a
            for a, b in ((getattr(scenes, k), getattr(other, k)) for k in Scenes.__slots__)
        )
    )
    with torch.no_grad():
        torch.testing.assert_close(student.image(scenes, 8), student.image(mixed, 8))


def test_framed_needs_the_size_it_reads() -> None:
    with pytest.raises(ValueError, match="32"):
        make_student(StudentConfig("framed", "learned", learned=LiftingConfig(16, 32)))
