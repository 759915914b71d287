"""Skipping by the kernel in the plane: pictures against those of every object at every sample."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

import scenelang as nsg
from lab.probes import FLAT, rng_of
from lab.sets.plane import GEOMETRIES, SETS, random_scene
from scenelang.assets.element_file import ElementFile
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Program
from scenelang.drawing.closed import closed_forms
from scenelang.drawing.neural.draw import draw
from scenelang.drawing.neural.files import load_arrays
from scenelang.language.words import COMBINE
from tests.assets.shapes import element, noise, square
from tests.compiler.random_scenes import blob_scene
from tests.compiler.random_scenes import random_scene as random_tree
from tests.pictures import premultiplied

NETWORK = load_arrays("shapes2d").network


def program(scene: nsg.Scene | str, canvas: tuple[int, int] = (96, 80)) -> Program:
    scene = nsg.loads(scene) if isinstance(scene, str) else scene
    return compile_scene(scene.model_copy(update={"canvas": canvas, "background": None}))


def test_what_is_hidden_costs_nothing() -> None:
    """Objects of all colours behind one that covers the canvas, which is bent: the compiler cannot tell."""
    hidden = " ".join(
        f"star {{ scale(0.3); material flat {{ color(hsv({i / 40}, 1, 1)); }} rotate({7 * i}deg); }}"
        for i in range(40)
    )
    drawing = draw(NETWORK, program(f"{hidden} square {{ bend(0.1); scale(4); }}", (256, 256)))
    assert drawing.met == drawing.refined == 0
    assert np.ptp(premultiplied(np.asarray(drawing.image)), axis=(0, 1)).max() < 1e-4


EGG = element(lambda x, y: np.hypot(x, y / 0.6) - 0.5, "egg", d=2)
ZOO = nsg.Elements.of(
    "zoo", "zoo.safetensors", ElementFile.of([element(square, "tile", d=2), EGG, noise(9, 7)])
)


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


def of_sets() -> Iterator[tuple[str, nsg.Scene]]:
    for name, config in SETS.items():
        side = 64 if max(config.objects) > 16 else 72
        yield name, random_scene(rng_of(0, 0), config).sized((side, 64))


def of_probes() -> Iterator[tuple[str, nsg.Scene]]:
    for name, probe in FLAT.probes.items():
        for value in (probe.values[0], probe.values[-1]):
            if value <= 16 or name not in ("objects", "blends", "canvas"):
                yield f"{name} {value}", probe.make(rng_of(0, 0), value).sized((72, 64))


def of_all_kinds() -> Iterator[tuple[str, nsg.Scene]]:
    for at in range(8):
        yield f"tree {at}", random_tree(at).sized((72, 64))
        yield f"blob {at}", blob_scene(at).sized((72, 64))
        yield f"wild {at}", wild(rng_of(at, 0)).sized((72, 64))


@pytest.mark.parametrize("kind", [of_sets, of_probes, of_all_kinds])
def test_nothing_that_shows_is_ruled_out(
    kind: Callable[[], Iterator[tuple[str, nsg.Scene]]],
) -> None:
    """By the network and, of every other scene, by formulas: true distances' bounds have no slack."""
    for at, (name, scene) in enumerate(kind()):
        model = "shapes2d"
        try:
            p = nsg.compile(scene.model_copy(update={"background": None}), model=model)
        except nsg.SceneError:
            continue
        for net in (NETWORK, *[closed_forms(model)][at % 2 :]):
            pruned, whole = (
                premultiplied(np.asarray(draw(net, p, skip=skip, samples="four").image))  # type: ignore[arg-type]
                for skip in (True, False)
            )
            off = abs(pruned - whole).max(-1) > 1 / 255
            # of formulas, whose outlines are sharp, a sample may lie within rounding of one
            assert off.sum() <= (net is not NETWORK), (name, type(net).__name__)


def test_what_is_out_of_reach_moves_no_outline_by_long_rows_of_blends() -> None:
    """A row of 32, one sample of which lies 10⁻⁵ from the outline."""
    p = nsg.compile(FLAT.probes["blends"].make(rng_of(2021, 1), 32), model="shapes2d")
    ways = [draw(NETWORK, p, samples="four", skip=skip) for skip in (True, False)]
    assert abs(np.asarray(ways[0].image) - np.asarray(ways[1].image)).max() < 1 / 255
    assert ways[0].pairs < 0.7 * ways[1].pairs
