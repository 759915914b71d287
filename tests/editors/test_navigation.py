"""Definitions, references and renaming over real pipes, across files."""

from __future__ import annotations

from pathlib import Path

from tests.editors.client import Client
from tests.editors.conftest import LIBRARY, SCENE


def test_definition_goes_across_files(client: Client, uri: str) -> None:
    found = client.request("textDocument/definition", client.at(uri, "lib.dot", 5))
    assert found["uri"].endswith("lib.nsg")
    assert found["range"]["start"] == {"line": 3, "character": 7}
    found = client.request("textDocument/definition", client.at(uri, "size = r", 1))
    assert found["uri"].endswith("lib.nsg")
    found = client.request("textDocument/definition", client.at(uri, "ring(3", 0))
    assert client.shown(uri, found["range"]) == "ring"
    found = client.request("textDocument/definition", client.at(uri, '"lib.nsg"', 3))
    assert found["uri"].endswith("lib.nsg")
    assert client.request("textDocument/definition", client.at(uri, "square", 3)) is None


def test_references_and_highlights_mean_the_same_name(client: Client, uri: str, folder: Path) -> None:
    at = {**client.at(uri, "let r", 4), "context": {"includeDeclaration": True}}
    found = client.request("textDocument/references", at)
    assert [client.shown(uri, f["range"]) for f in found] == ["r"] * 3
    at["context"] = {"includeDeclaration": False}
    assert len(client.request("textDocument/references", at)) == 2
    library = client.open((folder / "lib.nsg").as_uri(), LIBRARY)
    at = {**client.at(library, "twice", 1), "context": {"includeDeclaration": True}}
    found = client.request("textDocument/references", at)
    assert sorted(f["uri"].rpartition("/")[2] for f in found) == ["lib.nsg", "main.nsg"]
    client.close(library)
    marks = client.request("textDocument/documentHighlight", client.at(uri, "(k)", 1))
    assert sorted(mark["kind"] for mark in marks) == [2, 2, 3]


def test_the_library_that_ships_is_read_and_never_changed(client: Client, folder: Path) -> None:
    text = 'import "std/shapes" as s;\ns.disc(0.3);\n'
    uri = client.open((folder / "shaped.nsg").as_uri(), text)
    assert client.diagnostics(uri) == []
    found = client.request("textDocument/definition", client.at(uri, "disc", 1))
    assert found["uri"].endswith("std/shapes.nsg")
    assert client.request("textDocument/definition", client.at(uri, "std/", 1))["uri"] == found["uri"]
    said = client.request("textDocument/hover", client.at(uri, "disc", 1))["contents"]["value"]
    assert "module disc(r = 1, sides = sides_of(r))" in said
    assert "A disc of radius r" in said
    offered = client.request("textDocument/completion", client.at(uri, "disc", 0))["items"]
    assert {"disc", "rect", "arrow"} <= {item["label"] for item in offered}
    offered = client.request("textDocument/completion", client.at(uri, "shapes", 0))["items"]
    assert "std/shapes" in {item["label"] for item in offered}
    for method, more in (("prepareRename", {}), ("rename", {"newName": "round"})):
        said = client.refused(f"textDocument/{method}", {**client.at(uri, "disc", 1), **more})
        assert "belongs to the library that ships" in said
    client.close(uri)


def test_rename_goes_across_imports_and_keeps_the_meaning(client: Client, uri: str) -> None:
    at = client.at(uri, "lib.dot", 5)
    assert client.request("textDocument/prepareRename", at)["placeholder"] == "dot"
    edit = client.request("textDocument/rename", {**at, "newName": "spot"})
    changes = {c["textDocument"]["uri"]: c["edits"] for c in edit["documentChanges"]}
    assert client.applied(SCENE, changes[uri]) == SCENE.replace("lib.dot", "lib.spot")
    (library,) = [edits for name, edits in changes.items() if name != uri]
    assert client.applied(LIBRARY, library) == LIBRARY.replace("module dot", "module spot")
    edit = client.request("textDocument/rename", {**client.at(uri, "size = r", 1), "newName": "side"})
    changes = {c["textDocument"]["uri"]: c["edits"] for c in edit["documentChanges"]}
    assert client.applied(SCENE, changes[uri]) == SCENE.replace("size = r", "side = r")


def test_rename_refuses_what_would_change_the_meaning(client: Client, uri: str) -> None:
    for word, shift, new, why in (
        ("let r", 4, "k", "already defined in line 3"),
        ("let r", 4, "2r", "not a name"),
        ("let r", 4, "module", "keyword"),
        ("ring(n", 0, "scale", "word of the language"),
        ("ring(n", 5, "c", "`c` is already defined"),
        ("let r", 4, "i", "`i` is already defined"),
        ("(n, c", 1, "k", "would mean this"),
        ("let r", 4, "hsv", "would mean this"),
    ):
        at = {**client.at(uri, word, shift), "newName": new}
        assert why in client.refused("textDocument/rename", at)


def test_words_of_the_language_are_not_renamed(client: Client, uri: str) -> None:
    assert "not defined" in client.refused("textDocument/prepareRename", client.at(uri, "square", 1))
