"""Random edits keep texts in step; what is missing or fails is told, and nothing crashes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.editors.client import PATIENCE_S, Client

EXAMPLES = Path(__file__).parents[2] / "examples"
PIECES = [
    *"{}()[];,.\"'/=#é𝄞\t\n",
    *("\r\n", "let x = ", "square { scale(0.5); }\n", 'import "a.nsg" as b;\n'),
    *("lib.", "/*", "*/", "30deg", "rotate("),
]
FEATURES = ("hover", "completion", "signatureHelp", "definition", "documentHighlight", "prepareRename")
WHOLE = ("documentSymbol", "foldingRange", "documentColor", "documentLink", "semanticTokens/full")


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from(["carousel", "tangram", "gear", "chain"]),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 9), st.sampled_from(PIECES)), min_size=1, max_size=6),
    st.floats(0, 1),
)
def test_random_edits_keep_texts_in_step_and_crash_nothing(
    lasting: Client, name: str, edits: list[tuple[float, int, str]], where: float
) -> None:
    client = lasting
    uri = client.open(f"untitled:{name}", (EXAMPLES / f"{name}.nsg").read_text("utf-8"))
    document = {"textDocument": {"uri": uri}}
    for share, length, new in edits:
        text = client.texts[uri]
        start = round(share * len(text))
        end = min(start + length, len(text))
        # A position cannot stand between the two characters of a CRLF.
        if "\r" in (text[start - 1 : start], text[end - 1 : end]):
            continue
        client.change(uri, start, end, new)
    if "\r" not in client.texts[uri]:
        whole = client.request(
            "textDocument/selectionRange", {**document, "positions": [{"line": 0, "character": 0}]}
        )
        outer = whole[0]
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
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == 2
    assert done.stderr.strip() == "Error: the language server needs pygls: pip install 'scenelang[lsp]'"


def test_a_log_is_written_where_asked(tmp_path: Path) -> None:
    log = tmp_path / "server.log"
    client = Client(command=[sys.executable, "-m", "scenelang", "lsp", "--stdio", "--log", str(log)])
    try:
        assert client.stop() == 0
        assert "INFO" in log.read_text("utf-8")
    finally:
        client.kill()


def test_an_internal_error_is_logged_and_the_answer_empty(tmp_path: Path) -> None:
    code = (
        "import scenelang.editors.hover as hover\n"
        "def broken(*_): raise RuntimeError('on purpose')\n"
        "hover.hover = broken\n"
        "from scenelang.cli.main import main\n"
        "main(['lsp'])"
    )
    client = Client(command=[sys.executable, "-c", code])
    try:
        uri = client.open("untitled:a", "let a = 1;\n")
        answer: Any = client.request("textDocument/hover", client.at(uri, "let", 1))
        assert answer is None
        client.request("textDocument/documentSymbol", {"textDocument": {"uri": uri}})
        assert "on purpose" in client.logged[-1]["message"]
        assert client.stop() == 0
    finally:
        client.kill()
