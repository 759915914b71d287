"""The JSON Schemas say what the reader does: jsonschema judges examples, random scenes and random damage."""

from __future__ import annotations

import copy
import json
import random
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

import scenelang as nsg
from scenelang.editors.dumps import SCHEMAS, scene_schema
from scenelang.language.reports import render_json
from scenelang.language.scene import to_readable_json
from tests.strategies import scenes

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.nsg"))
SCENE = Draft202012Validator(scene_schema())
UNSAID = ("a singular matrix", "the eye is the target")  # what a schema cannot say


def reads(data: Any) -> bool:
    """Whether the reader takes it; what no schema can say does not count."""
    try:
        nsg.Scene.from_json(json.dumps(data))
    except nsg.SceneError as error:
        return all(d.message.endswith(UNSAID) for d in error.diagnostics)
    return True


def test_schemas_are_schemas() -> None:
    for kind, written in SCHEMAS.items():
        schema = written()
        Draft202012Validator.check_schema(schema)
        assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
        assert schema["$id"] == f"urn:scenelang:schema:{kind}:1"


def test_examples_are_valid() -> None:
    for path in EXAMPLES:
        text = to_readable_json(nsg.load(path))
        if len(text) < 8_000:  # the others hold more of the same
            SCENE.validate(json.loads(text))


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all values in JSON data."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(below for key, item in inner for below in places(item, (*path, key)))]


ODD: tuple[Any, ...] = (
    *(None, True, 0, 1, -1, 2.5, 256.0, 9000, "", "star", "0.5", "a b", "union", "subtract", "scale"),
    *("rotate", "object", [], {}, [0, 0, 0], [1, 1, 1], [0, 0, 0, 1], {"kind": "flip"}, {"x": 1, "y": 1}),
)


def damaged(data: Any, rng: random.Random) -> Any:
    """Data with one value replaced, taken away, added or moved."""
    data = copy.deepcopy(data)
    path = rng.choice(places(data)[1:])
    holder = data
    for key in path[:-1]:
        holder = holder[key]
    key = path[-1]
    match rng.randrange(4):
        case 0:
            holder[key] = copy.deepcopy(rng.choice(ODD))
        case 1:
            del holder[key]
        case 2 if isinstance(holder, dict):
            holder[rng.choice(["x", "k", "kind", "op", "extra", "rgb", "children", "Kind"])] = rng.choice(ODD)
        case 2:
            holder.append(copy.deepcopy(rng.choice(ODD)))
        case _:
            other = data
            for step in rng.choice(places(data)):
                other = other[step]
            holder[key] = copy.deepcopy(other)
    return data


@settings(max_examples=40)
@given(scenes, st.integers(0, 2**32 - 1))
def test_schema_and_reader_agree_on_scenes_and_damage(scene: nsg.Scene, seed: int) -> None:
    data = json.loads(scene.to_json())
    SCENE.validate(data)
    data = damaged(data, random.Random(seed))
    said = [f"{error.json_path}: {error.message}" for error in SCENE.iter_errors(data)]
    assert reads(data) == (not said), (said[:3], data)


AGREED = [
    ('{"canvas": [256.0, 1e2]}', True),
    ('{"canvas": [256.5, 1]}', False),
    ('{"canvas": [true, 1]}', False),
    ('{"version": true}', False),
    ('{"version": 1.0}', True),
    ('{"nodes": [{"geometry": "star"}]}', False),
    ('{"nodes": [{"kind": "object", "geometry": "star", "transforms": [{"angle": 1}]}]}', False),
    ('{"nodes": [{"kind": "chain", "children": [{"node": {"kind": "object", "geometry": "a"}}]}]}', True),
    ('{"background": ["0", "0", "0"]}', False),
    ('{"animation": {"seconds": 0, "fps": 24}}', False),
    ('{"animation": {"seconds": 1, "fps": 24, "loop": 1}}', False),
]


def test_schema_and_reader_agree() -> None:
    for text, good in AGREED:
        assert SCENE.is_valid(json.loads(text)) == reads(json.loads(text)) == good, text


def test_diagnostics_are_valid() -> None:
    validator = Draft202012Validator(SCHEMAS["diagnostics"]())
    found = nsg.Diagnostics()
    for source in (
        "square { rotate(30); }",
        "square { scale(foo); rotate(30); } let a = 1 let b = [; subtract star {} strr {} let a = 2;",
        'fn f(x) = f(x); let y = f(1); import "a.nsg" as a;',
        "chain { subtract star { } }",
    ):
        with pytest.raises(nsg.SceneError):
            nsg.loads(source, diagnostics=found)
    data = json.loads(render_json(found))
    assert len(data["diagnostics"]) >= 5
    assert any(d["fix"] for d in data["diagnostics"])
    assert any(d["labels"] for d in data["diagnostics"])
    validator.validate(data)
    with pytest.raises(nsg.SceneError) as caught:
        nsg.Scene.from_json("[")
    validator.validate(json.loads(render_json(caught.value.diagnostics)))
    assert not validator.is_valid({"version": 1, "diagnostics": [{"code": "E0101"}]})
