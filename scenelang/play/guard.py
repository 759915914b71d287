"""Who may ask: the token, the host, the origin; and what every answer says to the browser.

The page is on this machine, and so is whatever else the browser shows. Another site's page can send requests
here, and by a name that it has point at 127.0.0.1 even read the answers, but knows no token, cannot choose
the ``Host`` of a name that is not its own, and cannot hide its ``Origin``.
"""

from __future__ import annotations

import ipaddress
import secrets
import socket
from collections.abc import Iterable
from typing import Final
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LOCAL: Final = ("localhost", "127.0.0.1", "::1")
HEADERS: Final = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
_NOTHING: Final = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
_REFUSED: Final = "Refused: open the address that `scenelang play` has printed.\n"


def policy(nonce: str, host: str) -> str:
    """The content policy of the page; ``host`` is its own, with the port."""
    return (
        f"{_NOTHING}; script-src 'self'; style-src 'self' 'nonce-{nonce}'; img-src 'self' data: blob:; "
        f"connect-src 'self' ws://{host}"
    )


class Guard:
    """Lets requests through that have the token, come from the page itself and name this machine.

    Args:
        app: what answers; the token is taken off its paths.
        token: what the page's address holds.
        hosts: names by which this machine may be called, besides those of its loopback.
        anywhere: any number of an address is a name of it: it serves others too.
    """

    def __init__(self, app: ASGIApp, token: str, hosts: Iterable[str] = (), anywhere: bool = False) -> None:
        self._app, self._token, self._anywhere = app, token, anywhere
        self._hosts = {*LOCAL, *(host.lower() for host in hosts)}
        self._once: str | None = secrets.token_urlsafe(16)

    @property
    def once(self) -> str:
        """A path that leads to the page once: a browser's command line, which others may read, gets this."""
        return f"/open/{self._once}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return

        async def answer(message: Message) -> None:
            if message["type"] in ("http.response.start", "websocket.accept"):
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers[name] = value
                headers.setdefault("Content-Security-Policy", _NOTHING)
            await send(message)

        if self._knows(scope):
            path, query = scope["path"], parse_qs(scope["query_string"].decode("latin-1"))
            first, _, rest = path.removeprefix("/").partition("/")
            if self._once and _same(path, self.once):
                self._once = None
                await RedirectResponse(f"/{self._token}/", 303)(scope, receive, answer)
                return
            if _same(first, self._token) and path != f"/{first}":
                inner = {**scope, "path": f"/{rest}", "raw_path": None}
                await self._app(inner, receive, answer)
                return
            if _same(first, self._token) or (path == "/" and _same(query.get("token", [""])[0], self._token)):
                await RedirectResponse(f"/{self._token}/", 303)(scope, receive, answer)
                return
            if _same(query.get("token", [""])[0], self._token):
                await self._app(scope, receive, answer)
                return
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            await PlainTextResponse(_REFUSED, 403)(scope, receive, answer)

    def _knows(self, scope: Scope) -> bool:
        """Whether a request names this machine and no other page sent it."""
        headers = Headers(scope=scope)
        host, origin, site = headers.getlist("host"), headers.getlist("origin"), headers.get("sec-fetch-site")
        if len(host) != 1 or not self._is_here(host[0]) or len(origin) > 1:
            return False
        if scope["type"] == "websocket" and not origin:
            return False
        if site not in (None, "same-origin", "none"):
            return False
        return not origin or origin[0].lower() == f"http://{host[0].lower()}"

    def _is_here(self, host: str) -> bool:
        """Whether a ``Host`` is a name of this machine; the port is in the origin."""
        name, _, port = host.lower().rpartition(":") if not host.endswith("]") else (host, "", "")
        name = name if port.isascii() and port.isdigit() else host.lower()
        name = name[1:-1] if name.startswith("[") and name.endswith("]") else name
        if name in self._hosts:
            return True
        try:
            return self._anywhere and bool(ipaddress.ip_address(name))
        except ValueError:
            return False


def _same(one: str, other: str) -> bool:
    """Whether two texts are the same, in a time that does not tell how much of them is."""
    return secrets.compare_digest(one.encode("utf-8", "replace"), other.encode())


def is_loopback(host: str) -> bool:
    """Whether nobody but this machine reaches an address."""
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        return False
    return all(ipaddress.ip_address(str(place[4][0]).partition("%")[0]).is_loopback for place in found)
