"""From the command line: ports, addresses, Ctrl-C, and nothing that stays."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from click.testing import CliRunner

import scenelang as nsg
from scenelang.cli.main import cli
from scenelang.web.server import PORT, listen
from tests.play.client import Server, below, is_there
from tests.play.conftest import SQUARE


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_it_ends_with_all_its_processes(tmp_path: Path, how: signal.Signals) -> None:
    (tmp_path / "a.nsg").write_text(SQUARE)
    with (
        Server(tmp_path, tmp_path / ".state") as server,
        server.page() as page,
        server.connect("lsp"),
    ):
        page.open("a.nsg")
        page.say("edit", file="a.nsg", version=1, text="for (i in 0..3000) { for (j in 0..3000) { } }")
        page.draw(1, "a.nsg", by="reference")
        processes = below(server.process.pid)
        assert len(processes) >= 5  # of both pools one, what forks them, and language servers
        code = server.end(how)
    assert code == {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGKILL: -9}[how]
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


def test_a_scene_that_is_not_there_is_made(tmp_path: Path) -> None:
    new = tmp_path / "new.nsg"
    with Server(new, tmp_path / ".state"):
        assert [d.severity for d in nsg.check(new)] == []
    new.write_text("star;")
    with Server(new, tmp_path / ".state"):
        assert new.read_text() == "star;"


@pytest.mark.parametrize("missing", ["starlette", "uvicorn", "watchfiles", "pygls"])
def test_what_is_missing_is_told(missing: str) -> None:
    code = f"import sys; sys.modules['{missing}'] = None\nfrom scenelang.cli.main import main\nmain(['play'])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "pip install 'scenelang[play]'" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_files_of_the_package_and_no_others(server: Server) -> None:
    """Static files: the page's and the viewer's, whatever else a path says."""

    def get(path: str) -> int:
        try:
            with urllib.request.urlopen(f"{server.url}{path}") as answer:
                return int(answer.status)
        except urllib.error.HTTPError as error:
            with error:
                return error.code

    assert get("static/viewer/gl.js") == get("static/codemirror.js") == 200
    for path in (
        *(
            "static/../app.py",
            "static/%2e%2e/app.py",
            "static/viewer/../view.py",
            "static/viewer/%2e%2e%2fa.py",
        ),
        *("static//etc/passwd", "static/..%5capp.py", "static/web", "static/", "static/.", "static/viewer"),
        *("static/play.js%00.py", "static/viewer/gl.js/x", "app.py", "download", "download?key=", "live"),
    ):
        assert get(path) in (403, 404, 405), path
