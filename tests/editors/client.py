"""A client of the language server over real pipes, written against the protocol alone, with its own texts."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import tempfile
import threading
import time
from operator import itemgetter
from pathlib import Path
from typing import Any

Json = dict[str, Any]
PATIENCE_S = 120.0
"""How long an answer is waited for before the server counts as hanging; most take milliseconds."""
CAPABILITIES: Json = {
    "general": {"positionEncodings": ["utf-16"]},
    "workspace": {
        "workspaceEdit": {"documentChanges": True},
        "didChangeWatchedFiles": {"dynamicRegistration": True},
        "inlayHint": {"refreshSupport": True},
    },
    "textDocument": {
        "completion": {"completionItem": {"snippetSupport": True}},
        "rename": {"prepareSupport": True},
        "publishDiagnostics": {"relatedInformation": True, "versionSupport": True},
        "semanticTokens": {"requests": {}, "tokenTypes": [], "tokenModifiers": [], "formats": ["relative"]},
    },
}


class Client:
    """One server process and the editor in front of it, which has a folder open and knows one encoding."""

    def __init__(
        self,
        root: Path | None = None,
        encoding: str = "utf-16",
        options: Json | None = None,
        command: list[str] | None = None,
    ) -> None:
        self.errors = tempfile.TemporaryFile()  # noqa: SIM115
        self.process = subprocess.Popen(
            command or [sys.executable, "-m", "scenelang", "lsp"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.errors,
        )
        self.encoding = encoding
        self.texts: dict[str, str] = {}
        self.versions: dict[str, int] = {}
        self.published: dict[str, list[Json]] = {}
        self.logged: list[Json] = []
        self.asked: list[Json] = []
        self._answers: dict[int, Json] = {}
        self._inbox: queue.Queue[Json | None] = queue.Queue()
        self._id = 0
        threading.Thread(target=self._read, daemon=True).start()
        capabilities = json.loads(json.dumps(CAPABILITIES))
        capabilities["general"]["positionEncodings"] = [encoding]
        params = {
            "processId": None,
            "rootUri": root.as_uri() if root else None,
            "workspaceFolders": [{"uri": root.as_uri(), "name": root.name}] if root else None,
            "capabilities": capabilities,
            "initializationOptions": {"debounceMs": 20} if options is None else options,
        }
        try:
            self.capabilities = self.request("initialize", params)["capabilities"]
        except BaseException:
            self.kill()
            raise
        self.notify("initialized", {})

    def _read(self) -> None:
        stream = self.process.stdout
        assert stream is not None
        while True:
            length = 0
            while line := stream.readline().strip():
                name, _, value = line.partition(b":")
                length = int(value) if name.lower() == b"content-length" else length
            if not length:
                self._inbox.put(None)
                return
            self._inbox.put(json.loads(stream.read(length)))

    def send(self, message: Json) -> None:
        data = json.dumps({"jsonrpc": "2.0", **message}).encode()
        assert self.process.stdin is not None
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(data) + data)
        self.process.stdin.flush()

    def notify(self, method: str, params: Any) -> None:
        self.send({"method": method, "params": params})

    def start(self, method: str, params: Any) -> int:
        """Send a request; its answer is asked for later."""
        self._id += 1
        self.send({"id": self._id, "method": method, "params": params})
        return self._id

    def _take(self, what: str, end: float) -> None:
        """Take one message in before a time; one that does not come fails the test."""
        try:
            message = self._inbox.get(timeout=max(end - time.monotonic(), 0.0))
        except queue.Empty:
            raise AssertionError(f"no {what}") from None
        if message is None:
            self.errors.seek(0)
            raise EOFError(self.errors.read().decode())
        method = message.get("method")
        if method == "textDocument/publishDiagnostics":
            self.published.setdefault(message["params"]["uri"], []).append(message["params"])
        elif method == "window/logMessage":
            self.logged.append(message["params"])
        elif method and "id" in message:
            self.asked.append(message)
            self.send({"id": message["id"], "result": None})
        elif method is None:
            self._answers[message["id"]] = message

    def answer(self, request: int) -> Json:
        """The whole answer to a request."""
        end = time.monotonic() + PATIENCE_S
        while request not in self._answers:
            self._take(f"answer to {request}", end)
        return self._answers.pop(request)

    def request(self, method: str, params: Any) -> Any:
        """The result of a request; an error of the server fails the test."""
        message = self.answer(self.start(method, params))
        assert "error" not in message, message["error"]
        return message["result"]

    def refused(self, method: str, params: Any) -> str:
        """The message of a request that the server refuses."""
        message = self.answer(self.start(method, params))
        assert "error" in message, message
        return str(message["error"]["message"])

    def open(self, uri: str, text: str) -> str:
        self.texts[uri], self.versions[uri] = text, 1
        item = {"uri": uri, "languageId": "nsg", "version": 1, "text": text}
        self.notify("textDocument/didOpen", {"textDocument": item})
        return uri

    def change(self, uri: str, start: int, end: int, new: str) -> None:
        """Replace offsets ``[start, end)`` of a text."""
        text = self.texts[uri]
        place = {"start": self.position(text, start), "end": self.position(text, end)}
        self.texts[uri] = text[:start] + new + text[end:]
        self._changed(uri, {"range": place, "text": new})

    def replace(self, uri: str, text: str) -> None:
        """Send a whole text."""
        self.texts[uri] = text
        self._changed(uri, {"text": text})

    def _changed(self, uri: str, change: Json) -> None:
        self.versions[uri] += 1
        document = {"uri": uri, "version": self.versions[uri]}
        self.notify("textDocument/didChange", {"textDocument": document, "contentChanges": [change]})

    def close(self, uri: str) -> None:
        self.notify("textDocument/didClose", {"textDocument": {"uri": uri}})

    def position(self, text: str, offset: int) -> Json:
        before = text[:offset]
        line = before.count("\n")
        column = before[before.rfind("\n") + 1 :]
        return {"line": line, "character": self.units(column)}

    def units(self, text: str) -> int:
        size = {"utf-8": 1, "utf-16": 2, "utf-32": 4}[self.encoding]
        return len(text.encode(f"{self.encoding}-le" if size > 1 else "utf-8")) // size

    def offset(self, text: str, place: Json) -> int:
        start = 0
        for _ in range(place["line"]):
            start = text.index("\n", start) + 1
        at = start
        while self.units(text[start:at]) < place["character"]:
            at += 1
        return at

    def at(self, uri: str, word: str, shift: int = 0, occurrence: int = 0) -> Json:
        """Text and position of the ``occurrence``-th ``word`` of a document, ``shift`` further on."""
        at = -1
        for _ in range(occurrence + 1):
            at = self.texts[uri].index(word, at + 1)
        return {"textDocument": {"uri": uri}, "position": self.position(self.texts[uri], at + shift)}

    def shown(self, uri: str, place: Json) -> str:
        """The text of a range."""
        text = self.texts[uri]
        return text[self.offset(text, place["start"]) : self.offset(text, place["end"])]

    def applied(self, text: str, edits: list[Json]) -> str:
        """A text after edits, which must not overlap."""
        places = [[self.offset(text, e["range"][side]) for side in ("start", "end")] for e in edits]
        first = len(text)
        for (start, end), edit in sorted(zip(places, edits, strict=True), key=itemgetter(0), reverse=True):
            assert end <= first, "edits overlap"
            text, first = text[:start] + edit["newText"] + text[end:], start
        return text

    def diagnostics(self, uri: str, seconds: float = PATIENCE_S) -> list[Json]:
        """What is published for the latest text of a document, once its check has ended too."""
        end = time.monotonic() + seconds
        while True:
            found = [p for p in self.published.get(uri, []) if p.get("version") == self.versions[uri]]
            if len(found) >= 2:  # the syntax at once, the rest later
                return list(found[-1]["diagnostics"])
            self._take(f"diagnostics of {uri}", end)

    def next_diagnostics(self, uri: str) -> list[Json]:
        """The publication after those that have come so far."""
        end = time.monotonic() + PATIENCE_S
        count = len(self.published.get(uri, []))
        while len(self.published.get(uri, [])) == count:
            self._take(f"more diagnostics of {uri}", end)
        return list(self.published[uri][-1]["diagnostics"])

    def stop(self) -> int:
        """Shut the server down; its exit code."""
        self.request("shutdown", None)
        self.notify("exit", None)
        return self.process.wait(PATIENCE_S)

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()

    def kill(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(PATIENCE_S)
        for stream in (self.process.stdin, self.process.stdout, self.errors):
            assert stream is not None
            stream.close()
