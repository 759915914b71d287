"""What the stability suite varies of solids. The base is the set `solids3d`, on 64 x 64 pixels."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from itertools import takewhile

from lab.sets import varied_solids as solids
from lab.sets.sets import Rng
from lab.sets.solid_sets import WARP
from lab.sets.varied import blends, rebuilt
from lab.stability.probes import Kit, Probe, cell_of, common
from scenelang.scene.schema import Camera, Object, Rotate, Scale, Scene, Transform
from scenelang.words import BLEND

DEPTH = 3 * 2 * 0.6  # optical depth of a medium of middling scale
MOST = {"operators": 6, "blends": 8, "size": 4, "shear": 4, "canvas": 256}
"""Of probes of both dimensions, beyond which the exact picture of solids takes too long, or is empty."""


MORE = {"warp": (5.0,)}


def _within(name: str, probe: Probe) -> Probe:
    most = MOST.get(name, math.inf)
    return replace(
        probe,
        values=(*takewhile(lambda value: value <= most, probe.values), *MORE.get(name, ())),
        healthy=128 if name == "canvas" else probe.healthy,
    )


PROBES: dict[str, Probe] = {
    **{
        name: _within(name, probe)
        for name, probe in common(solids.scene, solids.deformed, WARP).items()
        if name != "thin"
    },
    "objects": Probe(
        "objects of a scene, the smaller the more", "objects", (1, 2, 4, 16, 64, 100), 4, solids.crowd
    ),
    "thickness": Probe(
        "thin solids, opaque", "thickness", (0.003, 0.005, 0.01, 0.015, 0.02, 0.03, 0.05, 0.1, 0.3), 0.3,
        solids.thin,
    ),
    "width": Probe(
        "widths of a blend", "k", (0.01, 0.05, 0.15, 0.3, 0.6, 1.2), BLEND,
        lambda rng, k: blends(solids.scene, rng, 2, k=k),
    ),
    "amount": Probe(
        "displacements of frequency 5", "amount", (0.01, 0.02, 0.05, 0.1, 0.2, 0.3), 0.05,
        partial(solids.bulged, frequency=5.0),
    ),
    "frequency": Probe(
        "displacements by 0.05", "frequency", (2, 4, 8, 12, 16, 24), 4,
        lambda rng, frequency: solids.bulged(rng, 0.05, frequency),
    ),
    "shell": Probe("hollow balls", "thickness", (0.01, 0.02, 0.05, 0.1, 0.3), 0.1, solids.shell),
    "depth": Probe(
        "media by what lies in them", "optical depth", (0.4, 1, 3.6, 7, 14), 3.6,
        lambda rng, depth: solids.scene(rng, size=depth / DEPTH, media=1.0),
    ),
    "mist": Probe("an eye in a medium", "its radius", (0.1, 0.3, 0.6, 1, 2), 0.3, solids.in_mist),
    "distance": Probe(
        "distances of the eye", "times the usual", (0.25, 0.5, 1, 2, 4, 8), 1,
        lambda rng, times: solids.seen(rng, Camera((0.0, times * solids.EYE[1], times * solids.EYE[2]))),
    ),
    "fov": Probe(
        "angles of view", "degrees", (5, 15, 37, 60, 90, 120, 150), 37,
        lambda rng, fov: solids.seen(rng, Camera(fov=math.radians(fov))),
    ),
    "height": Probe(
        "heights of the eye", "degrees", (-5, 10, 30, 60, 90), 10,
        lambda rng, angle: solids.seen(rng, Camera(solids.high(math.radians(angle)))),
    ),
    "close": Probe(
        "an eye near an object", "distance", (0.003, 0.01, 0.03, 0.1, 0.3, 1), 1, solids.close
    ),
    "light": Probe("a light near an object", "distance", (0.003, 0.01, 0.03, 0.1, 0.3, 1), 1, solids.lit),
}  # fmt: skip


def _apart(rng: Rng, count: int = 9) -> list[Object]:
    nodes = [link.node for link in solids.links(solids.scene(rng, objects=(count, count)))]
    return [
        Object(node.geometry, (Scale(0.28), node.transforms[1], cell_of(i, count)), node.material)
        for i, node in enumerate(nodes)
        if isinstance(node, Object)
    ]


def _animated(rng: Rng, frames: int) -> list[Scene]:
    """Frames of a base scene, the eye going round it by 2 degrees a frame while the objects turn by 3."""
    scene = solids.scene(rng)

    def turned(frame: int) -> Scene:
        def moves(_: int, node: Object) -> list[Transform]:
            scale, turn, move = node.transforms
            return [scale, turn, Rotate.degrees(3.0 * frame, (0.0, 1.0, 0.0)), move]

        a = math.radians(2.0 * frame)
        eye = solids.EYE[2] * math.sin(a), solids.EYE[1], solids.EYE[2] * math.cos(a)
        return rebuilt(scene, moves).model_copy(update={"camera": Camera(eye)})

    return [turned(frame) for frame in range(frames)]


SOLIDS = Kit(PROBES, _apart, _animated)
