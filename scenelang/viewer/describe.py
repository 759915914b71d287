"""A picture in words, for those who do not see it: what is in it, its colours, whether it moves."""

from __future__ import annotations

import colorsys
from collections import Counter
from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from scenelang.graph.stage import encoded
from scenelang.program.groups import SMOOTH, SUBTRACT, UNION, read_groups

MOST: Final = 5  # kinds of objects and colours that are named
_HUES: Final = (
    (0.03, "red"),
    (0.11, "orange"),
    (0.18, "yellow"),
    (0.42, "green"),
    (0.53, "turquoise"),
    (0.69, "blue"),
    (0.80, "purple"),
    (0.95, "pink"),
    (1.00, "red"),
)  # up to which hue, in turns, a colour is called so

_PLURALS: Final = {"torus": "tori"}


def alternative(data: dict[str, Any]) -> str:
    """The alternative text of a view's data."""
    program, animation, solid = data["program"], data["animation"], data["dimension"] == 3
    rows = program["rows"]
    shapes = [shape["name"] for shape in data["shapes"]]
    groups = read_groups(np.array([row["token"] for row in rows], np.int8))
    around = np.append(groups.joins, UNION)[groups.path]
    joins = np.column_stack([around, groups.tokens])  # of rows and of the groups that they are in
    holes, drawn = (joins == SUBTRACT).any(1), (joins <= SMOOTH).all(1)
    parts = _counted(shapes[rows[at]["shape"]] for at in np.flatnonzero(~holes))
    said = f"A {'3D scene' if solid else 'picture'} of {parts}" if parts else "An empty picture"
    if count := int(holes.sum()):
        said += f", with {count:,} cut-outs" if count > 1 else ", with a cut-out"
    plain = [rows[at] for at in np.flatnonzero(drawn) if rows[at]["paint"] < 0]
    colours = Counter(colour_name(_colour(data, row)) for row in plain)
    if colours:
        said += f", in {_listed([name for name, _ in colours.most_common(MOST)], len(colours))}"
    stage, background = program["stage"], program["background"]
    if stage:
        said += "" if stage["transparent"] else f", under a {colour_name(encoded(stage['zenith']))} sky"
        said += ", on the ground" if stage["ground"] else ""
    elif background:
        said += f", on {colour_name(background)}"
    said += "."
    if animation:
        said += (
            f" It moves for {animation['seconds']:g} seconds{', over and over' * bool(animation['loop'])}."
        )
    return said


def colour_name(rgb: Iterable[float]) -> str:
    """What an sRGB colour is called, in one or two words."""
    r, g, b = (min(1.0, max(0.0, float(v))) for v in rgb)
    hue, light, _ = colorsys.rgb_to_hls(r, g, b)
    chroma = max(r, g, b) - min(r, g, b)
    if light > 0.96 or (light > 0.88 and chroma < 0.12):
        return "white"
    if light < 0.08:
        return "black"
    if chroma < 0.08:
        return "light grey" if light > 0.7 else "dark grey" if light < 0.3 else "grey"
    name = next(name for most, name in _HUES if hue <= most)
    if light < 0.4 and name == "orange":
        return "brown"
    return f"light {name}" if light > 0.75 else f"dark {name}" if light < 0.3 else name


def _colour(data: dict[str, Any], row: dict[str, Any]) -> Iterable[float]:
    albedo = data["materials"][row["material"]]["albedo"]
    colour = [a * c for a, c in zip(albedo, row["colour"], strict=True)]
    return encoded((colour[0], colour[1], colour[2])) if data["dimension"] == 3 else colour


def _counted(names: Iterable[str]) -> str:
    """``2 squares, a pentagon and a star``."""
    counts = Counter(names)
    told = [_several(name, n) for name, n in counts.most_common(MOST)]
    return _listed(told, len(counts))


def _several(name: str, count: int) -> str:
    if count == 1:
        return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"
    return f"{count:,} {_PLURALS.get(name, f'{name}s')}"


def _listed(names: list[str], count: int) -> str:
    if count > len(names):
        names = [*names, "more"]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else ""
