"""`scenelang dump`: every stage can be shown, and what is shown is what was compiled."""

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
from scenelang.editors.dumps import Box, changes, to_dot, to_mermaid
from tests.cli.conftest import Folder

TEXT = """param k = 0.5;
chain { square { scale(0.3); } smooth pentagon { twirl(0.4); scale(0.2); } }
group { star { scale(k); material flat { color(#d33); } } translate(0.1, 0); rotate(0deg); }
"""
STAGES = ["syntax", "scene", "lower", *(step.name for step in PASSES), "program"]


def test_stages_as_text(folder: Folder) -> None:
    """One has no title; of a scene with mistakes those that it reaches are shown."""
    name = folder.write("a.nsg", TEXT)
    lower, _, linear = folder.run(
        "dump", name, "--after", "lower", "--after", "flatten", code=0
    ).stdout.partition("after flatten:")
    assert lower.startswith("after lower:\nscene 256x256\n")
    assert "(group)" in lower
    assert "(group)" not in linear
    assert "star #dd3333  [0.5 0 0.1; 0 0.5 0]" in linear
    assert folder.run("dump", name, "--after", "scene").stdout == nsg.load(name).to_nsg()
    table = folder.run("dump", name).stdout
    assert table.splitlines()[1].split() == ["row", "token", "object", "bounds", "place"]
    assert re.search(r"^1 +smooth +pentagon +\[.*\] +a\.nsg:2:39$", table, re.MULTILINE)
    said = folder.run("dump", name, "--after", "syntax").stdout
    assert said.startswith("File  @1:1\n  Param k  @1:1\n")
    assert "Combined smooth  @2:32" in said
    name = folder.write("b.nsg", "square { scale(foo); }")
    result = folder.run("dump", name, "--after", "syntax", "--after", "lower", code=1)
    assert "E0201" in result.stderr
    assert result.stdout.startswith("File")
    refused = folder.write("c.nsg", 'model "shapes2d-reading"; square; subtract { square; star; }')
    result = folder.run("dump", refused, "--after", "lower", "--after", "program", code=1)
    assert result.stdout.startswith("scene 256x256")


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
    result = folder.run("dump", folder.write("b.nsg", "square {}"), "--diff", "--after", "flatten", code=0)
    assert result.stdout == "after flatten:\n"
    before, after = "".join(f"a{n}\n" for n in range(50_000)), "".join(f"b{n}\n" for n in range(40_000))
    said = changes("same\n" + before, "same\n" + after, "x", "y")
    assert said == "--- x\n+++ y\n@@ from line 2: 50,000 lines became 40,000 @@\n"


def test_data_of_every_stage(folder: Folder) -> None:
    arguments = [part for name in STAGES for part in ("--after", name)]
    result = folder.run("dump", folder.write("a.nsg", TEXT), *arguments, "--format", "json")
    stages = json.loads(result.stdout)["stages"]
    assert [stage["stage"] for stage in stages] == STAGES
    statements = stages[0]["tree"]["statements"]
    assert [s["node"] for s in statements] == ["Param", "Node", "Node"]
    assert statements[1]["span"]["start"] == {"line": 2, "column": 1}
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
    drawn = [Box(('a"b\\c]<d>;{e}|#35;',))]
    assert '["a#34;b#92;c]#60;d#62;#59;#123;e#125;#124;#35;35#59;"]' in to_mermaid(drawn)
    assert 'label="a\\"b\\\\c]<d>;{e}|#35;"' in to_dot(drawn)


def test_large_scenes_are_cut(folder: Folder) -> None:
    square = "square { scale(0.01 + i / 100); translate(i / 50, j / 60); }"
    text = f"for (i in 0..<12) {{ group {{ for (j in 0..<20) {{ {square} }} }} }}"
    name = folder.write("a.nsg", text)
    for stage, kind in (("scene", "mmd"), ("lower", "dot"), ("flatten", "mmd"), ("program", "dot")):
        said = folder.run("dump", name, "--after", stage, "--format", kind, "--most", "60").stdout
        boxes = re.findall(r"^  n\d+ ?[\[(]", said, re.MULTILINE)
        assert 24 < len(boxes) <= 80, stage
        assert " more" in said


def test_dot_draws(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stand-in for Graphviz gets DOT text and says which picture was asked for."""
    name = folder.write("a.nsg", TEXT)
    monkeypatch.setenv("PATH", str(folder.path))
    missing = folder.run("dump", name, "-o", "a.svg", code=2)
    assert "install the package `graphviz`" in missing.stderr
    dot = folder.path / "dot"
    dot.write_text("#!/bin/sh\necho picture $1\n/bin/cat\n")
    dot.chmod(dot.stat().st_mode | stat.S_IXUSR)
    for suffix in ("svg", "png"):
        folder.run("dump", name, "-o", f"a.{suffix}", code=0)
        assert Path(f"a.{suffix}").read_text().startswith(f"picture -T{suffix}\ndigraph scene {{")
    dot.write_text("#!/bin/sh\necho no such font >&2\nexit 1\n")
    failed = folder.run("dump", name, "-o", "b.svg", code=2)
    assert failed.stderr == "Error: dot failed: no such font\n"
    assert "b.svg" not in os.listdir()


def test_boxes_show_numbers_in_short_and_colours_as_drawn(folder: Folder) -> None:
    """`hue` acts on linear values in space."""
    moves = "scale(sqrt(3)); rotate(17.123456789deg); translate(1/3, -1/3e9);"
    name = folder.write("a.nsg", f"square {{ {moves} material flat {{ hue(0.1234567turn); }} }}")
    said = folder.run("dump", name, "--format", "dot").stdout
    for shown in ("scale(1.7321)", "rotate(17.123deg)", "translate(0.33333, -3.3333e-10)"):
        assert shown in said
    assert not re.search(r"\d\.\d{6}", said)
    text = "torus { material volumetric { color([0.3, 0.5, 1.0]); hue(0.1turn); } }"
    name = folder.write("b.nsg", text)
    for after in ((), ("--after", "lower")):
        said = folder.run("dump", name, "--format", "mmd", *after).stdout
        assert re.findall("fill:(#[0-9a-f]{6})", said) == ["#ba4dff"]
