"""`scenelang export`: pages, where they go, what is refused."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.cli.conftest import GOOD, Folder


def test_one_scene(folder: Folder) -> None:
    result = folder.run(
        "export", folder.write("a.nsg", "param k = 1 in 0..2;" + GOOD), "-o", "a.html", "-D", "k=2"
    )
    assert (result.exit_code, result.output) == (0, "")
    text = Path("a.html").read_text("utf-8")
    assert text.startswith("<!doctype html>")
    assert "<title>a</title>" in text
    assert folder.run("export", "a.nsg", "-o", "b.html", "--title", "Sales & more").exit_code == 0
    assert "<title>Sales &amp; more</title>" in Path("b.html").read_text("utf-8")
    refused = folder.run("export", "a.nsg", "a.nsg", "-o", "out", "--title", "T")
    assert (refused.exit_code, "--title is of one page" in refused.output) == (2, True)


def test_many_scenes_programs_and_json(folder: Folder) -> None:
    scene = folder.write("a.nsg")
    assert folder.run("compile", scene, "-o", "b.safetensors").exit_code == 0
    assert folder.run("convert", scene, "-o", "c.json").exit_code == 0
    result = folder.run("export", scene, "b.safetensors", "c.json", "-o", "out", "-v")
    assert result.exit_code == 0
    assert sorted(os.listdir("out")) == ["a.html", "b.html", "c.html"]
    assert "out/b.html" in result.output
    assert folder.run("export", "-", "-o", "out/", stdin=GOOD).exit_code == 0
    assert Path("out/stdin.html").is_file()


def test_scenes_with_errors_are_left_out(folder: Folder) -> None:
    names = (
        folder.write("a.nsg"),
        folder.write("b.nsg", "circle;"),
        folder.write("c.nsg", 'model "shapes2d-reading"; star;'),
    )
    result = folder.run("export", *names, "nowhere.nsg", "-o", "out")
    assert result.exit_code == 2
    assert os.listdir("out") == ["a.html"]
    for fact in ("E0204", "nowhere.nsg: no such file", "`shapes2d-reading` draws whole pictures"):
        assert fact in result.output
    assert folder.run("export", names[1], "-o", "b.html").exit_code == 1
    assert folder.run("export", names[0], "-o", "a.html", "-D", "k=1").exit_code == 1
    assert not Path("a.html").exists()


@pytest.mark.parametrize(
    ("out", "fact"),
    [
        ("a.png", "a page's file ends in .html"),
        ("a", "a page has a suffix such as .html"),
        ("no/a.html", "no folder"),
    ],
)
def test_places_that_are_none(folder: Folder, out: str, fact: str) -> None:
    result = folder.run("export", folder.write("a.nsg"), "-o", out)
    assert result.exit_code == 2
    assert fact in result.output


def test_pages_replace_no_input_and_follow_no_link(folder: Folder) -> None:
    folder.write("a.html")
    assert "an input of the same command" in folder.run("export", "a.html", "-o", "a.html").output
    os.makedirs("out")
    os.symlink("elsewhere.html", "out/b.html")
    assert "is a link" in folder.run("export", folder.write("b.nsg"), "-o", "out").output
