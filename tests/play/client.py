"""A server in a process of its own, and a page without a browser."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

WAIT_S = 60


class Server:
    """``scenelang play`` of a folder; ``state`` is where it keeps what was not saved."""

    def __init__(self, path: Path, state: Path, *arguments: str) -> None:
        command = [sys.executable, "-m", "scenelang", "play", str(path), "--no-browser", *arguments]
        environment = {**os.environ, "SCENELANG_STATE": str(state), "PYTHONUNBUFFERED": "1"}
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, env=environment, stdout=pipe, stderr=pipe, text=True)
        assert self.process.stdout is not None
        self.url = next(line.strip() for line in self.process.stdout if line.startswith("http://"))
        self.origin = self.url.rsplit("/", 2)[0]

    def connect(self, name: str, **options: Any) -> ClientConnection:
        options = {"origin": self.origin, "max_size": None, "proxy": None, **options}
        socket: ClientConnection = connect(f"{self.url.replace('http', 'ws', 1)}{name}", **options)
        return socket

    @contextlib.contextmanager
    def page(self) -> Iterator[Page]:
        with self.connect("live") as socket:
            yield Page(socket)

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self.end(signal.SIGTERM)  # which does nothing to one that has ended

    def end(self, how: int = signal.SIGINT) -> int:
        self.process.send_signal(how)
        self.process.communicate(timeout=WAIT_S)
        return self.process.returncode


class Page:
    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.told: list[dict[str, Any]] = []
        self.files = self.until("files")

    def say(self, kind: str, **message: Any) -> None:
        self.socket.send(json.dumps({"kind": kind, **message}))

    def hear(self) -> dict[str, Any]:
        self.told.append(json.loads(self.socket.recv(WAIT_S)))
        return self.told[-1]

    def until(self, kind: str, **like: Any) -> dict[str, Any]:
        """The next message of a kind that has such parts."""
        while True:
            message = self.hear()
            if message["kind"] == kind and all(message[key] == value for key, value in like.items()):
                return message

    def open(self, file: str) -> dict[str, Any]:
        """Open a file; its text, when its view is there too."""
        self.say("open", file=file)
        text = self.until("text", file=file)
        self.until("view", file=file)
        return text

    def draw(self, id: int | str, file: str, by: str = "network", **wishes: Any) -> None:
        self.say("draw", id=id, file=file, by=by, **{"params": {}, "frame": 0, "size": [64, 48], **wishes})


def children(pid: int) -> set[int]:
    found = subprocess.run(["ps", "-eo", "pid=,ppid=,comm="], capture_output=True, text=True, check=True)
    rows = [line.split(None, 2) for line in found.stdout.splitlines()]
    return {int(child) for child, parent, name in rows if int(parent) == pid and name != "ps"}


def below(pid: int) -> set[int]:
    found = children(pid)
    return found.union(*map(below, found))


def is_there(pid: int) -> bool:
    with contextlib.suppress(FileNotFoundError, ProcessLookupError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False
