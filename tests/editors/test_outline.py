"""The shape of a file over real pipes: symbols, folds, links, colours, tokens and hints."""

from __future__ import annotations

from itertools import pairwise

import pytest

from tests.editors.client import Client
from tests.editors.conftest import SCENE


def test_symbols_of_a_file_and_of_the_folder(client: Client, uri: str) -> None:
    found = client.request("textDocument/documentSymbol", {"textDocument": {"uri": uri}})
    assert [s["name"] for s in found] == ["lib", "k", "r", "ring"]
    assert [s["name"] for s in found[3]["children"]] == ["for i"]
    assert [s["name"] for s in found[3]["children"][0]["children"]] == ["square"]
    client.replace(uri, "camera(fov = 40deg);\nsmooth(k = 0.2) { sphere; }\nlight;\n")
    found = client.request("textDocument/documentSymbol", {"textDocument": {"uri": uri}})
    assert [(s["name"], s.get("detail")) for s in found] == [
        ("camera", "(fov = 40deg)"),
        ("smooth", "(k = 0.2)"),
        ("light", None),
    ]
    found = client.request("workspace/symbol", {"query": "tw"})
    assert [(s["name"], s["containerName"]) for s in found] == [("twice", "lib.nsg")]


def test_folding_and_growing_selections(client: Client, uri: str) -> None:
    client.replace(uri, '// one\n// two\nimport "lib.nsg" as a;\nimport "lib.nsg" as b;\n' + SCENE)
    found = client.request("textDocument/foldingRange", {"textDocument": {"uri": uri}})
    shapes = {(f["startLine"], f["endLine"], f.get("kind")) for f in found}
    assert shapes >= {(0, 1, "comment"), (2, 3, "imports"), (8, 11, None), (9, 10, None)}
    at = client.at(uri, "0.2 * r", 6)
    params = {"textDocument": {"uri": uri}, "positions": [at["position"]]}
    (inner,) = client.request("textDocument/selectionRange", params)
    texts = []
    while inner:
        texts.append(client.shown(uri, inner["range"]))
        inner = inner.get("parent")
    assert texts[:3] == ["r", "0.2 * r", "scale(0.2 * r);"]
    assert texts[-1] == client.texts[uri]
    assert all(outer.find(inner) >= 0 for inner, outer in pairwise(texts))


def test_imports_are_links(client: Client, uri: str) -> None:
    (link,) = client.request("textDocument/documentLink", {"textDocument": {"uri": uri}})
    assert client.shown(uri, link["range"]) == "lib.nsg"
    assert link["target"].endswith("lib.nsg")


def test_colours_are_shown_and_written(client: Client, uri: str) -> None:
    client.replace(
        uri,
        "background([0, 0.5, 1]);\nlet c = rgb(1, 0, 0);\nlet d = hsv(120deg, 1, 1);\nlet e = #abc;\n"
        "light([0, 1, 0], color = [1, 1, 0]);\nground(-1, [0, 1, 0]);\n",
    )
    found = client.request("textDocument/documentColor", {"textDocument": {"uri": uri}})
    assert [client.shown(uri, f["range"]) for f in found] == [
        "[0, 0.5, 1]",
        "rgb(1, 0, 0)",
        "hsv(120deg, 1, 1)",
        "#abc",
        "[1, 1, 0]",
        "[0, 1, 0]",
    ]
    assert found[2]["color"] == pytest.approx({"red": 0, "green": 1, "blue": 0, "alpha": 1})
    params = {"textDocument": {"uri": uri}, "range": found[1]["range"], "color": found[2]["color"]}
    forms = [p["label"] for p in client.request("textDocument/colorPresentation", params)]
    assert forms == ["rgb(0, 1, 0)", "#0f0", "hsv(0.333, 1, 1)", "[0, 1, 0]"]


def test_semantic_tokens_cover_what_a_grammar_cannot_know(client: Client, uri: str) -> None:
    legend = client.capabilities["semanticTokensProvider"]["legend"]
    data = client.request("textDocument/semanticTokens/full", {"textDocument": {"uri": uri}})["data"]
    found: dict[str, tuple[str, int]] = {}
    line = column = 0
    lines = SCENE.split("\n")
    for at in range(0, len(data), 5):
        step, start, length, kind, modifiers = data[at : at + 5]
        line, column = line + step, start if step else column + start
        found[lines[line][column : column + length]] = (legend["tokenTypes"][kind], modifiers)
    assert found["ring"][0] == "class"
    assert found["lib"][0] == "namespace"
    assert found["twirl"] == ("method", 4)
    assert found["k"][0] == "property"
    assert found["n"][0] == "parameter"
    assert found["// how large"][0] == "comment"
    assert found["#d33"][0] == "number"


def test_hints_show_values_and_parameters(client: Client, uri: str) -> None:
    whole = {"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}}
    found = client.request("textDocument/inlayHint", {"textDocument": {"uri": uri}, "range": whole})
    assert [(hint["label"], hint["position"]["line"]) for hint in found] == [(" = 1", 3), ("n:", 9)]
