"""The language server of a page: the folder's files, and no others."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection

from scenelang.web.folder import Folder
from scenelang.web.language import Elsewhere, checked
from tests.play.client import WAIT_S, Server
from tests.play.conftest import SQUARE


class Editor:
    """A client of the protocol."""

    def __init__(self, socket: ClientConnection, folder: Path) -> None:
        self.socket, self.folder, self._ids = socket, folder, itertools.count(1)
        self.request("initialize", {"capabilities": {}, "processId": 1, "rootUri": "file:///etc"})
        self.notify("initialized", {})

    def notify(self, method: str, params: Any) -> None:
        self.socket.send(json.dumps({"jsonrpc": "2.0", "method": method, "params": params}))

    def request(self, method: str, params: Any) -> Any:
        id = next(self._ids)
        self.socket.send(json.dumps({"jsonrpc": "2.0", "id": id, "method": method, "params": params}))
        while (message := self.hear()).get("id") != id:
            pass
        return message.get("result", message.get("error"))

    def hear(self) -> Any:
        return json.loads(self.socket.recv(WAIT_S))

    def open(self, name: str, text: str) -> str:
        uri = (self.folder / name).as_uri()
        item = {"uri": uri, "languageId": "nsg", "version": 1, "text": text}
        self.notify("textDocument/didOpen", {"textDocument": item})
        return uri

    def diagnostics(self, uri: str, evaluated: bool) -> list[Any]:
        """What is said of a file: at once of its syntax, then of its evaluation."""
        for _ in range(2 if evaluated else 1):
            message = self.hear()
            while (
                message.get("method") != "textDocument/publishDiagnostics" or message["params"]["uri"] != uri
            ):
                message = self.hear()
        found: list[Any] = message["params"]["diagnostics"]
        return found


@pytest.fixture
def editor(server: Server, folder: Path) -> Iterator[Editor]:
    with server.connect("lsp") as socket:
        yield Editor(socket, folder)


def test_an_editor_of_the_page(editor: Editor) -> None:
    uri = editor.open("unsaved.nsg", SQUARE.replace("square", "sqare"))
    (found,) = editor.diagnostics(uri, evaluated=True)
    assert "sqare" in found["message"]
    place = {"textDocument": {"uri": uri}, "position": {"line": 1, "character": 12}}
    assert "scale" in json.dumps(editor.request("textDocument/hover", place))
    assert editor.request("textDocument/completion", place)["items"]


def test_imports_stay_in_the_folder(editor: Editor, folder: Path) -> None:
    (folder.parent / "outside.nsg").write_text("let secret = 1;")
    uri = editor.open("out.nsg", 'import "../outside.nsg" as out;\nsquare { scale(out.secret); }')
    assert [d["code"] for d in editor.diagnostics(uri, evaluated=True)] == ["E0215"]


def test_other_files_are_refused(editor: Editor, folder: Path) -> None:
    for uri in ("file:///etc/passwd", "file:///x.nsg", "FILE:///x.nsg", "file://host/x.nsg"):
        assert "outside" in editor.request("textDocument/hover", {"textDocument": {"uri": uri}})["message"]
        item = {"uri": uri, "languageId": "nsg", "version": 1, "text": 'import "a.nsg" as a;'}
        editor.notify("textDocument/didOpen", {"textDocument": item})
    there = editor.open("a.nsg", SQUARE)
    assert editor.diagnostics(there, evaluated=False) == []  # it is the first that anything is said of


def test_malformed_messages(editor: Editor) -> None:
    for text in ("", "{", "[]", "7", "[" * 100_000, '{"method": 1}', '{"jsonrpc": "2.0"}'):
        editor.socket.send(text)
    uri = editor.open("a.nsg", SQUARE)
    assert editor.diagnostics(uri, evaluated=True) == []


def test_what_goes_on(tmp_path: Path) -> None:
    """The folder is the server's, links lead nowhere else, and settings of places are dropped."""
    inside = tmp_path / "in"
    inside.mkdir()
    (inside / "link.nsg").symlink_to(tmp_path / "out.nsg")
    folder = Folder(inside, tmp_path)
    given = {
        "rootUri": "file:///",
        "rootPath": "/",
        "workspaceFolders": [{"uri": "file:///", "name": "all"}],
        "initializationOptions": {"scenelang": {"root": "/", "model": "x", "debounceMs": 50}},
        "capabilities": {"general": {}},
    }
    passed = checked({"method": "initialize", "id": 1, "params": given}, folder)["params"]
    assert passed["rootUri"] == inside.as_uri()
    assert passed["workspaceFolders"] == [{"uri": inside.as_uri(), "name": "in"}]
    assert passed["initializationOptions"] == {"debounceMs": 50, "root": str(tmp_path)}
    assert "rootPath" not in passed
    changed = {"method": "workspace/didChangeConfiguration", "params": {"settings": {"root": "/"}}}
    assert checked(changed, folder)["params"] == {"settings": {"root": str(tmp_path)}}
    for uri in (f"{inside.as_uri()}/../out.nsg", (inside / "link.nsg").as_uri(), f"{inside.as_uri()}x/a.nsg"):
        with pytest.raises(Elsewhere):
            checked({"method": "m", "params": {"changes": [{"newUri": uri}]}}, folder)
    text = {"textDocument": {"uri": f"{inside.as_uri()}/a.nsg", "text": "file:///etc"}}
    assert checked({"method": "m", "params": text}, folder)["params"] == text
