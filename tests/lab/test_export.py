"""What a study trains is what a model draws."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.numpy import load_file

from lab.designs.export import export
from lab.designs.pictures import PictureConfig, random_scenes
from lab.designs.students import StudentConfig
from lab.designs.studies import StudentFile, Study, StudyConfig
from scenelang.graph.steps import Affine, Warp
from scenelang.lifting.learned import lift_geometry, lift_material, read_lifting
from scenelang.renderers.streaming import StreamingConfig


def study_of(renderer: str, lifting: str) -> Study:
    sizes = StreamingConfig(resolution=8, width=1 / 64)
    student = StudentConfig(renderer=renderer, lifting=lifting, streaming=sizes)  # type: ignore[arg-type]
    return Study(StudyConfig(student, seconds=0.05, scenes=2, points=8))


@pytest.mark.parametrize("renderer", ["streaming", "reading"])
def test_the_file_holds_the_averaged_weights_alone(renderer: str, tmp_path: Path) -> None:
    study = study_of(renderer, "learned")
    for _ in study.run():
        pass
    path = tmp_path / "weights.safetensors"
    export(study, StudentFile("x", study.config), path)
    found, known = load_file(path), study.averaged.state_dict()
    assert not [name for name in found if name.startswith("renderer.stages.") and ".8." not in name]
    assert {name for name in known if name not in found} == {
        name for name in known if name.startswith("renderer.stages.4.")
    }
    for name, value in found.items():
        np.testing.assert_array_equal(value, known[name].half().numpy())


def test_the_compiler_lifts_as_training_does(tmp_path: Path) -> None:
    study = study_of("reading", "learned")
    path = tmp_path / "weights.safetensors"
    export(study, StudentFile("x", study.config), path)
    lifting = read_lifting(load_file(path))
    scenes = random_scenes(3, PictureConfig(), torch.Generator().manual_seed(4))
    with torch.no_grad():
        expected = study.averaged.half().float().lifting.lift(scenes).numpy()
    for b, n in ((0, 0), (1, 0), (2, 0)):
        rows = tuple(scenes.affine[b, n].double().flatten()[:12].tolist())
        twirl, bend = scenes.twirl[b, n].item(), scenes.bend[b, n].item()
        chain = [Warp(twirl, (0.0, 0.0)), Warp(0.0, (bend, 0.0)), Affine(rows)]
        g = lift_geometry(lifting, [chain], [int(scenes.leaf[b, n])])
        m = lift_material(lifting, [scenes.rgb[b, n].tolist()], [0])
        np.testing.assert_allclose(np.concatenate([g, m], 1)[0], expected[b, n], rtol=1e-4, atol=1e-5)


def test_framed_students_are_not_exported(tmp_path: Path) -> None:
    study = study_of("framed", "exact")
    with pytest.raises(ValueError, match="phases"):
        export(study, StudentFile("x", study.config), tmp_path / "w.safetensors")
