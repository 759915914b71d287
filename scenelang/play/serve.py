"""Serving a folder on a port until Ctrl-C."""

from __future__ import annotations

import errno
import logging
import secrets
import socket
import threading
import webbrowser
from collections.abc import Callable
from typing import Final

import uvicorn

from scenelang.play.app import make_app
from scenelang.play.guard import LOCAL, Guard, is_loopback
from scenelang.play.shared import Play

PORT: Final = 8766
MOST_MESSAGE: Final = 1 << 25
"""Bytes of a message of the page: the largest text, each character of which may be escaped."""
_LEAVE_S: Final = 2


class PortTaken(OSError):
    """The port that was asked for cannot be had."""


def listen(host: str, port: int | None) -> socket.socket:
    """A listening socket: on the port, or on `PORT` or any other that is free.

    Raises:
        PortTaken: it cannot be had.
        OSError: there is no such address here.
    """
    wanted = (PORT, 0) if port is None else (port,)
    for number in wanted:
        try:
            family = socket.getaddrinfo(host, number, type=socket.SOCK_STREAM)[0][0]
            return socket.create_server((host, number), family=family)
        except OSError as error:
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                raise OSError(error.errno, f"cannot listen on `{host}`: {error.strerror or error}") from None
            if number == wanted[-1]:
                reason = "is in use" if error.errno == errno.EADDRINUSE else "may not be used"
                raise PortTaken(error.errno, f"port {number} of {host} {reason}") from None
    raise AssertionError


def serve(
    play: Play, host: str, port: int | None, *, browser: bool, say: Callable[[str], None] = print
) -> None:
    """Serve until Ctrl-C, which is raised again when everything has ended.

    Args:
        host: an address or name of this machine.
        port: None for any.
        browser: open the page.
        say: told the address.

    Raises:
        OSError: as `listen`.
    """
    token = secrets.token_urlsafe(32)
    with listen(host, port) as listener:
        number = listener.getsockname()[1]
        local = is_loopback(host)
        hosts = () if local else (host, socket.gethostname())
        guard = Guard(make_app(play), token, hosts, anywhere=not local)
        name = host if local or host not in ("0.0.0.0", "::", "") else LOCAL[1]
        name = f"[{name}]" if ":" in name else name
        config = uvicorn.Config(
            guard,
            log_level=logging.WARNING,
            access_log=False,  # which would hold the token
            server_header=False,
            http="h11",
            ws="websockets-sansio",
            ws_max_size=MOST_MESSAGE,
            ws_per_message_deflate=False,
            lifespan="on",
            timeout_graceful_shutdown=_LEAVE_S,
        )
        say(f"http://{name}:{number}/{token}/")
        if browser:
            address = f"http://{name}:{number}{guard.once}"
            threading.Timer(0.3, webbrowser.open, (address,)).start()
        uvicorn.Server(config).run(sockets=[listener])
