"""Scenes against hand-made nodes."""

from __future__ import annotations

import math

import pytest

import scenelang as nsg
from scenelang.language import tree
from scenelang.language.diagnostics import SourceFile, Span
from scenelang.language.library import Calls, SpanMap, Written
from scenelang.language.scene import SceneNode
from scenelang.language.statements import EXPRESSIONS, STATEMENTS
from tests.language.cases import run_text, transform


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


@pytest.mark.parametrize("frame", [0, 7, 47])
def test_animated_scene(frame: int) -> None:
    scene = run_text(ANIMATION, frame=frame).good()
    u = frame / 48
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


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("translate([1, 2]);", nsg.Translate(x=1, y=2)),
        ("translate([1, 2, 3]);", nsg.Translate(x=1, y=2, z=3)),
        ("translate(y = 2, x = 1);", nsg.Translate(x=1, y=2)),
        ("scale(2);", nsg.Scale(x=2, y=2, z=2)),
        ("scale(s = 2);", nsg.Scale(x=2, y=2, z=2)),
        ("scale(2, 3);", nsg.Scale(x=2, y=3, z=1)),
        ("scale([2, 3]);", nsg.Scale(x=2, y=3, z=1)),
        ("scale([2, 3, 4]);", nsg.Scale(x=2, y=3, z=4)),
        ("scale(sx = 2, sy = 3);", nsg.Scale(x=2, y=3, z=1)),
        ("scale(-1, 1);", nsg.Scale(x=-1, y=1, z=1)),
        ("rotate(0);", nsg.Rotate(angle=0)),
        ("rotate(1rad, axis = X);", nsg.Rotate(angle=1, axis=(1, 0, 0))),
        ("rotate(axis = [0, 1, 1], 1rad);", nsg.Rotate(angle=1, axis=(0, 1, 1))),
        ("shear(yx = 0.5);", nsg.Shear(axes="yx", k=0.5)),
        ("twirl(-1);", nsg.Twirl(k=-1)),
        ("twist(2);", nsg.Twist(k=2)),
        ("displace(0.1, frequency = 5);", nsg.Displace(amount=0.1, frequency=5)),
        (
            "matrix([[1, 0, 0, 2], [0, 1, 0, 3], [0, 0, 1, 4], [0, 0, 0, 1]]);",
            nsg.Matrix(rows=((1, 0, 0, 2), (0, 1, 0, 3), (0, 0, 1, 4), (0, 0, 0, 1))),
        ),
    ],
)
def test_transform(text: str, expected: object) -> None:
    for geometry in ("square", "sphere"):
        (node,) = nodes(f"{geometry} {{ {text} }}")
        assert node.transforms == (expected,)


def test_control_flow_among_transforms_and_chain_children() -> None:
    (node,) = nodes("square { for (i in 1..3) { if (i != 2) { translate(i, 0); } } scale(2); }")
    assert [t.kind for t in node.transforms] == ["translate", "translate", "scale"]
    (chain,) = nodes("chain { for (i in 0..<3) { smooth square { translate(i, 0); } } subtract star {} }")
    assert isinstance(chain, nsg.Chain)
    assert [link.op for link in chain.children] == ["union", "smooth", "smooth", "subtract"]
    (first, *_) = nodes("if (false) { star {} } else if (1 > 0) { square {} } else { pentagon {} }")
    assert isinstance(first, nsg.Object)
    assert first.geometry == "square"


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
    assert spans.statement(star).text == "star { rotate(1rad); }"  # type: ignore[union-attr]
    assert [span.locate()[0] for span in spans.calls(square)] == [(3, 3)]
    assert spans.calls(star) == ()
    assert spans.span(object()) is None


def test_a_place_of_its_own_is_kept_for_a_node_that_nobody_else_keeps() -> None:
    """What was known of a node that is gone is not told of the next one, which may have its address."""
    spans, span = SpanMap(), Span(SourceFile("a.nsg", "square;"), 0, 6)
    for _ in range(100):
        spans.record(object(), Written(span, span), Calls(span, None))
    assert len(spans) == 100
    node = object()
    spans.record(node, Written(span, span), Calls(span, None))
    spans.record(node, Written(span, span))
    assert spans.calls(node) == ()


def test_each_class_of_the_tree_is_in_its_table() -> None:
    assert list(EXPRESSIONS) == tree.Expr.__subclasses__()
    assert list(STATEMENTS) == tree.Stmt.__subclasses__()
