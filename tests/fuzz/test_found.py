"""What fuzzing found, one test each; the inputs themselves are in ``found/`` and run by `test_targets`."""

from __future__ import annotations

import json
import struct
from dataclasses import replace

import numpy as np
import pytest

from fuzz.oracles import check_rendering
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.manifest import ROOT, Manifest
from scenelang.compiler.program import ProgramError
from scenelang.compiler.weights import ModelError, read_facts
from scenelang.drawing.how import RenderError
from scenelang.drawing.render import render
from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile
from scenelang.language.evaluation import loads
from scenelang.language.formatting import format_text
from scenelang.language.machine import render_sarif
from scenelang.language.parser import parse
from scenelang.language.reports import SceneError, render_text
from scenelang.language.scene import Scene
from scenelang.language.tables import tables
from scenelang.language.words import RESERVED
from tests.work import ends, lines_run


def illegal(count: int, around: int) -> list[Diagnostic]:
    """What is found in one line with so many illegal characters, and so many others before and after them."""
    source = SourceFile("long.nsg", "x" * around + " \0" * count + "y" * around)
    found = Diagnostics()
    parse(source, found)
    return list(found)


def test_snippets_of_a_very_long_line_lay_out_only_what_is_near_their_marks() -> None:
    """Each of 200 diagnostics laid out the whole line seven times: minutes for a file of one line."""

    def work(around: int) -> int:
        found = illegal(5, around)
        return lines_run(lambda: render_text(found))

    assert work(100_000) < 1.1 * work(10_000)
    lines = render_text(illegal(300, 300_000)).splitlines()
    assert max(map(len, lines)) < 200
    carets = [index for index, line in enumerate(lines) if line.endswith("^")]
    for index in carets[1:150]:  # the first caret may stand under a cut line
        marked = lines[index - 1][len(lines[index]) - 1]
        assert marked == "\N{REPLACEMENT CHARACTER}", lines[index - 1 : index + 1]


MANIFEST = json.loads((ROOT / "shapes2d" / "manifest.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    "change",
    [
        {"trained": -1},
        {"trained": {"twirl": 1e308}},
        {"trained": {"twirl": [1, 10**400]}},
        {"trained": {"twirl": [2, 1]}},
        {"geometries": ["square", False]},
        {"geometries": "square"},
        {"geometries": ["square", "square"]},
        {"materials": []},
        {"limits": -1e308},
        {"limits": {"canvas": {}}},
        {"limits": {"inner_warps": [1, 2]}},
        {"limits": {"inner_warps": True}},
        {"measured": "union"},
        {"measured": {"stability": {"twirl": 5}}},
        {"name": [-1, 1]},
        {"name": 'a"b'},
        {"summary": "two\nlines"},
        {"dimension": 2.0},
        {"dimension": True},
        {"renderer": None},
        {"format": 2},
        {"more": 1},
    ],
    ids=str,
)
def test_manifests_hold_what_the_compiler_asks_of_them(change: dict[str, object]) -> None:
    """Each of these was a traceback while a scene was evaluated or compiled."""
    Manifest.from_json(json.dumps(MANIFEST))
    with pytest.raises(ValueError, match=r"."):
        Manifest.from_json(json.dumps({**MANIFEST, **change}))


def test_manifests_miss_nothing() -> None:
    for key in MANIFEST.keys() - {"layout", "any_blend"}:
        with pytest.raises(ValueError, match=r"."):
            Manifest.from_json(json.dumps({k: v for k, v in MANIFEST.items() if k != key}))


@pytest.mark.parametrize("shape", [[1e308, 10**400], "ab", None, [-1], [1 << 40], [True], {}], ids=str)
def test_shapes_in_weights_are_shapes(shape: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """The size of a tensor of 10^400 numbers has no float64."""
    outer = {
        "__metadata__": {"scenelang": '{"format": 1}'},
        "codes": {"dtype": "F32", "shape": shape, "data_offsets": [0, 4]},
    }
    text = json.dumps(outer).encode()
    data = struct.pack("<Q", len(text)) + text
    monkeypatch.setattr("scenelang.compiler.weights.read_regular", lambda path, most: data)
    with pytest.raises(ModelError, match="has no shape"):
        read_facts("shapes2d")


@pytest.mark.parametrize("background", [[0, 0, 10**400], [-1e308, 0, 0], [0.5, 1.0000001, 0]], ids=str)
def test_a_program_has_a_colour_behind_it(background: list[float]) -> None:
    """numpy has no isfinite for 10^400, and -1e308 overflows float32."""
    program = compile_scene(loads("star { }"))
    with pytest.raises(ProgramError, match="which is not a colour"):
        replace(program, background=tuple(background))


@pytest.mark.parametrize(
    "frame",
    [
        [0] * 6,
        [1, 1, 0, 1, 1, 0],
        [1e35, 0, 0, 0, 1, 0],
        [1e-40, 0, 0, 0, 1e-40, 0],
        [1e-45, 3e38, 0, 1e-45, 1, 0],
    ],
    ids=str,
)
@pytest.mark.parametrize("start", [5, 20])
def test_vectors_that_lead_nowhere_are_refused_when_drawn(frame: list[float], start: int) -> None:
    """A singular frame was a LinAlgError, a nearly singular one a ZeroDivisionError."""
    program = compile_scene(loads("canvas(8, 8); star { bend(1); scale(2); }"))
    vectors = program.vectors.copy()
    vectors[0, start : start + 6] = frame
    with pytest.raises(RenderError, match="damaged program"):
        render(replace(program, vectors=vectors), device="cpu", threads=1)


@pytest.mark.parametrize(
    "moves", ["twirl(-1e19); scale(1e-29);", "bend(1e25); scale(1e20); translate(1e29, 0);"]
)
@pytest.mark.parametrize("after", ["smooth square { scale(0.5); }", "intersect square { }", ""])
def test_pictures_are_numbers_however_large_the_moves(moves: str, after: str) -> None:
    """Angles beyond float32 have no cosine: pixels were NaN, and bytes whatever the processor made of it."""
    scene = loads(
        f"canvas(9, 7); background(#123); chain {{ square {{ }} smooth star {{ {moves} }} {after} }}"
    )
    picture = render(scene, device="cpu", threads=1)
    assert np.isfinite(picture).all()
    assert picture.to_uint8().shape == (7, 9, 3)


def test_a_step_of_a_call_is_no_more_work_than_one_of_a_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    """Doubling functions took half a minute to ten million steps, where a loop took two seconds."""
    monkeypatch.setattr("scenelang.language.session.MAX_STEPS", 50_000)

    def stopped(text: str) -> None:
        with pytest.raises(SceneError, match="E0322"):
            loads(text)

    loop = lines_run(lambda: stopped("for (i in 0..<1000000) { let a = i * i; }"))
    calls = lines_run(lambda: stopped("fn f(n) = n < 1 ? 0 : f(n - 1) + f(n - 1); let a = f(100);"))
    assert calls < loop  # 8 and 21 lines a step


def test_a_param_in_a_range_of_steps_too_small_to_count() -> None:
    """The number of steps from 0 to 1 was infinite, and infinity has no nearest whole number."""
    assert loads("param k = 1 in 0..1 step 1e-320; square { scale(k); }").nodes


@pytest.mark.parametrize(
    "data",
    [
        {"background": [1, 1, 1e9]},
        {"background": [-0.1, 0, 0]},
        {"animation": {"seconds": 1e200, "fps": 1e200}},
        {"animation": {"seconds": 1e6, "fps": 2}},
        {"nodes": [{"kind": "object", "geometry": "union"}]},
        {"nodes": [{"kind": "object", "geometry": "star", "material": {"name": "for"}}]},
    ],
    ids=str,
)
def test_scenes_from_data_are_no_more_than_text_can_say(data: dict[str, object]) -> None:
    """Their text was refused, or read back as something else."""
    with pytest.raises(SceneError, match="E0313"):
        Scene.from_json(json.dumps(data))


def test_reserved_words_are_those_of_the_grammar() -> None:
    words = {text for text in tables().literals if text[0].isalpha()}
    assert words - set(RESERVED) == {"step", "as"}  # keywords only where they can follow something
    assert set(RESERVED) <= words


@pytest.mark.parametrize(
    ("text", "laid"),
    [
        ("star {};\n", "star {}\n"),
        ("let a = 1; ;; // one\nlet b = 2;", "let a = 1;  // one\nlet b = 2;\n"),
        ("group { star { } /* two */; }", "group { star {} /* two */ }\n"),
        ("star { }\r\n;\r\n", "star {}\r\n"),
        (";", ""),
    ],
)
def test_formatting_takes_stray_semicolons_out(text: str, laid: str) -> None:
    """They are only warned about, and the formatter took a text without errors for one the grammar reads."""
    assert format_text(text) == laid


@pytest.mark.parametrize(
    ("name", "uri"),
    [("a\udcff.nsg", "a%FF.nsg"), ("\ud800.nsg", "%ED%A0%80.nsg"), ("/é b.nsg", "file:///%C3%A9%20b.nsg")],
)
def test_files_whose_names_are_no_text(name: str, uri: str) -> None:
    """Python names a file that is not UTF-8 by lone surrogates, of which SARIF made no URI."""
    source = SourceFile(name, "let")
    found = Diagnostics()
    parse(source, found)
    check_rendering(list(found))
    log = json.loads(render_sarif(list(found)))
    place = log["runs"][0]["results"][0]["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == uri


@pytest.mark.parametrize("number", ["0", "1.5", "2e3", ".5"])
@pytest.mark.parametrize("before", ["", "/* */ ", "0 ? b : /* 7 */ ", "// x\n"])
@pytest.mark.parametrize("between", ["", "// line\n", "/* c */ "])
def test_a_dot_behind_a_number_behind_a_comment_is_no_decimal_point(
    number: str, before: str, between: str
) -> None:
    """The formatter looked for a number alone, and stopped at its own check of the result."""
    done = format_text(f"let a = {before}{number} . {between}a;")
    assert f"{number} ." in done
    assert format_text(done) == done


@pytest.mark.parametrize(
    ("reader", "unit", "head", "tail"),
    [
        ("fmt", "/* ", "", ""),
        ("edit", "//", "", ""),
        ("edit", "/* ", "", ""),
        ("edit", '\\"', "", ""),
        ("edit", "a", "let ", " = 1;"),
    ],
)
def test_text_without_end_is_read_once(reader: str, unit: str, head: str, tail: str) -> None:
    """Patterns that met no end began again one letter further on."""
    ends(f"from fuzz import pumps; pumps.READERS[{reader!r}]({head!r} + {unit!r} * 300_000 + {tail!r})")
