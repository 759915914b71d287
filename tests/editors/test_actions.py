"""Changes of the text that an editor may ask for: fixes and formatting."""

from __future__ import annotations

from typing import Any

from tests.editors.client import Client
from tests.editors.conftest import SCENE


def test_fixes_are_code_actions(client: Client, uri: str) -> None:
    text = "square { rotate(30); scal(0.5) }\nlet spare = 1;\n"
    client.replace(uri, text)
    client.diagnostics(uri)
    at = client.at(uri, "30", 1)["position"]
    params = {
        "textDocument": {"uri": uri},
        "range": {"start": at, "end": at},
        "context": {"diagnostics": [], "only": ["quickfix"]},
    }
    actions = {a["title"]: a for a in client.request("textDocument/codeAction", params)}
    assert all(a["kind"] == "quickfix" for a in actions.values())
    assert client.applied(text, actions["Insert `;`"]["edit"]["changes"][uri]) == text.replace(
        "5) }", "5); }"
    )
    params["context"] = {"diagnostics": [], "only": ["source.fixAll"]}
    (whole,) = client.request("textDocument/codeAction", params)
    assert whole["kind"] == "source.fixAll.scenelang"
    fixed = client.applied(text, whole["edit"]["changes"][uri])
    assert "0.5);" in fixed
    client.replace(uri, fixed)
    client.diagnostics(uri)
    (whole,) = client.request("textDocument/codeAction", params)
    assert "rotate(30deg); scale(0.5);" in client.applied(fixed, whole["edit"]["changes"][uri])


def test_formatting_changes_few_lines_and_leaves_broken_files(client: Client, uri: str) -> None:
    text = SCENE.replace("param k = 0.5 in 0..1;", "param   k=0.5   in 0..1;")
    client.replace(uri, text)
    params: dict[str, Any] = {"textDocument": {"uri": uri}, "options": {"tabSize": 2, "insertSpaces": True}}
    edits = client.request("textDocument/formatting", params)
    formatted = client.applied(text, edits)
    assert "param k = 0.5 in 0..1;" in formatted
    client.replace(uri, formatted)
    assert client.request("textDocument/formatting", params) == []
    client.replace(uri, "let  a=1;\n\n\nlet  b=2;\n")
    params["range"] = {"start": {"line": 3, "character": 0}, "end": {"line": 3, "character": 4}}
    (edit,) = client.request("textDocument/rangeFormatting", params)
    assert edit["range"]["start"]["line"] >= 1
    client.replace(uri, "let a = ;\n")
    assert client.request("textDocument/formatting", params) is None
