"""Pictures of random scenes, liftings and renderers as they are trained, against the compiler's own path."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from lab.designs.pictures import PictureConfig, Scenes, exact_vectors, pictures, random_scenes
from lab.designs.students import LiftingConfig, StudentConfig, make_student
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


@pytest.mark.parametrize("lifting", ["exact", "learned"])
@pytest.mark.parametrize("renderer", ["streaming", "reading"])
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
