"""The kernel's rays and cones against those of the network as written, and against sums over many points."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Paint
from scenelang.drawing.closed import field_of
from scenelang.drawing.how import RenderError
from scenelang.drawing.kernel import Trails, load_kernel
from scenelang.drawing.solid.draw import Lighting, directions
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.march import Trail
from scenelang.drawing.solid.plain import PlainField
from scenelang.drawing.solid.soft import ASIDE, WIDE
from scenelang.drawing.tables import Tables
from scenelang.language.evaluation import load
from scenelang.language.words import TOKENS, Combine
from tests.drawing.solids import LEAVES, Object, moved, network, scaled, turned, vector
from tests.drawing.solids import field as stream
from tests.drawing.test_lamps import PLACES
from tests.drawing.test_renderers_solids import COARSE, MOVED, SPACE, STEPS

ROOT = Path(__file__).parents[2]
KERNEL = load_kernel()
SIDE = 28
ABOVE = np.array([0, 4, 0], np.float32), 0.3  # a lamp
NEAR = 2e-3  # world units, as far as a step may pass what is certain, and less
NAMES = (
    *("bracket", "castle", "caterpillar", "clouds", "cumulus", "die", "fog"),
    *("lantern", "lotus", "paperlamp", "robot", "saturn", "teatime", "turned"),
)


def hold(found: Trails, trail: Trail, gap: float) -> None:
    """Hits and ways in media are the plain field's, within its steps."""
    there = np.isfinite(found.hit)
    assert (there != np.isfinite(trail.hit)).mean() < 5e-3
    both = there & np.isfinite(trail.hit)
    off = abs(found.hit - trail.hit)[both]
    assert (off > NEAR).sum() <= 0.05 * len(off)
    assert (off > 2 * gap).sum() <= 0.01 * len(off)
    assert (abs(found.length - trail.length) > NEAR).mean() <= 3e-3
    assert (found.soft != (trail.soft > 0)).mean() <= 2e-3
    assert (abs(found.depth - trail.depth) > 0.02).mean() <= 3e-3
    assert found.near == trail.work.near
    assert found.steps < 1.6 * trail.work.steps + 100
    sums = np.zeros(len(found.hit))
    np.add.at(sums, found.pieces["ray"], found.pieces["end"] - found.pieces["begin"])
    assert sums == pytest.approx(found.length, abs=1e-4)


@pytest.mark.parametrize("name", NAMES)
def test_rays_of_the_eye_and_from_anywhere(name: str) -> None:
    program = compile_scene(load(ROOT / f"examples/{name}.nsg"))
    assert program.stage is not None
    given = program.vectors, program.tokens, program.brought(), program.paints()
    net = field_of(program, False)
    field, tables = SolidField(net, *given), Tables(net, *given)  # type: ignore[arg-type]
    lighting, plain = Lighting(field, program.stage), PlainField(net, *given)  # type: ignore[arg-type]
    gap, x = lighting.pace.gap, np.arange(SIDE) + 0.5
    way = directions(program.stage.camera, (SIDE, SIDE), x, x[:, None]).reshape(3, -1)
    limit, rng = lighting.limit(way), np.random.default_rng(0)
    origins = rng.uniform(-1, 1, way.shape).astype(np.float32)
    ways = rng.normal(size=way.shape)
    ways = (ways / np.linalg.norm(ways, axis=0)).astype(np.float32)
    far = np.full(way.shape[1], np.inf, np.float32)
    with field.xp.inference():
        for rays in ((lighting.eye, way, limit), (origins, ways, far)):
            trail = plain.march(*rays, gap=gap)
            hold(KERNEL.rays(tables, *rays, gap=gap), trail, gap)


def test_rays_begin_and_end_where_they_should() -> None:
    """Of a ray in mist the way between its begin and its limit; steps that do not suffice are told."""
    program = compile_scene(load(ROOT / "examples/cumulus.nsg"))
    tables = Tables(field_of(program, False), program.vectors, program.tokens)  # type: ignore[arg-type]
    p, way = np.zeros((3, 9), np.float32), np.tile(np.array([[1.0], [0.0], [0.0]], np.float32), 9)
    whole = KERNEL.rays(tables, p, way, np.full(9, np.inf, np.float32), gap=0.01)
    begin, limit = np.linspace(0, 0.1, 9, dtype=np.float32), np.linspace(0.12, 0.2, 9, dtype=np.float32)
    part = KERNEL.rays(tables, p, way, limit, begin, gap=0.01)
    assert (whole.length > 0.3).all()
    assert part.length == pytest.approx(limit - begin, abs=1e-4)
    pieces = np.sort(part.pieces, order="ray")
    assert pieces["begin"] == pytest.approx(begin, abs=1e-4)
    assert KERNEL.rays(tables, p, way, limit + 9, gap=0.01, steps=1).lost == 9


def media(seed: int, solids: float, coloured: bool = True) -> SolidField:
    """Seven objects, most of them media of several densities and colours."""
    rng, objects = np.random.default_rng(seed), []
    for i in range(7):
        steps = (
            scaled(*rng.uniform(0.3, 0.9, 3)),
            turned(rng.uniform(0, 6)),
            moved(*rng.uniform(-0.7, 0.7, 3)),
        )
        op: Combine = (
            "union" if i == 0 else ("union", "smooth", "subtract")[rng.choice(3, p=[0.65, 0.2, 0.15])]
        )
        kind, rgb = ("volumetric", "diffuse")[rng.random() < solids], tuple(rng.uniform(0, 1, 3).tolist())
        leaf = LEAVES[rng.integers(len(LEAVES))]
        objects.append(Object(leaf, steps, kind, rgb if coloured else (0.5, 0.5, 0.5), op))
    vectors = np.array([vector(o, network()) for o in objects], np.float32)
    vectors[:, PLACES.density] = rng.choice([0.3, 1.0, 2.0, 6.0], 7)
    return SolidField(network(), vectors, np.array([TOKENS[o.token] for o in objects], np.int8))


def crossing(seed: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Origins, some of them within, and ways to about the middle, and limits."""
    rng = np.random.default_rng(seed)
    origin = rng.normal(size=(3, count))
    origin *= np.where(np.arange(count) % 3, 3, 0.3) / np.linalg.norm(origin, axis=0)
    to = rng.uniform(-0.8, 0.8, (3, count)) - origin
    way = to / np.linalg.norm(to, axis=0)
    return origin.astype(np.float32), way.astype(np.float32), np.full(count, 6.0, np.float32)


def summed(
    tables: Tables, origin: np.ndarray, way: np.ndarray, ends: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Optical depths (M,) and light (3, M) of media whose colours glow, by sums over points of rays."""
    step, depth, light = 0.002, [], []
    for o, w, end in zip(origin.T, way.T, ends, strict=True):
        t = np.arange(step / 2, end, step)
        found = KERNEL.field(tables, o[:, None] + w[:, None] * t, 0.05, every=True)
        within = (found.distance < 0) & (found.register[-1] > 0.5)
        sigma = np.where(within, found.register[-tables.looks.switched].astype(float), 0.0) * step
        before = np.cumsum(sigma) - sigma / 2
        depth.append(sigma.sum())
        light.append((found.register[:3] * sigma * np.exp(-before)).sum(1))
    return np.array(depth), np.array(light).T


def glowing(tables: Tables, origin: np.ndarray, way: np.ndarray, pieces: np.ndarray) -> np.ndarray:
    """The same light (3, M) by three points of each piece."""
    result, (points, weights) = np.zeros(way.shape), np.polynomial.legendre.leggauss(3)
    ray, sigma = pieces["ray"], pieces["sigma"].astype(float)
    taken = 1 - np.exp(-sigma * (pieces["end"] - pieces["begin"]))
    for point, weight in zip((points + 1) / 2, weights / 2, strict=True):
        t = pieces["begin"] - np.log1p(-point * taken) / sigma
        colours = KERNEL.field(tables, origin[:, ray] + way[:, ray] * t, 0.05, every=True).register[:3]
        np.add.at(result.T, ray, (colours * (weight * taken * np.exp(-sigma * pieces["before"]))).T)
    return result


@pytest.mark.parametrize("seed", range(6))
def test_ways_in_media_are_cut_where_these_differ(seed: int) -> None:
    """Against sums over many points, and no less exact than the plain field's pieces."""
    field, rays = media(seed, 0.3 * (seed % 2)), crossing(seed, 60)
    found = KERNEL.rays(field.tables, *rays, gap=0.009)
    depth, light = summed(field.tables, *rays[:2], np.minimum(found.hit, rays[2]))
    pieces = found.pieces
    assert len(pieces) > 30
    assert (np.diff(pieces["ray"]) >= 0).all()
    same = pieces["ray"][1:] == pieces["ray"][:-1]
    assert same.sum() > 10
    assert (pieces["begin"][1:] >= pieces["end"][:-1] - 1e-5)[same].all()
    off, glow = abs(found.depth - depth), abs(glowing(field.tables, *rays[:2], pieces) - light)
    assert off.mean() < 4e-3
    assert off.max() < 0.03
    assert glow.mean() < 5e-4
    assert glow.max() < 0.02
    own = pieces["sigma"] * (pieces["end"] - pieces["begin"])
    total = np.zeros(60)
    np.add.at(total, pieces["ray"], own)
    assert total == pytest.approx(found.depth, abs=1e-4)
    before = np.concatenate(
        [[0.0], np.where(same, (own[:-1] + (pieces["before"] * pieces["sigma"])[:-1]), 0.0)]
    )
    assert pieces["before"] * pieces["sigma"] == pytest.approx(before, abs=1e-4)
    with field.xp.inference():
        trail = PlainField(network(), *field.rows).march(*rays, gap=0.009)
    assert off.mean() < abs(trail.depth - depth).mean() + 1e-3
    plain = np.zeros(len(trail.pieces.ray), pieces.dtype)
    for name, part in zip(plain.dtype.names or (), trail.pieces, strict=True):
        plain[name] = part
    assert glow.mean() < abs(glowing(field.tables, *rays[:2], plain) - light).mean() + 2e-4


def test_where_the_depth_alone_is_asked_for_there_are_no_pieces() -> None:
    field, rays = media(1, 0.3), crossing(1, 200)
    every, depth = (KERNEL.rays(field.tables, *rays, gap=0.009, parted=parted) for parted in (True, False))
    assert not len(depth.pieces)
    assert depth.depth == pytest.approx(every.depth, abs=0.03)
    assert (depth.hit == every.hit).mean() > 0.99
    grey = KERNEL.rays(media(1, 0.3, coloured=False).tables, *rays, gap=0.009)
    assert (grey.depth == depth.depth).all()


def test_portions_make_no_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    field, rays = media(2, 0.3), crossing(2, 500)
    p, n = rays[0], -rays[1]
    whole = KERNEL.rays(field.tables, *rays, gap=0.009), KERNEL.cones(field.tables, *ABOVE, p, n)
    monkeypatch.setattr("scenelang.drawing.kernel.PORTION", 100)
    parts = KERNEL.rays(field.tables, *rays, gap=0.009), KERNEL.cones(field.tables, *ABOVE, p, n)
    for a, b in zip(whole, parts, strict=True):
        for one, other in zip(a[:-1], b[:-1], strict=True):  # all but the work
            assert np.asarray(one).tobytes() == np.asarray(other).tobytes()
    with pytest.raises(RenderError, match="more work"):
        KERNEL.rays(field.tables, *rays, gap=0.009, until_s=0.0)
    with pytest.raises(RenderError, match="more work"):
        KERNEL.cones(field.tables, *ABOVE, p, n, until_s=0.0)


def test_processors_with_wide_packets_give_the_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    field, rays, newest = media(4, 0.3), crossing(4, 300), KERNEL.variant
    p, way, _ = rays
    found = []
    for variant in range(newest + 1):
        monkeypatch.setattr(KERNEL, "variant", variant)
        shares = KERNEL.cones(field.tables, *ABOVE, p, -way)[0]
        trails = KERNEL.rays(field.tables, *rays, gap=0.009)
        found.append([trails.hit, trails.depth, shares, trails.pieces])
    for first, *others in zip(*found, strict=True):
        for a, b in pairwise(others):
            assert a.tobytes() == b.tobytes()
        if others and len(first) == len(p[0]):
            assert (np.isclose(first, others[0], atol=2e-3)).mean() > 0.99


def lamps(
    name: str, side: int = 48
) -> tuple[SolidField, list[tuple[np.ndarray, float, np.ndarray, np.ndarray]]]:
    """The field of an example; its lamps, with radii if they have none, and points that the eye sees."""
    program = compile_scene(load(ROOT / f"examples/{name}.nsg"))
    assert program.stage is not None
    given = program.vectors, program.tokens, program.brought(), program.paints()
    field = SolidField(field_of(program, False), *given)  # type: ignore[arg-type]
    lighting, x = Lighting(field, program.stage), np.arange(side) + 0.5
    way = directions(program.stage.camera, (side, side), x, x[:, None]).reshape(3, -1)
    hit = KERNEL.rays(field.tables, lighting.eye, way, lighting.limit(way), gap=0.009).hit
    way, hit = way[:, np.isfinite(hit)], hit[np.isfinite(hit)]
    p = (np.asarray(lighting.eye)[:, None] + way * hit).astype(np.float32)
    n = KERNEL.field(field.tables, p, 0.05, gradient=True).gradient
    n = n / np.linalg.norm(n, axis=0)
    places = [np.array(light.position, np.float32) for light in program.stage.lights]
    radii = [light.radius or 0.2 for light in program.stage.lights]
    return field, [(at, radius, p, n) for at, radius in zip(places, radii, strict=True)]


@pytest.mark.parametrize("name", ["castle", "chess", "clay", "floor", "fog", "robot", "stilllife"])
def test_shares_of_soft_lamps(name: str) -> None:
    """As the plain field has them but for points on the edge between cases, on surfaces and in media."""
    field, given = lamps(name)
    for at, radius, p, n in given:
        opaque = field.opaque((ASIDE + WIDE) * radius)
        n[:, ::5] = 0
        with field.xp.inference():
            theirs, work = PlainField(opaque.network, *opaque.rows, None, opaque.reach).shown(
                at, radius, p, n
            )
        share, near, met = KERNEL.cones(opaque.tables, at, radius, p, n)
        assert near == pytest.approx(work.near, rel=0.01)
        assert met > 0
        # of the rounded box of clay the plain field's own shares change so much within 3e-6 of these points
        assert (abs(share - theirs) > 2e-3).mean() <= (0.05 if name == "clay" else 2e-3)


@pytest.mark.parametrize(("name", "most"), [("stilllife", 0.02), ("robot", 0.02)])
def test_shares_are_those_of_rays_to_the_lamp(name: str, most: float) -> None:
    """Of points whose shadows have soft edges, by 400 rays to points of the disc."""
    field, given = lamps(name, 32)
    at, radius, p, n = given[0]
    facing = (n * (at[:, None] - p)).sum(0) > 0.4 * np.linalg.norm(at[:, None] - p, axis=0)
    p, n = p[:, facing], n[:, facing]
    share = KERNEL.cones(field.opaque((ASIDE + WIDE) * radius).tables, at, radius, p, n)[0]
    r, turn = radius * np.sqrt((np.arange(400) + 0.5) / 400), 2.399963 * np.arange(400)
    axis = (at[:, None] - p) / np.linalg.norm(at[:, None] - p, axis=0)
    u = np.cross(axis.T, (0.3, -0.5, 0.8)).T
    u /= np.linalg.norm(u, axis=0)
    v = np.cross(axis.T, u.T).T
    disc = at[:, None, None] + u[:, :, None] * (r * np.cos(turn)) + v[:, :, None] * (r * np.sin(turn))
    to = (disc - p[:, :, None]).reshape(3, -1)
    far = np.linalg.norm(to, axis=0)
    begin = np.repeat(p + 0.004 * n, 400, 1).astype(np.float32)
    hit = KERNEL.rays(field.tables, begin, (to / far).astype(np.float32), far, gap=0.002).hit
    free = (~np.isfinite(hit)).reshape(-1, 400).mean(1)
    assert abs(share - free).mean() < most
    assert np.quantile(abs(share - free), 0.95) < 0.1


def test_colours_of_objects_alone() -> None:
    paints = Paint(COARSE, STEPS), Paint(SPACE), None
    leaves, steps = ("torus", "sphere", "box"), (scaled(1.1), turned(0.8), moved(0.2, 0.1, 0))
    field = stream(
        [Object(leaf, steps, paint=paint, texture=MOVED) for leaf, paint in zip(leaves, paints, strict=True)]
    )
    rng = np.random.default_rng(3)
    objects, p = rng.integers(0, 3, 700), rng.uniform(-1, 1, (3, 700)).astype(np.float32)
    assert KERNEL.worn(field.tables, objects, p) == pytest.approx(
        PlainField(network(), *field.rows, field.paints).worn(objects, p), abs=2e-4
    )
