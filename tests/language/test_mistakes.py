"""Mistakes: each is reported once, with its code, at its place, with fixes that mend, and no other is.

A case of ``*.nsgs`` has a title, a text with marks, and below a line what its fixes make of it, if anything;
in ``advice.nsgs`` the title is part of the help, and the text below the line follows it.
"""

from __future__ import annotations

import re
from collections import Counter
from functools import cache
from pathlib import Path

import scenelang as nsg
from scenelang.language import foreign
from scenelang.language import tree as nodes
from scenelang.language.diagnostics import SourceFile, Span, apply_fixes, did_you_mean, ranked, settle
from scenelang.language.pages import CODES
from scenelang.language.values import FUNCTIONS
from scenelang.language.words import LANGUAGE, STAGE
from tests.language.cases import HERE, Outcome, mismatch, run_text
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

TEXTS = [path.read_text("utf-8") for path in MALFORMED]
MISTAKEN = [path.read_text("utf-8") for path in sorted((HERE / "mistaken").glob("*.nsg"))]


def cases(name: str) -> list[tuple[str, str]]:
    """Text and what the fixes make of it, of each case of a file."""
    texts = re.split(r"^=== .*\n", (HERE / name).read_text("utf-8"), flags=re.MULTILINE)[1:]
    return [case.partition("---\n")[::2] for case in texts]


ERRORS, HABITS, FIXES = map(cases, ("errors.nsgs", "habits.nsgs", "fixes.nsgs"))


@cache
def outcome_of(text: str) -> Outcome:
    """The result of a case; two tests look at it."""
    return run_text(text)


def test_advice_leads_to_a_scene() -> None:
    wrong = []
    for case in (HERE / "advice.nsgs").read_text("utf-8").split("===")[1:]:
        head, meant = case.strip().split("\n---\n")
        said, _, text = head.rpartition("\n")
        found = [*nsg.check_text(text)]
        only = found[0] if len(found) == 1 else None
        if (
            only is None
            or only.code not in CODES
            or said not in (only.help or "")
            or [*nsg.check_text(meant)]
        ):
            wrong.append((text, found))
        elif only.fix is not None:
            after, left = nsg.fix_text(text)
            if " ".join(after.split()) != meant or [*left]:
                wrong.append((text, [after, *left]))
    assert wrong == []


def test_lists_name_what_can_stand_there() -> None:
    """Not what a library is made of inside: a statement is no place for a function."""
    shapes = 'import "std/shapes" as s;'
    (only,) = nsg.check_text(f"{shapes} s.blob(0.3);")
    assert (only.help or "").startswith("it has arc, arrow, capsule, corners, disc")
    (only,) = nsg.check_text(f"{shapes} square {{ scale(s.sizze([1, 0])); }}")
    assert only.help == "did you mean `size`?"


def test_time_in_an_imported_file_is_for_the_scene_to_run(tmp_path: Path) -> None:
    (tmp_path / "lib.nsg").write_text("module hand() { star { rotate(360deg * t); } }", "utf-8")
    (tmp_path / "a.nsg").write_text('import "lib.nsg" as lib; lib.hand();', "utf-8")
    assert [*nsg.check(tmp_path / "a.nsg")] == []
    (tmp_path / "a.nsg").write_text("star { rotate(360deg * t + 1deg * frame); }", "utf-8")
    assert [d.code for d in nsg.check(tmp_path / "a.nsg")] == ["W0304"]


def test_marked_mistakes_are_all() -> None:
    assert len(MISTAKEN) == len(MALFORMED) == 10
    assert all(text.count("//!") >= 3 for text in MISTAKEN)
    texts = MISTAKEN + [text for text, _ in ERRORS + HABITS + FIXES]
    assert [(text, no) for text in texts if (no := mismatch(text, outcome_of(text).diagnostics))] == []
    assert [t for t in texts if (outcome_of(t).scene is None) != bool(outcome_of(t).diagnostics.errors)] == []
    assert [mistakes(read(text)[1]) for text in TEXTS] == [expected(text) for text in TEXTS]
    assert all(len(expected(text)) >= 3 for text in TEXTS)


def test_fixes_of_habits_and_words_mend_or_are_not_there() -> None:
    wrong = []
    for text, meant in HABITS + FIXES:
        bare = "\n".join(line.partition("//!")[0].rstrip() for line in text.split("\n"))
        done = settle({0: bare}, lambda texts: [(0, d) for d in run_text(texts[0]).diagnostics])
        if done.texts[0].strip() != (meant or bare).strip() or any(d.fix for _, d in done.left):
            wrong.append((text, done.texts[0]))
    assert wrong == []
    assert run_text("let ab = 1; square { translate(ba, 0); }").only().fix is None
    assert not any(d.fix for d in run_text('import "my parts.nsg as a;').diagnostics)


def test_habits_in_what_is_taken_for_a_comment() -> None:
    for text, code, meant in (
        ("let a = 7 // 2;\nsquare { scale(a / 7); }", "E0102", None),
        (
            "let a = 7 // of them\nsquare { scale(a / 7); }",
            "E0102",
            "let a = 7; // of them\nsquare { scale(a / 7); }",
        ),
        ("#define K 0.5\nsquare { scale(K); }", "E0133", "let K = 0.5;\nsquare { scale(K); }"),
        ("#declare K = 0.5;\nsquare { scale(K); }", "E0133", "let K = 0.5;\nsquare { scale(K); }"),
    ):
        found = run_text(text).only()
        assert (found.code, found.fix and apply_fixes(text, [found])[0]) == (code, meant)
        assert meant is None or not run_text(meant).codes


def test_habits_next_to_each_other_are_told_apart() -> None:
    own = [text for text, _ in HABITS if set(re.findall("[EW][0-9]{4}", text)) == {"E0133"}]
    texts = [text for text in own if not re.search("let |for i|param|uniform|import|define", text)]
    together = "".join(f"group {{\n{text}\n}}\n" for text in texts)
    assert len(texts) > 20
    assert mismatch(together, run_text(together).diagnostics) == ""


def test_one_liners() -> None:
    wrong = []
    for text, where in ONE_LINERS:
        tree, diagnostics = read(text)
        found = mistakes(diagnostics)
        if found != [(1, column, code) for column, code in where] or tree.span.end != len(text):
            wrong.append((text, found))
    assert wrong == []


def test_every_code_of_syntax_is_produced_and_too_many_end_the_report() -> None:
    many = "let = 1;\n" * 300
    found = {d.code for text in (*TEXTS, many, *(text for text, _ in ONE_LINERS)) for d in read(text)[1]}
    assert found == {code for code in CODES if code[1:3] == "01" and code != "W0102"}  # of all stages
    tree, diagnostics = read(many)
    assert (len(diagnostics), diagnostics[-1].code) == (201, "E0121")
    assert isinstance(tree.statements[-1], nodes.BadStmt)


def test_a_fix_mends_its_mistake_and_makes_none() -> None:
    wrong = []
    for text in TEXTS + [text for text, _ in ONE_LINERS]:
        found = read(text)[1]
        before = Counter(d.code for d in found)
        for d in found:
            after = Counter(other.code for other in read(apply(text, d.fix))[1]) if d.fix else None
            if after is not None and (before - after != Counter([d.code]) or not after <= before):
                wrong.append((text, d))
    assert wrong == []


def test_messages_keep_the_house_style() -> None:
    found = [d for text in TEXTS + [text for text, _ in ONE_LINERS] for d in read(text)[1]]
    found += [
        d for text in MISTAKEN + [text for text, _ in ERRORS + HABITS] for d in outcome_of(text).diagnostics
    ]
    for d in found:
        assert d.code in CODES
        assert d.message[0] == d.message[0].lower(), d.message
        assert not d.message.endswith("."), d.message
        assert not (d.help or "").endswith("."), d.help
        quoted = re.sub("`[^`]*`", "", f"{d.message} {d.help}")
        assert not re.search(r"(?<![\w\"])'[^'\n]*'(?!\w)", quoted), "names stand in backticks"


# ---------------------------------------------------------------- labels and one report for many places


def test_labels_show_both_places() -> None:
    label = run_text("let a = 1;\nlet a = 2;").only().labels[0]
    assert (label.span.locate()[0], label.message) == ((1, 5), "first defined here")
    label = run_text("square { material flat; material flat; }").only().labels[0]
    assert label.span.text == "material flat"
    inside = run_text("module m(a) { square { scale(1 / a); } }\nm(0);").only()
    assert [x.span.locate()[0] for x in inside.labels] == [(2, 1)]


def test_labels_show_what_else_takes_part() -> None:
    for text, labels in (
        ('square { translate("a" + 1, 0); }', [('"a"', "a string")]),
        ('square { translate(1 - "a", 0); }', [("1", "a number")]),
        ("square { translate([1, 2] + [1, 2, 3]); }", [("[1, 2]", "2 items"), ("[1, 2, 3]", "3 items")]),
        ("square { rotate(45deg + 1); }", [("45deg", "an angle")]),
        ("if (1 == true) { square {} }", [("1", "a number")]),
        ('if ("a" < 1) { square {} }', [("1", "a number")]),
        (
            "module m(a, b, c = 1) { square { scale(a * b * c); } } m(c = 2);",
            [("a", "needs a value"), ("b", "needs a value")],
        ),
    ):
        assert [(label.span.text, label.message) for label in run_text(text).only().labels] == labels, text


SPREAD = {
    "surplus": ("fn f(a) = 2 * a;\nsquare { scale(f(1, 2)); rotate(1deg * f(1, 3)); }", "E0308", 2, 2),
    "missing": ("module m(a, b) { square { scale(a * b); } }\nm(1);\nm(2);\nm(3);", "E0308", 2, 3),
    "named": ("fn f(a) = 2 * a;\nsquare { scale(f(a = 1, z = 2), f(a = 1, z = 3)); }", "E0206", 2, 2),
    "some fit": ("fn f(a) = a;\nlet x = f(1);\nsquare { scale(f(x, 2), f(x, 3)); }", "E0308", 3, 2),
    "geometry": ("fn square(i) = i;\nsquare;\nsquare { scale(2); }", "E0213", 2, 2),
    "misplaced": ("square { star; star; }", "E0330", 1, 1),
    "chain": ("chain { subtract square; intersect star; }", "E0335", 1, 0),
}


def test_one_mistake_in_many_places_is_one_report() -> None:
    for case, (text, code, line, labels) in SPREAD.items():
        found = run_text(text).only()
        assert found.span is not None
        assert (found.code, found.span.locate()[0][0]) == (code, line), case
        assert len(found.labels) >= labels, case
    found = run_text("square { scale(nope); translate(nope, 0); }\nstar { scale(nope); }").only()
    assert [label.span.locate()[0] for label in found.labels] == [(1, 33), (2, 14)]


def test_independent_mistakes_are_told_apart() -> None:
    for text in (
        "fn f(a) = a;\nfn g(a) = a;\nsquare { scale(f(1, 2), g(1, 2)); }",
        "fn f(a) = a;\nlet x = f(1);\nsquare { scale(f(x, 2), f(z = 1)); }",
        "fn f(a) = a + b;\nfn g(a) = a;\nsquare { scale(f(1), g(1, 2)); }",
        "fn f(a, b) = a * b;\nsquare { scale(f(1), f(1, 2, 3)); }",
        "let a = [1, 2, 3];\nlet b = [1, 2, 3];\nsquare { scale(1, 1 + a); scale(1, 1 + b); }",
        "let v = [1, 2];\nsquare { scale(v[2], v[3]); }",
        "square { scale(sin(1, 2), cos(1, 2)); }",
        "square { star; }\nsquare { star; }",
    ):
        assert len(run_text(text).codes) == 2, text
    text = "".join(f"fn f{i}(a) = a;\nsquare {{ scale(f{i}(1, 2)); }}\n" for i in range(10))
    assert len(run_text(text).codes) == 10


# ---------------------------------------------------------------- what is said, and what is passed over


def test_help() -> None:
    for text, help in (
        ("difference { square {} star {} }", "it is called `subtract` here"),
        ("square { translate(vec2(1, 2)); }", "write [x, y]"),
        (
            "legs(side, paint) { square { scale(side); } }",
            "to define it write module legs(side, paint) { … }",
        ),
        ("let a = 1; let e = 2; square { scale(nothing); }", None),
        ("square { scale(zz); }", None),
    ):
        assert run_text(text).only().help == help, text


def test_ranking() -> None:
    place = Span(SourceFile("x", "x"), 0, 1)
    assert [name for _, name in ranked("tranlsate", ["translate", "transpose"])] == ["translate"]
    assert ranked("Size", ["size", "sizes"])[0][1] == "size"
    assert ranked("scal", ["scale", "scan"])[0][0] == ranked("scal", ["scan"])[0][0] == 1
    assert did_you_mean("scal", ["scale", "scan"], place) == ("did you mean `scale` or `scan`?", None)
    assert did_you_mean("x", ["y", "z"], place) == (None, None)
    assert did_you_mean("foo", ["bar", "baz"], place) == (None, None)


def test_words_of_other_languages_lead_to_words_of_this_one() -> None:
    ours = LANGUAGE | {
        "square",
        "sphere",
        "torus",
        "union",
        "smooth",
        "intersect",
        "subtract",
        "material",
        "else if",
        *STAGE,
    }
    assert set(foreign.WORDS.values()) <= ours
    assert not set(foreign.WORDS) & ours
    assert not set(foreign.FUNCTIONS) & set(FUNCTIONS)


HELPED = {
    "star { shadow(0.1); }": "in the plane draw the object twice",
    "sphere { blur(3); }": "nothing is blurred",
    "sphere { material glossy { ior(1.5); } }": "light is not bent",
    'let a = format("x", 2); star;': "write str(v, digits = 2), and join strings by +",
    'let a = "x" + [1, 2]; star;': "write str(…) of a number or a boolean",
    "star { keyframe(2); }": "there is bend, displace, grow, matrix, rotate, scale, shear,",
    "star { material flat { bloom(2); } }": "there is color, density, flip, glow, grayscale,",
    "let a = debug(2); star;": "there is abs, acos, asin,",
    'import "std/letters" as abc; sphere; abc.text("Ag");': "letters and drawings are of flat ones",
    'import "std/letters" as abc; model "shapes2d-reading"; canvas(64, 64); abc.text("A");': "the usual",
}


def test_what_is_unknown_has_help() -> None:
    for text, words in HELPED.items():
        found = [d.help or "" for d in nsg.check_text(text) if d.code[0] == "E"]
        assert [words in help for help in found] == [True], text


def test_a_syntax_mistake_has_no_consequences() -> None:
    for text in (
        "let = 0.5;\nsquare { scale(size); }",  # the name is lost
        "let size 0.5 0.6;\nsquare { scale(size); }",
        "animate(seconds 2);\nsquare { scale(1 + u); }",
        'import "a.nsg" a;\na.dot(1);\nsquare { scale(a.size); }',
        "square {\n  scale(1, );\n  translate(0.1 0.2);\n}",
        "group {\n  square { scale(0.5);\n}\nrotate(10deg);\nstar { }",  # what stands where?
        "fn half(x) = x / ;\nlet a = half(1, 2);",
        "for (i 0..3) { square { translate(i, 0); } }",
        "module dot(at) { square { translate(at.x, at.y); } }\ndot(at = [1, 2);",
        "param k = ;\nsquare { scale(k); rotate(k); }",
    ):
        outcome = run_text(text)
        assert ({code[:3] for code in outcome.codes}, outcome.scene) == ({"E01"}, None), text
    text = "let a = 1\nsquare { scale(nope); }\nstar { rotate(30); }\ntriangle { falt; }\n"
    assert sorted(run_text(text).codes) == ["E0102", "E0201", "E0204", "E0302"]  # elsewhere


def test_what_a_fix_mends_for_sure_hides_nothing() -> None:
    """Both are reported at once, and the second is what is left when the first is mended."""
    for text in (
        "square { scale(2 ** nope); }",  # a sign
        "square { scale(0.5f); translate(nope, 0); }",  # a number
        "square { rotate(30 deg); translate(nope, 0); }",
        "const a = nope;\nsquare { scale(a); }",  # a word
        "if (true and nope) { square; }",
    ):
        first, second = sorted(run_text(text).diagnostics, key=lambda d: d.code)
        left = run_text(apply_fixes(text, [first])[0]).only()
        assert (first.code[:3], second.code) == ("E01", "E0201"), text
        assert (left.code, left.message) == (second.code, second.message), text


# ---------------------------------------------------------------- braces, by the layout

TIDY = """nsg 1;
group {
  square { scale(0.2); translate(1, 0); }
  circle {
    scale(2);
    material flat { color(#d33); }
  }
  for (i in 0..3) {
    if (i == 2) { dot(1); } else { square { scale(0.2); } }
    rotate(3deg);
  }
  rotate(30deg);
}
star { scale(2); }
"""


def test_a_brace_too_many_or_too_few_is_found_near_its_line() -> None:
    slips = [(at, TIDY[:at] + TIDY[at + 1 :]) for at in range(len(TIDY)) if TIDY[at] in "{}"]
    for match in re.finditer(r"(?<=[\s;{}(),])(?=\S)", TIDY):
        slips += [
            (match.start(), f"{TIDY[: match.start()]}{brace} {TIDY[match.start() :]}") for brace in "{}"
        ]
    assert read(TIDY)[1] == []
    wrong = []
    for at, text in slips:
        found = mistakes(read(text)[1])
        if len(found) != 1 or abs(found[0][0] - TIDY.count("\n", 0, at) - 1) > 1:
            wrong.append((text, found))
    assert wrong == []


def test_unindented_text_still_matches_up() -> None:
    text = "group {\nsquare {\nscale(2);\n}\nstar;\n"
    assert mistakes(read(text)[1]) == [(5, 6, "E0104")]
    assert mistakes(read(text + "}\n}\n")[1]) == [(7, 1, "E0105")]


def test_braces_that_match_are_taken_at_their_word() -> None:
    text = TIDY.replace("#d33); }\n  }", "#d33) }\n").replace("scale(2); }\n", "scale(2); }\n}\n")
    assert mistakes(read(text)[1]) == [(6, 32, "E0102")]


def test_odd_layout_is_no_mistake() -> None:
    for block in (
        "group {\n" + "star;\n" * 6 + "}\n",
        "group {\n" + "        star;\n" * 6 + "}\n",
        "  group {\n    star;\n    star;\n    star;\n    star;\n  }\n",
        "group { star;\n" + "  star;\n" * 6 + "} star;\n",
    ):
        assert read(TIDY + block)[1] == []
        assert mistakes(read("let a = 1 2;\n" + TIDY + block)[1]) == [(1, 11, "E0101")]
