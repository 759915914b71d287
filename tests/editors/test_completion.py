"""Completion and signatures over real pipes."""

from __future__ import annotations

from typing import Any

import pytest

from scenelang.compiler.manifest import available
from scenelang.language.words import TEXTURES
from tests.editors.client import Client
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


@pytest.mark.parametrize("word", ["subtract", "intersect", "smooth"])
def test_the_width_of_an_edge(client: Client, uri: str, word: str) -> None:
    client.replace(uri, f"nsg 1;\nstar;\n{word}(k = 0.3) {{ square; subtract {{ star; pentagon; }} }}\n")
    assert labels(client, client.at(uri, f"{word}(", len(word) + 1))[0] == "k ="
    found = client.request("textDocument/signatureHelp", client.at(uri, f"{word}(k = 0.3", len(word) + 7))
    assert found["signatures"][0]["label"] == f"{word}([k])"
    assert word in str(client.request("textDocument/hover", client.at(uri, f"{word}(", 1)))


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
