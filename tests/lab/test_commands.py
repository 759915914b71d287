"""`python -m lab` as a command line: trainings, evaluations, benchmarks, everything at once."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import click
import numpy as np
import pytest
import torch

import scenelang as nsg
from lab import ROOT, everything
from lab.about import command_line
from lab.cli import command
from lab.everything import ELSEWHERE, STEPS, Step, command_lines
from lab.fits import FAR_DB, random_case
from lab.sets.scenes import scenes_of
from lab.training.checkpoint import save_tensors
from lab.training.config import CONFIGS, read_config
from scenelang.compiler.manifest import load_manifest
from scenelang.drawing.metrics import over_white, psnr
from scenelang.drawing.neural.load import load_model
from tests.lab.conftest import run


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)


def test_help_names_every_command_and_every_script() -> None:
    assert isinstance(command, click.Group)
    for name in command.commands:
        assert f"  {name} " in run("--help").stdout
        assert run(name, "--help").exit_code == 0
    assert "floor" in run("bench", "--help").stdout
    assert run("bench", "none").exit_code == 2
    assert "results" in run("docs", "--help").stdout
    assert "usage: python -m lab bench compile" in run("bench", "compile", "--help").stdout
    refused = run("eval", "solids3d", "--set", "tiny", "-o", "out")
    assert refused.exit_code == 2
    assert "no set `tiny`; there are solids3d, diffuse" in refused.output


def tiny_config(**changes: object) -> str:
    config = json.loads((CONFIGS / "shapes2d.json").read_text())
    config["phases"] = [{"objects": 2, "iterations": 6, "streams": 2}]
    config["scenes"]["points"] = 16
    Path("tiny.json").write_text(json.dumps({**config, **changes}))
    return "tiny.json"


def test_train(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lab.sets.scenes.RECORDED", 1)
    arguments = ("train", tiny_config(), "-o", "run", "--device", "cpu", "--every", "2")
    result = run(*arguments)
    assert result.exit_code == 0
    assert result.stderr.startswith("starting the training of shapes2d at step 0 of 6, on cpu, in run\n")
    assert "2 of 6 steps" in result.stderr
    assert result.stdout.startswith("done, mean loss ")
    weights = Path("run/weights.safetensors").read_bytes()
    again = run(*arguments)
    assert again.exit_code == 0
    assert again.stderr == "going on with the training of shapes2d at step 6 of 6, on cpu, in run\n"
    assert Path("run/weights.safetensors").stat().st_size == len(weights)
    assert "nonsense" in run("train", tiny_config(nonsense=1), "-o", "run").stderr
    assert run("train", "none.json", "-o", "run").exit_code == 2
    other = run("train", tiny_config(seed=7), "-o", "run", "--device", "cpu")
    assert other.exit_code == 2
    assert "another configuration" in other.stderr


def test_a_checkpoint_that_cannot_be_gone_on_with_ends_a_training_in_words() -> None:
    """A damaged one, and one of the right configuration with another training's tensors."""
    for damaged in (True, False):
        name, path = tiny_config(), Path("run/checkpoint.safetensors")
        path.parent.mkdir(exist_ok=True)
        header = {"format": 1, "config": read_config(name).to_json(), "iteration": 1, "seconds": 1.0}
        save_tensors(path, {"network.codes": torch.zeros(2)}, header)
        if damaged:
            path.write_bytes(path.read_bytes()[:200])
        result = run("train", name, "-o", "run", "--device", "cpu")
        assert result.exit_code == 2
        assert result.stderr.splitlines()[-1].startswith("Error: ")
        assert "checkpoint" in result.stderr.splitlines()[-1]


def test_folders_are_left_out() -> None:
    for given, said in (
        ("eval solids3d --kept=/tmp/k --side 256 --out /tmp/x", "eval solids3d --side 256"),
        ("eval solids3d --originals /tmp/x -o y", "eval solids3d --originals FOLDER"),
        ("stability solids3d -o", "stability solids3d"),
        ("eval 'a b.safetensors'", "eval 'a b.safetensors'"),
    ):
        assert command_line(["python -m lab", *shlex.split(given)]) == f"python -m lab {said}"


def test_every_command_and_every_benchmark_that_a_page_cites_is_run() -> None:
    run = {tuple(step.line.split()[1:3]) for step in STEPS}
    assert set(command.commands) - {"all", "docs"} <= {name for name, _ in run}
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]
    cited = {name for page in pages for name in re.findall(r"-m lab bench (\w+)", page.read_text("utf-8"))}
    assert {("bench", name) for name in cited - {*ELSEWHERE}} <= run
    assert not {("bench", name) for name in ELSEWHERE} & run


def test_the_command_lines_are_understood(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (tmp_path / "experiments").mkdir()
    for words, _ in command_lines(tmp_path, 0.5, 1000):
        assert "{" not in "".join(words)
        command.commands[words[1]].make_context(words[1], words[2:])


def test_it_goes_on_behind_what_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steps = Step("lab nothing"), Step("lab chart {out}", needs=("no_such_program",)), Step("lab --help")
    monkeypatch.setattr(everything, "STEPS", steps)
    result = run("all", "-o", ".")
    assert result.exit_code == 1
    assert result.stderr.splitlines()[-1] == "failed: python -m lab nothing"
    failed, left, done = json.loads((tmp_path / "all.json").read_text())["steps"]
    assert (failed["exit"], left["needs"], done["exit"]) == (2, ["no_such_program"], 0)


@pytest.mark.slow
def test_everything_runs_at_its_smallest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    result = run("all", "-o", str(tmp_path))
    assert result.exit_code == 0, result.stderr
    record = json.loads((tmp_path / "all.json").read_text())
    assert len(record["steps"]) == len(STEPS)


def test_figures_of_solids_are_those_of_the_pictures_users_get(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = ["eval", "solids3d", "--set", "staged", "--scenes", "2", "--side", "16", "--seed", "4"]
    asked += ["--kept", str(tmp_path / "kept")]
    done = run(*asked, "-o", ".")
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "staged.json").read_text("utf-8"))
    assert found["canvas"] == [16, 16]
    (tmp_path / "staged.json").unlink()
    kept = sorted((tmp_path / "kept").iterdir())
    assert len(kept) == 2
    with monkeypatch.context() as without:
        without.setattr("lab.evaluate.reference_of", None)  # nothing is drawn again
        assert run(*asked, "-o", ".").exit_code == 0
    again = json.loads((tmp_path / "staged.json").read_text("utf-8"))
    assert (again["psnr_uncapped"], again["ssim"]) == (found["psnr_uncapped"], found["ssim"])
    scene_at = scenes_of(load_model("solids3d"), "staged", 4, 16)
    told = []
    for index in range(2):
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


SIDE = 64


def test_the_truth_draws_the_target_and_the_start_does_not() -> None:
    for index in range(2):
        case = random_case(load_manifest("shapes2d"), index, 3, seed=5, side=SIDE)
        given: dict[str, object] = {}
        for line in case.text.splitlines():
            if line.startswith("param"):
                name, low, high = line.split()[1], *line.rstrip(";").split(" in ")[1].split("..")
                unit = "deg" if low.endswith("deg") else ""
                ends = [float(end.removesuffix("deg")) for end in (low, high)]
                value = ends[0] + case.truth[name] * (ends[1] - ends[0])
                given[name] = f"{value!r}{unit}"
        assert given.keys() == case.truth.keys()
        start, true = (
            over_white(nsg.render(nsg.loads(case.text, params=p, size=(SIDE, SIDE)), backend="reference"))
            for p in ({}, given)
        )
        assert np.abs(true - case.target).max() <= 0.5 / 255 + 1e-6
        assert psnr(start, case.target) < FAR_DB + 2  # whose start was measured in fewer pixels
