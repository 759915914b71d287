"""Scenes as text and as JSON: both read back equal; hostile JSON is refused in words."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings

import scenelang as nsg
from scenelang.language.scene import MAX_NODE_DEPTH
from tests.language.cases import run_text
from tests.strategies import scenes


@settings(max_examples=150)
@given(scenes)
def test_text_reads_back(scene: nsg.Scene) -> None:
    text = scene.to_nsg()
    again = run_text(text).good()
    assert again == scene
    assert again.to_json() == scene.to_json()  # bit for bit: -0.0 equals 0.0
    assert again.to_nsg() == text


@settings(max_examples=100)
@given(scenes)
def test_json_reads_back(scene: nsg.Scene) -> None:
    assert nsg.Scene.from_json(scene.to_json()) == scene
    assert nsg.Scene.model_validate_json(scene.model_dump_json()) == scene


def test_canonical_text() -> None:
    scene = run_text(
        'model "shapes2d"; chain { square { scale(0.8); material flat { color(#d33); } } '
        "smooth star { rotate(30deg); } } group { star {} rotate(0.123456789012345rad); }"
    ).good()
    assert scene.to_nsg() == (
        "nsg 1;\n"
        'model "shapes2d";\n'
        "chain {\n"
        "  square { material flat { color(#dd3333); } scale(0.8); }\n"
        "  smooth star { rotate(30deg); }\n"
        "}\n"
        "group {\n"
        "  star {}\n"
        "  rotate(0.123456789012345rad);\n"
        "}\n"
    )


def nested(depth: int) -> str:
    text = '{"kind":"object","geometry":"square"}'
    for _ in range(depth):
        text = f'{{"kind":"chain","children":[{{"node":{text}}}]}}'
    return f'{{"nodes":[{text}]}}'


ONE = '{{"nodes": [{{"kind": "object", "geometry": "a", {}}}]}}'


@pytest.mark.parametrize("depth", [1, 40, 60, 200, MAX_NODE_DEPTH])
def test_deep_scenes_survive_json(depth: int) -> None:
    scene = nsg.Scene.from_json(nested(depth))
    # as text: Python 3.12 compares no trees as deep as these
    assert nsg.Scene.from_json(scene.to_json()).to_json() == scene.to_json()
    run_text(scene.to_nsg()) if depth < 190 else None


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("", "json"),
        ("{", "json"),
        ("[]", "object"),
        ("null", "object"),
        ('{"nodes": 3}', "nodes"),
        ('{"colour": 3}', "colour"),
        ('{"version": 2}', "version"),
        ('{"canvas": [0, 256]}', "canvas"),
        ('{"canvas": [256, 1e9]}', "canvas"),
        ('{"background": [NaN, 0, 0]}', "finite"),
        ('{"background": [1e999, 0, 0]}', "background"),
        ('{"nodes": [{"kind": "object"}]}', "geometry"),
        ('{"nodes": [{"kind": "object", "geometry": "a b"}]}', "geometry"),
        ('{"nodes": [{"kind": "object", "geometry": "a", "extra": 1}]}', "extra"),
        ('{"nodes": [{"kind": "cube"}]}', "kind"),
        (ONE.format('"transforms": [{"kind": "scale", "x": 0, "y": 1, "z": 1}]'), "scale by 0"),
        (nested(1).replace('{"node"', '{"op": "subtract", "node"'), "first child"),
        (nested(MAX_NODE_DEPTH + 10), "deeper"),
        ("[" * 200_000, "deeper"),
        ('{"nodes":' * 100_000, "deeper"),
        ("[" * 300 + "NaN" + "]" * 300, "json"),
        ("[" * 300 + "]" * 300, "dictionary"),
    ],
)  # fmt: skip
def test_hostile_json(text: str, part: str) -> None:
    with pytest.raises(nsg.SceneError) as caught:
        nsg.Scene.from_json(text)
    assert part in " ".join(d.message.lower() for d in caught.value.diagnostics)
    assert {d.code for d in caught.value.diagnostics} == {"E0313"}


@pytest.mark.parametrize("depth", [0, 100])
def test_keys_given_twice_are_shown(depth: int) -> None:
    """JSON readers take the last of two equal keys, in silence."""
    good = nested(depth)
    nsg.Scene.from_json(good)
    text = good.replace('"kind":"object",', '"kind":"object","geometry":"star",').replace(
        '{"nodes"', '{"version":1,"ver\\u0073ion":1,"nodes"'
    )
    with pytest.raises(nsg.SceneError) as caught:
        nsg.Scene.from_json(text)
    assert [d.span.text for d in caught.value.diagnostics if d.span] == ['"ver\\u0073ion"', '"geometry"']
    assert {(d.code, d.message) for d in caught.value.diagnostics} == {
        ("E0313", "a key that the object has already")
    }


def test_bytes_and_bad_bytes() -> None:
    assert nsg.Scene.from_json(b"{}") == nsg.Scene()
    with pytest.raises(nsg.SceneError):
        nsg.Scene.from_json(b"\xff{}")


def test_python_building_checks() -> None:
    for wrong in (
        lambda: nsg.Scale(x=0, y=1, z=1),
        lambda: nsg.Rotate(angle=1, axis=(0, 0, 0)),
        lambda: nsg.Translate(x=math.inf, y=0),
        lambda: nsg.Object("two words"),
        lambda: nsg.Object("a", size=3),
        lambda: nsg.Matrix(rows=((1, 0, 0, 0), (1, 0, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))),
        lambda: nsg.Matrix(rows=((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 2))),
        lambda: nsg.Chain(children=(nsg.Link(op="subtract", node=nsg.Object("a")),)),
        lambda: nsg.Scene(canvas=(0, 1)),
        lambda: nsg.Scene(model='a"b'),
    ):
        with pytest.raises(ValueError, match=r"^[A-Z][a-z]+: "):
            wrong()
    with pytest.raises(ValueError, match="frozen"):
        nsg.Object("a").geometry = "b"
