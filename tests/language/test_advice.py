"""Advice leads to a scene without mistakes: what is said of one mistake, and the text that follows it."""

from __future__ import annotations

from pathlib import Path

import scenelang as nsg
from scenelang.language.pages import CODES

SHAPES = 'import "std/shapes" as s;'
CAMERA = "camera(eye = [0, 1, 5]);"
CASES = (
    (f"{SHAPES} s.disc(0.3) {{ fill(#f00); }}", "material flat {",
        f"{SHAPES} s.disc(0.3) {{ material flat {{ color(#f00); }} }}"),
    ("sphere; square { translate(1, 0); }", "a scene is flat or solid", "sphere;"),
    (f"{SHAPES} s.disc(0.3); sphere;", "a scene is flat or solid", f"{SHAPES} s.disc(0.3);"),
    ("sphere { material flat; }", "write material diffuse or volumetric", "sphere { material volumetric; }"),
    ("square { twist(1); }", "`twirl` or `bend`", "square { }"),
    (f"{CAMERA} square;", "leave it out; flat scenes have none", "square;"),
    (f"{SHAPES} s.circle(0.3);", "s.disc(r)", f"{SHAPES} s.disc(0.3);"),
    (f"{CAMERA} box {{ scale(0.5); }}", "there is sphere, torus, and what is learned", f"{CAMERA} torus;"),
    ("cylinder(h = 1);", "flat scenes draw pentagon, square, star, triangle, solid ones sphere", "torus;"),
    (f"{CAMERA} sphere {{ material glossy; }}", "diffuse, which is matte", "sphere { material diffuse; }"),
    (f"{CAMERA} sphere {{ material ice; }}", ", diffuse, ", "sphere { material diffuse; }"),
    ("sphere { material lambert; }", "`diffuse`", "sphere { material diffuse; }"),
    ("let m = #f00; square { material m; }", "material flat { color(m); }",
        "let m = #f00; square { material flat { color(m); } }"),
    ("let m = #f00; square { m; }", "material flat { color(m); }",
        "let m = #f00; square { material flat { color(m); } }"),
    (f"s.disc(0.3); {SHAPES}", "move the definition of `s` above", f"{SHAPES} s.disc(0.3);"),
    ("square { material flat { color(#ff000080); } }", "write #ff0000",
        "square { material flat { color(#ff0000); } }"),
    ("square { material flat { color(#f008); } }", "write #f00", "square { material flat { color(#f00); } }"),
    ("light(power = 3); light(power = 5); sphere;", "there is one light", "light(power = 5); sphere;"),
    ("background(linear_gradient(#fff, #000)); star;", "mix(a, b, t)",
        "background(mix(#fff, #000, 0.3)); star;"),
    ("let s = sphere; s;", "module part() { sphere; }", "module part() { sphere; } part();"),
    ("let s = torus(0.5); s;", "module part() { torus; }", "module part() { torus; } part();"),
    ("sphere { rotate(45, 0, 0); }", "rotate(45deg, axis = X)", "sphere { rotate(45deg, axis = X); }"),
    ("square.translate(0.5, 0);", "square { translate(0.5, 0); }", "square { translate(0.5, 0); }"),
    ("square { pos(0.5, 0.5); }", "`translate`", "square { translate(0.5, 0.5); }"),
    ("size(80, 60); star;", "`canvas`", "canvas(80, 60); star;"),
    ("animate(duration = 2, fps = 4); star;", "`seconds`", "animate(seconds = 2, fps = 4); star;"),
    ('import "std/shapes"; s.disc(0.3);', 'import "std/shapes" as s;', f"{SHAPES} s.disc(0.3);"),
    ("import shapes; star;", 'import "std/shapes" as s;', f"{SHAPES} s.disc(0.3);"),
    ("new Sphere(0.5);", "sphere { scale(0.5); }", "sphere { scale(0.5); }"),
    ("fog(0.1); torus;", "sphere { material volumetric; }", "sphere { material volumetric; } torus;"),
    ("loop(5) { star; }", "for (i in 0..<n)", "for (i in 0..<5) { star; }"),
    ("star { rotate(360deg * t); }", "animate(seconds = 2, fps = 24);",
        "animate(seconds = 2, fps = 24); star { rotate(360deg * t); }"),
    ("star { mirror(); }", "scale(-1, 1)", "star { scale(-1, 1); }"),
    ("star { skew(20deg); }", "shear(xy = tan(20deg))", "star { shear(xy = tan(20deg)); }"),
    ("star { scaleX(0.5); }", "scale(x, 1)", "star { scale(0.5, 1); }"),
    ("star { translateX(0.5); }", "translate(x, 0)", "star { translate(0.5, 0); }"),
    ("star { rotate(45, deg); }", "30deg", "star { rotate(45deg); }"),
    ("let a = 30; star { rotate(deg(a)); }", "multiplied by 1deg", "let a = 30; star { rotate(a * 1deg); }"),
    ("torus { diffuse(#f00); }", "material diffuse", "torus { material diffuse { color(#f00); } }"),
    ("star { material flat { gradient(#f00, #00f); } }", "one colour",
        "star { material flat { color(mix(#f00, #00f, 0.5)); } }"),
    ("star { material flat { rgb(1, 0, 0); } }", "color(rgb(1, 0, 0));",
        "star { material flat { color(rgb(1, 0, 0)); } }"),
    ("fillet(0.1) { sphere; torus; }", "smooth(k = 0.1)", "smooth(k = 0.1) { sphere; torus; }"),
    ("canvas(width = 80, h = 60); star;", "`w`", "canvas(w = 80, h = 60); star;"),
    ("subtract(radius = 0.1) { torus; sphere; }", "`k`", "subtract(k = 0.1) { torus; sphere; }"),
    (f"{SHAPES} s.disc(0.3, color = #f00);", "s.disc(…) { material flat { color(#d33); } }",
        f"{SHAPES} s.disc(0.3) {{ material flat {{ color(#f00); }} }}"),
    ("cube([1, 2, 3]);", "learned from a mesh", "torus;"),
    ("box([1, 2]);", "s.rect(w, h)", f"{SHAPES} s.rect(1, 2);"),
    ("line(0, 0, 1);", "s.line([x, y], [x, y], width)", f"{SHAPES} s.line([0, 0], [1, 1]);"),
    (f"{SHAPES} s.arc(0.5, 0.1, 0, 90);", "s.arc(r, width, 0deg, 90deg)",
        f"{SHAPES} s.arc(0.5, 0.1, 0deg, 90deg);"),
    (f"{SHAPES} s.path([0, 0, 1, 1], 0.1);", "s.path([[x, y], [x, y], …], width)",
        f"{SHAPES} s.path([[0, 0], [1, 1]], 0.1);"),
    (f"{SHAPES} s.polygon([[0, 0], [1, 0], [0, 1]]);", "s.polygon(n, r), which is regular",
        f"{SHAPES} s.polygon(3, 1);"),
    ("star { fill = #f00; }", "material flat { color(…); }",
        "star { material flat { color(#f00); } }"),
    ("torus { position = [1, 0, 0]; }", "translate(…);", "torus { translate([1, 0, 0]); }"),
    ("star { r = 0.5; scale(r); }", None, "star { let r = 0.5; scale(r); }"),
    ("torus { radius = 0.5; }", "scale(s)", "torus { scale(0.5); }"),
    ("star { translate(10px, 0); }", "the shorter side of the canvas is 2", "star { translate(0.1, 0); }"),
    ("canvas(80x60); star;", "80, 60", "canvas(80, 60); star;"),
    ("star { rotate(45°); }", "it is `deg` here", "star { rotate(45deg); }"),
    ("let a = [for (i in 0..3) i]; star { scale(a[1]); }", "draw in a loop: for (i in 0..<n)",
        "for (i in 0..3) { star { translate(i, 0); } }"),
    ("light([2, 4, 3], #fff); torus;", "light([2, 4, 3], 30, #fff)", "light([2, 4, 3], 30, #fff); torus;"),
    ("star { material flat { color([1, 0, 0, 1]); } }", "no alpha",
        "star { material flat { color([1, 0, 0]); } }"),
    ("torus { rotate(45deg, axis = y); }", "X, Y and Z", "torus { rotate(45deg, axis = Y); }"),
    ("model shapes2d; star;", "a string", 'model "shapes2d"; star;'),
    ("mirror([1, 0]) star;", "in the block", "star { scale(-1, 1); }"),
    ("star { scale(0,5); }", "behind a point", "star { scale(0.5); }"),
    ("sphere { <0, 0, 0>, 1 pigment { color Red } }", "sphere { translate(0, 1, 0); }",
        "sphere { translate(0, 1, 0); material diffuse { color(#f00); } }"),
    ("star { flip(); }", "for an object write scale(-1, 1)", "star { scale(-1, 1); }"),
    ("star { scale(translate(1, 0)); }", "square { translate(1, 0); }", "star { translate(1, 0); }"),
    ("star { material flat { color(hsv(120, 1, 1)); } }", "write 120deg",
        "star { material flat { color(hsv(120deg, 1, 1)); } }"),
)  # fmt: skip


def test_advice_leads_to_a_scene() -> None:
    wrong = []
    for text, said, meant in CASES:
        found = [*nsg.check_text(text)]
        only = found[0] if len(found) == 1 else None
        good = only is not None and only.code in CODES and (said is None or said in (only.help or ""))
        if not good or [*nsg.check_text(meant)]:
            wrong.append((text, found))
        elif only is not None and only.fix is not None:
            after, left = nsg.fix_text(text)
            if " ".join(after.split()) != meant or [*left]:
                wrong.append((text, [after, *left]))
    assert wrong == []


def test_lists_name_what_can_stand_there() -> None:
    """Not what a library is made of inside: a statement is no place for a function."""
    (only,) = nsg.check_text(f"{SHAPES} s.blob(0.3);")
    assert only.help is not None
    assert only.help.startswith("it has arc, arrow, capsule, corners, disc")
    (only,) = nsg.check_text(f"{SHAPES} square {{ scale(s.sizze([1, 0])); }}")
    assert only.help == "did you mean `size`?"


def test_time_in_an_imported_file_is_for_the_scene_to_run(tmp_path: Path) -> None:
    (tmp_path / "lib.nsg").write_text("module hand() { star { rotate(360deg * t); } }", "utf-8")
    (tmp_path / "a.nsg").write_text('import "lib.nsg" as lib; lib.hand();', "utf-8")
    assert [*nsg.check(tmp_path / "a.nsg")] == []
    (tmp_path / "a.nsg").write_text("star { rotate(360deg * t + 1deg * frame); }", "utf-8")
    assert [d.code for d in nsg.check(tmp_path / "a.nsg")] == ["W0304"]
