"""Scenes as text, JSON and `repr`: all read back equal; hostile JSON is refused in words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings

import scenelang as nsg
from scenelang.assets.records import deep_stack
from scenelang.compiler.program import program_bytes
from scenelang.language.scene import MAX_NODE_DEPTH, to_readable_json
from tests.language.cases import run_text
from tests.strategies import scenes

EXAMPLES = Path(__file__).parents[2] / "examples"


@settings(max_examples=40)
@given(scenes)
def test_text_json_and_repr_read_back(scene: nsg.Scene) -> None:
    code = repr(scene.nodes)
    assert eval(code, {name: getattr(nsg, name) for name in nsg.__all__ if name in code}) == scene.nodes
    for text in (scene.to_json(), to_readable_json(scene)):
        assert nsg.Scene.from_json(text) == scene
        assert nsg.Scene.from_json(text).to_json() == scene.to_json()
    assert nsg.Scene.model_validate_json(scene.model_dump_json()) == scene
    text = scene.to_nsg()
    again = run_text(text).good()
    assert again == scene
    assert again.to_json() == scene.to_json()  # bit for bit: -0.0 equals 0.0
    assert again.to_nsg() == text


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


def test_deep_scenes_survive_json() -> None:
    for depth in (1, 60, 200, MAX_NODE_DEPTH):
        scene = nsg.Scene.from_json(nested(depth))
        # as text: Python 3.12 compares no trees as deep as these
        assert nsg.Scene.from_json(scene.to_json()).to_json() == scene.to_json()
        run_text(scene.to_nsg()).good() if depth < 190 else None


def test_hostile_json() -> None:
    wrong = []
    for text, part in (
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
        (b"\xff{}", "utf-8"),
    ):  # fmt: skip
        with pytest.raises(nsg.SceneError) as caught:
            nsg.Scene.from_json(text)
        found = caught.value.diagnostics
        if {d.code for d in found} != {"E0313"} or part not in " ".join(d.message.lower() for d in found):
            wrong.append((text[:100], list(found)))
    assert wrong == []
    assert nsg.Scene.from_json(b"{}") == nsg.Scene()


def test_keys_given_twice_are_shown() -> None:
    """JSON readers take the last of two equal keys, in silence."""
    for depth in (0, 100):
        text = nested(depth).replace('"kind":"object",', '"kind":"object","geometry":"star",')
        with pytest.raises(nsg.SceneError) as caught:
            nsg.Scene.from_json(text.replace('{"nodes"', '{"version":1,"ver\\u0073ion":1,"nodes"'))
        found = [(d.code, d.message, d.span and d.span.text) for d in caught.value.diagnostics]
        words = "a key that the object has already"
        assert found == [("E0313", words, '"ver\\u0073ion"'), ("E0313", words, '"geometry"')]


def test_nodes_are_frozen() -> None:
    with pytest.raises(ValueError, match="frozen"):
        nsg.Object("a").geometry = "b"


def test_every_way_gives_the_same_program(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(EXAMPLES)  # where files of elements are looked for
    for at, path in enumerate(sorted(EXAMPLES.glob("*.nsg"))[::2]):
        scene = nsg.load(path)
        program = program_bytes(nsg.compile(scene))
        ways = nsg.Scene.from_json(scene.to_json(), root="."), nsg.loads(scene.to_nsg(), root=".")
        assert ways[0] == ways[1] == scene
        assert program_bytes(nsg.compile(ways[at % 2])) == program, path.name


def test_deep_scenes_have_a_repr() -> None:
    node: Any = nsg.Object("star")
    for _ in range(399):
        node = nsg.Chain.model_construct(
            kind="chain",
            children=(nsg.Link.model_construct(op="union", node=node),),
            transforms=(),
            material=None,
        )
    scene = nsg.Scene.model_construct(nodes=(node,))
    assert repr(scene) == "Scene(1 object, 256 x 256)"
    with deep_stack():
        assert "…" in repr(scene.nodes) or repr(scene.nodes)


def test_repr_shows_what_was_said() -> None:
    star = nsg.Object("star", transforms=[nsg.Scale.uniform(0.5)], material=nsg.Material("flat"))
    said = "Object(geometry='star', transforms=(Scale(x=0.5, y=0.5, z=0.5),), material=Material(name='flat'))"
    assert repr(star) == said
    assert repr(nsg.Scene()) == "Scene(0 objects, 256 x 256)"
    pair = nsg.Group((star, nsg.Chain((star, nsg.Link("subtract", star)))))
    animation = nsg.Animation(2, 24)
    scene = nsg.Scene(canvas=(64, 48), model="shapes2d", animation=animation, nodes=(star, *[pair] * 500))
    assert f"{scene}" == repr(scene) == "Scene(1,501 objects, 64 x 48, shapes2d, a frame of 48)"
    assert repr(nsg.Flip()) == "Flip()"
