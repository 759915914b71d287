"""`python -m lab` as a command line: trainings, benchmarks, scripts."""

from __future__ import annotations

import json
from pathlib import Path

import click
import pytest
import torch

from lab.cli import command as lab
from lab.training.checkpoint import save_tensors
from lab.training.config import CONFIGS, read_config
from tests.lab.conftest import run


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)


def write(name: str, text: str) -> str:
    Path(name).write_text(text)
    return name


def test_help_names_every_command_and_every_script() -> None:
    context = click.Context(lab)
    assert isinstance(lab, click.Group)
    for name in lab.list_commands(context):
        assert f"  {name} " in run("--help").stdout
        assert run(name, "--help").exit_code == 0
    assert "floor" in run("bench", "--help").stdout
    assert run("bench", "none").exit_code == 2
    assert "results" in run("docs", "--help").stdout


def test_scripts_get_their_arguments() -> None:
    assert "usage: python -m lab bench compile" in run("bench", "compile", "--help").stdout


def tiny_config(**changes: object) -> str:
    config = json.loads((CONFIGS / "shapes2d.json").read_text())
    config["phases"] = [{"objects": 2, "iterations": 6, "streams": 2}]
    config["scenes"]["points"] = 16
    return write("tiny.json", json.dumps({**config, **changes}))


@pytest.fixture
def one_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was trained is measured on one scene of each set, not on many."""
    monkeypatch.setattr("lab.sets.scenes.RECORDED", 1)


@pytest.mark.usefixtures("one_scene")
def test_train() -> None:
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


@pytest.mark.usefixtures("one_scene")
def test_train_usage() -> None:
    name = tiny_config(nonsense=1)
    assert "nonsense" in run("train", name, "-o", "run").stderr
    assert run("train", "none.json", "-o", "run").exit_code == 2
    run("train", tiny_config(), "-o", "run", "--device", "cpu")
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
