"""Light from everywhere for the page's shader, as it is when the page is made.

Nodes of a lattice around the objects keep moments of the light that comes there, by which surfaces of any
normal are lit (Ramamoorthi and Hanrahan, An Efficient Representation for Irradiance Environment Maps, 2001).
The ground has a map of its own, finer about the objects. Letters: n nodes, K some of them, R rays.
"""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

import numpy as np

from scenelang.compiler.program import Program
from scenelang.compiler.spaces import Sky
from scenelang.drawing.size import sized
from scenelang.drawing.solid.around import GOLDEN, TURNS, Around, arriving, disc
from scenelang.drawing.solid.draw import Lighting
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.march import MARCH_SETTINGS
from scenelang.drawing.solid.mist import NEIGHBOURS, Floats, box_of, pair_of
from scenelang.drawing.solid.network import SolidArrays
from scenelang.web.arrays import ArrayStore

SPREAD = 3.0  # nodes along a side of the ground's map stand at s sinh(SPREAD u)
NOISE = 0.02  # of the light, above which there are more rays
UNLIKE = 0.15  # of the light of both, by which neighbours differ that are not mixed
FILLED = 3  # nodes in solids that a surface may be next to, behind each other
OFF, GAP = 1e-3, 0.01  # world units off the ground where rays begin, and as of `MarchSettings`
BATCH = 1 << 16  # points at once
PAIRS: Final = ((0, 1), (1, 2), (2, 0), (0, 0), (1, 1))


class Detail(NamedTuple):
    """Numbers of nodes of the lattice, about, of the ground's map along a side, and of rays of a node."""

    nodes: int = 14_000
    floor: int = 80
    rays: int = 64
    more: int = 128  # where light is noisy


FULL: Final = Detail()
DRAFT: Final = Detail(1000, 24, 16, 0)
OPEN: Final = Detail(8, 8, 64, 0)
"""Light as if nothing stood in its way, which takes no time."""

Counts = Callable[[Floats], list[Any]]  # of directions (3, …): by what light from there is multiplied


def volume(
    program: Program, network: SolidArrays, store: ArrayStore, detail: Detail = FULL
) -> dict[str, Any]:
    """The part ``around`` of a view, of a Program whose stage has a sky, in the Program's own unit."""
    assert program.stage is not None
    by, program = program.stage.growth, sized(program)
    brought, paints, stage = program.brought(), program.paints(), program.stage
    assert stage is not None
    ground = stage.ground
    with np.errstate(all="ignore"):
        field = SolidField(network, program.vectors, program.tokens, brought, paints)
        lighting = Lighting(field, stage, MARCH_SETTINGS["adaptive"])
        around = _open(lighting) if detail is OPEN else arriving(lighting)
        low, high = box_of(field, np.ones(len(field)))
        if ground is not None:
            low[1] = min(max(low[1], ground.y), high[1])
        sizes = (high - low).clip(1e-3)
        h = float(np.cbrt((sizes + sizes.max() / 12).prod() / detail.nodes))  # with a node more at each end
        sides = (np.ceil(sizes / h).astype(int) + 2).tolist()
        middle, half = (low + high) / 2, h * (np.array(sides) - 1) / 2
        axes = list(map(np.linspace, middle - half, middle + half, sides))
        p, light, free = _light(around, axes, _moments, detail)
        means = light[:3]
        if field.media:
            means = np.concatenate([means, means if around.mist is None else around.medium(p)])
        ratios = (light[3:] / np.tile(light[:3], (8, 1)).clip(1e-9)).clip(-1.0, 1.0)
        data = {"low": ((middle - half) / by).tolist(), "side": h / by, "sides": sides, "floor": None}
        data |= {"free": store.add(free.astype(np.uint8)), **_roots(means, store)}
        data["ratios"] = store.add(np.rint(128 + 127 * ratios).astype(np.uint8))
        if ground is not None:
            scale = float(max(half[0], half[2]) / np.sinh(SPREAD / 2))
            x = scale * np.sinh(SPREAD * np.linspace(-1.0, 1.0, detail.floor))
            axes = [middle[0] + x, np.array([ground.y + OFF]), middle[2] + x]
            light = _light(around, axes, lambda way: [4 * way[1].clip(0.0)], detail)[1]
            plane = [*(middle[[0, 2]] / by).tolist(), scale / by, SPREAD]
            data["floor"] = {"plane": plane, "side": detail.floor, **_roots(light, store)}
    return data


def _open(lighting: Lighting) -> Any:
    """Light of a sky over the bare ground, asked as `Around` is."""
    stage = lighting.stage
    sky, ground = stage.sky or Sky(power=0.0), stage.ground
    horizon, zenith = (sky.power * np.array([rgb], np.float32).T for rgb in (sky.horizon, sky.zenith))
    floor = horizon * np.array(ground.rgb if ground else (1.0, 1.0, 1.0), np.float32)[:, None]

    def arriving(p: Floats, way: Floats) -> tuple[Floats, Floats]:
        high = (2 * way[1]).clip(0.0, 1.0)
        light = np.where(way[1] < 0, floor, horizon)
        return light + (zenith - horizon) * high, 0 * high

    bare = {"mist": None, "emitters": SimpleNamespace(there=False)}
    return SimpleNamespace(field=lighting.field, arriving=arriving, **bare)


def _roots(light: Floats, store: ArrayStore) -> dict[str, Any]:
    """Light as the roots of parts of the most, in 16 bits."""
    top = max(float(light.max()), 1e-9)
    return {"top": top, "light": store.add(np.rint(65535 * np.sqrt(light.clip(0.0) / top)).astype(np.uint16))}


def _moments(way: Floats) -> list[Any]:
    return [1.0 + 0 * way[0], *way, *(way[i] * way[j] for i, j in PAIRS)]


def _light(
    around: Around, axes: list[np.ndarray], counts: Counts, detail: Detail
) -> tuple[Floats, Floats, np.ndarray]:
    """Nodes (3, n) of a lattice, light that comes there by what it counts (…, n), and which are outside of
    solids; the others have light of their neighbours.
    """
    p = np.stack(np.meshgrid(*axes, indexing="ij")).astype(np.float32)
    sides, p = p.shape[1:], p.reshape(3, -1)
    met = around.field.near(p, 0 * p[0] + GAP, every=True)
    free = ~((met.distance < 0) & ~around.field.material(met).medium).reshape(sides)
    glow = _glowing(around, p, counts)
    light = (glow + _gathered(around, p, 0, detail.rays, counts)).reshape(-1, *sides)
    noise = abs(_evened(light, free) - light)[:3, free].sum() / light[:3, free].sum().clip(1e-9)
    if more := round(min(max(float(noise) / NOISE - 1, 0.0), 1.0) * detail.more):
        rest = (glow + _gathered(around, p, detail.rays, more, counts)).reshape(-1, *sides)
        light = _evened(_evened((detail.rays * light + more * rest) / (detail.rays + more), free), free)
    filled = free
    for _ in range(FILLED):
        even = _evened(light, filled)
        light, filled = np.where(filled, light, even), filled | (even[:3].sum(0) > 0)
    return p, light.reshape(-1, p.shape[1]), free


def _gathered(around: Around, p: Floats, begin: int, rays: int, counts: Counts) -> Floats:
    """The mean light (…, n) along rays from points (3, n)."""
    result, each = [], np.arange(rays)[:, None]
    for start in range(0, p.shape[1], BATCH):
        band = np.arange(start, min(start + BATCH, p.shape[1]))
        shift, turn = (TURNS @ np.stack([band, 0 * band + begin]) + 0.5) % 1.0
        z = 1 - 2 * (each + shift) / rays
        way = disc(np.sqrt(1 - z * z), GOLDEN * each + 2 * np.pi * turn).astype(np.float32)  # (3, R, K)
        way[2] = z
        at, ways = np.repeat(p[:, None, band], rays, 1).reshape(3, -1), way.reshape(3, -1)
        light, reach = around.arriving(at, ways)
        if around.mist is not None:
            more, clear = around.mist.along(at, ways, reach)
            light = light * clear + more
        light = light.reshape(3, rays, -1)
        result.append(np.concatenate([(light * count).mean(1) for count in counts(way)]))
    return np.concatenate(result, 1)


def _glowing(around: Around, p: Floats, counts: Counts) -> Floats:
    """The same (…, n) of what glows, which rays do not see."""
    result = np.zeros((len(counts(p)), 3, p.shape[1]), np.float32)
    for start in range(0, p.shape[1] if around.emitters.there else 0, BATCH):
        band = slice(start, start + BATCH)
        point, way, light = around.drawn(p[:, band])
        for row, count in zip(result, counts(way), strict=True):
            around.xp.add(row[:, band], point, light * count / 4)
    return result.reshape(-1, p.shape[1])


def _evened(values: np.ndarray, free: np.ndarray) -> Floats:
    """Values (…, n…) mixed with those of free neighbours that are as bright, 0 where there are none."""
    total, count, bright = 8 * values * free, 8.0 * free, values[:3].sum(0) * free
    for shift in NEIGHBOURS:
        to, on = pair_of(free.shape, shift)
        apart = (bright[on] - bright[to]) / (UNLIKE * (bright[on] + bright[to])).clip(1e-9)
        weight = 2 ** (3 - sum(map(abs, shift))) * free[on] / (1 + free[to] * apart**4)
        total[:, *to] += weight * values[:, *on]
        count[to] += weight
    return np.asarray(total / count.clip(1e-9), np.float32)
