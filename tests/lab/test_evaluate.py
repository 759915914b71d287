"""Evaluation of a set: the figures of its scenes, each as a user would draw it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import scenelang as nsg
from lab.cli import command
from lab.sets.scenes import scenes_of
from scenelang.drawing.neural.load import load_model


def test_figures_of_solids_are_those_of_the_pictures_users_get(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = ["eval", "solids3d", "--set", "staged", "--scenes", "3", "--side", "24", "--seed", "4"]
    asked += ["--kept", str(tmp_path / "kept")]
    done = CliRunner().invoke(command, [*asked, "-o", str(tmp_path)])
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "staged.json").read_text("utf-8"))
    assert found["canvas"] == [24, 24]
    (tmp_path / "staged.json").unlink()
    kept = sorted((tmp_path / "kept").iterdir())
    assert len(kept) == 3
    with monkeypatch.context() as without:
        without.setattr("lab.evaluate.reference_of", None)  # nothing is drawn again
        assert CliRunner().invoke(command, [*asked, "-o", str(tmp_path)]).exit_code == 0
    again = json.loads((tmp_path / "staged.json").read_text("utf-8"))
    assert (again["psnr_uncapped"], again["ssim"]) == (found["psnr_uncapped"], found["ssim"])
    scene_at = scenes_of(load_model("solids3d"), "staged", 4, 24)
    told = []
    for index in range(3):
        text = nsg.loads(scene_at(index).to_nsg())
        network, exact = (
            np.asarray(nsg.render(text, backend=way), np.float64) for way in ("neural", "reference")
        )
        if network.shape[2] == 4:  # over white
            network, exact = (p[..., :3] * p[..., 3:] + 1 - p[..., 3:] for p in (network, exact))
        told.append(-10 * np.log10(np.mean((network - exact) ** 2)))
    assert found["psnr_uncapped"]["mean"] == pytest.approx(np.mean(told), abs=0.3)
    assert found["worst_cases"][0]["psnr_uncapped"] == pytest.approx(min(told), abs=0.3)
    assert (tmp_path / "staged-worst.png").exists()
    assert found["psnr"]["mean"] == pytest.approx(np.minimum(told, 50).mean(), abs=0.3)


def test_a_set_of_another_dimension_is_refused(tmp_path: Path) -> None:
    done = CliRunner().invoke(command, ["eval", "solids3d", "--set", "tiny", "-o", str(tmp_path)])
    assert done.exit_code == 2
    assert "no set `tiny`; there are solids3d, diffuse" in done.output


def test_any_trees(tmp_path: Path) -> None:
    """The operator of the last row, whatever groups end behind it."""
    asked = ["eval", "shapes2d", "--set", "trees", "--scenes", "4", "--side", "24", "-o", str(tmp_path)]
    done = CliRunner().invoke(command, asked)
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "trees.json").read_text("utf-8"))
    assert sum(part["count"] for part in found["by_last_token"].values()) == 4
