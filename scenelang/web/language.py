"""The language server of a page, in a process of its own, ``python -m scenelang.web.language``.

It gets the messages of the page, but for those that name files outside the folder; the folder and the root of
imports are set here, not by the page.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import re
import sys
from collections.abc import Iterator
from typing import Any, Final

from pygls.uris import to_fs_path
from starlette.websockets import WebSocket, WebSocketDisconnect

from scenelang.assets.files import read_json
from scenelang.web.folder import Folder

log = logging.getLogger("scenelang.play")
_LENGTH: Final = re.compile(rb"Content-Length: *(\d{1,9})\r\n", re.IGNORECASE)
_REFUSED: Final = -32602  # the protocol's InvalidParams


class Elsewhere(ValueError):
    """A message names a file outside the folder."""


class Languages:
    """Language servers, one for each page, and a spare one, so that the next page need not wait."""

    def __init__(self, folder: Folder) -> None:
        self._folder, self._closed = folder, False
        self._spare: asyncio.Task[asyncio.subprocess.Process] | None = None

    def start(self) -> None:
        """Start the spare one."""
        if self._spare is None and not self._closed:
            self._spare = asyncio.create_task(_start())

    async def serve(self, socket: WebSocket) -> None:
        """Pass messages on, both ways, until one side ends."""
        await socket.accept()
        self.start()
        if self._spare is None:
            return
        spare, self._spare = self._spare, None
        process = await spare
        try:
            await _bridge(socket, process, self._folder)
        finally:
            await _end(process)
            self.start()

    async def close(self) -> None:
        """End the spare one."""
        self._closed = True
        if self._spare is not None:
            await _end(await self._spare)
            self._spare = None


async def _start() -> asyncio.subprocess.Process:
    pipe = asyncio.subprocess.PIPE
    command = (sys.executable, "-m", "scenelang.web.language")
    return await asyncio.create_subprocess_exec(*command, stdin=pipe, stdout=pipe, start_new_session=True)


async def _end(process: asyncio.subprocess.Process) -> None:
    with contextlib.suppress(ProcessLookupError):
        process.kill()
    await process.wait()


async def _bridge(socket: WebSocket, process: asyncio.subprocess.Process, folder: Folder) -> None:
    assert process.stdin is not None
    assert process.stdout is not None
    ways = [
        asyncio.create_task(_up(socket, process.stdin, folder)),
        asyncio.create_task(_down(process.stdout, socket)),
    ]
    try:
        await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for way in ways:
            way.cancel()
        await asyncio.gather(*ways, return_exceptions=True)
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await socket.close()


async def _up(socket: WebSocket, stream: asyncio.StreamWriter, folder: Folder) -> None:
    with contextlib.suppress(WebSocketDisconnect, RuntimeError, KeyError, OSError):
        while True:
            text = await socket.receive_text()
            message: Any = None
            try:
                message = read_json(text.encode())
                data = json.dumps(checked(message, folder)).encode()
            except (ValueError, RecursionError) as error:
                id = message.get("id") if isinstance(message, dict) else None
                if id is not None or not isinstance(message, dict):
                    refusal = {"code": _REFUSED, "message": str(error)}
                    await socket.send_text(json.dumps({"jsonrpc": "2.0", "id": id, "error": refusal}))
                continue
            stream.write(b"Content-Length: %d\r\n\r\n" % len(data) + data)
            await stream.drain()


async def _down(stream: asyncio.StreamReader, socket: WebSocket) -> None:
    with contextlib.suppress(
        WebSocketDisconnect, RuntimeError, OSError, ValueError, asyncio.IncompleteReadError
    ):
        while line := await stream.readline():
            length = _LENGTH.fullmatch(line)
            if length is not None:
                while (await stream.readline()).strip():
                    pass
                await socket.send_text((await stream.readexactly(int(length[1]))).decode())


def checked(message: Any, folder: Folder) -> dict[str, Any]:
    """A message of the page, checked, with the folder and the root of this server.

    Raises:
        Elsewhere: it names a file outside the folder.
        ValueError: it is not a message of the protocol.
    """
    if not isinstance(message, dict):
        raise ValueError("not a message")
    params = message.get("params")
    method = message.get("method")
    if method == "initialize" and isinstance(params, dict):
        uri = folder.path.as_uri()
        options = params.get("initializationOptions")
        params = {key: params[key] for key in ("capabilities", "clientInfo", "locale") if key in params}
        params |= {"processId": None, "rootUri": uri}
        params["workspaceFolders"] = [{"uri": uri, "name": folder.path.name}]
        params["initializationOptions"] = _settings(options, folder)
        return {**message, "params": params}
    if method == "workspace/didChangeConfiguration" and isinstance(params, dict):
        return {**message, "params": {"settings": _settings(params.get("settings"), folder)}}
    if method == "workspace/didChangeWorkspaceFolders":
        raise Elsewhere("the folder is the one that was opened")
    for uri in _uris(params):
        if uri[:5].lower() == "file:":
            place = to_fs_path(uri)
            if not place or not folder.holds(place):
                raise Elsewhere("a file outside the folder")
    return message


def _settings(given: Any, folder: Folder) -> dict[str, Any]:
    """Settings for the language server: those of the page that are allowed, and the root of imports."""
    given = given.get("scenelang", given) if isinstance(given, dict) else {}
    allowed = {key: given[key] for key in ("debounceMs", "inlayHints") if key in given}
    return allowed if folder.root is None else {**allowed, "root": str(folder.root)}


def _uris(value: Any) -> Iterator[str]:
    """Every text that a message has under a key that ends in ``uri``."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if key.lower().endswith("uri") and isinstance(inner, str):
                yield inner
            else:
                yield from _uris(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _uris(inner)


def main() -> None:
    """Serve standard input and output, with as much memory as a drawing may have."""
    from scenelang.drawing.small import thumbnail
    from scenelang.editors.handlers import make_server
    from scenelang.web.worker import limit_memory

    limit_memory()
    logging.basicConfig(level=logging.CRITICAL)
    server = make_server(lambda element: thumbnail(element, 96).encode())
    server.serve(sys.stdin.buffer, sys.stdout.buffer)


if __name__ == "__main__":
    main()
