"""`scenelang import`: glTF in, formatted text out, and what is left out is said."""

from __future__ import annotations

from pathlib import Path

import scenelang as nsg
from scenelang.interchange.gltf import load_gltf
from tests.cli.conftest import Folder
from tests.interchange.documents import document, write


def test_names_stay_in_their_comments(folder: Folder) -> None:
    name = "a\nsquare {}\r*/\u2028" + "x" * 1000
    nodes = [
        {"name": name, "children": [1, 2]},
        {"name": "star"},
        {"name": "star.001", "translation": [1, 0, 0]},
    ]
    write(folder.path, document(nodes))
    said = folder.run("import", "a.gltf").stdout
    assert nsg.loads(said) == load_gltf("a.gltf").scene
    assert max(map(len, said.splitlines())) < 100
    assert "// star.001\n" in said


def test_the_command(folder: Folder) -> None:
    nodes = [
        {"name": "root", "children": [1, 2]},
        {"name": "star", "mesh": 0},
        {"name": "Suzanne", "mesh": 0},
    ]
    write(folder.path, document(nodes))
    result = folder.run("import", "a.gltf", "-o", "a.nsg")
    assert result.exit_code == 0
    assert result.stderr == "left out: /root/Suzanne: no geometry of shapes2d is named so\n"
    assert Path("a.nsg").read_text() == 'nsg 1;\nmodel "shapes2d";\n// star\nstar {}\n'
    assert folder.run("check", "a.nsg").exit_code == 0
    assert folder.run("import", "a.gltf", "-o", "b.nsg", "--strict").exit_code == 1
    assert folder.run("import", "a.gltf", "-o", "a.json").exit_code == 0
    assert nsg.Scene.from_json(Path("a.json").read_text()) == nsg.load("a.nsg")
    write(folder.path, document([{"name": "Suzanne", "mesh": 0}]), "b.gltf")
    nothing = folder.run("import", "b.gltf", "-o", "b.nsg")
    assert nothing.exit_code == 2
    assert "no node is named like a geometry of shapes2d" in nothing.stderr
    assert folder.run("import", "a.obj").exit_code == 2
    assert folder.run("import", "none.glb").exit_code == 2
    assert folder.run("import", "a.gltf", "--model", "none").exit_code == 2
    assert not Path("b.nsg").exists()
