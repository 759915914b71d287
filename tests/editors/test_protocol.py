"""The protocol itself: sessions, encodings, texts in step; what is missing is told, nothing crashes."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import time
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from scenelang.editors.workspace import MAX_TEXT, ClientSettings
from tests.editors.client import PATIENCE_S, Client, Json

ASTRAL = '/* 𝄞 é */ let\ta = "𝄞𝄞"; let b = #d33; squar { }\n'


def test_sessions_that_end_without_shutdown() -> None:
    with Client(encoding="utf-8") as client:
        positions_count(client)
        client.notify("exit", None)
        assert client.process.wait(PATIENCE_S) == 1
    with Client(encoding="utf-32") as client:
        positions_count(client)
        assert client.process.stdin is not None
        client.process.stdin.close()
        client.process.wait(PATIENCE_S)


def positions_count(client: Client) -> None:
    """Check that places mean what they mean to the client, before and after edits."""
    assert client.capabilities["positionEncoding"] == client.encoding
    uri = client.open("untitled:astral", ASTRAL)
    (found,) = (d for d in client.diagnostics(uri) if d["code"] == "E0204")
    assert client.shown(uri, found["range"]) == "squar"
    at = ASTRAL.index("𝄞𝄞") + 1
    for start, end, new in ((at, at, ""), (at, at + 1, "é𝄞x"), (0, 0, "𝄞")):
        client.change(uri, start, end, new)
        (colour,) = client.request("textDocument/documentColor", {"textDocument": {"uri": uri}})
        assert client.shown(uri, colour["range"]) == "#d33"


def test_positions_count_what_was_agreed_on(client: Client) -> None:
    positions_count(client)


def test_documents_that_are_not_there_get_empty_answers(client: Client) -> None:
    document = {"textDocument": {"uri": "file:///nowhere/at/all.nsg"}}
    at = {**document, "position": {"line": 0, "character": 0}}
    assert client.request("textDocument/hover", at) is None
    assert client.request("textDocument/documentSymbol", document) == []
    options = {"options": {"tabSize": 2, "insertSpaces": True}}
    assert client.request("textDocument/formatting", {**document, **options}) is None
    change = {"textDocument": {**document["textDocument"], "version": 2}, "contentChanges": [{"text": "x"}]}
    client.notify("textDocument/didChange", change)
    client.notify("textDocument/didClose", document)
    client.notify("some/unknownNotification", {})
    assert "unknownRequest" in client.refused("some/unknownRequest", {})


def test_positions_and_pauses_that_are_none_are_refused(client: Client) -> None:
    uri = client.open("untitled:places", "let a = 1;\n")
    for place in ({"line": -1, "character": 0}, {"line": 0, "character": 1 << 40}, None, "x"):
        for method in ("hover", "completion", "definition"):
            params = {"textDocument": {"uri": uri}, "position": place}
            assert "Invalid" in client.refused(f"textDocument/{method}", params)
    for pause in (1e300, 10**400, float("nan"), float("inf"), -1, 60_001, True, False, "7", None):
        assert ClientSettings.read({"debounceMs": pause}) == ClientSettings(), pause
    assert ClientSettings.read({"debounceMs": 60_000}).debounce_ms == 60_000


HELD = """
import sys, time
from collections.abc import Iterator
from pathlib import Path
from scenelang.cli.main import main
from scenelang.editors import server
check, begun, gate = server.check, Path(sys.argv[1]), Path(sys.argv[2])
def held(*given):
    begun.touch()
    while not gate.exists():
        time.sleep(0.005)
    return check(*given)
server.check = held
main(["lsp"])
"""
"""A server whose checks wait until a file is there."""


def test_typing_goes_on_while_a_scene_is_evaluated(tmp_path: Path) -> None:
    """The evaluation ends after the answers, whatever they take."""
    begun, gate = tmp_path / "begun", tmp_path / "gate"
    command = [sys.executable, "-c", HELD, str(begun), str(gate)]
    with Client(options={"debounceMs": 0}, command=command) as client:
        uri = client.open("untitled:a", "let a = 1;\nsquare { rotate(30); }\n")
        assert client.next_diagnostics(uri) == []
        end = time.monotonic() + PATIENCE_S
        while not begun.exists():
            assert time.monotonic() < end, "nothing is evaluated"
            time.sleep(0.005)
        client.change(uri, 0, 0, "let ;\n")
        assert [d["code"] for d in client.next_diagnostics(uri)] == ["E0110"]
        assert client.request("textDocument/completion", client.at(uri, "let a", 0))
        client.change(uri, 0, 6, "// a\n")
        assert client.next_diagnostics(uri) == []
        gate.touch()
        assert [d["code"] for d in client.diagnostics(uri)] == ["W0201", "E0302"]
        versions = [found["version"] for found in client.published[uri]]
        assert versions == [1, 2, 3, 3], "a check of a text that had changed was published"
        assert client.stop() == 0


def test_a_long_evaluation_is_dropped_when_its_text_has_changed(client: Client) -> None:
    slow = "fn f(n) = n > 0 ? f(n - 1) + f(n - 2) : 0;\nlet a = f(23);\n"
    slow += "for (i in 0..<300) { for (j in 0..<300) { square { scale(0.5); } } }\n"
    uri = client.open("untitled:slow", slow)
    client.change(uri, 0, 0, "// a\n")
    client.request("textDocument/completion", client.at(uri, "let a", 0))
    client.replace(uri, "square { rotate(30); }\n")
    assert [d["code"] for d in client.diagnostics(uri)] == ["E0302"]


def test_a_text_beyond_the_limit_is_refused_at_once(client: Client) -> None:
    client.replace(client.open("untitled:long", "square { }\n"), "square { }\n" * (MAX_TEXT // 11 + 1))
    uri = client.open("untitled:longer", client.texts["untitled:long"])
    for name in ("untitled:long", uri):
        while [d["code"] for d in client.next_diagnostics(name)] != ["E0324"]:
            pass
    client.close("untitled:long")
    client.replace(uri, "squar { }\n")
    assert [d["code"] for d in client.diagnostics(uri)] == ["E0204"]
    assert client.request("textDocument/documentSymbol", {"textDocument": {"uri": uri}})


def test_a_port_serves_as_well_as_pipes() -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "scenelang", "lsp", "--tcp", str(port)]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    end = time.monotonic() + PATIENCE_S
    try:
        with socket.socket() as connection:
            while connection.connect_ex(("127.0.0.1", port)):
                assert process.poll() is None, "the server ended"
                assert time.monotonic() < end, "nobody listens"
                time.sleep(0.05)
            connection.settimeout(PATIENCE_S)
            params: Json = {"processId": None, "rootUri": None, "capabilities": {}}
            data = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": params})
            connection.sendall(f"Content-Length: {len(data)}\r\n\r\n{data}".encode())
            answer = b""
            while b'"serverInfo":' not in answer:
                more = connection.recv(1 << 16)
                assert more, answer
                answer += more
    finally:
        process.kill()
        process.wait(PATIENCE_S)


EXAMPLES = Path(__file__).parents[2] / "examples"
PIECES = [
    *("let x = ", "square { scale(0.5); }\n", 'import "a.nsg" as b;\n', "lib.", "30deg", "rotate("),
    *("/*", "*/", *"{}()[];,.\"'/=#é𝄞\t\n"),
]
FEATURES = ("hover", "completion", "signatureHelp", "definition", "documentHighlight", "prepareRename")
WHOLE = ("documentSymbol", "foldingRange", "documentColor", "documentLink", "semanticTokens/full")


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from(["carousel", "tangram", "gear", "chain"]),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 9), st.sampled_from(PIECES)), min_size=1, max_size=6),
    st.floats(0, 1),
)
def test_random_edits_keep_texts_in_step_and_crash_nothing(
    client: Client, name: str, edits: list[tuple[float, int, str]], where: float
) -> None:
    uri = client.open(f"untitled:{name}", (EXAMPLES / f"{name}.nsg").read_text("utf-8"))
    document = {"textDocument": {"uri": uri}}
    for share, length, new in edits:
        size = len(client.texts[uri])
        start = round(share * size)
        client.change(uri, start, min(start + length, size), new)
    start_of = {**document, "positions": [{"line": 0, "character": 0}]}
    (outer,) = client.request("textDocument/selectionRange", start_of)
    while outer.get("parent"):
        outer = outer["parent"]
    assert client.shown(uri, outer["range"]) == client.texts[uri]
    colours = client.request("textDocument/documentColor", document)
    assert all(client.shown(uri, c["range"])[:1] in "#[rh" for c in colours)
    line = client.texts[uri].count("\n")
    at = {**document, "position": {"line": round(where * line), "character": 3}}
    for feature in FEATURES:
        client.answer(client.start(f"textDocument/{feature}", at))
    for feature in WHOLE:
        client.request(f"textDocument/{feature}", document)
    place = {"start": {"line": 0, "character": 0}, "end": {"line": line + 1, "character": 0}}
    client.request("textDocument/inlayHint", {**document, "range": place})
    client.request("textDocument/codeAction", {**document, "range": place, "context": {"diagnostics": []}})
    client.close(uri)


def test_a_missing_library_is_one_line_that_says_what_to_do() -> None:
    code = "import sys; sys.modules['pygls'] = None\nfrom scenelang.cli.main import main\nmain(['lsp'])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.strip() == "Error: the language server needs pygls: pip install 'scenelang[lsp]'"


def test_an_internal_error_is_logged_and_the_answer_empty(tmp_path: Path) -> None:
    log = tmp_path / "server.log"
    code = (
        "import sys\nfrom scenelang.editors import navigation\n"
        "def broken(*_): raise RuntimeError('on purpose')\n"
        "navigation.hover = broken\n"
        "from scenelang.cli.main import main\n"
        "main(['lsp', '--stdio', '--log', sys.argv[1]])"
    )
    with Client(command=[sys.executable, "-c", code, str(log)]) as client:
        uri = client.open("untitled:a", "let a = 1;\n")
        assert client.request("textDocument/hover", client.at(uri, "let", 1)) is None
        client.request("textDocument/documentSymbol", {"textDocument": {"uri": uri}})
        assert "on purpose" in client.logged[-1]["message"]
        assert client.stop() == 0
    assert "INFO" in log.read_text("utf-8")
    assert "on purpose" in log.read_text("utf-8")
