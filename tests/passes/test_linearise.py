"""The boolean rule: what is rewritten to which stream, and what is refused with both operands underlined."""

from __future__ import annotations

import pytest

from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.diagnostics.span import SourceFile
from scenelang.evaluate.evaluation import load_source
from scenelang.models.manifest import load_manifest
from scenelang.passes import check_scene

SHORT = {"union": "", "smooth": "~", "subtract": "-", "intersect": "&"}
LEAVES = {
    # a to d overlap at the centre; p and q overlap on the left, r and s on the right, far from each other
    "a": "square { scale(0.5); }",
    "b": "pentagon { scale(0.4); translate(0.1, 0); }",
    "c": "star { scale(0.3); translate(0, 0.1); }",
    "d": "triangle { scale(0.3); translate(0, -0.1); }",
    "p": "square { scale(0.1); translate(-0.8, 0); }",
    "q": "star { scale(0.1); translate(-0.8, 0.05); }",
    "r": "pentagon { scale(0.1); translate(0.8, 0); }",
    "s": "triangle { scale(0.1); translate(0.8, 0.05); }",
    # near p and q, and apart from them
    "x": "pentagon { scale(0.1); translate(-0.5, 0); }",
    "y": "triangle { scale(0.1); translate(-0.5, 0.05); }",
    # long bars: from q to r, and from s to p
    "u": "square { scale(0.02, 1); rotate(90deg); }",
    "v": "square { scale(0.02, 1.2); rotate(90deg); translate(0, 0.05); }",
}


def check(text: str) -> tuple[str, Diagnostics]:
    """Compile scene text made of `LEAVES`; returns the stream in their letters."""
    source = SourceFile("tree.nsg", text)
    diagnostics = Diagnostics()
    scene, spans = load_source(source, diagnostics=diagnostics)
    assert scene is not None, list(diagnostics)
    stages = {}
    check_scene(scene, spans, diagnostics, load_manifest("shapes2d"), stages.__setitem__)
    names = {}
    for letter, leaf in LEAVES.items():
        alone, _ = load_source(SourceFile("leaf.nsg", leaf), diagnostics=Diagnostics())
        assert alone is not None
        row = check_scene(alone, None, Diagnostics(), load_manifest("shapes2d")).root.links[0].node
        names[row.geometry, tuple(move.step for move in row.moves)] = letter
    stream = "".join(
        SHORT[link.op] + names[link.node.geometry, tuple(move.step for move in link.node.moves)]
        for link in stages["linearise"].root.links
    )
    return stream, diagnostics


def tree(text: str) -> str:
    """``U{…}`` for union and so on, so that leaves can be single small letters."""
    words = {"U": "union", "M": "smooth", "S": "subtract", "I": "intersect", "G": "group", "C": "chain"}
    out = ""
    for char in text:
        out += f"{words[char]} " if char in words else LEAVES.get(char, char)
    return out


REWRITES = {
    "S{a U{b c}}": "a-b-c",
    "U{U{a b} U{c d}}": "abcd",
    "S{U{a b} U{c d}}": "ab-c-d",
    "I{a I{b c}}": "a&b&c",
    "I{a S{b c}}": "a&b-c",
    "I{a S{b U{c d}}}": "a&b-c-d",
    "S{a U{b U{c d}}}": "a-b-c-d",
    "M{U{a b} c}": "ab~c",
    "U{a G{b c} d}": "abcd",
    "G{a G{b G{c d}}}": "abcd",
    "S{a G{b}}": "a-b",
    "S{a S{b}}": "a-b",
    "S{G{S{a}} I{b}}": "a-b",
    "S{a}": "a",
    "S{}": "",
    "G{}": "",
    "S{a G{}}": "a",
    "S{G{} a}": "",
    "M{G{} a b}": "a~b",
    "U{a S{}}": "a",
    "I{a b G{}}": "",
    "U{I{a G{}} b}": "b",
    # a u (b - c) where bounds prove a and b apart
    "U{p S{r s}}": "r-sp",
    "U{p I{r s}}": "r&sp",
    "U{p U{a S{r s}}}": "par-s",
    # composites apart, one after the other
    "U{S{p q} S{r s}}": "p-qr-s",
    "U{M{p q} M{r s}}": "p~qr~s",
    "U{p M{r s}}": "pr~s",
    "U{S{p u} S{r s}}": "p-ur-s",
    # an operator of the second reaches the first, none of the first the second
    "U{S{p q} S{r v}}": "r-vp-q",
    "U{S{p q} I{r s}}": "r&sp-q",
    "U{S{p q} I{x y}}": "x&yp-q",
}

REFUSALS = {
    "S{a I{b c}}": ("E0402", "intersect", "square"),
    "I{a U{b c}}": ("E0403", "union", "square"),
    "S{a S{b c}}": ("E0402", "subtract", "square"),
    "M{a U{b c}}": ("E0404", "union", "square"),
    "M{a G{b c}}": ("E0404", "group", "square"),
    "M{a M{b c}}": ("E0404", "smooth", "square"),
    "I{a M{b c}}": ("E0403", "smooth", "square"),
    "S{a M{b c}}": ("E0402", "smooth", "square"),
    "U{a S{b c}}": ("E0401", "subtract", "square"),
    "U{a M{b c}}": ("E0401", "smooth", "square"),
    "U{a I{b c}}": ("E0401", "intersect", "square"),
    # both operators reach the other composite
    "U{S{p u} S{r v}}": ("E0401", "subtract", "square"),
    # intersect reaches everything, and the first has one too
    "U{I{p q} I{r s}}": ("E0401", "intersect", "square"),
    # no swap when a smooth follows
    "M{U{p S{r s}} a}": ("E0401", "subtract", "square"),
    "M{U{p S{r s}} U{a} b}": ("E0401", "subtract", "square"),
}


@pytest.mark.parametrize("text", REWRITES)
def test_rewritten(text: str) -> None:
    stream, diagnostics = check(tree(text))
    assert not diagnostics.errors
    assert stream == REWRITES[text]


@pytest.mark.parametrize("text", REFUSALS)
def test_refused_with_both_operands_underlined(text: str) -> None:
    code, operand, other = REFUSALS[text]
    _, diagnostics = check(tree(text))
    (error,) = diagnostics.errors
    assert error.code == code
    assert error.span is not None
    assert error.span.text.split()[0] == operand
    assert other in {label.span.text.split()[0] for label in error.labels}
    assert error.help


def test_every_refusal_is_found() -> None:
    _, diagnostics = check(tree("U{S{a I{b c}} S{p S{q I{p q}}}}") + tree("M{a G{b S{c I{a b}}}}"))
    codes = sorted(error.code for error in diagnostics.errors)
    assert codes == ["E0402", "E0402", "E0402", "E0402", "E0404"]


def test_an_empty_intersection_warns() -> None:
    _, diagnostics = check(tree("I{a G{}}"))
    assert [d.code for d in diagnostics if d.code == "W0401"] == ["W0401"]


def test_a_stream_of_tiles_is_found_apart() -> None:
    """A grid of composites, where one box around all before would touch the next."""
    text = (
        "for (i in 0..<12) { for (j in 0..<12) { subtract { pentagon { scale(0.05); } star { scale(0.03); }"
        " translate(-0.9 + 0.15 * i, -0.9 + 0.15 * j); } } }"
    )
    diagnostics = Diagnostics()
    scene, spans = load_source(SourceFile("tiles.nsg", text), diagnostics=diagnostics)
    assert scene is not None
    graph = check_scene(scene, spans, diagnostics, load_manifest("shapes2d"))
    assert not diagnostics.errors
    assert len(graph.root.links) == 288


@pytest.mark.parametrize("shape", ["left", "right"])
def test_depth_is_no_matter(shape: str) -> None:
    from scenelang.scene import schema

    leaf = schema.Object(geometry="square", transforms=(schema.Scale(x=0.5, y=0.5, z=1),))
    node: schema.SceneNode = leaf
    for level in range(900):
        children = (node, leaf) if shape == "left" else (leaf, node)
        op = "union" if shape == "right" or level % 2 else "subtract"
        node = schema.Boolean.model_construct(op=op, children=children, transforms=(schema.Twirl(k=1e-3),))
    diagnostics = Diagnostics()
    scene = schema.Scene.model_construct(nodes=(node,), canvas=(64, 64), background=None)
    check_scene(scene, None, diagnostics, load_manifest("shapes2d"))
    assert not diagnostics.errors
    for _ in range(200):
        node = schema.Group.model_construct(children=(node,), transforms=())
    scene = schema.Scene.model_construct(nodes=(node,), canvas=(64, 64), background=None)
    check_scene(scene, None, diagnostics, load_manifest("shapes2d"))
    assert [error.code for error in diagnostics.errors] == ["E0405"]
