"""What `scenelang dump --costs` says, against counts by hand."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
from click.testing import CliRunner

import scenelang as nsg
from scenelang.cli.main import cli
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.graph import Graph
from scenelang.compiler.passes import PASSES
from scenelang.drawing.neural.field import SLACK
from scenelang.drawing.neural.load import load_model
from scenelang.drawing.small import draw_small
from scenelang.output.frontier import choice, drawing_cost, stages, token_counts

SCENE = """
subtract { pentagon { scale(0.4); } triangle { scale(0.1); } }
group {
  square { scale(0.2); rotate(0deg); rotate(30deg); twirl(0.4); }
  star { translate(5, 0); }
  translate(0.1, 0);
}
"""


def test_counts_of_a_scene_by_hand() -> None:
    graphs: dict[str, Graph] = {}
    compile_scene(nsg.loads(SCENE), after=graphs.__setitem__)
    rows = {row["stage"]: row for row in stages(graphs)}
    assert list(rows) == ["lower", *(step.name for step in PASSES)]
    # scale, two rotations, a twirl; a translation; one on the group; a scale each
    assert (rows["lower"]["objects"], rows["lower"]["affines"], rows["lower"]["deformations"]) == (4, 7, 1)
    assert rows["lower"]["folds"] == 3  # the file, the group, the subtraction
    # the rotation by 0 goes, the other joins the scale, the translation goes to both, then past the twirl
    assert (rows["push_transforms"]["affines"], rows["fold_warps"]["affines"]) == (5, 4)
    assert rows["drop_unseen"]["objects"] == 3  # the star is off the canvas
    assert not rows["check_trained"]["changed"]
    # the file joins the subtraction and the group, these two things each
    assert rows["lower"]["tokens"] == {"union": 5, "subtract": 1}
    assert rows["flatten"]["tokens"] == {"union": 3, "subtract": 1}
    assert rows["drop_hidden"]["tokens"] == {"union": 2, "subtract": 1}


def test_cost_of_a_drawing() -> None:
    scene = nsg.loads("canvas(40, 30); chain { square { scale(0.5); } subtract star { scale(0.2); } }")
    program = compile_scene(scene)
    cost = drawing_cost(scene, program, load_model("shapes2d"))
    assert cost["pixels"] == 1200
    assert cost["samples"] == 1200 + 4 * cost["refined"]
    assert cost["meetings_unskipped"] == 2 * cost["samples"]
    assert 0 < cost["meetings"] < cost["meetings_unskipped"]
    assert cost["refined"] < cost["evaluated"] < 1200
    assert cost["psnr"] > 40
    assert 0 <= cost["flip"] < 0.05
    assert cost["parameters"] == sum(p.numel() for p in load_model("shapes2d").network.parameters())
    assert token_counts(program.tokens.tolist()) == {"union": 1, "subtract": 1}


def test_pixels_that_no_object_reaches_are_not_evaluated() -> None:
    """A leaf reaches its unit disc, and a little more for what the network may bulge."""
    side, radius = 200, 0.4
    scene = nsg.loads(f"canvas({side}, {side}); star {{ scale({radius}); }}")
    program = compile_scene(scene)
    drawing = draw_small(program, threads=1)
    across = (np.arange(side) + 0.5) * 2 / side - 1
    far = np.hypot(across[:, None], across[None, :])
    disc = int((far <= radius * (1 + SLACK)).sum())
    assert 0.2 * disc < drawing.met < 0.9 * disc  # much of the disc is proved to show one colour
    assert draw_small(program, threads=3).met == drawing.met
    everywhere = draw_small(program, samples="four")
    assert everywhere.refined == everywhere.met == drawing.met


def test_the_choice_says_why() -> None:
    free, named = nsg.loads("star { }"), nsg.loads('model "shapes2d"; star { }')
    assert choice(free, "shapes2d", asked=False)["why"] == "the usual one of its dimension"
    assert choice(named, "shapes2d", asked=False)["why"] == "named by the scene"
    assert choice(named, "shapes2d", asked=True)["why"] == "by --model"
    found = choice(free, "shapes2d", asked=False)
    assert found["runner_up"] == "shapes2d-reading"
    assert found["lacking"]["solids3d"] == ["geometry `star` belongs to flat scenes, and this one is solid"]
    assert "shapes2d-reading" not in found["lacking"]


def test_the_command(tmp_path: Path) -> None:
    file = tmp_path / "scene.nsg"
    file.write_text(SCENE)
    arguments = ["dump", "--costs", str(file), "--size", "32x32", "--format"]
    plan = json.loads(CliRunner().invoke(cli, [*arguments, "json"]).output)
    assert (plan["rows"], plan["tokens"]) == (3, {"union": 2, "subtract": 1})
    said = CliRunner().invoke(cli, [*arguments, "text"]).output
    first = [line.split()[0] for line in said.splitlines()[:5]]
    assert first == ["stream", "pixels", "meetings", "frame", "error"]
    assert "drop_unseen" in said
    assert "3 rows of 64 numbers" in said
    assert re.search(r"pixels +[\d,]+ of 1,024 evaluated \(\d+\.\d %\)", said)
    header = next(line for line in said.splitlines() if line.startswith("after"))
    assert header.split()[1:8] == ["objects", "matrices", "affine", "deform", "folds", "union", "subtract"]
