"""Every feature over a real process and real pipes, as an editor would ask for it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.lsp.client import Client

LIBRARY = """// Pieces to import.
let unit = 0.5;
// A dot of some size.
module dot(at, size = 0.2) { star { scale(size * unit); translate(at); } }
fn twice(x) = 2 * x;
"""
SCENE = """nsg 1;
import "lib.nsg" as lib;
param k = 0.5 in 0..1;
let r = lib.twice(k);    // how large
module ring(n, c = #d33) {
  for (i in 0..<n) {
    square { scale(0.2 * r); twirl(k); translate(0.5, 0); rotate(1turn * i / n); material flat { color(c); } }
  }
}
ring(3, c = hsv(0.1, 1, 1));
lib.dot(at = [0.1, 0.2], size = r);
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("scenes")
    (root / "lib.nsg").write_text(LIBRARY, "utf-8")
    (root / "main.nsg").write_text(SCENE, "utf-8")
    return root


@pytest.fixture(scope="module")
def client(folder: Path) -> Iterator[Client]:
    client = Client(folder)
    yield client
    client.kill()


@pytest.fixture
def uri(client: Client, folder: Path) -> Iterator[str]:
    uri = client.open((folder / "main.nsg").as_uri(), SCENE)
    assert client.diagnostics(uri) == []
    yield uri
    client.close(uri)
    client.next_diagnostics(uri)
    client.published.pop(uri)


def labels(client: Client, at: dict[str, Any]) -> list[str]:
    items = client.request("textDocument/completion", at)["items"]
    return [item["label"] for item in sorted(items, key=lambda item: item["sortText"])]


def hover(client: Client, at: dict[str, Any]) -> str:
    return str(client.request("textDocument/hover", at)["contents"]["value"])


# ---------------------------------------------------------------- diagnostics


def test_syntax_comes_at_once_and_the_rest_when_typing_pauses(client: Client, uri: str) -> None:
    at = client.texts[uri].index("ring(3")
    client.change(uri, at, at, "square { rotate(30) }\n")
    first = client.next_diagnostics(uri)
    assert [d["code"] for d in first] == ["E0102"]
    assert client.shown(uri, first[0]["range"]) == ""
    end = client.texts[uri].index(" }\nring")
    client.change(uri, end, end, ";")
    found = client.diagnostics(uri)
    assert [d["code"] for d in found] == ["E0302"]
    assert client.shown(uri, found[0]["range"]) == "30"
    assert found[0]["severity"] == 1
    assert found[0]["codeDescription"]["href"].endswith("E0302.md")


def test_labels_are_related_places_and_unused_names_are_faded(client: Client, uri: str) -> None:
    client.replace(uri, SCENE + "let r = 2;\nlet spare = 1;\n")
    found = {d["code"]: d for d in client.diagnostics(uri)}
    assert found["W0201"]["tags"] == [1]
    assert client.shown(uri, found["W0201"]["range"]) == "spare"
    (related,) = found["E0202"]["relatedInformation"]
    assert related["message"] == "first defined here"
    assert client.shown(uri, related["location"]["range"]) == "r"
    assert related["location"]["range"]["start"]["line"] == 3


def test_what_evaluation_found_stays_in_place_while_typing_goes_on(client: Client, uri: str) -> None:
    client.replace(uri, SCENE + "square { rotate(30); }\n")
    assert [d["code"] for d in client.diagnostics(uri)] == ["E0302"]
    client.change(uri, 0, 0, "// a line\n")
    (moved,) = client.next_diagnostics(uri)
    assert moved["code"] == "E0302"
    assert client.shown(uri, moved["range"]) == "30"


def test_a_mistake_in_an_imported_file_stands_at_what_led_there(client: Client, uri: str) -> None:
    client.replace(uri, SCENE.replace("at = [0.1, 0.2]", "at = 3"))
    (found,) = client.diagnostics(uri)
    assert found["message"].startswith("in 'lib.nsg': ")
    assert client.shown(uri, found["range"]) == "lib.dot"
    assert found["relatedInformation"][0]["location"]["uri"].endswith("lib.nsg")


def test_an_open_import_counts_before_it_is_saved(client: Client, uri: str, folder: Path) -> None:
    library = client.open((folder / "lib.nsg").as_uri(), LIBRARY)
    client.diagnostics(library)
    client.replace(library, LIBRARY.replace("fn twice", "fn double"))
    while not (found := client.next_diagnostics(uri)):
        pass
    assert [d["code"] for d in found] == ["E0212"]
    client.close(library)
    while client.next_diagnostics(uri):
        pass


def test_a_file_that_changes_on_the_disk_is_read_again(client: Client, uri: str, folder: Path) -> None:
    assert any(
        watcher["globPattern"] == "**/*.nsg"
        for message in client.asked
        if message["method"] == "client/registerCapability"
        for registration in message["params"]["registrations"]
        for watcher in registration["registerOptions"]["watchers"]
    )
    path = folder / "lib.nsg"
    path.write_text(LIBRARY.replace("module dot", "module spot"), "utf-8")
    try:
        client.notify("workspace/didChangeWatchedFiles", {"changes": [{"uri": path.as_uri(), "type": 2}]})
        assert [d["code"] for d in client.next_diagnostics(uri)] == ["E0212"]
    finally:
        path.write_text(LIBRARY, "utf-8")
    client.notify("workspace/didChangeWatchedFiles", {"changes": [{"uri": path.as_uri(), "type": 2}]})
    assert client.next_diagnostics(uri) == []


def test_a_buffer_without_a_file_is_a_scene_too(client: Client) -> None:
    uri = client.open("untitled:Untitled-1", "squar { scale(0.5); }\n")
    (found,) = client.diagnostics(uri)
    assert found["code"] == "E0204"
    assert "did you mean 'square'?" in found["message"]
    client.close(uri)


# ---------------------------------------------------------------- completion


def test_completion_of_statements_goes_by_the_block(client: Client, uri: str) -> None:
    client.replace(uri, SCENE + "group {\n  \n}\nsquare {  }\nchain { square; subtract  }\nmod\n")
    at = client.at(uri, "group {\n  ", 10)
    assert {"square", "star", "ring", "lib", "translate", "let", "for"} <= set(labels(client, at))
    inside = labels(client, client.at(uri, "square {  }", 9))
    assert {"translate", "rotate", "twirl", "material"} <= set(inside)
    assert not {"square", "canvas", "color"} & set(inside)
    assert set(labels(client, client.at(uri, "subtract  }", 9))) >= {"square", "ring", "group"}
    assert "canvas" not in labels(client, client.at(uri, "subtract  }", 9))
    top = labels(client, client.at(uri, "mod\n", 3))
    assert {"module", "canvas", "animate", "square"} <= set(top)
    assert "translate" not in top


def test_completion_in_a_material_offers_its_operations(client: Client, uri: str) -> None:
    client.replace(uri, "square { material flat {  } }\n")
    found = labels(client, client.at(uri, "{  }", 2))
    assert {"color", "hue", "grayscale", "flip"} <= set(found)
    assert not {"twirl", "square"} & set(found)
    assert labels(client, client.at(uri, "material flat", 9)) == ["flat"]


def test_completion_in_calls_names_arguments_and_values(client: Client, uri: str) -> None:
    client.replace(uri, SCENE + "square { rotate(30deg, axis = ); }\nring(2, );\n")
    assert labels(client, client.at(uri, "axis = )", 7))[:3] == ["X", "Y", "Z"]
    found = labels(client, client.at(uri, "ring(2, )", 8))
    assert found[0] == "c ="
    assert {"k", "r", "sin", "PI", "lib"} <= set(found)
    assert "ring" not in found
    assert "n =" not in found


def test_completion_of_members_paths_models_and_units(client: Client, uri: str) -> None:
    client.replace(uri, SCENE + 'let a = lib.;\nimport "" as b;\nmodel "";\nlet c = 30d;\nlib.;\n')
    assert labels(client, client.at(uri, "lib.;", 4)) == ["dot", "twice", "unit"]
    assert labels(client, client.at(uri, "lib.;", 4, 1)) == ["dot", "unit"]
    assert labels(client, client.at(uri, 'import "" as', 8)) == ["lib.nsg"]
    assert labels(client, client.at(uri, 'model ""', 7)) == ["shapes2d"]
    assert labels(client, client.at(uri, "30d;", 3)) == ["30deg"]


def test_completion_stays_silent_where_a_name_is_made_up(client: Client, uri: str) -> None:
    client.replace(uri, "// squ\nlet \nparam p\nsquare { /* sc */ }\n")
    assert labels(client, client.at(uri, "// squ", 6)) == []
    assert labels(client, client.at(uri, "let ", 4)) == []
    assert labels(client, client.at(uri, "/* sc", 5)) == []


def test_completion_knows_scopes_and_inserts_snippets(client: Client, uri: str) -> None:
    client.replace(uri, SCENE + "fn f(inner) = inn;\nlet late = 1;\n")
    items = client.request("textDocument/completion", client.at(uri, "inn;", 3))["items"]
    found = {item["label"]: item for item in items}
    assert "inner" in found
    assert "late" not in found
    assert found["clamp"]["insertTextFormat"] == 2
    assert found["clamp"]["textEdit"]["newText"] == "clamp(${1:x}, ${2:low}, ${3:high})"
    assert client.shown(uri, found["inner"]["textEdit"]["range"]) == "inn"


def test_signatures_follow_the_argument(client: Client, uri: str) -> None:
    client.replace(uri, SCENE + "ring(2, c = #fff);\nsquare { translate(1, 2); }\n")
    found = client.request("textDocument/signatureHelp", client.at(uri, "ring(2, c", 5))
    assert found["signatures"][0]["label"] == "module ring(n, c = #d33)"
    assert found["activeParameter"] == 0
    assert client.request("textDocument/signatureHelp", client.at(uri, "c = #fff", 5))["activeParameter"] == 1
    found = client.request("textDocument/signatureHelp", client.at(uri, "translate(1, 2", 13))
    assert found["activeParameter"] == 1
    label, (start, end) = found["signatures"][0]["label"], found["signatures"][0]["parameters"][1]["label"]
    assert label[start:end] == "y"


# ---------------------------------------------------------------- hover


def test_hover_tells_values_ranges_and_comments(client: Client, uri: str) -> None:
    text = hover(client, client.at(uri, "0.2 * r", 6))
    assert "let r = lib.twice(k);" in text
    assert "how large" in text
    assert "= `1`" in text
    assert "param k = 0.5 in 0..1;" in hover(client, client.at(uri, "twice(k)", 6))
    assert "A dot of some size." in hover(client, client.at(uri, "lib.dot", 5))
    assert "`0`, `1`, `2`" in hover(client, client.at(uri, "* i / n", 2))


def test_hover_tells_a_transform_s_matrix_and_a_warp_s_formula(client: Client, uri: str) -> None:
    text = hover(client, client.at(uri, "scale(0.2 * r)", 1))
    assert "scale(0.2);" in text
    assert "[ 0.2    0    0 ]" in text
    assert "p → R(0.5 |p|) p" in hover(client, client.at(uri, "twirl", 1))


def test_hover_tells_an_object_s_composed_chain(client: Client, uri: str) -> None:
    text = hover(client, client.at(uri, "square", 1))
    assert "the first of 3" in text
    assert "[   1    0  0.5 ]" in text
    assert "Half-side" in text


def test_hover_tells_what_a_model_offers_and_words_mean(client: Client, uri: str) -> None:
    client.replace(uri, 'nsg 1;\nmodel "shapes2d";\nsquare { scale(sin(TAU * 1rad)); }\n')
    text = hover(client, client.at(uri, "shapes2d", 2))
    assert "2D" in text
    assert "triangle" in text
    assert "sine" in hover(client, client.at(uri, "sin", 1))
    assert "2π" in hover(client, client.at(uri, "TAU", 1))
    assert "smallest one" in hover(client, client.at(uri, "model", 1))


# ---------------------------------------------------------------- names


def test_definition_goes_across_files(client: Client, uri: str) -> None:
    found = client.request("textDocument/definition", client.at(uri, "lib.dot", 5))
    assert found["uri"].endswith("lib.nsg")
    assert found["range"]["start"] == {"line": 3, "character": 7}
    found = client.request("textDocument/definition", client.at(uri, "size = r", 1))
    assert found["uri"].endswith("lib.nsg")
    found = client.request("textDocument/definition", client.at(uri, "ring(3", 0))
    assert client.shown(uri, found["range"]) == "ring"
    found = client.request("textDocument/definition", client.at(uri, '"lib.nsg"', 3))
    assert found["uri"].endswith("lib.nsg")
    assert client.request("textDocument/definition", client.at(uri, "square", 3)) is None


def test_references_and_highlights_mean_the_same_name(client: Client, uri: str, folder: Path) -> None:
    at = {**client.at(uri, "let r", 4), "context": {"includeDeclaration": True}}
    found = client.request("textDocument/references", at)
    assert [client.shown(uri, f["range"]) for f in found] == ["r"] * 3
    at["context"] = {"includeDeclaration": False}
    assert len(client.request("textDocument/references", at)) == 2
    library = client.open((folder / "lib.nsg").as_uri(), LIBRARY)
    at = {**client.at(library, "twice", 1), "context": {"includeDeclaration": True}}
    found = client.request("textDocument/references", at)
    assert sorted(f["uri"].rpartition("/")[2] for f in found) == ["lib.nsg", "main.nsg"]
    client.close(library)
    marks = client.request("textDocument/documentHighlight", client.at(uri, "(k)", 1))
    assert sorted(mark["kind"] for mark in marks) == [2, 2, 3]


def test_rename_goes_across_imports_and_keeps_the_meaning(client: Client, uri: str) -> None:
    at = client.at(uri, "lib.dot", 5)
    assert client.request("textDocument/prepareRename", at)["placeholder"] == "dot"
    edit = client.request("textDocument/rename", {**at, "newName": "spot"})
    changes = {c["textDocument"]["uri"]: c["edits"] for c in edit["documentChanges"]}
    assert client.applied(SCENE, changes[uri]) == SCENE.replace("lib.dot", "lib.spot")
    (library,) = [edits for name, edits in changes.items() if name != uri]
    assert client.applied(LIBRARY, library) == LIBRARY.replace("module dot", "module spot")
    edit = client.request("textDocument/rename", {**client.at(uri, "size = r", 1), "newName": "side"})
    changes = {c["textDocument"]["uri"]: c["edits"] for c in edit["documentChanges"]}
    assert client.applied(SCENE, changes[uri]) == SCENE.replace("size = r", "side = r")


@pytest.mark.parametrize(
    ("word", "shift", "new", "why"),
    [
        ("let r", 4, "k", "already defined in line 3"),
        ("let r", 4, "2r", "not a name"),
        ("let r", 4, "module", "keyword"),
        ("ring(n", 0, "scale", "word of the language"),
        ("ring(n", 5, "c", "'c' is already defined"),
        ("let r", 4, "i", "'i' is already defined"),
        ("(n, c", 1, "k", "would mean this"),
        ("let r", 4, "hsv", "would mean this"),
    ],
)
def test_rename_refuses_what_would_change_the_meaning(
    client: Client, uri: str, word: str, shift: int, new: str, why: str
) -> None:
    at = {**client.at(uri, word, shift), "newName": new}
    assert why in client.refused("textDocument/rename", at)


def test_words_of_the_language_are_not_renamed(client: Client, uri: str) -> None:
    assert "not defined" in client.refused("textDocument/prepareRename", client.at(uri, "square", 1))


# ---------------------------------------------------------------- the shape of a file


def test_symbols_of_a_file_and_of_the_folder(client: Client, uri: str) -> None:
    found = client.request("textDocument/documentSymbol", {"textDocument": {"uri": uri}})
    assert [s["name"] for s in found] == ["lib", "k", "r", "ring"]
    assert [s["name"] for s in found[3]["children"]] == ["for i"]
    assert [s["name"] for s in found[3]["children"][0]["children"]] == ["square"]
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
        uri, "background([0, 0.5, 1]);\nlet c = rgb(1, 0, 0);\nlet d = hsv(120deg, 1, 1);\nlet e = #abc;\n"
    )
    found = client.request("textDocument/documentColor", {"textDocument": {"uri": uri}})
    assert [client.shown(uri, f["range"]) for f in found] == [
        "[0, 0.5, 1]",
        "rgb(1, 0, 0)",
        "hsv(120deg, 1, 1)",
        "#abc",
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


# ---------------------------------------------------------------- changes of the text


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
