"""Answers over real pipes: diagnostics, completion, hover, fixes, renaming, symbols and hints."""

from __future__ import annotations

from base64 import b64decode
from dataclasses import replace
from io import BytesIO
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from scenelang.assets.element import Part
from scenelang.assets.element_file import element_file_bytes
from scenelang.compiler.manifest import available
from scenelang.language import library
from scenelang.language.words import PAINTS
from tests.assets.shapes import ball, element, noise, square, torus
from tests.editors.client import CAPABILITIES, Client, Json
from tests.editors.conftest import LIBRARY, SCENE


def labels(client: Client, at: Json) -> list[str]:
    items = client.request("textDocument/completion", at)["items"]
    return [item["label"] for item in sorted(items, key=lambda item: item["sortText"])]


def hover(client: Client, at: Json) -> str:
    return str(client.request("textDocument/hover", at)["contents"]["value"])


def says(client: Client, uri: str, rows: list[tuple[str, int, list[str]]]) -> None:
    """Check that hovers at words have texts."""
    told = {row[0]: hover(client, client.at(uri, *row[:2])) for row in rows}
    assert [(word, text) for word, _, texts in rows for text in texts if text not in told[word]] == [], told


def test_syntax_comes_at_once_and_the_rest_when_typing_pauses(client: Client, uri: str) -> None:
    at = client.texts[uri].index("ring(3")
    client.change(uri, at, at, "square { rotate(30) }\n")
    first = client.next_diagnostics(uri)
    assert [d["code"] for d in first] == ["E0102"]
    assert client.shown(uri, first[0]["range"]) == ""
    end = client.texts[uri].index(" }\nring")
    client.change(uri, end, end, ";")
    (found,) = client.diagnostics(uri)
    assert (found["code"], client.shown(uri, found["range"]), found["severity"]) == ("E0302", "30", 1)
    assert found["codeDescription"]["href"].endswith("E0302.md")
    client.change(uri, 0, 0, "// a line\n")  # what evaluation found stays in place meanwhile
    (moved,) = client.next_diagnostics(uri)
    assert (moved["code"], client.shown(uri, moved["range"])) == ("E0302", "30")


def test_labels_are_related_places_and_unused_names_are_faded(client: Client, uri: str) -> None:
    client.replace(uri, SCENE + "let r = 2;\nlet spare = 1;\n")
    found = {d["code"]: d for d in client.diagnostics(uri)}
    assert found["W0201"]["tags"] == [1]
    assert client.shown(uri, found["W0201"]["range"]) == "spare"
    (related,) = found["E0202"]["relatedInformation"]
    assert related["message"] == "first defined here"
    assert client.shown(uri, related["location"]["range"]) == "r"
    assert related["location"]["range"]["start"]["line"] == 3


def test_a_mistake_in_an_imported_file_stands_at_what_led_there(client: Client, uri: str) -> None:
    client.replace(uri, SCENE.replace("at = [0.1, 0.2]", "at = 3"))
    (found,) = client.diagnostics(uri)
    assert found["message"].startswith("in `lib.nsg`: ")
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
    (asked,) = (m["params"] for m in client.asked if m["method"] == "client/registerCapability")
    assert asked["registrations"][0]["registerOptions"]["watchers"][0]["globPattern"] == "**/*.nsg"
    path = folder / "lib.nsg"
    for text, codes in ((LIBRARY.replace("module dot", "module spot"), ["E0212"]), (LIBRARY, [])):
        path.write_text(text, "utf-8")
        client.notify("workspace/didChangeWatchedFiles", {"changes": [{"uri": path.as_uri(), "type": 2}]})
        assert [d["code"] for d in client.next_diagnostics(uri)] == codes


def test_later_frames_are_looked_at_also_without_a_file(client: Client) -> None:
    uri = client.open("untitled:frames", "animate(1, 10);\nsquare { rotate(u); }\n")
    (found,) = client.diagnostics(uri)
    assert found["message"].startswith("expected an angle, found a bare number (frame 1)")
    client.close(uri)


def test_completion_goes_by_the_block(client: Client, uri: str) -> None:
    text = "group {\n  \n}\nsquare {  }\nchain { square; subtract  }\ntorus { material flat { /**/ } }\nmod\n"
    client.replace(uri, SCENE + text)
    for before, offered, withheld in (
        ("group {\n  ", "square star ring lib translate let for", ""),
        ("\nsquare { ", "translate rotate twirl grow shell material", "square canvas color"),
        ("subtract ", "square ring group", "canvas"),
        ("flat { ", "color hue grayscale flip opacity glow density roughness", "twirl square samples"),
        ("\nmod", "module canvas animate samples square", "translate opacity"),
    ):
        found = set(labels(client, client.at(uri, before, len(before))))
        assert set(offered.split()) <= found, before
        assert not set(withheld.split()) & found, before


def test_completion_of_arguments_members_paths_models_and_units(client: Client, uri: str) -> None:
    text = 'square { rotate(30deg, axis = ); }\nring(2, );\nlet a = lib.;\nimport "" as b;\nmodel "";\n'
    client.replace(uri, SCENE + text + "let c = 30d;\nlib.;\n")
    assert labels(client, client.at(uri, "axis = )", 7))[:3] == ["X", "Y", "Z"]
    found = labels(client, client.at(uri, "ring(2, )", 8))
    assert found[0] == "c ="
    assert {"k", "r", "sin", "PI", "lib"} <= set(found)
    assert not {"ring", "n ="} & set(found)
    assert labels(client, client.at(uri, "lib.;", 4)) == ["dot", "twice", "unit"]
    assert labels(client, client.at(uri, "lib.;", 4, 1)) == ["dot", "unit"]
    files = [*library.names(), "lib.nsg"]
    assert labels(client, client.at(uri, 'import "" as', 8)) == files
    assert labels(client, client.at(uri, 'model ""', 7)) == available()
    assert labels(client, client.at(uri, "30d;", 3)) == ["30deg"]
    client.replace(uri, 'model "shapes2d";\nsquare { material flat; }\n// squ\nlet \n/* sc */\n')
    assert set(labels(client, client.at(uri, "flat"))) == {"flat", *PAINTS}
    for text in ("// squ", "let ", "/* sc"):  # comments, and names that are made up
        assert labels(client, client.at(uri, text, len(text))) == [], text


def test_completion_knows_scopes_and_inserts_snippets(client: Client, uri: str) -> None:
    client.replace(uri, SCENE + "fn f(inner) = inn;\nlet late = 1;\n")
    items = client.request("textDocument/completion", client.at(uri, "inn;", 3))["items"]
    found = {item["label"]: item for item in items}
    assert "late" not in found
    assert found["clamp"]["insertTextFormat"] == 2
    assert found["clamp"]["textEdit"]["newText"] == "clamp(${1:x}, ${2:low}, ${3:high})"
    assert client.shown(uri, found["inner"]["textEdit"]["range"]) == "inn"


def test_completion_of_the_stage_and_the_width_of_a_blend(client: Client, uri: str) -> None:
    text = "smooth() { star; }\nchain { square; smooth(k = 0.3)  }\nsmooth(0.2) {  }\nlight(color = );\n"
    client.replace(uri, text + "sky(zenith = );\nlight();\nground();\ncamera();\n\n")
    assert labels(client, client.at(uri, "zenith = )", 9))[0] == "#d33"
    assert "none" in labels(client, client.at(uri, "light();", 6))
    assert {"camera", "light", "ground", "sky"} <= set(labels(client, client.at(uri, "();\n\n", 4)))
    assert labels(client, client.at(uri, "camera(", 7))[:4] == ["exposure =", "eye =", "fov =", "target ="]
    assert labels(client, client.at(uri, "color = )", 8))[0] == "#d33"
    assert "none" in labels(client, client.at(uri, "ground(", 7))[:3]
    assert labels(client, client.at(uri, "smooth(", 7))[0] == "k ="
    assert set(labels(client, client.at(uri, "0.3)  }", 5))) >= {"square", "group"}
    assert "star" in labels(client, client.at(uri, "0.2) {  }", 7))


def test_signatures_follow_the_argument(client: Client, uri: str) -> None:
    client.replace(uri, SCENE + "ring(2, c = #fff);\nsquare { translate(1, 2); }\nsmooth(k = 0.3) { }\n")
    for word, shift, head, active, name in (
        ("ring(2, c", 5, "module ring(n, c = #d33)", 0, "n"),
        ("c = #fff", 5, "module ring(n, c = #d33)", 1, "c"),
        ("translate(1, 2", 13, "translate(x, y[, z])", 1, "y"),
        ("smooth(k = 0.3", 13, "smooth([k])", 0, "k"),
    ):
        found = client.request("textDocument/signatureHelp", client.at(uri, word, shift))
        (signature,) = found["signatures"]
        start, end = signature["parameters"][active]["label"]
        assert (signature["label"], found["activeParameter"]) == (head, active)
        assert head[start:end] == name


def test_hover_tells_values_matrices_and_chains(client: Client, uri: str) -> None:
    rows = [
        ("0.2 * r", 6, ["let r = lib.twice(k);", "how large", "= `1`"]),
        ("twice(k)", 6, ["param k = 0.5 in 0..1;"]),
        ("lib.dot", 5, ["A dot of some size."]),
        ("* i / n", 2, ["`0`, `1`, `2`"]),
        ("scale(0.2 * r)", 1, ["scale(0.2);", "[ 0.2    0    0 ]"]),
        ("twirl", 1, ["p → R(0.5 |p|) p"]),
        ("square", 1, ["the first of 3", "[   1    0  0.5 ]", "half a side is 0.707"]),
    ]
    says(client, uri, rows)


def test_hover_tells_words_models_and_the_stage_unless_a_module_hides_it(client: Client, uri: str) -> None:
    text = 'nsg 1;\nmodel "shapes2d";\nsquare { scale(sin(TAU * 1rad)); }\n'
    client.replace(uri, text + "light(power = 3);\nsmooth(k = 0.2) { sphere; torus; }\n")
    rows = [
        ("shapes2d", 2, ["2D", "triangle"]),
        *[("sin", 1, ["sine"]), ("TAU", 1, ["2π"]), ("model", 1, ["usual one"])],
        *[("light", 1, ["up to eight"]), ("power", 1, ["power"])],
        *[("smooth", 1, ["blend"]), ("k = 0.2", 0, ["width"])],
    ]
    says(client, uri, rows)
    client.replace(uri, "sky(2);\nsphere { material metal { roughness(0.5); } }\n")
    rows = [("sky", 1, ["from surface to surface"]), ("metal", 1, ["needs a `sky`"])]
    says(client, uri, [*rows, ("roughness", 1, ["how far reflections spread"])])
    client.replace(uri, "samples(16);\nsquare { material flat { opacity(0.5); } }\n")
    says(client, uri, [("samples", 1, ["4 or 16"]), ("opacity", 1, ["behind an object"])])
    client.replace(uri, "module opacity(a) { square { scale(a); } }\nopacity(0.5);\n")
    says(client, uri, [("opacity(0.5)", 1, ["module opacity(a)"])])
    client.replace(uri, "module light(power) { sphere; }\nlight(3);\n")
    says(client, uri, [("light(3)", 1, ["module light(power)"])])


def test_fixes_are_code_actions(client: Client, uri: str) -> None:
    text = "square { rotate(30); scal(0.5) }\nlet spare = 1;\n"
    client.replace(uri, text)
    client.diagnostics(uri)
    at = client.at(uri, "30", 1)["position"]
    document = {"textDocument": {"uri": uri}, "range": {"start": at, "end": at}}
    params = {**document, "context": {"diagnostics": [], "only": ["quickfix"]}}
    actions = {a["title"]: a for a in client.request("textDocument/codeAction", params)}
    assert {a["kind"] for a in actions.values()} == {"quickfix"}
    for title, old, new in (("Insert `;`", "5) }", "5); }"), ("Rename to `scale`", "scal(", "scale(")):
        assert client.applied(text, actions[title]["edit"]["changes"][uri]) == text.replace(old, new)
    params["context"] = {"diagnostics": [], "only": ["source.fixAll"]}
    for done in ("0.5);", "rotate(30deg); scal(0.5);"):  # a guess is for the writer to take
        (whole,) = client.request("textDocument/codeAction", params)
        assert whole["kind"] == "source.fixAll.scenelang"
        fixed = client.applied(client.texts[uri], whole["edit"]["changes"][uri])
        assert done in fixed
        client.replace(uri, fixed)
        client.diagnostics(uri)


def test_formatting_changes_few_lines_and_leaves_broken_files(client: Client, uri: str) -> None:
    text = SCENE.replace("param k = 0.5 in 0..1;", "param   k=0.5   in 0..1;")
    client.replace(uri, text)
    params: Json = {"textDocument": {"uri": uri}, "options": {"tabSize": 2, "insertSpaces": True}}
    formatted = client.applied(text, client.request("textDocument/formatting", params))
    assert "param k = 0.5 in 0..1;" in formatted
    client.replace(uri, formatted)
    assert client.request("textDocument/formatting", params) == []
    client.replace(uri, "let  a=1;\n\n\nlet  b=2;\n")
    params["range"] = {"start": {"line": 3, "character": 0}, "end": {"line": 3, "character": 4}}
    (edit,) = client.request("textDocument/rangeFormatting", params)
    assert edit["range"]["start"]["line"] >= 1
    client.replace(uri, "let a = ;\n")
    assert client.request("textDocument/formatting", params) is None


def test_definition_goes_across_files(client: Client, uri: str) -> None:
    found = client.request("textDocument/definition", client.at(uri, "lib.dot", 5))
    assert found["range"]["start"] == {"line": 3, "character": 7}
    for word, shift in (("lib.dot", 5), ("size = r", 1), ('"lib.nsg"', 3)):
        found = client.request("textDocument/definition", client.at(uri, word, shift))
        assert found["uri"].endswith("lib.nsg"), word
    found = client.request("textDocument/definition", client.at(uri, "ring(3", 0))
    assert client.shown(uri, found["range"]) == "ring"
    assert client.request("textDocument/definition", client.at(uri, "square", 3)) is None
    (link,) = client.request("textDocument/documentLink", {"textDocument": {"uri": uri}})
    assert client.shown(uri, link["range"]) == "lib.nsg"
    assert link["target"].endswith("lib.nsg")


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


def test_shapes_by_points_are_offered_and_told(client: Client, folder: Path) -> None:
    text = "poly\npolygon([[0, 0], [1, 0], [0, 1]]);\nspline([[0, 0], [1, 0], [0, 1]]) { grow(2); }\n"
    uri = client.open((folder / "points.nsg").as_uri(), text)
    assert {"polygon", "spline"} <= {*labels(client, client.at(uri, "poly", 4))}
    says(client, uri, [("polygon", 1, ["polygon(points)", "winding number", "`points`", "flat scenes"])])
    found = client.request("textDocument/signatureHelp", client.at(uri, "spline([", 8))
    assert found["signatures"][0]["label"] == "spline(points)"


def test_a_font_brings_text_and_width(client: Client, folder: Path) -> None:
    text = 'import "std/letters" as abc;\nlet w = abc.width("A");\nabc.text("A", size = w);\n'
    text += "square { scale(abc.); }\nabc.;\n"
    uri = client.open((folder / "letters.nsg").as_uri(), text)
    assert labels(client, client.at(uri, "abc.);", 4)) == ["width"]
    assert labels(client, client.at(uri, "abc.;", 4)) == ["text"]
    says(client, uri, [("text", 1, ['text("Ag", size = 1, align = "left")', "letters", "Open Font License"])])
    says(client, uri, [("width", 1, ['width("Ag", size = 1)', "in world units"])])
    found = client.request("textDocument/signatureHelp", client.at(uri, "size = w", 7))
    assert found["signatures"][0]["label"] == 'text("Ag", size = 1, align = "left")'
    client.close(uri)


def test_the_library_that_ships_is_read_and_never_changed(client: Client, folder: Path) -> None:
    uri = client.open((folder / "shaped.nsg").as_uri(), 'import "std/shapes" as s;\ns.disc(0.3);\n')
    assert client.diagnostics(uri) == []
    found = client.request("textDocument/definition", client.at(uri, "disc", 1))
    assert found["uri"].endswith("std/shapes.nsg")
    assert client.request("textDocument/definition", client.at(uri, "std/", 1))["uri"] == found["uri"]
    says(client, uri, [("disc", 1, ["module disc(r = 1, ", "A disc of radius r"])])
    assert {"disc", "rect", "arrow"} <= set(labels(client, client.at(uri, "disc", 0)))
    assert "std/shapes" in labels(client, client.at(uri, "shapes", 0))
    for method, more in (("prepareRename", {}), ("rename", {"newName": "round"})):
        said = client.refused(f"textDocument/{method}", {**client.at(uri, "disc", 1), **more})
        assert "belongs to the library that ships" in said
    client.close(uri)


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


def test_loops_in_vectors_are_completed_told_and_renamed(client: Client, uri: str) -> None:
    text = "let late = 1;\nlet v = [for (i in 0..3) if (i > 1) [i, late]];\nsquare { scale(len(v)); }\n"
    client.replace(uri, text)
    assert "for (i in 0..3)" in hover(client, client.at(uri, "[i,", 1))
    edit = client.request("textDocument/rename", {**client.at(uri, "i in", 0), "newName": "turn"})
    (changes,) = [c["edits"] for c in edit["documentChanges"]]
    renamed = text.replace("(i in", "(turn in").replace("(i >", "(turn >").replace("[i,", "[turn,")
    assert client.applied(text, changes) == renamed
    client.replace(uri, text + "let w = [for (k in 0..3) , for (")
    for before, offered, withheld in (
        ("0..3) ,", "k late for if sin", "star"),
        ("3) , ", "late for if sin", "k"),
        ("3) , for (", "", "late for"),
        ("(k ", "in", "late"),
        ("(i > ", "i late", "for"),
    ):
        found = set(labels(client, client.at(uri, before, len(before) - before.endswith(","))))
        assert set(offered.split()) <= found, before
        assert not set(withheld.split()) & found, before


def test_rename_refuses_what_would_change_the_meaning(client: Client, uri: str) -> None:
    for word, shift, new, why in (
        ("let r", 4, "k", "already defined in line 3"),
        ("let r", 4, "2r", "not a name"),
        ("let r", 4, "module", "keyword"),
        ("ring(n", 0, "scale", "word of the language"),
        ("ring(n", 5, "c", "`c` is already defined"),
        ("let r", 4, "i", "`i` is already defined"),
        ("(n, c", 1, "k", "would mean this"),
        ("let r", 4, "hsv", "would mean this"),
    ):
        at = {**client.at(uri, word, shift), "newName": new}
        assert why in client.refused("textDocument/rename", at)
    assert "not defined" in client.refused("textDocument/prepareRename", client.at(uri, "square", 1))


def test_symbols_of_a_file_and_of_the_folder(client: Client, uri: str) -> None:
    found = client.request("textDocument/documentSymbol", {"textDocument": {"uri": uri}})
    assert [s["name"] for s in found] == ["lib", "k", "r", "ring"]
    (loop,) = found[3]["children"]
    assert [loop["name"], *(s["name"] for s in loop["children"])] == ["for i", "square"]
    client.replace(uri, "camera(fov = 40deg);\nsmooth(k = 0.2) { sphere; }\nlight;\n")
    found = client.request("textDocument/documentSymbol", {"textDocument": {"uri": uri}})
    named = [(s["name"], s.get("detail")) for s in found]
    assert named == [("camera", "(fov = 40deg)"), ("smooth", "(k = 0.2)"), ("light", None)]
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
    assert all(inner in outer for inner, outer in pairwise(texts))


def test_colours_are_shown_and_written(client: Client, uri: str) -> None:
    text = "background([0, 0.5, 1]);\nlet c = rgb(1, 0, 0);\nlet d = hsv(120deg, 1, 1);\nlet e = #abc;\n"
    client.replace(uri, text + "light([0, 1, 0], color = [1, 1, 0]);\nground(-1, [0, 1, 0]);\n")
    found = client.request("textDocument/documentColor", {"textDocument": {"uri": uri}})
    texts = ["[0, 0.5, 1]", "rgb(1, 0, 0)", "hsv(120deg, 1, 1)", "#abc", "[1, 1, 0]", "[0, 1, 0]"]
    assert [client.shown(uri, f["range"]) for f in found] == texts
    assert found[2]["color"] == pytest.approx({"red": 0, "green": 1, "blue": 0, "alpha": 1})
    params = {"textDocument": {"uri": uri}, "range": found[1]["range"], "color": found[2]["color"]}
    forms = [p["label"] for p in client.request("textDocument/colorPresentation", params)]
    assert forms == ["rgb(0, 1, 0)", "#0f0", "hsv(0.333, 1, 1)", "[0, 1, 0]"]


def test_semantic_tokens_and_hints_tell_what_a_grammar_cannot_know(client: Client, uri: str) -> None:
    legend = client.capabilities["semanticTokensProvider"]["legend"]["tokenTypes"]
    data = client.request("textDocument/semanticTokens/full", {"textDocument": {"uri": uri}})["data"]
    found: dict[str, tuple[str, int]] = {}
    line = column = 0
    lines = SCENE.split("\n")
    for at in range(0, len(data), 5):
        step, start, length, kind, modifiers = data[at : at + 5]
        line, column = line + step, start if step else column + start
        found[lines[line][column : column + length]] = legend[kind], modifiers
    for text, kind in {
        **{"ring": "class", "lib": "namespace", "twirl": "method", "k": "property", "n": "parameter"},
        **{"// how large": "comment", "#d33": "number"},
    }.items():
        assert found[text][0] == kind, text
    assert found["twirl"][1] == 4
    whole = {"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}}
    hints = client.request("textDocument/inlayHint", {"textDocument": {"uri": uri}, "range": whole})
    assert [(hint["label"], hint["position"]["line"]) for hint in hints] == [(" = 1", 3), ("n:", 9)]


def test_elements_groups_and_materials_are_proposed_and_told_of(
    client: Client, uri: str, folder: Path
) -> None:
    ring = Part("ring", (0.0, 0.5, 0.0), 0.5)
    elements = [element(torus, "ring"), element(ball, "ball"), noise(2, 3, name="ring"), noise(2, 2)]
    elements[1] = replace(elements[1], about={"size": 2.5, "x": 0, "y": -1.5, "z": 4})
    groups = {"car": (ring, ring), "ring": (ring,)}
    (folder / "zoo.safetensors").write_bytes(element_file_bytes(elements, groups))
    text = 'import "zoo.safetensors" as zoo;\nzoo.ring { scale(0.5); }\nzoo.car();\n'
    client.replace(uri, text + "sphere { material diffuse zoo.ring; }\ntorus { material zoo.; }\nzoo.;\n")
    assert labels(client, client.at(uri, "zoo.;\n", 4)) == [
        "ball",
        "car()",
        "ring",
        "ring()",
        "ball_centre",
        "ball_size",
    ]
    text += "sphere { scale(zoo.ball_size); translate(zoo.ball_centre); }\n"
    client.replace(uri, text + "sphere { material diffuse zoo.ring; }\ntorus { material zoo.; }\nzoo.;\n")
    assert labels(client, client.at(uri, "zoo.; }", 4)) == ["bark", "ring"]
    assert set(labels(client, client.at(uri, "material diffuse", 9))) >= {"diffuse", "flat", "zoo", *PAINTS}
    assert labels(client, client.at(uri, "diffuse zoo", 8))[-1] == "zoo"
    shape = ["element of space: 33 × 33 × 33 distances", "license: none needed", "ring(): group of ring"]
    rows = [("zoo.ring {", 5, shape), ("zoo.ring;", 5, ["texture: 3 × 2 colours"])]
    rows.append(("ball_centre", 5, ["size: 2.5", "y: -1.5"]))
    says(client, uri, [*rows, ("zoo.car", 5, ["car(): group of 2 ring"])])
    assert "distances" not in hover(client, client.at(uri, "zoo.ring;", 5))
    assert "data:image" not in hover(client, client.at(uri, "zoo.ring {", 5))  # this editor shows none
    found = client.request("textDocument/definition", client.at(uri, "zoo.ring;", 5))
    assert found["range"]["start"]["line"] == 0


def test_elements_are_shown_where_the_editor_shows_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    markdown = {"parser": "marked", "allowedTags": ["p", "img"]}
    monkeypatch.setitem(CAPABILITIES["general"], "markdown", markdown)
    elements = [element(torus, "ring"), element(square, "tile", d=2)]
    (tmp_path / "zoo.safetensors").write_bytes(element_file_bytes(elements))
    with Client(tmp_path) as client:
        text = 'import "zoo.safetensors" as zoo;\nzoo.ring { }\nzoo.tile { }\n'
        uri = client.open((tmp_path / "a.nsg").as_uri(), text)
        told = [hover(client, client.at(uri, name, 5)) for name in ("zoo.ring", "zoo.tile", "zoo.ring")]
    pictures = [text.partition("(data:image/png;base64,")[2].partition(")")[0] for text in told]
    assert pictures[0] == pictures[2]
    ring, tile = (np.asarray(Image.open(BytesIO(b64decode(picture)))) for picture in pictures[:2])
    assert ring.shape == tile.shape == (96, 96, 3)
    assert max(map(len, pictures)) < 20_000
    assert tile[48, 48].tolist() == [34, 34, 34]
    assert tile[2, 2].tolist() == [255, 255, 255]
    assert np.ptp(ring[40:56, 40:56, 0]) > 40  # lit
