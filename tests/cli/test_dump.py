"""`scenelang dump` and `graph`: every stage can be shown, and what is shown is what was compiled."""

from __future__ import annotations

import json
import os
import re
import stat
from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.passes import PASSES
from scenelang.editors.dumps import changes
from tests.cli.conftest import Folder

TEXT = """param k = 0.5;
chain { square { scale(0.3); } smooth pentagon { twirl(0.4); scale(0.2); } }
group { star { scale(k); material flat { color(#d33); } } translate(0.1, 0); rotate(0deg); }
"""
STAGES = ["syntax", "scene", "lower", *(step.name for step in PASSES), "program"]


def test_graphs_change_on_the_way(folder: Folder) -> None:
    result = folder.run("dump", folder.write("a.nsg", TEXT), "--after", "lower", "--after", "flatten")
    assert result.exit_code == 0
    lower, _, linear = result.stdout.partition("after flatten:")
    assert lower.startswith("after lower:\nscene 256x256\n")
    assert "(group)" in lower
    assert "(group)" not in linear
    assert "star #dd3333  [0.5 0 0.1; 0 0.5 0]" in linear


def test_one_stage_has_no_title(folder: Folder) -> None:
    name = folder.write("a.nsg", TEXT)
    assert folder.run("dump", name, "--after", "scene").stdout == nsg.load("a.nsg").to_nsg()
    assert folder.run("dump", name, "--after", "lower").stdout.startswith("scene 256x256\n")
    table = folder.run("dump", name).stdout
    assert table.splitlines()[1].split() == ["row", "token", "object", "bounds", "place"]
    assert re.search(r"^1 +smooth +pentagon +\[.*\] +a\.nsg:2:39$", table, re.MULTILINE)


def test_the_tree(folder: Folder) -> None:
    said = folder.run("dump", folder.write("a.nsg", TEXT), "--after", "syntax").stdout
    assert said.startswith("File  @1:1\n  Param k  @1:1\n")
    assert "Combined smooth  @2:32" in said
    data = json.loads(folder.run("dump", "a.nsg", "--after", "syntax", "--format", "json").stdout)
    (stage,) = data["stages"]
    kinds = [s["node"] for s in stage["tree"]["statements"]]
    assert kinds == ["Param", "Node", "Node"]
    assert stage["tree"]["statements"][1]["span"]["start"] == {"line": 2, "column": 1}


def test_differences_apply_in_order(folder: Folder) -> None:
    """Taking each diff's plus lines for its minus lines leads from the first dump to the last."""
    name = folder.write("a.nsg", TEXT)
    said = folder.run("dump", name, "--diff").stdout
    parts = re.split(r"^after (\w+):\n", said, flags=re.MULTILINE)[1:]
    text = parts[1].rstrip("\n") + "\n"
    assert parts[0] == "lower"
    for stage, diff in zip(parts[2::2], parts[3::2], strict=True):
        body = re.split(r"^@@.*\n", diff, flags=re.MULTILINE)[1:]
        for hunk in body:
            lines = hunk.rstrip("\n").splitlines()
            old = "".join(line[1:] + "\n" for line in lines if line[0] in " -")
            new = "".join(line[1:] + "\n" for line in lines if line[0] in " +")
            assert old in text, stage
            text = text.replace(old, new, 1)
        assert text == folder.run("dump", name, "--after", stage).stdout
    assert text == folder.run("dump", name, "--after", PASSES[-1].name).stdout


def test_a_pass_that_changed_nothing(folder: Folder) -> None:
    result = folder.run("dump", folder.write("a.nsg", "square {}"), "--diff", "--after", "flatten")
    assert (result.exit_code, result.stdout) == (0, "after flatten:\n")


def test_large_changes_are_told_by_their_size() -> None:
    before, after = "".join(f"a{n}\n" for n in range(50_000)), "".join(f"b{n}\n" for n in range(40_000))
    said = changes("same\n" + before, "same\n" + after, "x", "y")
    assert said == "--- x\n+++ y\n@@ from line 2: 50,000 lines became 40,000 @@\n"


def test_data_of_every_stage(folder: Folder) -> None:
    arguments = [part for name in STAGES for part in ("--after", name)]
    result = folder.run("dump", folder.write("a.nsg", TEXT), *arguments, "--format", "json")
    stages = json.loads(result.stdout)["stages"]
    assert [stage["stage"] for stage in stages] == STAGES
    scene = nsg.load("a.nsg")
    assert nsg.Scene.from_json(json.dumps(stages[1]["scene"])) == scene
    assert stages[2]["graph"]["root"]["links"][1]["node"]["kind"] == "group"
    last = stages[-2]["graph"]["root"]["links"]
    assert [(link["op"], link["node"]["geometry"]) for link in last] == [
        ("union", "square"),
        ("smooth", "pentagon"),
        ("union", "star"),
    ]
    program, compiled = stages[-1]["program"], nsg.compile(scene)
    assert program["digest"] == compiled.digest()
    vectors = np.array([row["vector"] for row in program["rows"]], dtype=np.float32)
    assert np.array_equal(vectors, compiled.vectors)


def test_scenes_with_mistakes_are_shown_as_far_as_they_go(folder: Folder) -> None:
    name = folder.write("a.nsg", "square { scale(foo); }")
    result = folder.run("dump", name, "--after", "syntax", "--after", "lower")
    assert result.exit_code == 1
    assert "E0201" in result.stderr
    assert result.stdout.startswith("File")
    refused = folder.write("b.nsg", 'model "shapes2d-reading"; square; subtract { square; star; }')
    result = folder.run("dump", refused, "--after", "lower", "--after", "program")
    assert result.exit_code == 1
    assert result.stdout.startswith("scene 256x256")


def test_mermaid(folder: Folder) -> None:
    said = folder.run("dump", folder.write("a.nsg", TEXT), "--format", "mmd").stdout
    assert said.startswith("flowchart TB\n")
    boxes = dict(re.findall(r"^  (n\d+)[\[(]+\"(\w+)", said, re.MULTILINE))
    arrows = re.findall(r"^  (n\d+) -->(?:\|(\w+)\|)? (n\d+)$", said, re.MULTILINE)
    edges = {(boxes[start], word, boxes[end]) for start, word, end in arrows}
    assert edges == {
        ("scene", "", "group"),
        ("scene", "", "chain"),
        ("group", "", "star"),
        ("chain", "", "square"),
        ("chain", "smooth", "pentagon"),
    }
    (star,) = (number for number, name in boxes.items() if name == "star")
    assert f"style {star} fill:#dd3333" in said
    assert not re.search(r"[{}]", re.sub(r"#\d+;", "", said)), "what means something to Mermaid is escaped"


def test_large_scenes_are_cut(folder: Folder) -> None:
    square = "square { scale(0.01 + i / 100); translate(i / 50, j / 60); }"
    text = f"for (i in 0..<30) {{ group {{ for (j in 0..<50) {{ {square} }} }} }}"
    name = folder.write("a.nsg", text)
    for stage, kind in (("scene", "mmd"), ("lower", "dot"), ("flatten", "mmd"), ("program", "dot")):
        said = folder.run("dump", name, "--after", stage, "--format", kind, "--most", "100").stdout
        boxes = re.findall(r"^  n\d+ ?[\[(]", said, re.MULTILINE)
        assert 40 < len(boxes) <= 140, stage
        assert " more" in said


def test_dot_draws(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stand-in for Graphviz gets DOT text and says which picture was asked for."""
    name = folder.write("a.nsg", TEXT)
    monkeypatch.setenv("PATH", str(folder.path))
    missing = folder.run("dump", name, "-o", "a.svg")
    assert missing.exit_code == 2
    assert "install the package `graphviz`" in missing.stderr
    dot = folder.path / "dot"
    dot.write_text("#!/bin/sh\necho picture $1\n/bin/cat\n")
    dot.chmod(dot.stat().st_mode | stat.S_IXUSR)
    for suffix in ("svg", "png"):
        assert folder.run("dump", name, "-o", f"a.{suffix}").exit_code == 0
        said = Path(f"a.{suffix}").read_text()
        assert said.startswith(f"picture -T{suffix}\ndigraph scene {{")
    dot.write_text("#!/bin/sh\necho no such font >&2\nexit 1\n")
    failed = folder.run("dump", name, "-o", "b.svg")
    assert failed.exit_code == 2
    assert failed.stderr == "Error: dot failed: no such font\n"
    assert "b.svg" not in os.listdir()


def test_quotes_in_names_stay_inside_labels(folder: Folder) -> None:
    scene = nsg.Scene(model="a]b<c>&{d}|e", nodes=(nsg.Object("star"),))
    name = folder.write("a.json", scene.to_json())
    for kind in ("mmd", "dot"):
        said = folder.run("dump", name, "--format", kind)
        assert said.exit_code == 1  # no such model
    from scenelang.editors.dumps import Box, Drawing, to_dot, to_mermaid

    drawn = Drawing([Box(('a"b\\c]<d>;{e}|#35;',))])
    assert '["a#34;b#92;c]#60;d#62;#59;#123;e#125;#124;#35;35#59;"]' in to_mermaid(drawn)
    assert 'label="a\\"b\\\\c]<d>;{e}|#35;"' in to_dot(drawn)


def test_the_colours_of_solids_are_those_they_are_drawn_in(folder: Folder) -> None:
    """`hue` acts on linear values there."""
    text = "torus { material volumetric { color([0.3, 0.5, 1.0]); hue(0.1turn); } }"
    name = folder.write("a.nsg", text)
    fills = [
        re.findall("fill:(#[0-9a-f]{6})", folder.run("dump", name, "--format", "mmd", *after).stdout)
        for after in ((), ("--after", "lower"))
    ]
    assert fills[0] == fills[1] == ["#ba4dff"]


def test_boxes_show_numbers_in_short(folder: Folder) -> None:
    look = "material flat { hue(0.1234567turn); }"
    moves = "scale(sqrt(3)); rotate(17.123456789deg); translate(1/3, -1/3e9);"
    said = folder.run("dump", folder.write("a.nsg", f"square {{ {moves} {look} }}"), "--format", "dot").stdout
    assert "scale(1.7321)" in said
    assert "rotate(17.123deg)" in said
    assert "translate(0.33333, -3.3333e-10)" in said
    assert not re.search(r"\d\.\d{6}", said)
