"""Answers over real pipes: completion, signatures, hover, fixes, formatting, symbols, folds and hints."""

from __future__ import annotations

from base64 import b64decode
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from scenelang.assets.element import Part
from scenelang.assets.zoo import zoo_bytes
from scenelang.compiler.manifest import available
from scenelang.language.words import TEXTURES
from tests.assets.shapes import ball, element, noise, square, torus
from tests.editors.client import CAPABILITIES, Client
from tests.editors.conftest import SCENE


def labels(client: Client, at: dict[str, Any]) -> list[str]:
    items = client.request("textDocument/completion", at)["items"]
    return [item["label"] for item in sorted(items, key=lambda item: item["sortText"])]


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
    client.replace(uri, 'model "shapes2d";\nsquare { material flat {  } }\n')
    found = labels(client, client.at(uri, "{  }", 2))
    assert {"color", "hue", "grayscale", "flip"} <= set(found)
    assert not {"twirl", "square"} & set(found)
    assert set(labels(client, client.at(uri, "material flat", 9))) == {"flat", *TEXTURES}


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
    assert labels(client, client.at(uri, 'import "" as', 8)) == ["std/meshes", "std/shapes", "lib.nsg"]
    assert labels(client, client.at(uri, 'model ""', 7)) == available()
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


STAGE = "smooth() { star; }\nchain { square; smooth(k = 0.3)  }\nsmooth(0.2) {  }\nlight(color = );\n"


def test_the_stage_and_the_width_of_a_blend(client: Client, uri: str) -> None:
    client.replace(uri, STAGE + "ground();\ncamera();\n\n")
    assert {"camera", "light", "ground"} <= set(labels(client, client.at(uri, "();\n\n", 4)))
    assert labels(client, client.at(uri, "camera(", 7))[:3] == ["eye =", "fov =", "target ="]
    assert labels(client, client.at(uri, "color = )", 8))[0] == "#d33"
    assert "none" in labels(client, client.at(uri, "ground(", 7))[:3]
    assert labels(client, client.at(uri, "smooth(", 7))[0] == "k ="
    assert set(labels(client, client.at(uri, "0.3)  }", 5))) >= {"square", "group"}
    assert "star" in labels(client, client.at(uri, "0.2) {  }", 7))
    found = client.request("textDocument/signatureHelp", client.at(uri, "smooth(k = 0.3", 13))
    assert found["signatures"][0]["label"] == "smooth([k])"
    assert found["activeParameter"] == 0


def hover(client: Client, at: dict[str, Any]) -> str:
    return str(client.request("textDocument/hover", at)["contents"]["value"])


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
    assert "half a side is 0.707" in text


def test_hover_tells_what_a_model_offers_and_words_mean(client: Client, uri: str) -> None:
    client.replace(uri, 'nsg 1;\nmodel "shapes2d";\nsquare { scale(sin(TAU * 1rad)); }\n')
    text = hover(client, client.at(uri, "shapes2d", 2))
    assert "2D" in text
    assert "triangle" in text
    assert "sine" in hover(client, client.at(uri, "sin", 1))
    assert "2π" in hover(client, client.at(uri, "TAU", 1))
    assert "usual one" in hover(client, client.at(uri, "model", 1))


def test_hover_tells_the_stage_unless_a_module_hides_it(client: Client, uri: str) -> None:
    client.replace(uri, "light(power = 3);\nsmooth(k = 0.2) { sphere; torus; }\n")
    assert "point light" in hover(client, client.at(uri, "light", 1))
    assert "power" in hover(client, client.at(uri, "power", 1))
    assert "blend" in hover(client, client.at(uri, "smooth", 1))
    assert "width" in hover(client, client.at(uri, "k = 0.2", 0))
    client.replace(uri, "module light(power) { sphere; }\nlight(3);\n")
    assert "module light(power)" in hover(client, client.at(uri, "light(3)", 1))


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


def test_elements_are_proposed_and_told_of(client: Client, uri: str) -> None:
    zoo = Path(uri.removeprefix("file://")).with_name("zoo.safetensors")
    zoo.write_bytes(zoo_bytes([element(torus, "ring"), element(ball, "ball")]))
    client.replace(uri, 'import "zoo.safetensors" as zoo;\nzoo.ring { scale(0.5); }\nzoo.;\n')
    assert labels(client, client.at(uri, "zoo.;", 4)) == ["ball", "ring"]
    told = hover(client, client.at(uri, "zoo.ring", 5))
    assert "data:image" not in told  # this editor shows none
    assert "element of space: 33 × 33 × 33 distances" in told
    assert "license: none needed" in told


def test_materials_are_proposed_told_of_and_found(client: Client, uri: str) -> None:
    zoo = Path(uri.removeprefix("file://")).with_name("zoo.safetensors")
    zoo.write_bytes(zoo_bytes([element(torus, "ring"), noise(2, 3, name="ring"), noise(2, 2)]))
    text = (
        'import "zoo.safetensors" as zoo;\nsphere { material diffuse zoo.ring; }\ntorus { material zoo.; }\n'
    )
    client.replace(uri, text)
    assert labels(client, client.at(uri, "zoo.; }", 4)) == ["bark", "ring"]
    assert "zoo" in labels(client, client.at(uri, "material diffuse zoo", 9))
    assert labels(client, client.at(uri, "diffuse zoo", 8))[-1] == "zoo"
    told = hover(client, client.at(uri, "zoo.ring;", 5))
    assert "texture: 3 × 2 colours" in told
    assert "distances" not in told
    found = client.request("textDocument/definition", client.at(uri, "zoo.ring;", 5))
    assert found["range"]["start"]["line"] == 0


def test_elements_are_shown_where_the_editor_shows_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    markdown = {"parser": "marked", "allowedTags": ["p", "img"]}
    monkeypatch.setitem(CAPABILITIES["general"], "markdown", markdown)
    (tmp_path / "zoo.safetensors").write_bytes(
        zoo_bytes([element(torus, "ring"), element(square, "tile", d=2)])
    )
    client = Client(tmp_path)
    try:
        text = 'import "zoo.safetensors" as zoo;\nzoo.ring { }\nzoo.tile { }\n'
        uri = client.open((tmp_path / "a.nsg").as_uri(), text)
        told = [hover(client, client.at(uri, name, 5)) for name in ("zoo.ring", "zoo.tile", "zoo.ring")]
    finally:
        client.kill()
    pictures = [text.partition("(data:image/png;base64,")[2].partition(")")[0] for text in told]
    assert pictures[0] == pictures[2]
    ring, tile = (np.asarray(Image.open(BytesIO(b64decode(picture)))) for picture in pictures[:2])
    assert ring.shape == tile.shape == (96, 96, 3)
    assert max(map(len, pictures)) < 20_000
    assert tile[48, 48].tolist() == [34, 34, 34]
    assert tile[2, 2].tolist() == [255, 255, 255]
    assert np.ptp(ring[40:56, 40:56, 0]) > 40  # lit


def test_groups_are_proposed_and_told_of(client: Client, uri: str) -> None:
    zoo = Path(uri.removeprefix("file://")).with_name("zoo.safetensors")
    ring = Part("ring", (0.0, 0.5, 0.0), 0.5)
    zoo.write_bytes(zoo_bytes([element(torus, "ring")], {"car": (ring, ring), "ring": (ring,)}))
    client.replace(uri, 'import "zoo.safetensors" as zoo;\nzoo.car();\nzoo.ring();\nzoo.;\n')
    assert labels(client, client.at(uri, "zoo.;", 4)) == ["car()", "ring", "ring()"]
    assert "car(): group of 2 ring" in hover(client, client.at(uri, "zoo.car", 5))
    told = hover(client, client.at(uri, "zoo.ring", 5))
    assert "distances" in told
    assert "ring(): group of ring" in told
