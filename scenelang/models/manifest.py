"""What a model states about itself: what it can draw, what it was trained on, what it measured."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent


@dataclass(frozen=True, slots=True)
class Manifest:
    """A model's manifest, as read from its JSON file.

    Args:
        name: the model's name, as in ``model "name";``.
        summary: one line for people.
        dimension: 2 or 3.
        renderer: name of the renderer.
        lifting: name of the lifting.
        geometries: leaf geometries it draws.
        materials: materials it knows.
        default_material: what an object without a material gets.
        transforms: geometry transforms it accepts.
        material_ops: texture and colour operations it accepts.
        limits: hard limits; beyond them a scene cannot be compiled for this model.
        trained: ranges that were trained or, where the network never sees the quantity because frames are
            exact, measured to hold its figures, ``name -> [low, high]``; beyond them is a warning.
        measured: figures of its evaluation and stability suite.
    """

    name: str
    summary: str
    dimension: int
    renderer: str
    lifting: str
    geometries: tuple[str, ...]
    materials: tuple[str, ...]
    default_material: str
    transforms: tuple[str, ...]
    material_ops: tuple[str, ...]
    limits: dict[str, int]
    trained: dict[str, tuple[float, float]]
    measured: dict[str, Any]

    @staticmethod
    def from_json(text: str) -> Manifest:
        """Read a manifest; raises ValueError on unknown or missing fields."""
        data = json.loads(text)
        if not isinstance(data, dict) or data.pop("format", None) != 1:
            raise ValueError("not a model manifest of format 1")
        for key in ("geometries", "materials", "transforms", "material_ops"):
            data[key] = tuple(data.get(key, ()))
        data["trained"] = {k: (float(a), float(b)) for k, (a, b) in data.get("trained", {}).items()}
        try:
            return Manifest(**data)
        except TypeError as error:
            raise ValueError(f"bad manifest: {error}") from None


def available() -> list[str]:
    """Names of the shipped models, sorted."""
    return sorted(p.parent.name for p in ROOT.glob("*/manifest.json"))


def load_manifest(name: str) -> Manifest:
    """The manifest of a shipped model; raises KeyError for an unknown name."""
    if name not in available():
        raise KeyError(name)
    return Manifest.from_json((ROOT / name / "manifest.json").read_text("utf-8"))
