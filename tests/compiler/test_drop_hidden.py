"""What is drawn over whole: never more than lies in a disc of the cover, and all that lies well inside."""

from __future__ import annotations

import math
import random

import pytest

import scenelang as nsg
from scenelang.compiler.manifest import load_manifest
from scenelang.compiler.passes import check_scene
from scenelang.language.diagnostics import Diagnostics

INNER = {
    "square": math.sqrt(0.5),
    "triangle": 0.5,
    "pentagon": math.cos(math.pi / 5),
    "star": (3 - math.sqrt(5)) / 2,  # its inner corners
}
SMALL, LARGE = (
    "square { scale(0.02); rotate(7deg); translate(0.8, -0.7); }",
    "square { scale(0.1); translate(%s); }",
)


def others(geometry: str, size: float, count: int) -> str:
    """Covers of about one size, apart from what is to be covered."""
    return "".join(
        f"{geometry} {{ scale({size + i / 100}); rotate({i}rad); translate(-0.7, {i / 5 - 1}); }}"
        for i in range(count)
    )


def rows(text: str) -> int:
    graph = check_scene(nsg.loads(text), None, Diagnostics(), load_manifest("shapes2d"))
    return len(graph.root.links)


@pytest.mark.parametrize("geometry", INNER)
def test_a_disc_inside_the_cover_decides(geometry: str) -> None:
    rng, dropped, kept = random.Random(3), 0, 0
    for _ in range(150):
        size, x, y = rng.uniform(0.2, 0.6), rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5)
        away, towards, small = rng.uniform(0, 0.5), rng.uniform(0, 7), rng.uniform(0.02, 0.1)
        at = f"{x + away * math.cos(towards)}, {y + away * math.sin(towards)}"
        wide = rng.uniform(1, 1.4)
        cover = f"scale({size * wide}, {size}); rotate({rng.uniform(0, 6)}rad); translate({x}, {y});"
        found = rows(f"star {{ scale({small}); translate({at}); }} {geometry} {{ twirl(0.7); {cover} }}")
        radius = size * INNER[geometry]
        if away + math.sqrt(2) * small < 0.999 * radius:
            assert found == 1
            dropped += 1
        elif away > wide * radius:
            assert found == 2
            kept += 1
    assert dropped > 10
    assert kept > 10


@pytest.mark.parametrize(
    ("text", "count"),
    [
        (SMALL + LARGE % "0.8, -0.7", 1),
        (LARGE % "0.8, -0.7" + SMALL, 2),  # it is drawn first, and covers nothing
        (SMALL + SMALL, 1),  # the very same place
        (SMALL + SMALL.replace("square", "star"), 2),
        (f"smooth {{ {SMALL} {LARGE % '0.8, -0.7'} }}", 2),  # a blend looks at distances
        (f"subtract {{ {LARGE % '0, 0'} {SMALL} }} {LARGE % '0.8, -0.7'}", 2),
        # eight covers are tried, the largest: one more that is smaller, and one that is larger, than it
        (SMALL + LARGE % "0.8, -0.7" + "square { scale(0.3); }" + others("star", 0.01, 8), 10),
        (SMALL + LARGE % "0.8, -0.7" + others("square", 0.2, 9), 11),
    ],
)  # fmt: skip
def test_what_covers(text: str, count: int) -> None:
    assert rows(text) == count
