"""Findings of fuzzing that are not plain inputs; those are in ``found/`` and run by `test_targets`."""

from __future__ import annotations

import json
from itertools import product

import numpy as np
import pytest

from fuzz.oracles import check_rendering
from fuzz.pumps import READERS, Pump
from scenelang.drawing.render import render
from scenelang.language.diagnostics import Diagnostic, Diagnostics, SourceFile
from scenelang.language.evaluation import loads
from scenelang.language.formatting import format_text
from scenelang.language.parser import parse
from scenelang.language.reports import SceneError, render_sarif, render_text
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


def test_pictures_are_numbers_however_large_the_moves() -> None:
    """Angles beyond float32 have no cosine: pixels were NaN, and bytes whatever the processor made of it."""
    for moves in ("twirl(-1e19); scale(1e-29);", "bend(1e25); scale(1e20); translate(1e29, 0);"):
        for after in ("smooth square { scale(0.5); }", "intersect square { }", ""):
            chain = f"chain {{ square {{ }} smooth star {{ {moves} }} {after} }}"
            picture = render(loads(f"canvas(9, 7); background(#123); {chain}"), device="cpu", threads=1)
            assert np.isfinite(picture).all(), chain
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


def test_reserved_words_are_those_of_the_grammar() -> None:
    words = {text for text in tables().literals if text[0].isalpha()}
    assert words - set(RESERVED) == {"step", "as"}  # keywords only where they can follow something
    assert set(RESERVED) <= words


def test_formatting_takes_stray_semicolons_out() -> None:
    """They are only warned about, and the formatter took a text without errors for one the grammar reads."""
    laid = {
        "star {};\n": "star {}\n",
        "let a = 1; ;; // one\nlet b = 2;": "let a = 1;  // one\nlet b = 2;\n",
        "group { star { } /* two */; }": "group { star {} /* two */ }\n",
        "star { }\r\n;\r\n": "star {}\r\n",
        ";": "",
    }
    assert {text: format_text(text) for text in laid} == laid


def test_files_whose_names_are_no_text() -> None:
    """Python names a file that is not UTF-8 by lone surrogates, of which SARIF made no URI."""
    for name, uri in (
        ("a\udcff.nsg", "a%FF.nsg"),
        ("\ud800.nsg", "%ED%A0%80.nsg"),
        ("/é b.nsg", "file:///%C3%A9%20b.nsg"),
    ):
        found = Diagnostics()
        parse(SourceFile(name, "let"), found)
        check_rendering(list(found))
        log = json.loads(render_sarif(list(found)))
        place = log["runs"][0]["results"][0]["locations"][0]["physicalLocation"]
        assert place["artifactLocation"]["uri"] == uri


def test_a_dot_behind_a_number_behind_a_comment_is_no_decimal_point() -> None:
    """The formatter looked for a number alone, and stopped at its own check of the result."""
    for number, before, between in product(
        ("0", "1.5", "2e3", ".5"),
        ("", "/* */ ", "0 ? b : /* 7 */ ", "// x\n"),
        ("", "// line\n", "/* c */ "),
    ):
        done = format_text(f"let a = {before}{number} . {between}a;")
        assert f"{number} ." in done
        assert format_text(done) == done


LONG = (
    *(Pump("edit", unit) for unit in ("//", "/* ", '\\"')),
    Pump("fmt", "/* "),
    Pump("edit", "a", "let ", tail=" = 1;"),
)
FORMER = (
    Pump("check", "{", "nsg 1;\n"),
    Pump("fmt", "{", "square;\n"),
    Pump("check", "let x = 1; {"),
    Pump("check", 'import "std/shapes" as a\u00a4;'),
    Pump("check", "..\n(1,2)\n"),
    Pump("check", "s.disc(0.3);", 'import "std/shapes" as s;'),
    Pump("check", "star { scale(; } group } [ "),
    Pump("check", "", "for (i in 0..1e9) { for (j in 0..1e9) {} }"),
    Pump("fix", "star{rotate(TAU*u);}", "animate(1, 24);"),
    Pump("fix", "scale = 2; "),
    Pump("fix", "(1,2) step "),
    Pump("fix", "rotate(45);", "star {", tail="}"),
    Pump("fix", ";"),
    Pump("fix", "/*"),
)


def read_long_texts() -> None:
    """Read texts that once took minutes; the last one named is the one that still does."""
    for pumped, letters in ((LONG, 100_000), (FORMER, 50_000)):
        for pump in pumped:
            print(pump, flush=True)
            READERS[pump.reader](pump.text(letters))


def test_long_texts_are_read_in_time() -> None:
    """Patterns that met no end began again one letter further on; 5 KB of braces took 43 s."""
    ends("from tests.fuzz.test_found import read_long_texts; read_long_texts()")
