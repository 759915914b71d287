"""Who may ask; ports, addresses and Ctrl-C; the editor that is served is what its lock file says."""

from __future__ import annotations

import asyncio
import json
import re
import signal
import socket
import subprocess
import sys
import time
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

import pytest
from click.testing import CliRunner
from starlette.applications import Starlette
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import PlainTextResponse
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

import scenelang as nsg
from scenelang.cli.main import cli
from scenelang.web import server as serving
from scenelang.web.server import HEADERS, PORT, Guard, is_loopback, listen, policy
from tests.play.client import Server, below, is_there
from tests.play.conftest import SQUARE


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_it_ends_with_all_its_processes(tmp_path: Path, how: signal.Signals) -> None:
    (tmp_path / "a.nsg").write_text(SQUARE)
    with Server(tmp_path, tmp_path / ".state") as server, server.page() as page, server.connect("lsp"):
        page.open("a.nsg")
        page.say("edit", file="a.nsg", version=1, text="for (i in 0..3000) { for (j in 0..3000) { } }")
        page.draw(1, "a.nsg", by="reference")
        processes = below(server.process.pid)
        assert len(processes) >= 5  # of both pools one, what forks them, and language servers
        code = server.end(how)
    assert code == {signal.SIGINT: 130, signal.SIGKILL: -9}[how]
    while any(map(is_there, processes)):
        time.sleep(0.05)
    assert [path.name for path in tmp_path.iterdir() if path.name != ".state"] == ["a.nsg"]


def test_a_port_in_use() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        found = CliRunner().invoke(cli, ["play", "--no-browser", "--port", str(port)])
        assert found.exit_code == 2
        assert f"port {port} of 127.0.0.1 is in use" in found.output
    with listen("127.0.0.1", None) as first, listen("127.0.0.1", None) as second:
        assert second.getsockname()[1] not in (PORT, first.getsockname()[1])
        assert second.getsockname()[0] == "127.0.0.1"


def test_what_cannot_be_served(tmp_path: Path) -> None:
    for arguments, message in (
        (["none/none.nsg"], "there is neither a scene nor a folder"),
        ([str(tmp_path), "--host", "192.0.2.1"], "cannot listen on `192.0.2.1`"),
        ([str(tmp_path), "--host", "192.0.2.1"], "other machines reach 192.0.2.1"),
        ([str(tmp_path), "--host", "no.such.host.invalid"], "cannot listen on `no.such.host.invalid`"),
        ([str(tmp_path), "--port", "0"], "not in the range"),
    ):
        found = CliRunner().invoke(cli, ["play", "--no-browser", *arguments])
        assert (found.exit_code, message in found.output) == (2, True), found.output


def test_a_scene_that_is_not_there_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serving, "serve", lambda *_, **__: None)
    new = tmp_path / "new.nsg"
    assert CliRunner().invoke(cli, ["play", str(new)]).output.startswith("Made ")
    assert not [*nsg.check(new)]
    new.write_text("star;")
    assert CliRunner().invoke(cli, ["play", str(new)]).exit_code == 0
    assert new.read_text() == "star;"


def test_what_is_missing_is_told() -> None:
    names = ["starlette", "uvicorn", "watchfiles", "pygls"]
    code = f"""
import contextlib, sys
from scenelang.cli.main import main
for name in {names}:
    sys.modules[name] = None
    with contextlib.suppress(SystemExit):
        main(["play"])
    del sys.modules[name]
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    lines = done.stderr.splitlines()
    assert [line.split()[3].split(".")[0].rstrip(":") for line in lines] == names, lines
    assert all("pip install 'scenelang[play]'" in line for line in lines)


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


PAGE = f"/{TOKEN}/"
FINE: list[tuple[str, dict[str, Any], int]] = [
    (PAGE, {}, 200),
    (f"{PAGE}static/play.js", {"origin": f"http://{HERE}", "sec_fetch_site": "same-origin"}, 200),
    (f"/static/play.js?token={TOKEN}", {}, 200),
    *((PAGE, {"host": host}, 200) for host in ("localhost:8766", "[::1]:8766", "LOCALHOST")),
    (f"/{TOKEN}", {}, 303),
    (f"/?token={TOKEN}", {}, 303),
]
PATHS = ("/", f"/{TOKEN[:-1]}/", f"/{TOKEN}t/", f"/{TOKEN.upper()}/", "/%C3%A9%ED%A0%80/", f"//{TOKEN}/")
PATHS += ("/static/play.js?token=", f"/static/play.js?token={TOKEN}x", "/open/None", "/open/")
HOSTS = ("evil.example", "evil.example:8766", "127.0.0.1.evil.example:8766", "localhost.evil.example")
HOSTS += ("192.168.1.7:8766", "127.0.0.1:8766:1", "", [], [HERE, "evil.example"])  # type: ignore[assignment]
ORIGINS = ("http://evil.example", "null", [f"http://{HERE}", "http://evil.example"], f"https://{HERE}")
ORIGINS += ("http://127.0.0.1:9999", "http://localhost:8766", f"http://{HERE}.evil.example")
REFUSED: list[tuple[str, dict[str, Any], int]] = [
    *((path, {}, 403) for path in PATHS),
    *((PAGE, {"host": host}, 403) for host in HOSTS),
    *((PAGE, {"origin": origin}, 403) for origin in ORIGINS),
    *((PAGE, {"sec_fetch_site": site}, 403) for site in ("cross-site", "same-site")),
]


def test_requests() -> None:
    for path, headers, code in [*FINE, *REFUSED]:
        found = ask(guard(), path, **headers)
        assert found.code == code, (path, headers)
        assert {name: found.headers[name] for name in HEADERS} == HEADERS
        assert "default-src 'none'" in found.headers["content-security-policy"]
        assert "set-cookie" not in found.headers
        if code == 403:
            assert TOKEN not in found.text + str(found.headers)
        if code == 303:
            assert found.headers["location"] == PAGE
    assert ask(guard(), f"{PAGE}static/viewer/gl.js").text == "/static/viewer/gl.js"


def test_a_browser_is_led_to_the_page_once() -> None:
    guarded = guard()
    way = guarded.once
    assert TOKEN not in way
    assert ask(guarded, way, host="evil.example").code == 403
    assert ask(guarded, way).headers["location"] == f"/{TOKEN}/"
    assert ask(guarded, way).code == 403
    assert ask(guarded, guarded.once).code == 403


def test_websockets() -> None:
    here, evil = f"http://{HERE}", "http://evil.example"
    for path, headers in (
        (f"{PAGE}live", {}),  # no origin at all
        (f"{PAGE}live", {"origin": evil}),
        (f"{PAGE}live", {"origin": "null"}),
        (f"{PAGE}live", {"origin": here, "host": "evil.example"}),
        (f"{PAGE}live", {"origin": evil, "host": "evil.example"}),
        (f"{PAGE}live", {"origin": here, "sec_fetch_site": "cross-site"}),
        ("/live", {"origin": here}),
        ("/live?token=x", {"origin": here}),
    ):
        assert ask(guard(), path, "websocket", **headers).code == 403, (path, headers)
    for path in (f"{PAGE}live", f"/live?token={TOKEN}"):
        assert ask(guard(), path, "websocket", origin=here).code == 101, path


def test_a_server_for_others_has_names_and_numbers() -> None:
    known = guard(hosts=("box.local",), anywhere=True)
    for host, code in (("10.0.0.7:8766", 200), ("[fe80::1]:8766", 200), ("box.local", 200)):
        assert ask(known, PAGE, host=host).code == code, host
    for host in ("evil.example", "10"):
        assert ask(known, PAGE, host=host).code == 403, host


def test_the_page_can_load_nothing_from_elsewhere() -> None:
    parts = dict(part.strip().split(" ", 1) for part in policy("abc", HERE).split(";"))
    assert parts["default-src"] == "'none'"
    assert parts["script-src"] == "'self'"
    assert parts["connect-src"] == f"'self' ws://{HERE}"
    assert "unsafe" not in policy("abc", HERE)
    assert all(map(is_loopback, ("127.0.0.1", "localhost", "127.9.9.9")))
    assert not any(map(is_loopback, ("0.0.0.0", "8.8.8.8")))


ROOT = Path(__file__).parents[2]
SOURCE, WEB = ROOT / "editors/playground", ROOT / "scenelang/web/editor"


def test_the_bundle_is_made_of_the_locked_packages() -> None:
    head, _, code = (WEB / "codemirror.js").read_text("utf-8").partition(" */\n")
    said = dict(line.split() for line in head.splitlines()[1:])
    for name in ("package-lock.json", "codemirror.js"):
        assert said.pop(name) == sha256((SOURCE / name).read_bytes()).hexdigest(), "run build.mjs again"
    assert said.pop("code") == sha256(code.encode()).hexdigest(), "the bundle was changed by hand"
    locked = json.loads((SOURCE / "package-lock.json").read_text("utf-8"))["packages"]
    assert said == {name: locked[f"node_modules/{name}"]["version"] for name in said}
    assert said.keys() >= {*re.findall(r'from "(.+)"', (SOURCE / "codemirror.js").read_text("utf-8"))}
    licences = (WEB / "codemirror.LICENSE.txt").read_text("utf-8")
    assert all(f"{name} {number} (MIT)" in licences for name, number in said.items())
    assert licences.count("Permission is hereby granted") == len(said)


def test_scenes_to_start_from_are_the_examples() -> None:
    shipped = sorted((WEB / "examples").glob("*.nsg"))
    assert shipped
    for path in shipped:
        assert path.read_bytes() == (ROOT / "examples" / path.name).read_bytes()
