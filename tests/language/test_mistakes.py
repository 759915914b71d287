"""Every mistake is reported once, where it is, and nothing else is."""

from __future__ import annotations

from collections import Counter

from scenelang.language import tree as nodes
from scenelang.language.pages import CODES
from tests.language.reading import MALFORMED, apply, expected, mistakes, read

ONE_LINERS: list[tuple[str, list[tuple[int, str]]]] = [
    ("let a = 1", [(10, "E0102")]),
    ("scale(0.8) translate(1, 2);", [(11, "E0102")]),
    ("let mist = material flat\nstar { mist; }", [(25, "E0102")]),  # no texture of another line
    ("translate(-0.2, 0; scale(2);", [(18, "E0103")]),
    ("translate(sin(cos(0.5);", [(23, "E0103")]),
    ("fn f(p = abs(sin(p));", [(7, "E0103")]),
    ("group { star; ", [(14, "E0104")]),
    ("star { } }", [(10, "E0105")]),
    ("let v = [1, 2);", [(14, "E0105")]),
    ("for (i in 0..3) star;", [(17, "E0106")]),
    ("group star { } }", [(6, "E0106")]),
    ("scale 0.8);", [(6, "E0107")]),
    ("if a > 2 { star; }", [(4, "E0107")]),
    ("let a = ;", [(9, "E0108")]),
    ("let = 3;", [(5, "E0109")]),
    ("let if = 3;", [(5, "E0110")]),
    ("if (a = b) { star; }", [(7, "E0111")]),
    ("translate(0.1 0.2);", [(14, "E0112")]),
    ("let a = b ~ c;", [(11, "E0113")]),
    ('model "shapes2d;', [(7, "E0114")]),
    ("star; /* never", [(7, "E0115")]),
    ("scale(1.2.3);", [(7, "E0116")]),
    ("rotate(30 deg);", [(8, "E0117")]),
    ("rotate(30 degrees);", [(8, "E0117")]),
    ("color(#12);", [(7, "E0118")]),
    (r'model "a\b";', [(9, "E0119")]),
    ("let a = " + "(" * 300 + "1" + ")" * 300 + ";", [(209, "E0120")]),
    ("import as x y z;", [(1, "E0133")]),
    ("model 'shapes2d';", [(7, "E0123")]),
    ("let ä = 1;", [(5, "E0124")]),
    ("let a = 1e400;", [(9, "E0125")]),
    ("let a 3;", [(6, "E0126")]),
    ("param k;", [(8, "E0126")]),
    ("import parts.nsg as parts;", [(1, "E0126")]),
    ("let a = 2 ** 3;", [(11, "E0127")]),
    ("let a = [1].f();", [(9, "E0128")]),
    ("{ star; }", [(1, "E0129")]),
    ("translate(1; 2);", [(12, "E0130")]),
    ("f(a: 1);", [(4, "E0130")]),
    ("a let = 3;", [(1, "E0131")]),
    ('modle "shapes2d";', [(1, "E0132")]),
    ("for (i = [0:5]) { star; }", [(8, "E0133")]),
    ("modul x() { square; }\nx();", [(1, "E0132")]),
    ("chain { square; subtrct star; }", [(17, "E0132")]),
    ("parm k = 1;\nlet z = k;", [(1, "E0132")]),
    ("star { };", [(9, "W0101")]),
    ("star { }; ; ;", [(9, "W0101"), (11, "W0101"), (13, "W0101")]),
    ("let let a = 3;", [(5, "E0101")]),
    ("fr (i in 0..3) { star; }", [(1, "E0132")]),
    ("for (i n 0..3) { star; }", [(8, "E0132")]),
    ("fi (a) { star; } else { square; }", [(18, "E0101")]),
    ("let m = materila flat { color(#d33); };", [(9, "E0132")]),
    ("function half(x) = x / 2;", [(1, "E0132")]),
    ("var a = 3;", [(1, "E0132")]),
    ("foreach (i in 0..3) { star; }", [(1, "E0132")]),
    ("for (i = 0; i < 3; i++) { star; }", [(8, "E0126")]),
    ("# a comment", [(1, "E0127")]),
    ("star;  # a comment, with (signs);", [(8, "E0127")]),
    ("#a comment\t(here", [(1, "E0127")]),
    ("color(#);", [(7, "E0118")]),
    ("let n = 1,000;", [(10, "E0101")]),
    ("let n = 1_000;", [(9, "E0116")]),
    ("f(1,000);", []),
    ("if a > 1 and b < 2 { star; }", [(4, "E0107"), (10, "E0127")]),
    ("fn half x = x / 2;", [(9, "E0107")]),
    ("scale] 0.8);", [(6, "E0101")]),
    ("square ] scale(2); translate(1, 0); }", [(8, "E0130")]),
    ("rotate}sway(0.25));", [(7, "E0130")]),
    ("square { scale(50%); }", [(18, "E0133")]),
    ('square { fill = "#f00"; }', [(10, "E0126")]),
    ("for (i in 0..3) { i = i + 1; }", [(19, "E0133")]),
    ("= = =;", [(1, "E0122")]),
    ("let = 3; let 0.5 = 4;", [(5, "E0109"), (14, "E0109")]),
    ("translate(0, 0.5 *\nscale(2);", [(19, "E0108")]),
    ("for (i in 0..<\nsquare { }", [(15, "E0108")]),
    ("else { star; }", [(1, "E0101")]),
    ("use <lib.nsg>", [(1, "E0126")]),
    ('include "lib.nsg";  // parts', [(1, "E0126")]),
    ('import "lib.nsg";', [(17, "E0126")]),
    ("let m = material flat { color(#d33);\nstar { m; }\nsquare { m; }", [(37, "E0104")]),
]


def too_many() -> str:
    return "let = 1;\n" * 300


def test_malformed_scenes() -> None:
    texts = [path.read_text(encoding="utf-8") for path in MALFORMED]
    assert [mistakes(read(text)[1]) for text in texts] == [expected(text) for text in texts]


def test_there_are_ten_malformed_scenes() -> None:
    assert len(MALFORMED) == 10
    assert all(len(expected(path.read_text(encoding="utf-8"))) >= 3 for path in MALFORMED)


def test_one_liners() -> None:
    wrong = []
    for text, where in ONE_LINERS:
        tree, diagnostics = read(text)
        found = mistakes(diagnostics)
        if found != [(1, column, code) for column, code in where] or tree.span.end != len(text):
            wrong.append((text, found))
    assert wrong == []


def test_every_code_is_produced() -> None:
    texts = [path.read_text(encoding="utf-8") for path in MALFORMED]
    texts += [text for text, _ in ONE_LINERS]
    texts.append(too_many())
    assert {d.code for text in texts for d in read(text)[1]} == {
        code for code in CODES if code[1:3] == "01" and code != "W0102"
    }  # which is of all stages


def test_too_many_mistakes_end_the_report() -> None:
    tree, diagnostics = read(too_many())
    assert len(diagnostics) == 201
    assert diagnostics[-1].code == "E0121"
    assert isinstance(tree.statements[-1], nodes.BadStmt)


def test_a_fix_mends_its_mistake_and_makes_none() -> None:
    texts = [path.read_text(encoding="utf-8") for path in MALFORMED]
    wrong = []
    for text in texts + [text for text, _ in ONE_LINERS]:
        found = read(text)[1]
        before = Counter(d.code for d in found)
        for d in found:
            after = Counter(other.code for other in read(apply(text, d.fix))[1]) if d.fix else None
            if after is not None and (before - after != Counter([d.code]) or not after <= before):
                wrong.append((text, d))
    assert wrong == []


def test_messages_follow_the_house_style() -> None:
    texts = [path.read_text(encoding="utf-8") for path in MALFORMED] + [text for text, _ in ONE_LINERS]
    for text in texts:
        for d in read(text)[1]:
            assert d.message[0] in "`" or not d.message[0].isupper()
            assert not d.message.endswith(".")
