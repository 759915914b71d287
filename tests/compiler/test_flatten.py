"""Any tree of booleans: which operands go on in the open state, and which become groups."""

from __future__ import annotations

from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.passes import check_scene
from scenelang.language import scene as schema
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source

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
    scene, spans = Source(text=source).scene(diagnostics)
    assert scene is not None, list(diagnostics)
    stages = {}
    check_scene(scene, spans, diagnostics, load_manifest("shapes2d"), stages.__setitem__)
    names = {}
    for letter, leaf in LEAVES.items():
        alone, _ = Source(text=SourceFile("leaf.nsg", leaf)).scene(Diagnostics())
        assert alone is not None
        row = check_scene(alone, None, Diagnostics(), load_manifest("shapes2d")).root.links[0].node
        names[row.geometry, tuple(move.step for move in row.moves)] = letter
    stream = ""
    for row in stages["flatten"].rows():
        name = names[row.leaf.geometry, tuple(move.step for move in row.leaf.moves)]
        stream += SHORT[row.op] + "(" * row.begins + name + ")" * row.ends
    return stream, diagnostics


def tree(text: str) -> str:
    """``U{…}`` for union and so on, so that leaves can be single small letters."""
    words = {"U": "union", "M": "smooth", "S": "subtract", "I": "intersect", "G": "group"}
    words["R"] = "subtract(k = 0.1)"
    out = ""
    for char in text:
        out += f"{words[char]} " if char in words else LEAVES.get(char, char)
    return out


REWRITES = {
    "S{a U{b c}}": "a-b-c",
    "S{U{a b} U{c d}}": "ab-c-d",
    "I{a S{b U{c d}}}": "a&b-c-d",
    "M{U{a b} c}": "ab~c",
    "G{a G{b G{c d}}}": "abcd",
    "S{a S{b}}": "a-b",
    "S{G{S{a}} I{b}}": "a-b",
    "S{}": "",
    "S{G{} a}": "",
    "M{G{} a b}": "a~b",
    "U{a S{}}": "a",
    "I{a b G{}}": "",
    "U{I{a G{}} b}": "b",
    # what a left fold does not equal
    "S{a I{b c}}": "a-(b&c)",
    "S{a S{b c}}": "a-(b-c)",
    "I{a U{b c}}": "a&(bc)",
    "I{a M{b c}}": "a&(b~c)",
    "M{a U{b c}}": "a~(bc)",
    "M{a M{b c}}": "a~(b~c)",
    "U{a S{b c}}": "a(b-c)",
    "U{S{a b} S{c d}}": "a-b(c-d)",
    # what follows in an operand is taken off its end
    "U{a U{S{b c} d}}": "a(b-c)d",
    "S{a U{I{b c} d}}": "a-(b&c)-d",
    "I{a S{U{b c} d}}": "a&(bc)-d",
    "I{a I{b S{c d}}}": "a&b&c-d",
    "M{a U{b c} d}": "a~(bc)~d",
    "U{a S{b M{c d}} p}": "a(b-(c~d))p",
    # not where an edge has a width
    "R{a U{b c}}": "a-(bc)",
    "I{a R{b c}}": "a&(b-c)",
    "I{a S{R{b c} d}}": "a&(b-c)-d",
}


def test_rewritten() -> None:
    for text, expected in REWRITES.items():
        stream, diagnostics = check(tree(text))
        assert not diagnostics.errors
        assert stream == expected, text


def test_an_empty_intersection_warns() -> None:
    _, diagnostics = check(tree("I{a G{}}"))
    assert [d.code for d in diagnostics if d.code == "W0401"] == ["W0401"]


def nested(depth: int) -> str:
    """A leaf in so many groups, each cut out of another leaf."""
    return "S{a " * depth + "I{b c}" + "}" * depth


def test_depth_of_groups() -> None:
    stream, diagnostics = check(tree(nested(15)))
    assert not diagnostics.errors
    assert stream == "a-" + "(a-" * 14 + "(b&c" + ")" * 15
    _, diagnostics = check(tree(nested(16)))
    (error,) = diagnostics.errors
    assert error.code == "E0409"
    assert error.span is not None
    assert error.span.text.startswith("intersect")


def test_depth_is_no_matter() -> None:
    leaf = schema.Object(geometry="square", transforms=(schema.Scale(x=0.5, y=0.5, z=1),))
    node: schema.SceneNode = leaf
    for level in range(900):
        op = "subtract" if level > 450 and level % 2 else "union"
        children = (node, leaf) if level > 450 else (leaf, node)
        node = schema.Boolean.model_construct(op=op, children=children, transforms=(schema.Twirl(k=1e-3),))
    diagnostics = Diagnostics()
    for groups in (0, 200):
        for _ in range(groups):
            node = schema.Group.model_construct(children=(node,), transforms=())
        scene = schema.Scene.model_construct(nodes=(node,), canvas=(64, 64), background=None)
        check_scene(scene, None, diagnostics, load_manifest("shapes2d"))
        assert [error.code for error in diagnostics.errors] == ["E0405"] * (groups > 0)
