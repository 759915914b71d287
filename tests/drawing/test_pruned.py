"""Pictures with blocks and objects ruled out against those of all objects at all pixels.

Four samples everywhere, so that nothing but what is ruled out can differ.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

import scenelang as nsg
from lab.probes import FLAT, rng_of
from lab.sets.plane import GEOMETRIES, SETS, random_scene
from scenelang.assets.zoo import Zoo
from scenelang.drawing.closed import closed_forms
from scenelang.drawing.neural.coverage import Coverage
from scenelang.drawing.neural.field import Field
from scenelang.drawing.neural.files import load_arrays
from scenelang.language.words import COMBINE
from tests.assets.shapes import element, noise, square
from tests.compiler.random_scenes import blob_scene
from tests.compiler.random_scenes import random_scene as random_tree

EGG = element(lambda x, y: np.hypot(x, y / 0.6) - 0.5, "egg", d=2)
ZOO = nsg.Elements.of("zoo", "zoo.safetensors", Zoo.of([element(square, "tile", d=2), EGG, noise(9, 7)]))


def wild(rng: np.random.Generator) -> nsg.Scene:
    """Sizes, places, blends and warps of all magnitudes, warps first and last, elements and textures."""

    def some(*moves: nsg.Twirl | nsg.Bend) -> list[nsg.Twirl | nsg.Bend]:
        return [*moves[: rng.integers(len(moves) + 1)]]

    links = []
    for at in range(rng.integers(1, 9)):
        x, y, k, turn, across, up, twirl, bend = rng.normal(0, 1, 8).tolist()
        size = 10 ** rng.uniform(-2, 0.5, 2)
        moves = [
            *some(nsg.Twirl(3 * twirl), nsg.Bend(2 * bend)),
            nsg.Scale(float(size[0]), float(size[1]), 1.0),
            nsg.Rotate(angle=3 * turn),
            nsg.Shear("xy", k),
            nsg.Translate(0.5 * x, 0.5 * y),
            *some(nsg.Bend(across), nsg.Twirl(up)),
        ]
        worn = nsg.Material(
            "zoo.bark" if rng.random() < 0.2 else "flat", nsg.Color(tuple(rng.uniform(0, 1, 3).tolist()))
        )
        shape = str(rng.choice([*GEOMETRIES, "zoo.tile", "zoo.egg"]))
        joined = str(rng.choice([*COMBINE])) if at else "union"
        widths = [float(10 ** rng.uniform(-2, 0.5))] if joined == "smooth" else []
        links.append(nsg.Link(joined, nsg.Object(shape, moves, worn), *widths))
    return nsg.Scene(elements=ZOO, nodes=nsg.Chain(links))


def of_sets(seed: int) -> Iterator[tuple[str, nsg.Scene]]:
    for name, config in SETS.items():
        side = 64 if max(config.objects) > 16 else 88
        yield (
            name,
            random_scene(rng_of(seed, 0), config).sized((side, 80)),
        )


def of_probes(seed: int) -> Iterator[tuple[str, nsg.Scene]]:
    for name, probe in FLAT.probes.items():
        for value in (probe.values[0], probe.values[-1]):
            if value <= 16 or name not in ("objects", "blends", "canvas"):
                yield f"{name} {value}", probe.make(rng_of(seed, 0), value).sized((88, 80))


def of_all_kinds(seed: int) -> Iterator[tuple[str, nsg.Scene]]:
    for at in range(8 * seed, 8 * seed + 8):
        yield f"tree {at}", random_tree(at).sized((88, 80))
        yield f"blob {at}", blob_scene(at).sized((88, 80))
        yield f"wild {at}", wild(rng_of(at, 0)).sized((88, 80))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", [of_sets, of_probes, of_all_kinds])
def test_nothing_that_shows_is_ruled_out(
    kind: Callable[[int], Iterator[tuple[str, nsg.Scene]]], seed: int
) -> None:
    """By the network and, of every other scene, by formulas: true distances' bounds have no slack."""
    met = np.zeros(2)
    for at, (name, scene) in enumerate(kind(seed)):
        model = "shapes2d"
        try:
            p = nsg.compile(scene.model_copy(update={"background": None}), model=model)
        except nsg.SceneError:
            continue
        for net in (load_arrays(model).network, *[closed_forms(model)][at % 2 :]):
            field = Field(net, p.vectors, p.tokens, p.brought(), p.paints())  # type: ignore[arg-type]
            ways = [
                Coverage(field, skip=skip).tile(p.canvas, range(p.canvas[1]), "four")
                for skip in (True, False)
            ]
            off = abs(ways[0].picture - ways[1].picture).max()
            assert off < 1 / 255, (name, type(net).__name__, off)
            met += [way.met for way in ways]
    assert met[0] < 0.7 * met[1]


def test_what_is_out_of_reach_moves_no_outline_by_long_rows_of_blends() -> None:
    """A row of 32, one sample of which lies 10⁻⁵ from the outline."""
    p = nsg.compile(FLAT.probes["blends"].make(rng_of(2021, 1), 32), model="shapes2d")
    field = Field(load_arrays("shapes2d").network, p.vectors, p.tokens)
    ways = [Coverage(field, skip=skip).tile(p.canvas, range(160, 168), "four") for skip in (True, False)]
    assert abs(ways[0].picture - ways[1].picture).max() < 1 / 255
    assert ways[0].pairs < 0.7 * ways[1].pairs
