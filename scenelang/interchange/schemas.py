"""JSON Schemas (draft 2020-12) of what scenelang reads and writes as JSON.

The Scene's is made from the pydantic model. What only code can check is not in it: that a matrix is not
singular, that numbers fit into float64, and how deep nodes may nest.
"""

from __future__ import annotations

from typing import Any, Final

from scenelang.models.manifest import OPTIONAL
from scenelang.scene.schema import Scene

_DRAFT: Final = "https://json-schema.org/draft/2020-12/schema"


def scene_schema() -> dict[str, Any]:
    """Of a Scene: what `Scene.from_json` reads and `Scene.to_json` writes."""
    made = Scene.model_json_schema()
    described = {"title": "Scene", "description": made.pop("description", ""), **made}
    return _plain(_headed("scene", described))  # type: ignore[no-any-return]


def diagnostics_schema() -> dict[str, Any]:
    """Of what ``scenelang check --format json`` prints."""
    number = {"type": "integer", "minimum": 1}
    position = {
        "description": "from 1, in code points",
        "type": ["object", "null"],
        "properties": {"line": number, "column": number},
        "required": ["line", "column"],
        "additionalProperties": False,
    }
    place = {
        "file": {"description": "as the user named it", "type": ["string", "null"]},
        "start": {"$ref": "#/$defs/position"},
        "end": {"$ref": "#/$defs/position", "description": "exclusive"},
    }
    edit = _object({**place, "replacement": {"description": "instead of the text there", "type": "string"}})
    fix = _object(
        {"message": {"type": "string"}, "edits": {"type": "array", "items": edit}},
        type=["object", "null"],
        description="a change that is safe to apply unseen",
    )
    diagnostic = _object(
        {
            "code": {"description": "stable; `scenelang explain CODE`", "pattern": "^[EW]\\d{4}$"},
            "severity": {"enum": ["error", "warning"]},
            "message": {"type": "string"},
            **place,
            "labels": {
                "description": "further places",
                "type": "array",
                "items": _object({"message": {"type": "string"}, **place}),
            },
            "help": {"type": ["string", "null"]},
            "fix": fix,
        }
    )
    whole = _object(
        {"version": {"const": 1}, "diagnostics": {"type": "array", "items": diagnostic}},
        title="Diagnostics",
        description="What is wrong with scenes.",
    )
    return _headed("diagnostics", {**whole, "$defs": {"position": position}})


def manifest_schema() -> dict[str, Any]:
    """Of a model's ``manifest.json``."""
    word = {"type": "string", "pattern": "^[A-Za-z_][A-Za-z0-9_]*$"}
    words = {"type": "array", "items": word, "uniqueItems": True}
    pair = {"type": "array", "prefixItems": [{"type": "number"}] * 2, "minItems": 2, "maxItems": 2}
    limit = {"type": "integer", "minimum": 0, "exclusiveMaximum": 1 << 31}
    side = {"type": "integer", "minimum": 1, "maximum": 8192}
    size = {"type": "array", "prefixItems": [side] * 2, "minItems": 2, "maxItems": 2}
    whole = _object(
        {
            "format": {"const": 1},
            "name": {"description": 'as in `model "name";`', "type": "string", "pattern": '^[^"\\\\]+$'},
            "summary": {"description": "one line for people", "type": "string"},
            "dimension": {"enum": [2, 3]},
            "renderer": word,
            "lifting": word,
            "geometries": {**words, "minItems": 1, "description": "in the order of the learned codes"},
            "materials": {**words, "minItems": 1, "description": "likewise, the default first"},
            "limits": {"type": "object", "additionalProperties": limit},
            "trained": {
                "description": "ranges, beyond which is a warning",
                "type": "object",
                "additionalProperties": pair,
            },
            "measured": {"description": "figures of its evaluation", "type": "object"},
            "set": {"description": "the scenes it was trained on; by default its name", "type": "string"},
            "sizes": {
                "description": "canvases (width, height) that it draws; any within its limits if none",
                "type": "array",
                "items": size,
            },
            "any_blend": {"description": "whether it blends over any width", "type": "boolean"},
            "white": {"description": "whether it draws over white alone", "type": "boolean"},
        },
        optional=OPTIONAL,
        title="Manifest",
        description="What a model states about itself.",
    )
    return _headed("manifest", whole)


SCHEMAS: Final = {"scene": scene_schema, "diagnostics": diagnostics_schema, "manifest": manifest_schema}


def _headed(name: str, schema: dict[str, Any]) -> dict[str, Any]:
    return {"$schema": _DRAFT, "$id": f"urn:scenelang:schema:{name}:1", **schema}


def _object(properties: dict[str, Any], *, optional: tuple[str, ...] = (), **further: Any) -> dict[str, Any]:
    """An object that has these properties, but for those that are optional, and no others."""
    return {
        "type": "object",
        **further,
        "properties": properties,
        "required": [name for name in properties if name not in optional],
        "additionalProperties": False,
    }


def _plain(value: Any) -> Any:
    """Descriptions as Markdown writes code, not as Python's documentation does."""
    if isinstance(value, dict):
        return {
            key: item.replace("``", "`") if key == "description" and isinstance(item, str) else _plain(item)
            for key, item in value.items()
        }
    return [_plain(item) for item in value] if isinstance(value, list) else value
