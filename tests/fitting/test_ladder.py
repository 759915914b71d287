"""What becomes of a mesh: the smallest pyramid that is as near as asked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

pytest.importorskip("igl")
trimesh = pytest.importorskip("trimesh")

import scenelang as nsg  # noqa: E402
from scenelang.cli.main import cli  # noqa: E402
from scenelang.elements.zoo import load_zoo  # noqa: E402
from scenelang.fitting.ladder import fit, measured  # noqa: E402
from scenelang.fitting.mesh import Mesh, mesh_of  # noqa: E402
from tests.elements.shapes import element, torus  # noqa: E402


@pytest.fixture(scope="module")
def ring() -> Mesh:
    made = trimesh.creation.torus(0.7, 0.3, major_sections=96, minor_sections=48)  # about z
    vertices = np.asarray(made.vertices)[:, [1, 2, 0]]
    return mesh_of(vertices, np.asarray(made.faces, np.int64))


def test_errors_are_those_of_the_shape(ring: Mesh) -> None:
    """A true torus lies as far from the mesh of one as chords lie from arcs."""
    rung = measured(element(torus, levels=5), *ring.surface(5000))
    assert 0.0001 < rung.error < 0.0006
    larger = measured(element(lambda *p: torus(*p) - 0.01, levels=5), *ring.surface(5000))
    assert larger.error == pytest.approx(0.01, abs=0.001)


def test_the_first_that_is_near_enough_is_kept(ring: Mesh) -> None:
    loose, tried = fit(ring, "ring", max_error=2e-3)
    near, more = fit(ring, "ring", max_error=5e-4)
    assert near.about["error"] <= 5e-4 < loose.about["error"] <= 2e-3  # type: ignore[operator]
    assert len(loose.data) < len(near.data) < 6000
    assert [rung.side for rung in more[: len(tried)]] == [rung.side for rung in tried]
    assert more == sorted(more, key=lambda rung: rung.side)


def test_the_same_steps_give_the_same_bytes(ring: Mesh) -> None:
    made = [fit(ring, "ring", max_error=1e-9, steps=3, budget_s=b)[0] for b in (1e-9, 1e9)]
    assert made[0].data == made[1].data
    assert made[0].about["steps"] == 3


def test_learn_adds_to_a_file_and_a_scene_draws_it(tmp_path: Path) -> None:
    trimesh.creation.icosphere(3).export(tmp_path / "a-ball.ply")
    trimesh.creation.box((1, 2, 3)).export(tmp_path / "2 boxes.stl")
    out = tmp_path / "zoo.safetensors"
    run = CliRunner().invoke
    first = run(cli, ["learn", str(tmp_path / "a-ball.ply"), "-o", str(out), "--license", "CC0"])
    assert first.exit_code == 0, first.output
    asked = ["--max-error", "0.01", "--preview", str(tmp_path / "preview.png")]
    second = run(cli, ["learn", str(tmp_path / "2 boxes.stl"), "-o", str(out), *asked])
    assert second.exit_code == 0, second.output
    zoo = load_zoo(out)
    assert list(zoo.elements) == ["_2_boxes", "a_ball"]
    assert zoo.elements["a_ball"].about["license"] == "CC0"
    assert (tmp_path / "preview.png").stat().st_size > 1000
    (tmp_path / "scene.nsg").write_text(
        'import "zoo.safetensors" as zoo; zoo.a_ball { scale(0.5); }', "utf-8"
    )
    (tmp_path / "true.nsg").write_text("sphere { scale(0.5); }", "utf-8")
    pictures = [nsg.render(nsg.load(tmp_path / f"{name}.nsg")) for name in ("scene", "true")]
    assert abs(pictures[0] - pictures[1]).mean() < 2e-3


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["a.ply", "-o", "zoo.st"], 2, "does not end in .safetensors"),
        (["a.ply", "b.ply", "-o", "z.safetensors", "--name", "x"], 2, "--name is for one file"),
        (["a.ply", "x/a.ply", "-o", "z.safetensors"], 2, "each once"),
        (["missing.ply", "-o", "z.safetensors"], 2, "missing.ply"),
        (["bad.ply", "-o", "z.safetensors"], 2, "bad.ply: damaged or not a mesh"),
        (["bad.ply", "-o", "bad.safetensors"], 2, "not a file of elements"),
    ],
)
def test_mistakes(
    arguments: list[str], code: int, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad.ply").write_text("no mesh")
    Path("bad.safetensors").write_text("no elements")
    done = CliRunner().invoke(cli, ["learn", *arguments])
    assert done.exit_code == code
    assert words in done.output
    assert Path("bad.safetensors").read_text() == "no elements"
