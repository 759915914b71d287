"""Who may ask: nobody without the token, no other page, no name that is not this machine's."""

from __future__ import annotations

import asyncio
from typing import Any, NamedTuple
from urllib.parse import unquote

import pytest
from starlette.applications import Starlette
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import PlainTextResponse
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from scenelang.web.server import HEADERS, Guard, is_loopback, policy

TOKEN, HERE = "t" * 43, "127.0.0.1:8766"


async def answer(request: Request) -> PlainTextResponse:
    return PlainTextResponse(request.url.path)


async def hold(socket: WebSocket) -> None:
    await socket.accept()


def guard(**options: Any) -> Guard:
    routes = [Route("/{rest:path}", answer), WebSocketRoute("/live", hold)]
    return Guard(Starlette(routes=routes), TOKEN, **options)


class Answer(NamedTuple):
    code: int  # of a websocket 101 where it is accepted
    headers: Headers
    text: str


def ask(guarded: Guard, address: str, kind: str = "http", **headers: str | list[str]) -> Answer:
    """What a guard answers; a header may be there several times."""
    path, _, query = address.partition("?")
    given = {"host": HERE, **{name.replace("_", "-"): value for name, value in headers.items()}}
    pairs = [(k, one) for k, v in given.items() for one in ([v] if isinstance(v, str) else v)]
    scope: dict[str, Any] = {
        "type": kind,
        "path": unquote(path, errors="surrogateescape"),
        "query_string": query.encode(),
        "headers": [(name.encode(), value.encode("latin-1")) for name, value in pairs],
        **({"method": "GET"} if kind == "http" else {"subprotocols": []}),
    }
    sent: list[Any] = []

    async def receive() -> Any:
        return {"type": "websocket.connect" if kind == "websocket" else "http.request"}

    async def send(message: Any) -> None:
        sent.append(message)

    asyncio.run(guarded(scope, receive, send))
    first = sent[0]
    code = first.get("status") or (101 if first["type"] == "websocket.accept" else 403)
    text = b"".join(message.get("body", b"") for message in sent).decode()
    return Answer(code, Headers(raw=list(first.get("headers", ()))), text)


@pytest.mark.parametrize(
    ("path", "headers", "code"),
    [
        (f"/{TOKEN}/", {}, 200),
        (f"/{TOKEN}/static/play.js", {"origin": f"http://{HERE}", "sec_fetch_site": "same-origin"}, 200),
        (f"/static/play.js?token={TOKEN}", {}, 200),
        (f"/{TOKEN}/", {"host": "localhost:8766"}, 200),
        (f"/{TOKEN}/", {"host": "[::1]:8766"}, 200),
        (f"/{TOKEN}/", {"host": "LOCALHOST"}, 200),
        (f"/{TOKEN}", {}, 303),
        (f"/?token={TOKEN}", {}, 303),
        # the token
        ("/", {}, 403),
        (f"/{TOKEN[:-1]}/", {}, 403),
        (f"/{TOKEN}t/", {}, 403),
        (f"/{TOKEN.upper()}/", {}, 403),
        ("/%C3%A9%ED%A0%80/", {}, 403),
        ("/static/play.js?token=", {}, 403),
        (f"/static/play.js?token={TOKEN}x", {}, 403),
        (f"//{TOKEN}/", {}, 403),
        ("/open/None", {}, 403),
        ("/open/", {}, 403),
        # the host
        (f"/{TOKEN}/", {"host": "evil.example"}, 403),
        (f"/{TOKEN}/", {"host": "evil.example:8766"}, 403),
        (f"/{TOKEN}/", {"host": "127.0.0.1.evil.example:8766"}, 403),
        (f"/{TOKEN}/", {"host": "localhost.evil.example"}, 403),
        (f"/{TOKEN}/", {"host": "192.168.1.7:8766"}, 403),
        (f"/{TOKEN}/", {"host": "127.0.0.1:8766:1"}, 403),
        (f"/{TOKEN}/", {"host": ""}, 403),
        (f"/{TOKEN}/", {"host": []}, 403),
        (f"/{TOKEN}/", {"host": [HERE, "evil.example"]}, 403),
        # the origin
        (f"/{TOKEN}/", {"origin": "http://evil.example"}, 403),
        (f"/{TOKEN}/", {"origin": "null"}, 403),
        (f"/{TOKEN}/", {"origin": [f"http://{HERE}", "http://evil.example"]}, 403),
        (f"/{TOKEN}/", {"origin": f"https://{HERE}"}, 403),
        (f"/{TOKEN}/", {"origin": "http://127.0.0.1:9999"}, 403),
        (f"/{TOKEN}/", {"origin": "http://localhost:8766"}, 403),
        (f"/{TOKEN}/", {"origin": f"http://{HERE}.evil.example"}, 403),
        (f"/{TOKEN}/", {"sec_fetch_site": "cross-site"}, 403),
        (f"/{TOKEN}/", {"sec_fetch_site": "same-site"}, 403),
    ],
)
def test_requests(path: str, headers: dict[str, Any], code: int) -> None:
    found = ask(guard(), path, **headers)
    assert found.code == code
    for name, value in HEADERS.items():
        assert found.headers[name] == value
    assert "default-src 'none'" in found.headers["content-security-policy"]
    assert "set-cookie" not in found.headers
    if code == 403:
        assert TOKEN not in found.text + str(found.headers)
    if code == 303:
        assert found.headers["location"] == f"/{TOKEN}/"


def test_the_token_is_taken_off_the_path() -> None:
    assert ask(guard(), f"/{TOKEN}/static/viewer/gl.js").text == "/static/viewer/gl.js"


def test_a_browser_is_led_to_the_page_once() -> None:
    guarded = guard()
    way = guarded.once
    assert TOKEN not in way
    assert ask(guarded, way, host="evil.example").code == 403
    assert ask(guarded, way).headers["location"] == f"/{TOKEN}/"
    assert ask(guarded, way).code == 403
    assert ask(guarded, guarded.once).code == 403


@pytest.mark.parametrize(
    ("path", "headers"),
    [
        (f"/{TOKEN}/live", {}),  # no origin at all
        (f"/{TOKEN}/live", {"origin": "http://evil.example"}),
        (f"/{TOKEN}/live", {"origin": "null"}),
        (f"/{TOKEN}/live", {"origin": f"http://{HERE}", "host": "evil.example"}),
        (f"/{TOKEN}/live", {"origin": "http://evil.example", "host": "evil.example"}),
        (f"/{TOKEN}/live", {"origin": f"http://{HERE}", "sec_fetch_site": "cross-site"}),
        ("/live", {"origin": f"http://{HERE}"}),
        ("/live?token=x", {"origin": f"http://{HERE}"}),
    ],
)
def test_foreign_websockets_are_refused(path: str, headers: dict[str, str]) -> None:
    assert ask(guard(), path, "websocket", **headers).code == 403


@pytest.mark.parametrize("path", [f"/{TOKEN}/live", f"/live?token={TOKEN}"])
def test_a_websocket_of_the_page(path: str) -> None:
    assert ask(guard(), path, "websocket", origin=f"http://{HERE}").code == 101


@pytest.mark.parametrize(
    ("host", "code"),
    [("10.0.0.7:8766", 200), ("[fe80::1]:8766", 200), ("box.local", 200), ("evil.example", 403), ("10", 403)],
)
def test_a_server_for_others_has_names_and_numbers(host: str, code: int) -> None:
    assert ask(guard(hosts=("box.local",), anywhere=True), f"/{TOKEN}/", host=host).code == code


def test_the_page_can_load_nothing_from_elsewhere() -> None:
    parts = dict(part.strip().split(" ", 1) for part in policy("abc", HERE).split(";"))
    assert parts["default-src"] == "'none'"
    assert parts["script-src"] == "'self'"
    assert parts["connect-src"] == f"'self' ws://{HERE}"
    assert "unsafe" not in policy("abc", HERE)


@pytest.mark.parametrize(
    ("host", "local"),
    [("127.0.0.1", True), ("localhost", True), ("127.9.9.9", True), ("0.0.0.0", False), ("8.8.8.8", False)],
)
def test_what_is_loopback(host: str, local: bool) -> None:
    assert is_loopback(host) is local
