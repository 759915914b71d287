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
from typing import Any, Final

from pygls.uris import to_fs_path
from starlette.websockets import WebSocket, WebSocketDisconnect

from scenelang.assets.files import read_json
from scenelang.web.folder import Folder

_LENGTH: Final = re.compile(rb"Content-Length: *(\d{1,9})\r\n", re.IGNORECASE)
_REFUSED: Final = -32602  # the protocol's InvalidParams


async def serve_language(socket: WebSocket, folder: Folder) -> None:
    """Pass messages between a page and a process of its own, until one side ends."""
    await socket.accept()
    pipe = asyncio.subprocess.PIPE
    command = (sys.executable, "-m", "scenelang.web.language")
    process = await asyncio.create_subprocess_exec(*command, stdin=pipe, stdout=pipe, start_new_session=True)
    assert process.stdin is not None
    assert process.stdout is not None
    ways = [
        asyncio.create_task(_up(socket, process.stdin, folder)),
        asyncio.create_task(_down(process.stdout, socket)),
    ]
    try:
        await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        for way in ways:
            way.cancel()
        await asyncio.gather(*ways, process.wait(), return_exceptions=True)
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
            if (length := _LENGTH.fullmatch(line)) is not None:
                while (await stream.readline()).strip():
                    pass
                await socket.send_text((await stream.readexactly(int(length[1]))).decode())


def checked(message: Any, folder: Folder) -> dict[str, Any]:
    """A message of the page, with the folder and the root of this server.

    Raises ValueError where it is not one of the protocol, or names a file outside the folder.
    """
    if not isinstance(message, dict):
        raise ValueError("not a message")
    params = message.get("params")
    method = message.get("method")
    if method == "initialize" and isinstance(params, dict):
        uri = folder.path.as_uri()
        passed = {key: params[key] for key in ("capabilities", "clientInfo", "locale") if key in params}
        passed |= {"processId": None, "rootUri": uri}
        passed["workspaceFolders"] = [{"uri": uri, "name": folder.path.name}]
        passed["initializationOptions"] = _settings(params.get("initializationOptions"), folder)
        return {**message, "params": passed}
    if method == "workspace/didChangeConfiguration" and isinstance(params, dict):
        return {**message, "params": {"settings": _settings(params.get("settings"), folder)}}
    if method == "workspace/didChangeWorkspaceFolders":
        raise ValueError("the folder is the one that was opened")
    _check_places(params, folder)
    return message


def _settings(given: Any, folder: Folder) -> dict[str, Any]:
    """Settings for the language server: those of the page that are allowed, and the root of imports."""
    given = given.get("scenelang", given) if isinstance(given, dict) else {}
    allowed = {key: given[key] for key in ("debounceMs", "inlayHints") if key in given}
    return allowed if folder.root is None else {**allowed, "root": str(folder.root)}


def _check_places(value: Any, folder: Folder) -> None:
    """Raise ValueError where a text under a key that ends in ``uri`` leads out of the folder."""
    for key, inner in value.items() if isinstance(value, dict) else ():
        if key.lower().endswith("uri") and isinstance(inner, str):
            place = to_fs_path(inner) if inner[:5].lower() == "file:" else None
            if inner[:5].lower() == "file:" and not (place and folder.holds(place)):
                raise ValueError("a file outside the folder")
    for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        _check_places(inner, folder)


def main() -> None:
    """Serve standard input and output, with as much memory as a drawing may have."""
    from scenelang.drawing.small import thumbnail
    from scenelang.editors.server import make_server
    from scenelang.web.pool import limit_memory

    limit_memory()
    logging.basicConfig(level=logging.CRITICAL)
    server = make_server(lambda element: thumbnail(element, 96).encode())
    server.start_io(sys.stdin.buffer, sys.stdout.buffer)


if __name__ == "__main__":
    main()
