"""Scene to Graph: what transforms and materials become, looks, and what a 2D model refuses."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenelang.compiler import steps as affine
from scenelang.compiler.graph import (
    ColourStep,
    Fold,
    InternalError,
    Invariant,
    Leaf,
    Link,
    Look,
    Move,
    colour_steps,
    coloured,
    normal,
    verify,
)
from scenelang.compiler.lower import Memory, lower
from scenelang.compiler.manifest import Manifest, load_manifest
from scenelang.compiler.steps import Affine, Warp, scaling
from scenelang.editors.dumps import dump
from scenelang.language import scene as schema
from scenelang.language.diagnostics import Diagnostics
from tests.assets.shapes import noise

SHAPES = load_manifest("shapes2d")


def lowered(*transforms, manifest=SHAPES, **settings):
    """(moves of a square with these transforms, codes)."""
    diagnostics = Diagnostics()
    node = schema.Object(geometry="square", transforms=transforms)
    graph = lower(schema.Scene(nodes=(node,), **settings), manifest, None, diagnostics)
    verify(graph, "lower")
    return [move.step for move in graph.root.links[0].node.moves], [d.code for d in diagnostics]


def matrix(*block):
    return schema.Matrix(rows=(*block, (0, 0, 0, 1)))


def test_transforms_become_steps() -> None:
    steps, codes = lowered(
        schema.Translate(x=1, y=2),
        schema.Scale(x=2, y=3, z=1),
        schema.Shear(axes="xy", k=0.5),
        schema.Twirl(k=0.3),
        schema.Bend(k=0.4),
    )
    assert codes == []
    assert steps == [
        Affine((1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 0)),
        Affine((2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1, 0)),
        Affine((1, 0.5, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0)),
        Warp(0.3, (0, 0)),
        Warp(0, (0.4, 0)),
    ]


def test_rotations_are_counter_clockwise_seen_from_the_tip_of_the_axis() -> None:
    (up,), _ = lowered(schema.Rotate(angle=pi / 2))
    (down,), _ = lowered(schema.Rotate(angle=pi / 2, axis=(0, 0, -3)))
    assert [up.rows[i] for i in (0, 1, 4, 5)] == pytest.approx([0, -1, 1, 0])
    assert [down.rows[i] for i in (0, 1, 4, 5)] == pytest.approx([0, 1, -1, 0])


REFUSED = [
    (schema.Translate(x=0, y=0, z=1), "E0505"),
    (schema.Rotate(angle=1, axis=(1, 0, 0)), "E0505"),
    (schema.Shear(axes="xz", k=1), "E0505"),
    (schema.Shear(axes="zy", k=1), "E0505"),
    (matrix((1, 0, 1, 0), (0, 1, 0, 0), (0, 0, 1, 0)), "E0505"),
    (matrix((1, 0, 0, 0), (0, 1, 0, 0), (0, 1, 1, 0)), "E0505"),
    (matrix((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 1)), "E0505"),
    (schema.Scale(x=1e-15, y=1, z=1), "E0312"),
    (schema.Scale(x=1e-40, y=1e-40, z=1), "E0312"),
    (matrix((1, 2, 0, 0), (2, 4 + 1e-11, 0, 0), (0, 0, 1, 0)), "E0312"),
    (schema.Twist(k=1), "E0505"),
    (schema.Displace(amount=1, frequency=1), "E0505"),
]
FLAT = [
    (schema.Scale(x=1, y=1, z=1e-20), ["W0508"]),
    (schema.Scale(x=3, y=2, z=-3), ["W0508"]),
    (schema.Scale(x=3, y=2, z=1), []),
    (schema.Scale.uniform(3), []),
    (schema.Shear(axes="xz", k=0), []),
    (schema.Rotate(angle=0, axis=(1, 0, 0)), []),
    (matrix((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, -3, 0)), []),
]


def test_what_a_plane_refuses() -> None:
    for transform, code in REFUSED:
        assert lowered(transform) == ([], [code]), transform
    for transform, codes in FLAT:
        assert lowered(transform)[1] == codes, transform


def test_what_is_said_of_singular_ones() -> None:
    for x, y, words in (
        (1e-31, 1e-31, "singular in float32: it stretches by 1e-31 to 1e-31"),
        (1e31, 1e31, "singular in float32: it stretches by 1e+31 to 1e+31"),
        (1e-15, 1.0, "it flattens everything to a line or a point"),
    ):
        star = schema.Object(geometry="star", transforms=(schema.Scale(x=x, y=y, z=1),))
        found = Diagnostics()
        lower(schema.Scene(nodes=(star,)), SHAPES, None, found)
        (only,) = found
        assert words in only.message


def test_names_that_the_model_lacks() -> None:
    diagnostics = Diagnostics()
    strange = schema.Material(name="glass", ops=(schema.Scale(x=1e-20, y=1, z=1),))
    nodes = (schema.Object(geometry="sqare", material=strange),)
    lower(
        schema.Scene(nodes=nodes, canvas=(100, 50)), replace(SHAPES, limits={"canvas": 64}), None, diagnostics
    )
    assert [d.code for d in diagnostics] == ["E0507", "E0501", "E0502", "E0312"]
    assert "did you mean `square`" in (diagnostics.items[1].help or "")


def test_sizes_and_backgrounds_that_a_model_does_not_draw() -> None:
    fixed = replace(SHAPES, sizes=((64, 64),), white=True)
    assert lowered(manifest=fixed, canvas=(64, 64))[1] == []
    assert lowered(manifest=fixed, canvas=(64, 32))[1] == ["E0509"]
    assert lowered(manifest=fixed, canvas=(64, 64), background=None)[1] == ["E0510"]


def test_materials_are_inherited_from_the_innermost() -> None:
    red = schema.Material(name="flat", ops=(schema.Color(rgb=(1, 0, 0)),))
    blue = schema.Material(name="flat", ops=(schema.Color(rgb=(0, 0, 1)),))
    bare, own = schema.Object(geometry="star"), schema.Object(geometry="star", material=blue)
    inner = schema.Boolean(op="smooth", children=(bare, own))
    scene = schema.Scene(nodes=(schema.Group(children=(inner, bare), material=red), bare))
    text = dump(lower(scene, SHAPES, None, Diagnostics()))
    assert text.split("\n")[1:-1] == [
        "  (group)",
        "    (smooth)",
        "      star #ff0000",
        "      smooth star #0000ff",
        "    star #ff0000",
        "  star #ffffff",
    ]


def test_colours_in_order_and_clamped() -> None:
    color, grey, hue = schema.Color, schema.Grayscale, schema.Hue
    move = schema.Translate(x=1, y=1)
    assert coloured(()) == (1, 1, 1)
    for ops, rgb in (
        ((color(rgb=(2.0, 0.5, -1.0)), color(rgb=(0.5, 1, 1)), move), (0.5, 0.5, 0)),
        ((color(rgb=(1, 0, 0)), grey(amount=1)), (0.2126,) * 3),
        ((color(rgb=(1, 0, 0)), hue(angle=2 * pi / 3)), (0, 1, 0)),
        ((grey(amount=5), hue(angle=1)), (1, 1, 1)),
    ):
        assert coloured(colour_steps(ops)) == pytest.approx(rgb)


def test_verify_names_the_pass() -> None:
    graph = lower(schema.Scene(nodes=(schema.Object(geometry="star"),)), SHAPES, None, Diagnostics())
    leaf = Leaf("star", Look("flat"))
    group = Fold("group", (Link("union", leaf),))

    def nested(depth: int) -> Fold:
        inner = leaf if depth == 1 else nested(depth - 1)
        return Fold("union", (Link("union", leaf), Link("subtract", inner)))

    grey = Look("flat", colours=(("grayscale", 1.0),))
    tilted = Move(Affine((1, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1, 0)))
    cases = [
        (Fold("scene", (Link("subtract", leaf),)), ()),
        (Fold("scene", (Link("union", replace(leaf, look=Look("flat", rgb=(2, 0, 0)))),)), ()),
        (Fold("scene", (Link("union", replace(leaf, moves=(tilted,))),)), ()),
        (Fold("scene", (Link("union", group),)), {Invariant.COMPOSITE}),
        (Fold("scene", (Link("union", group),)), {Invariant.STREAM}),
        (Fold("scene", (Link("union", leaf), Link("smooth", nested(16)))), {Invariant.STREAM}),
        (
            Fold("scene", (Link("union", replace(group, moves=(Move(Warp(1, (0, 0))),))),)),
            {Invariant.AT_LEAVES},
        ),
        (
            Fold("scene", (Link("union", replace(leaf, moves=(Move(Warp(0, (0, 0))),))),)),
            {Invariant.NO_IDENTITIES},
        ),
        (Fold("scene", (Link("union", replace(leaf, look=grey)),)), {Invariant.LOOKS}),
        (Fold("group", ()), ()),
    ]
    for root, holds in cases:
        with pytest.raises(InternalError, match="`flatten`"):
            verify(replace(graph, root=root), "flatten", holds)


def test_a_constant_look_folds_to_its_colour() -> None:
    steps = (("color", 1.0, 0.0, 0.0), ("grayscale", 0.5), ("hue", 0.25))
    look = Look("flat", steps, texture=(Affine(scaling(-1.0, 1.0)),))
    folded = look.folded()
    assert folded == Look("flat", rgb=coloured(steps))
    assert folded.colour() == look.colour()
    assert folded.folded() is folded


def test_objects_that_stay_keep_their_leaves() -> None:
    """Where object, material and model are the very same; the leaf then keeps its notes."""
    red, blue = (schema.Material(name="flat", ops=(schema.Color(rgb=rgb),)) for rgb in ((1, 0, 0), (0, 0, 1)))
    star, square = schema.Object(geometry="star"), schema.Object(geometry="square")

    def leaves(memory: Memory, material: schema.Material, manifest: Manifest = SHAPES) -> list[object]:
        group = schema.Group(children=(star, square.model_copy()), material=material)
        graph = lower(schema.Scene(nodes=(group,)), manifest, None, Diagnostics(), memory)
        (fold,) = (link.node for link in graph.root.links)
        assert isinstance(fold, Fold)
        return [link.node for link in fold.links]

    memory = Memory()
    first, again = leaves(memory, red), leaves(memory, red)
    assert first == again
    assert [a is b for a, b in zip(first, again, strict=True)] == [True, False]
    for other in (leaves(memory, blue), leaves(memory, blue, replace(SHAPES, name="other"))):
        assert not any(a is b for a, b in zip(again, other, strict=True))
        again = other


_share = st.floats(0, 1).map(lambda v: round(v, 3))
_wild = st.one_of(_share, st.sampled_from([0.0, 1.0, -0.5, 1.5, 3.0]))
_step = st.one_of(
    st.tuples(st.just("color"), _wild, _wild, _wild),
    st.tuples(st.just("grayscale"), _wild),
    st.tuples(st.just("hue"), st.floats(-2, 2).map(lambda v: round(v, 3))),
)


@given(st.lists(_step, max_size=8), st.tuples(_share, _share, _share))
def test_the_normal_form_gives_the_same_colours(
    steps: list[ColourStep], rgb: tuple[float, float, float]
) -> None:
    found = normal(steps)
    assert len(found) <= len(steps)
    assert normal(found) == found
    assert coloured(found, rgb) == pytest.approx(coloured(steps, rgb), abs=1e-6)


def test_what_joins() -> None:
    for ops, joined in (
        ([("color", 0.5, 0.5, 1.0), ("color", 0.5, 4.0, 1.0)], (("color", 0.25, 2.0, 1.0),)),
        ([("color", 2.0, 1.0, 1.0), ("color", 0.5, 1.0, 1.0)], None),  # clamped between
        ([("grayscale", 0.5), ("grayscale", 0.5)], (("grayscale", 0.75),)),
        ([("grayscale", 3.0), ("grayscale", 0.5)], None),
        ([("hue", 0.75), ("hue", 0.5)], (("hue", 0.25),)),
        ([("hue", -1.0), ("grayscale", 0.0), ("color", 1.0, 1.0, 1.0)], ()),
        (
            [("color", 0.5, 1.0, 1.0), ("hue", 0.5), ("hue", 0.5), ("color", 1.0, 0.5, 1.0)],
            (("color", 0.5, 0.5, 1.0),),
        ),
    ):
        assert normal(ops) == (tuple(ops) if joined is None else joined)


def test_a_texture_folds_to_one_move_and_stays_a_texture() -> None:
    moves = (Affine(affine.rotation(0.3)), Affine(affine.translation(0.2, 0.1)))
    look = Look("flat", (("hue", 0.5), ("hue", 0.25)), element=noise(2, 2), texture=moves)
    folded = look.folded()
    assert (folded.element, folded.colours) == (look.element, (("hue", 0.75),))
    assert folded.texture == (Affine(affine.compose(moves[1].rows, moves[0].rows)),)
    assert folded.folded() is folded
    np.testing.assert_allclose(folded.moved, look.moved)
