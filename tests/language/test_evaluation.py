"""Scenes, expressions and params against hand-made nodes and values worked out elsewhere."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import scenelang as nsg
from scenelang.language.scene import SceneNode
from tests.language.cases import run_text, transform, value


def nodes(text: str, **options: object) -> tuple[SceneNode, ...]:
    return run_text(text, **options).good().nodes


CHAIN = """
nsg 1;                                   // language version, first statement, optional
model "shapes2d";                        // optional: without it the smallest that fits
param k = 0.6 in 0..1;                   // scenelang render chain.nsg -D k=0.9
chain {                                  // streamed top to bottom, one boolean token per object
  square           { scale(0.8); translate(-0.2, 0); material flat { color(#d33); } }
  smooth pentagon  { twirl(k); bend(0.2); scale(0.5); rotate(30deg); }
  subtract star    { scale(0.3); translate(0.1, 0.1); }
  intersect square { rotate(45deg); }
}
"""
ANIMATION = """
nsg 1;
animate(seconds = 2, fps = 24, loop = true);   // provides t (s), u in [0,1), frame, frames
param n = 3 in 1..3;
fn bounce(p) = abs(sin(0.5turn * (u + p)));
module dot(phase) {
  let c = hsv(phase, 0.7, 0.9);
  star { scale(0.3); translate(0, 0.5 * bounce(phase)); material flat { color(c); } }
}
group {
  for (i in 0..<n) {
    group {
      if (i % 2 == 0) { dot(phase = i / n); } else { square { scale(0.2); } }
      translate(0.6, 0);
      rotate(1turn * i / n);
    }
  }
  rotate(1turn * u);
}
"""


def flat(*rgb: float) -> nsg.Material:
    return nsg.Material(name="flat", ops=(nsg.Color(rgb=rgb),))  # type: ignore[arg-type]


def test_chain_scene() -> None:
    scene = run_text(CHAIN, params={"k": "0.9"}).good()
    square = nsg.Object(
        "square",
        transforms=(nsg.Scale.uniform(0.8), nsg.Translate(x=-0.2, y=0)),
        material=flat(0xDD / 255, 0x33 / 255, 0x33 / 255),
    )
    pentagon = nsg.Object(
        "pentagon",
        transforms=(nsg.Twirl(k=0.9), nsg.Bend(k=0.2), nsg.Scale.uniform(0.5), nsg.Rotate.degrees(30)),
    )
    star = nsg.Object("star", transforms=(nsg.Scale.uniform(0.3), nsg.Translate(x=0.1, y=0.1)))
    turned = nsg.Object("square", transforms=(nsg.Rotate.degrees(45),))
    links = [("union", square), ("smooth", pentagon), ("subtract", star), ("intersect", turned)]
    chain = nsg.Chain(children=tuple(nsg.Link(op=op, node=node) for op, node in links))  # type: ignore[arg-type]
    assert scene == nsg.Scene(model="shapes2d", nodes=(chain,))


def test_animated_scene() -> None:
    scene = run_text(ANIMATION, frame=7).good()
    u = 7 / 48
    assert scene.animation == nsg.Animation(seconds=2, fps=24)
    (outer,) = scene.nodes
    assert isinstance(outer, nsg.Group)
    assert outer.transforms == (nsg.Rotate(angle=math.tau * u),)
    for i, group in enumerate(outer.children):
        assert isinstance(group, nsg.Group)
        assert group.transforms[0] == nsg.Translate(x=0.6, y=0)
        assert group.transforms[1].angle == pytest.approx(math.tau * i / 3)  # type: ignore[union-attr]
        (leaf,) = group.children
        assert isinstance(leaf, nsg.Object)
        assert leaf.geometry == ("square" if i == 1 else "star")
        if leaf.geometry == "star":
            lift = leaf.transforms[1]
            assert lift.y == pytest.approx(0.5 * abs(math.sin(math.pi * (u + i / 3))), abs=1e-15)  # type: ignore[union-attr]
    assert run_text(ANIMATION, frame=48).codes == ["E0337"]


def test_animation_that_does_not_loop_reaches_one() -> None:
    text = "animate(1s, 5, loop = false); square { translate(u, t); scale(frames, 1 + frame); }"
    last = run_text(text, frame=4).good()
    assert (transform(last).x, transform(last).y) == (1.0, 0.8)
    assert (transform(last, 0, 1).x, transform(last, 0, 1).y) == (5.0, 5.0)
    still = run_text("animate(0.1, 5, loop = false); square { translate(u, t); }").good()
    assert transform(still).x == 0.0
    assert run_text("square {}", frame=1).codes == ["E0337"]


def test_settings() -> None:
    scene = run_text('model "shapes2d"; canvas(320, 192); background(none);').good()
    assert scene == nsg.Scene(model="shapes2d", canvas=(320, 192), background=None)
    assert run_text("background(#012); canvas([8, 9]);").good() == nsg.Scene(
        canvas=(8, 9), background=(0.0, 0x11 / 255, 0x22 / 255)
    )
    assert run_text("").good() == nsg.Scene()
    assert run_text("square {}", model="shapes2d").good().model == "shapes2d"


TRANSFORMS = {
    "translate([1, 2]);": nsg.Translate(x=1, y=2),
    "translate([1, 2, 3]);": nsg.Translate(x=1, y=2, z=3),
    "translate(y = 2, x = 1);": nsg.Translate(x=1, y=2),
    "scale(2);": nsg.Scale(x=2, y=2, z=2),
    "scale(s = 2);": nsg.Scale(x=2, y=2, z=2),
    "scale(2, 3);": nsg.Scale(x=2, y=3, z=1),
    "scale([2, 3]);": nsg.Scale(x=2, y=3, z=1),
    "scale([2, 3, 4]);": nsg.Scale(x=2, y=3, z=4),
    "scale(sx = 2, sy = 3);": nsg.Scale(x=2, y=3, z=1),
    "scale(-1, 1);": nsg.Scale(x=-1, y=1, z=1),
    "rotate(0);": nsg.Rotate(angle=0),
    "rotate(1rad, axis = X);": nsg.Rotate(angle=1, axis=(1, 0, 0)),
    "rotate(axis = [0, 1, 1], 1rad);": nsg.Rotate(angle=1, axis=(0, 1, 1)),
    "rotate(0.5turn);": nsg.Rotate(angle=math.pi),
    "rotate(1turn * 1 / 3);": nsg.Rotate(angle=math.tau / 3),
    "rotate(-90deg);": nsg.Rotate(angle=-math.pi / 2),
    "shear(yx = 0.5);": nsg.Shear(axes="yx", k=0.5),
    "twirl(-1);": nsg.Twirl(k=-1),
    "twist(2);": nsg.Twist(k=2),
    "displace(0.1, frequency = 5);": nsg.Displace(amount=0.1, frequency=5),
    "grow(-0.5);": nsg.Grow(r=-0.5),
    "shell(w = 1);": nsg.Shell(w=1),
    "matrix([[1, 0, 0, 2], [0, 1, 0, 3], [0, 0, 1, 4], [0, 0, 0, 1]]);": nsg.Matrix(
        rows=((1, 0, 0, 2), (0, 1, 0, 3), (0, 0, 1, 4), (0, 0, 0, 1))
    ),
}


def test_transforms() -> None:
    for geometry in ("square", "sphere"):
        (node,) = nodes(f"{geometry} {{ {' '.join(TRANSFORMS)} }}")
        assert node.transforms == (*TRANSFORMS.values(),)


def test_control_flow() -> None:
    (chain,) = nodes("chain { for (i in 0..<3) { smooth square { translate(i, 0); } } subtract star {} }")
    assert isinstance(chain, nsg.Chain)
    assert [link.op for link in chain.children] == ["union", "smooth", "smooth", "subtract"]
    assert nodes("if (false) { star; } else if (1 > 0) { square; } else { star; }") == (nsg.Object("square"),)


def test_loops() -> None:
    text = "for (v in {}) {{ square {{ translate(v, 0); }} }}"

    def xs(what: str) -> list[float]:
        return [node.transforms[0].x for node in nodes(text.format(what))]  # type: ignore[union-attr]

    assert xs("0..3") == [0, 1, 2, 3]
    assert xs("0..<3") == [0, 1, 2]
    assert xs("3..0") == []
    assert xs("3..1 step -1") == [3, 2, 1]
    assert xs("0..1 step 0.5") == [0, 0.5, 1]
    assert xs("[5, 3, 4]") == [5, 3, 4]
    assert xs("[]") == []
    scene = run_text("for (c in [#f00, #0f0]) { square { material flat { color(c); } } }").good()
    assert [n.material.ops[0].rgb for n in scene.nodes] == [(1, 0, 0), (0, 1, 0)]  # type: ignore[union-attr]


def test_a_module_call_is_one_child() -> None:
    one = "module m(x) { square { scale(x); } translate(x, 0); }"
    (node,) = nodes(f"{one} m(2) {{ rotate(1rad); }}")
    assert node == nsg.Object(
        "square", transforms=(nsg.Scale.uniform(2), nsg.Translate(x=2, y=0), nsg.Rotate(angle=1))
    )
    (group,) = nodes("module two() { square {} star {} scale(2); } two() { rotate(1rad); material flat; }")
    assert group == nsg.Group(
        children=(nsg.Object("square"), nsg.Object("star")),
        transforms=(nsg.Scale.uniform(2), nsg.Rotate(angle=1)),
        material=nsg.Material(name="flat"),
    )
    (empty,) = nodes("module nothing() { if (false) { square {} } } nothing();")
    assert empty == nsg.Group()


def test_the_innermost_material_holds() -> None:
    text = "module m() { square { material flat { color(#f00); } } } m() { material flat { color(#0f0); } }"
    (node,) = nodes(text)
    assert node.material == flat(1, 0, 0)
    (node,) = nodes("module m() { square {} } m() { material flat { color(#0f0); } }")
    assert node.material == flat(0, 1, 0)


def test_scopes() -> None:
    inner = "group { let a = a + 1; square { let a = a + 1; translate(a, 0); } }"
    group, star = nodes(f"let a = 1; {inner} star {{ translate(a, 0); }}")
    assert isinstance(group, nsg.Group)
    assert group.children[0].transforms == (nsg.Translate(x=3, y=0),)
    assert star.transforms == (nsg.Translate(x=1, y=0),)
    (node,) = nodes("let t = 3; let mix = 4; square { translate(t, mix); }")
    assert node.transforms == (nsg.Translate(x=3, y=4),)
    nodes("let scale = 2; square { scale(scale); }")


def test_functions_and_modules_are_known_before_their_line() -> None:
    (node,) = nodes("square { translate(f(2), g(1)); } fn f(x, y = x * 3) = x + y; fn g(x) = f(x, 1);")
    assert node.transforms == (nsg.Translate(x=8, y=2),)
    (node,) = nodes("m(2); module m(x) { fn half(y) = y / x; square { translate(half(1), half(2)); } }")
    assert node.transforms == (nsg.Translate(x=0.5, y=1),)


def test_a_nested_function_sees_this_pass_only() -> None:
    text = """
    for (i in 1..2) {
      fn g(x) = x + k;
      let k = i * 10;
      square { translate(g(i), 0); }
    }"""
    assert [n.transforms[0].x for n in nodes(text)] == [11, 22]  # type: ignore[union-attr]
    early = "for (i in 1..2) { if (i > 0) { square { translate(g(i), 0); } } let k = i; fn g(x) = x + k; }"
    assert run_text(early).codes == ["E0203"]


def test_materials_are_values() -> None:
    values = "let ms = [material flat, material flat { color(#f00); }];"
    first, second = nodes(f"{values} for (m in ms) {{ square {{ m {{ hue(1rad); }} }} }}")
    assert first.material == nsg.Material(name="flat", ops=(nsg.Hue(angle=1),))
    assert second.material == nsg.Material(name="flat", ops=(nsg.Color(rgb=(1, 0, 0)), nsg.Hue(angle=1)))
    (node,) = nodes("module m(look) { square { look; } } m(material flat);")
    assert node.material == nsg.Material(name="flat")


def test_spans_beside_the_scene() -> None:
    text = "module m(x) { square { scale(x); } }\ngroup {\n  m(2);\n  star { rotate(1rad); }\n}"
    outcome = run_text(text)
    (group,) = outcome.good().nodes
    assert isinstance(group, nsg.Group)
    square, star = group.children
    spans = outcome.spans

    def where(node: object) -> str:
        span = spans.span(node)
        assert span is not None
        return span.text

    assert (where(group), where(square), where(star)) == ("group", "square", "star")
    assert where(star.transforms[0]) == "rotate"
    assert spans.span(object()) is None


TABLE = [
    line.rpartition(" = ")
    for line in (Path(__file__).parent / "expressions.nsgs").read_text("utf-8").splitlines()
    if line and not line.startswith("# ")
]


def test_values() -> None:
    """An expression of literals is folded; the same with a loop's variable is not."""
    wrong = []
    for text, _, expected in TABLE:
        hidden = f"for (zero in [0]) {{ square {{ translate(zero + ({text}), 0); }} }}"
        both = [value(text), transform(run_text(hidden).good()).x]
        if both != pytest.approx([float(expected)] * 2, rel=1e-14, abs=1e-15):
            wrong.append((text, *both))
    assert wrong == []
    assert value(" + ".join(["1"] * 190)) == value("(" * 190 + "190" + ")" * 190) == 190


def test_step_and_as_are_names_too() -> None:
    text = "fn step(as, k = 1,) = as * k; let as = 2; square { translate(step(as, k = 3), 0); }"
    assert transform(run_text(text).good()).x == 6


def test_rand_is_splitmix64() -> None:
    """SplitMix64 of the bits of 1.0 and 2.0, by the published recurrence in exact integers."""

    def by_hand(bits: int) -> float:
        z = (bits + 0x9E3779B97F4A7C15) % 2**64
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
        z = (z ^ (z >> 27)) * 0x94D049BB133111EB % 2**64
        return ((z ^ (z >> 31)) >> 11) / 2**53

    for seed, bits in ((1, 0x3FF0000000000000), (2, 0x4000000000000000), (0, 0)):
        scene = run_text(f"square {{ translate(rand({seed}), 0); }}").good()
        assert transform(scene).x == by_hand(bits)


def test_rand_is_even() -> None:
    text = "for (i in 0..<4000) { square { translate(rand(i), 0); } }"
    xs = [node.transforms[0].x for node in run_text(text).good().nodes]  # type: ignore[union-attr]
    assert all(0.0 <= x < 1.0 for x in xs)
    for k in range(8):
        share = sum(k / 8 <= x < (k + 1) / 8 for x in xs) / len(xs)
        assert abs(share - 1 / 8) < 0.02


def test_values_from_outside() -> None:
    wrong = []
    for declaration, use, text, x in (
        ("1", "p, 0", "2.5", 2.5),
        ("1", "p, 0", "-2", -2),
        ("1 in 0..3", "p, 0", "3", 3),
        ("1 in 0..3", "p, 0", " 2 ", 2),
        ("30deg", "p / 1deg, 0", "60deg", 60),
        ("30deg in 0deg..90deg", "p / 1deg, 0", "0.25turn", 90),
        ("30deg", "p / 1deg, 0", "0", 0),
        ("1s", "p / 1s, 0", "1500ms", 1.5),
        ("1s in 0s..2s", "p / 1s, 0", "2", 2),
        ("true", "p ? 1 : 0, 0", "false", 0),
        ("#d33", "p.r, 0", "#0f0", 0),
        ("#d33", "p.g, 0", "[0, 1, 0]", 1),
        ("#d33", "p.b, 0", "rgb(0, 0, 1)", 1),
        ("[1, 2]", "p", "[3, 4]", 3),
        ('"day"', 'p == "night" ? 1 : 0, 0', "night", 1),
        ('"day" in ["day", "night"]', 'p == "night" ? 1 : 0, 0', "night", 1),
        ("3 in 1..7 step 2 ", "p, 0", "5", 5),
        ("1", "p, 0", 2, 2),
        ("[1, 2]", "p", (4.5, 3), 4.5),
        ("true", "p ? 1 : 2, 0", False, 2),
    ):
        outcome = run_text(f"param p = {declaration}; square {{ translate({use}); }}", params={"p": text})
        if outcome.scene is None or transform(outcome.scene).x != pytest.approx(x):
            wrong.append((declaration, text, outcome.codes))
    assert wrong == []


def test_what_does_not_fit() -> None:
    wrong = []
    for declaration, given, code in (
        ("1 in 0..1", "2", "E0309"),
        ("1 in 0..<2", "2", "E0309"),
        ("1 in 1..7 step 2", "2", "E0309"),
        ("1", "1 + 1", "E0310"),
        ("1", "k", "E0310"),
        ("1", "PI", "E0310"),
        ("1", "", "E0310"),
        ("1", "1; square {}", "E0310"),
        ("1", "2 ^ 9", "E0310"),
        ("1", "30deg", "E0310"),
        ("1", "true", "E0310"),
        ("1", "nan", "E0310"),
        ("1", "1e999", "E0310"),
        ("1", "[1]", "E0310"),
        ("30deg", "30", "E0310"),
        ("30deg in 0deg..45deg", "90deg", "E0309"),
        ("#d33 in 0..1", "[0, 2, 0]", "E0309"),
        ('"a" in ["a", "b"]', "c", "E0309"),
        ("true", "1", "E0310"),
        ("1", float("nan"), "E0310"),
        ("1", 10**400, "E0310"),
        ("1", object(), "E0310"),
        ("1", None, "E0310"),
    ):
        found = run_text(f"param p = {declaration};", params={"p": given}).diagnostics.items
        if [(d.code, d.span and d.span.text) for d in found] != [(code, "p")]:
            wrong.append((declaration, given, found))
    assert wrong == []


def test_unused_values_are_errors() -> None:
    outcome = run_text("param size = 1; square { scale(size); }", params={"sise": "2"})
    assert outcome.codes == ["E0211"]
    assert outcome.only().help == "did you mean `size`?"
    assert run_text("square {}", params={"k": "2"}).codes == ["E0211"]


def test_a_range_may_be_computed() -> None:
    text = "let top = 2; param p = top / 2 in 0..top * 2; square { translate(p, 0); }"
    assert transform(run_text(text, params={"p": "4"}).good()).x == 4
    assert run_text(text, params={"p": "4.5"}).codes == ["E0309"]


def test_a_colour_by_its_name_is_told_its_number() -> None:
    outcome = run_text("param main = #d33;", params={"main": "red"})
    assert outcome.only().help == "colours have no names; red is #f00"
