"""Scenes under a sky, with ends of the ranges of all that takes part in their light, drawn small."""

from __future__ import annotations

import time
import warnings
from pathlib import Path
from random import Random

import numpy as np

from fuzz.target import Target, hold
from fuzz.text import PIECES, encode
from lab.light.families import FAMILIES, LEAVES, MESHES, Rng, scene_text
from scenelang.compiler.compile import compile_scene
from scenelang.drawing.how import RenderError
from scenelang.drawing.render import render
from scenelang.language.evaluation import loads
from scenelang.language.reports import SceneError

SIDE_PX = 32
MOST_S = 60.0
"""Processor time of a picture that is a finding."""
# of nodes at the top, and how often
COUNTS = {0: 0.15, 1: 0.3, 2: 0.2, 3: 0.15, 5: 0.1, 8: 0.05, 30: 0.03, 100: 0.02}
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
IMPORTS = 'import "std/meshes" as m;\nimport "originals/wood.safetensors" as log;\n'


def check(data: bytes) -> None:
    """A picture of numbers in [0, 1] without a warning and in time, or the refusal of a Scene."""
    try:
        scene = loads(data.decode(), root=EXAMPLES)
        program = compile_scene(scene.model_copy(update={"canvas": (SIDE_PX, SIDE_PX)}))
    except SceneError:
        return
    before_s = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".*; --patient draws all of it")  # what is bounded is told
        try:
            picture = render(program, threads=1)
        except RenderError as error:
            hold(False, "what compiles is drawn", error)
    taken_s = time.process_time() - before_s
    hold(np.isfinite(picture).all(), "pixels are numbers")
    hold(((picture >= 0) & (picture <= 1)).all(), "pixels lie in [0, 1]")
    hold(taken_s < MOST_S, "too much processor time", f"{taken_s:.0f} s")


def _one(rng: Rng, *values: str | float) -> str:
    return f"{values[int(rng.integers(len(values)))]}"


def _number(rng: Rng, low: float, high: float, *ends: float) -> str:
    """A number of a range, or one of its ends."""
    return _one(rng, *ends) if rng.random() < 0.35 else f"{rng.uniform(low, high):.4g}"


def _point(rng: Rng, wide: float, *ends: float) -> str:
    return f"[{', '.join(_number(rng, -wide, wide, 0.0, *ends) for _ in range(3))}]"


def _colour(rng: Rng) -> str:
    return (
        _one(rng, "#000", "#fff", "#fff", "#f00", "#0af")
        if rng.random() < 0.4
        else (f"[{', '.join(f'{c:.3f}' for c in rng.random(3))}]")
    )


def _power(rng: Rng, most: float) -> str:
    return _number(rng, 0.0, most, 0.0, 1e-6, 1e3, 1e6)


def _stage(rng: Rng) -> str:
    own = f", {_colour(rng)}, {_colour(rng)}" if rng.random() < 0.4 else ""
    text = f"sky({_power(rng, 2.0)}{own});\n"
    for _ in range(int(rng.choice((0, 1, 2, 8), p=(0.2, 0.5, 0.25, 0.05)))):
        at = _point(rng, 4.0, 1e-3, 1e3, -1e4)
        radius = _number(rng, 0.0, 1.0, 0.0, 1e-6, 100.0)
        text += f"light({at}, {_power(rng, 30.0)}, {_colour(rng)}, {radius});\n"
    if "light" not in text:
        text += "light(none);\n"
    if rng.random() < 0.7:
        wide = _one(rng, 0.3, 1.0, 5.0, 5.0)
        eye, target = (_point(rng, float(wide), *ends) for ends in ((1e-3, 1e2, 1e4), (1e-3, -1e4)))
        text += f"camera({eye}, {target}, {_number(rng, 20, 90, 0.01, 1, 170, 179.9)}deg);\n"
    text += _one(
        rng, "", "", "ground(none);\n", f"ground({_number(rng, -2, 1, -1e4, 0, 1e4)}, {_colour(rng)});\n"
    )
    text += _one(rng, "", "", "background(none);\n", f"background({_colour(rng)});\n")
    return text + _one(rng, *[""] * 9, "samples(16);\n")


def _material(rng: Rng) -> str:
    kind = _one(
        rng, "", "diffuse", "diffuse", "volumetric", "volumetric", "glossy", "glossy", "metal", "metal"
    )
    if not kind:
        return ""
    worn = _one(
        rng, "", "", "", f" linear {{ stop(0, {_colour(rng)}); stop(1, {_colour(rng)});", " log.wood {"
    )
    inside = f" color({_colour(rng)});" if rng.random() < 0.8 else ""
    inside += f" scale({_number(rng, 0.1, 2, 1e-3, 1e3)});" if worn else ""
    if kind == "volumetric" and rng.random() < 0.8:
        inside += f" density({_number(rng, 0.5, 10, 1e-6, 1e-3, 100)});"
    if kind in ("glossy", "metal") and rng.random() < 0.8:
        inside += f" roughness({_number(rng, 0.05, 1, 0.05, 1)});"
    if rng.random() < 0.3:
        inside += f" glow({_colour(rng)}, {_power(rng, 5.0)});"
    return f"material {kind}{worn or ' {'}{inside} }}"


def _moves(rng: Rng) -> str:
    text = _one(
        rng,
        *[""] * 7,
        "grow(0.3);",
        "grow(-0.2);",
        *(f"shell({w});" for w in (1e-3, 0.02, 0.1, 1)),
        "displace(0.1, 12);",
    )
    text += _one(rng, *[""] * 7, "twirl(2);", "bend(-0.8);", "twist(3);", "shear(xy = 2);")
    size = _number(rng, 0.2, 1.0, 1e-3, 0.05, 3.0, 100.0)
    text += (
        f" scale({size});"
        if rng.random() < 0.6
        else f" scale({size}, {_number(rng, 0.2, 1, 1e-2, 5)}, {size});"
    )
    if rng.random() < 0.5:
        axis = ", ".join(f"{c:.2f}" for c in rng.normal(size=3))
        text += f" rotate({rng.uniform(0, 360):.0f}deg, axis = [{axis}]);"
    return text + (f" translate({_point(rng, 1.5, 1e-3, -3.0, 1e3)});" if rng.random() < 0.8 else "")


def _node(rng: Rng, depth: int = 2) -> str:
    if depth and rng.random() < 0.25:
        word = _one(rng, "group", "union", "smooth(0.4)", "smooth", "subtract", "subtract(0.1)", "intersect")
        inside = "".join(_node(rng, depth - 1) for _ in range(int(rng.integers(1, 4))))
        return f"{word} {{ {inside} {_material(rng)} }}\n"
    name = _one(rng, *LEAVES, *LEAVES, *(f"m.{name}" for name in MESHES))
    return f"{name} {{ {_moves(rng)} {_material(rng)} }}\n"


def drawn(seed: int) -> str:
    """The text of a scene: one of a family whose parts are mixed in, or nothing but random nodes."""
    rng = np.random.default_rng(seed)
    text = IMPORTS + _stage(rng)
    if rng.random() < 0.15:  # what glows, mist, caves, as others have them
        family = _one(rng, *FAMILIES)
        text = IMPORTS + scene_text(family, seed, 0).replace('import "std/meshes" as m;\n', "")
        text = text.replace("nsg 1;\n", "")
    else:
        text += "".join(_node(rng) for _ in range(int(rng.choice(list(COUNTS), p=list(COUNTS.values())))))
    if rng.random() < 0.1:
        text += f"box {{ shell({_one(rng, 0.01, 0.1)}); scale({_one(rng, 5, 20)}); {_material(rng)} }}\n"
    return text


def mutate(data: bytes, generator: Random) -> bytes:
    """Another scene, whatever this one is."""
    return encode(drawn(generator.randrange(1 << 32)))


TARGET = Target(
    name="skies",
    summary="scenes under a sky with ends of all ranges are drawn as numbers, without a warning and in time",
    check=check,
    seeds=lambda: [encode(drawn(seed)) for seed in range(12)],
    mutate=mutate,
    dictionary=lambda: [encode(piece) for piece in PIECES if len(piece) < 60],
    most_bytes=65_536,
)
