"""Manifests of models: their vocabulary and limits, the ranges of their training, their measurements."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from scenelang.assets.files import note_input, read_json
from scenelang.language.words import REFLECTING

ROOT = Path(__file__).parent / "models"
ALIASES: Final = dict.fromkeys(("textures2d", "shapes2d-w16", "shapes2d-w8"), "shapes2d")
"""Earlier names of models, which scenes, Programs and commands may go on to use."""
USUAL: Final = {2: "shapes2d", 3: "solids3d"}
"""The model of scenes of a dimension that name none."""
_DRAWN = {2: ("element of the plane", "texture"), 3: ("element of space", "texture", "colouring of space")}
"""Kinds of users' elements that renderers draw, for models of the exact lifting."""


@dataclass(frozen=True, slots=True)
class Manifest:
    """A model's manifest, as read from its JSON file.

    Args:
        name: the model's name, as in ``model "name";``.
        summary: one line for people.
        dimension: 2 or 3.
        renderer: name of the renderer.
        lifting: name of the lifting.
        geometries: leaf geometries it draws, in the order of their codes.
        materials: the ways of lighting it knows, likewise; an object without a material gets the first.
        limits: hard limits; beyond them a scene cannot be compiled for this model.
        trained: ranges that were trained or, where the network never sees the quantity because frames are
            exact, measured to hold its figures, ``name -> [low, high]``; beyond them is a warning.
        measured: figures of its evaluation and stability suite.
        set: name of the scenes it was trained on, which models of different speed and error share.
        sizes: canvases (width, height) that it draws; any within its limits where there are none.
        white: whether it draws only over white, knowing colours but no coverage.
        any_blend: whether it draws `smooth` of any width k.
    """

    name: str
    summary: str
    dimension: int
    renderer: str
    lifting: str
    geometries: tuple[str, ...]
    materials: tuple[str, ...]
    limits: dict[str, int]
    trained: dict[str, tuple[float, float]]
    measured: dict[str, Any]
    set: str = ""
    sizes: tuple[tuple[int, int], ...] = ()
    white: bool = False
    any_blend: bool = False

    @staticmethod
    def from_json(data: bytes) -> Manifest:
        """Read a manifest; raises ValueError for what is not one of format 1, or lacks a part."""
        try:
            read = read_json(data)
            if read.pop("format") != 1:
                raise ValueError("another format")
            changed = {
                "set": read.get("set", read["name"]),
                "geometries": tuple(read["geometries"]),
                "materials": tuple(read["materials"]),
                "trained": {key: (float(low), float(high)) for key, (low, high) in read["trained"].items()},
                "sizes": tuple((width, height) for width, height in read.get("sizes", ())),
            }
            return Manifest(**{**read, **changed})
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise ValueError(f"not a model manifest of format 1: {error}") from error

    @property
    def elements(self) -> tuple[str, ...]:
        """Kinds of users' elements that it draws."""
        return _DRAWN[self.dimension] if self.framed else ()

    @property
    def framed(self) -> bool:
        """True where objects are met in exact frames, so that whatever their vectors have is drawn."""
        return self.renderer in ("framed", "solid") and self.lifting == "exact"

    @property
    def lights(self) -> bool:
        """True where it draws what glows, reflects or is of any density, under any lights."""
        return self.framed and self.dimension == 3

    @property
    def shadings(self) -> tuple[str, ...]:
        """The ways of lighting that materials may name: its own, and those that reflect."""
        return self.materials + REFLECTING if self.lights else self.materials

    def flip(self) -> float:
        """Mean FLIP on the scenes of its set, 1 where it was not measured."""
        return float(self.measured.get("sets", {}).get(self.set, {}).get("flip", 1.0))


MANIFEST: Final = "manifest.json"
_READ: Final[dict[Path, tuple[tuple[int, int, int], Manifest]]] = {}
"""A cache: manifests with their files' times, sizes and identities when they were read."""


def model_folder(name: str) -> Path:
    """The folder of a shipped model's files; earlier names of models work too."""
    return ROOT / ALIASES.get(name, name)


def available() -> list[str]:
    """Names of the shipped models, sorted."""
    # a page asks with each key: a glob takes a millisecond, this a fiftieth of one
    return sorted(name for name in os.listdir(ROOT) if os.path.exists(os.path.join(ROOT, name, MANIFEST)))


def load_manifest(name: str) -> Manifest:
    """The manifest of a model, by its name or an earlier one; raises KeyError, or ValueError if damaged."""
    name = ALIASES.get(name, name)
    if name not in available():
        raise KeyError(name)
    path = ROOT / name / MANIFEST
    stat = path.stat()
    stamp = stat.st_mtime_ns, stat.st_size, stat.st_ino
    if (known := _READ.get(path)) is None or known[0] != stamp:
        result = Manifest.from_json(path.read_bytes())
        if result.name != name:
            raise ValueError(f"the manifest of `{name}` calls itself `{result.name}`")
        known = _READ[path] = stamp, result
    note_input(os.fspath(path))
    return known[1]
