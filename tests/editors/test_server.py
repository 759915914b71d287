"""Diagnostics over a real process and real pipes, as an editor gets them."""

from __future__ import annotations

from pathlib import Path

from tests.editors.client import Client
from tests.editors.conftest import LIBRARY, SCENE


def test_syntax_comes_at_once_and_the_rest_when_typing_pauses(client: Client, uri: str) -> None:
    at = client.texts[uri].index("ring(3")
    client.change(uri, at, at, "square { rotate(30) }\n")
    first = client.next_diagnostics(uri)
    assert [d["code"] for d in first] == ["E0102"]
    assert client.shown(uri, first[0]["range"]) == ""
    end = client.texts[uri].index(" }\nring")
    client.change(uri, end, end, ";")
    found = client.diagnostics(uri)
    assert [d["code"] for d in found] == ["E0302"]
    assert client.shown(uri, found[0]["range"]) == "30"
    assert found[0]["severity"] == 1
    assert found[0]["codeDescription"]["href"].endswith("E0302.md")


def test_labels_are_related_places_and_unused_names_are_faded(client: Client, uri: str) -> None:
    client.replace(uri, SCENE + "let r = 2;\nlet spare = 1;\n")
    found = {d["code"]: d for d in client.diagnostics(uri)}
    assert found["W0201"]["tags"] == [1]
    assert client.shown(uri, found["W0201"]["range"]) == "spare"
    (related,) = found["E0202"]["relatedInformation"]
    assert related["message"] == "first defined here"
    assert client.shown(uri, related["location"]["range"]) == "r"
    assert related["location"]["range"]["start"]["line"] == 3


def test_what_evaluation_found_stays_in_place_while_typing_goes_on(client: Client, uri: str) -> None:
    client.replace(uri, SCENE + "square { rotate(30); }\n")
    assert [d["code"] for d in client.diagnostics(uri)] == ["E0302"]
    client.change(uri, 0, 0, "// a line\n")
    (moved,) = client.next_diagnostics(uri)
    assert moved["code"] == "E0302"
    assert client.shown(uri, moved["range"]) == "30"


def test_a_mistake_in_an_imported_file_stands_at_what_led_there(client: Client, uri: str) -> None:
    client.replace(uri, SCENE.replace("at = [0.1, 0.2]", "at = 3"))
    (found,) = client.diagnostics(uri)
    assert found["message"].startswith("in `lib.nsg`: ")
    assert client.shown(uri, found["range"]) == "lib.dot"
    assert found["relatedInformation"][0]["location"]["uri"].endswith("lib.nsg")


def test_an_open_import_counts_before_it_is_saved(client: Client, uri: str, folder: Path) -> None:
    library = client.open((folder / "lib.nsg").as_uri(), LIBRARY)
    client.diagnostics(library)
    client.replace(library, LIBRARY.replace("fn twice", "fn double"))
    while not (found := client.next_diagnostics(uri)):
        pass
    assert [d["code"] for d in found] == ["E0212"]
    client.close(library)
    while client.next_diagnostics(uri):
        pass


def test_a_file_that_changes_on_the_disk_is_read_again(client: Client, uri: str, folder: Path) -> None:
    assert any(
        watcher["globPattern"] == "**/*.nsg"
        for message in client.asked
        if message["method"] == "client/registerCapability"
        for registration in message["params"]["registrations"]
        for watcher in registration["registerOptions"]["watchers"]
    )
    path = folder / "lib.nsg"
    path.write_text(LIBRARY.replace("module dot", "module spot"), "utf-8")
    try:
        client.notify("workspace/didChangeWatchedFiles", {"changes": [{"uri": path.as_uri(), "type": 2}]})
        assert [d["code"] for d in client.next_diagnostics(uri)] == ["E0212"]
    finally:
        path.write_text(LIBRARY, "utf-8")
    client.notify("workspace/didChangeWatchedFiles", {"changes": [{"uri": path.as_uri(), "type": 2}]})
    assert client.next_diagnostics(uri) == []


def test_a_buffer_without_a_file_is_a_scene_too(client: Client) -> None:
    uri = client.open("untitled:Untitled-1", "squar { scale(0.5); }\n")
    (found,) = client.diagnostics(uri)
    assert found["code"] == "E0204"
    assert "did you mean `square`?" in found["message"]
    client.close(uri)


def test_later_frames_are_looked_at(client: Client, uri: str) -> None:
    client.replace(uri, "animate(1, 10);\nsquare { rotate(u); }\n")
    (found,) = client.diagnostics(uri)
    assert found["message"].startswith("expected an angle, found a bare number (frame 1)")
