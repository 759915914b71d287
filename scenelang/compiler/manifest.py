"""Manifests of models: their vocabulary and limits, the ranges of their training, their measurements."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from scenelang.assets.files import note_input, read_json, read_regular

ROOT = Path(__file__).parent / "models"
MOST: Final = 1e300  # bound of the numbers in ranges
_MOST_BYTES: Final = 1 << 20
OPTIONAL: Final = ("set", "sizes", "white", "any_blend")
ALIASES: Final = {"textures2d": "shapes2d"}
"""Earlier names of models, which scenes, Programs and commands may go on to use."""
USUAL: Final = {2: "shapes2d", 3: "solids3d"}
"""The model of scenes of a dimension that name none."""
_LIMITS: Final = {"canvas": 8192, "inner_warps": 2, "outer_warps": 3}
"""Limits that a model may have: the largest canvas of all, and what the exact lifting has room for."""
_RANGES: Final = {
    "objects", "smooth", "twirl", "bend", "twist", "scale", "thin", "blend", "displace", "frequency",
    "thickness", "width", "texels",
}  # fmt: skip
_DRAWN: Final = {
    "framed": ("element of the plane", "texture"),
    "solid": ("element of space", "texture", "colouring of space"),
}
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
    def from_json(text: str | bytes) -> Manifest:
        """Read a manifest; raises ValueError for other JSON, and for missing, unknown or wrong fields."""
        text = text.encode("utf-8") if isinstance(text, str) else text
        if len(text) > _MOST_BYTES:
            raise ValueError(f"a manifest of more than {_MOST_BYTES:,} bytes")
        data = read_json(text)
        if not isinstance(data, dict) or data.pop("format", None) != 1:
            raise ValueError("not a model manifest of format 1")
        if wrong := {*data, *OPTIONAL} ^ _KINDS.keys():
            raise ValueError(f"fields missing or unknown: {', '.join(sorted(wrong))}")
        data.setdefault("set", data["name"])
        for key, value in data.items():
            if not _KINDS[key](value):
                raise ValueError(f"field `{key}` does not hold what it should")
        lists = {key: tuple(data[key]) for key in ("geometries", "materials")}
        trained = {key: (float(low), float(high)) for key, (low, high) in data["trained"].items()}
        sizes = tuple((width, height) for width, height in data.get("sizes", ()))
        return Manifest(**{**data, **lists, "trained": trained, "sizes": sizes})

    @property
    def elements(self) -> tuple[str, ...]:
        """Kinds of users' elements that it draws."""
        return _DRAWN.get(self.renderer, ()) if self.lifting == "exact" else ()

    def flip(self) -> float:
        """Mean FLIP on the scenes of its set, 1 where it was not measured."""
        value = self.measured.get("sets", {}).get(self.set, {}).get("flip", 1.0)
        return float(value)


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and value != "" and value.isprintable()


def _is_name(value: Any) -> bool:
    """Names of models and sets name files too."""
    return _is_text(value) and len(value) <= 100 and value[0] != "." and not set(value) & set('"\\/:')


def _is_word(value: Any) -> bool:
    return isinstance(value, str) and value.isascii() and value.isidentifier()


def _are_words(value: Any) -> bool:
    return isinstance(value, list) and all(map(_is_word, value)) and len(set(value)) == len(value)


def _is_pair(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(type(v) in (int, float) for v in value)


def _is_range(value: Any) -> bool:
    """Two numbers that float64 holds, the lower first."""
    return _is_pair(value) and bool(-MOST <= value[0] <= value[1] <= MOST)


def _is_size(value: Any) -> bool:
    """Two sides in pixels."""
    return _is_pair(value) and all(type(v) is int and 1 <= v <= 8192 for v in value)


def _are(holds: Callable[[Any, Any], bool]) -> Callable[[Any], bool]:
    """A check that a value is an object and that each entry passes ``holds``."""
    return lambda value: isinstance(value, dict) and all(holds(k, v) for k, v in value.items())


def _is_figure(key: str, value: Any) -> bool:
    """Check a measurement: sets are objects of figures, the stability suite has a line for each quantity."""
    if key == "sets":
        return _are(lambda _, v: isinstance(v, dict) and _is_range([0, v.get("flip", 1)]))(value)
    return key != "stability" or _are(lambda _, v: _is_text(v))(value)


_KINDS: Final[dict[str, Callable[[Any], bool]]] = {
    "name": _is_name,
    "summary": _is_text,
    "dimension": lambda value: type(value) is int and value in (2, 3),
    "renderer": _is_word,
    "lifting": _is_word,
    "geometries": _are_words,
    "materials": lambda value: _are_words(value) and len(value) > 0,
    "limits": _are(lambda key, v: type(v) is int and 0 <= v <= _LIMITS.get(key, -1)),
    "trained": _are(lambda key, v: key in _RANGES and _is_range(v)),
    "measured": _are(_is_figure),
    "set": _is_name,
    "sizes": lambda value: isinstance(value, list) and all(map(_is_size, value)),
    "white": lambda value: type(value) is bool,
    "any_blend": lambda value: type(value) is bool,
}
"""The check of each field."""


_FILE: Final = "manifest.json"
_READ: Final[dict[Path, tuple[tuple[int, int, int], Manifest]]] = {}
"""A cache: manifests with their files' times, sizes and identities when they were read."""


def model_folder(name: str) -> Path:
    """The folder of a shipped model's files; earlier names of models work too."""
    return ROOT / ALIASES.get(name, name)


def available() -> list[str]:
    """Names of the shipped models, sorted."""
    # a page asks with each key: a glob takes a millisecond, this a fiftieth of one
    return sorted(name for name in os.listdir(ROOT) if os.path.exists(os.path.join(ROOT, name, _FILE)))


def load_manifest(name: str) -> Manifest:
    """The manifest of a model, by its name or an earlier one; raises KeyError, or ValueError if damaged."""
    name = ALIASES.get(name, name)
    if name not in available():
        raise KeyError(name)
    path = ROOT / name / _FILE
    stat = path.stat()
    stamp = stat.st_mtime_ns, stat.st_size, stat.st_ino
    known = _READ.get(path)
    if known is None or known[0] != stamp:
        result = Manifest.from_json(read_regular(path, _MOST_BYTES))
        if result.name != name:
            raise ValueError(f"the manifest of `{name}` calls itself `{result.name[:40]}`")
        known = _READ[path] = stamp, result
    note_input(os.fspath(path))
    return known[1]
