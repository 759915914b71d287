"""The network as it is written, over both libraries: against the kernel, and what is before lamps by rays."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import scenelang as nsg
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Paint
from scenelang.drawing.how import RenderError
from scenelang.drawing.kernel import load_kernel
from scenelang.drawing.solid.draw import directions
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.plain import PlainField
from scenelang.drawing.solid.soft import ASIDE, WIDE
from scenelang.drawing.tables import Tables
from scenelang.language.evaluation import load, loads
from tests.drawing.solids import (
    LEAVES,
    Object,
    field,
    moved,
    network,
    random_tree,
    scaled,
    torch_network,
    tree_field,
    turned,
)
from tests.drawing.test_kernel_field import OWN
from tests.drawing.test_renderers_solids import COARSE, MOVED, SPACE, STEPS

ROOT = Path(__file__).parents[2]
KERNEL = load_kernel()
NETS = {"numpy": network(), "torch": torch_network()}
TOLERANCE = 1e-5  # of a scene's size
GAP, SIDE = 0.009, 24
LIBRARIES = pytest.mark.parametrize("library", NETS)


@cache
def shipped(name: str) -> nsg.Program:
    return compile_scene(load(ROOT / f"examples/{name}.nsg"))


def of(program: nsg.Program, library: str) -> PlainField:
    return PlainField(NETS[library], program.vectors, program.tokens, program.brought(), program.paints())


def again(solids: SolidField, library: str) -> PlainField:
    return PlainField(NETS[library], *solids.rows, solids.paints)


def tables_of(plain: PlainField) -> Tables:
    """Tables of numpy's network, as the kernel has them."""
    return Tables(network(), *plain.rows, plain.paints)


def call(plain: Any, name: str, *given: Any, **more: Any) -> list[Any]:
    """What a method answers, as arrays of numpy."""
    xp, like = plain.xp, plain.network.codes
    placed = [xp.array(part, like) if isinstance(part, np.ndarray) else part for part in given]
    with xp.inference():
        answer = getattr(plain, name)(*placed, **more)
    parts = [answer] if hasattr(answer, "shape") else answer
    return [np.asarray(xp.to_numpy(part)) if hasattr(part, "shape") else part for part in parts]


def points(tables: Tables, seed: int, count: int = 1200) -> tuple[np.ndarray, float]:
    """Points (3, M) in the balls of objects, and the size of the scene."""
    rng, rows = np.random.default_rng(seed), tables.objects.rows
    centres, extents = rows["centre"], rows["extent"][:, None].clip(0, 2)
    which = rng.integers(0, len(rows), count)
    p = centres[which] + rng.uniform(-1, 1, (count, 3)) * extents[which]
    size = float(((centres + extents).max(0) - (centres - extents).min(0)).max())
    return p.T.astype(np.float32), size


def hold(plain: PlainField, seed: int = 0, loose: float = 2e-3) -> None:
    """Distances are the kernel's, and so is the rest, but for a part ``loose`` where slopes are abrupt."""
    tables = tables_of(plain)
    p, size = points(tables, seed)
    reach = (0.03 * 1.75 ** np.random.default_rng(seed).integers(0, 7, p.shape[1])).astype(np.float32)
    expected = KERNEL.field(tables, p, reach, gradient=True, every=True)
    d, gradient, register, owner, met = call(plain, "near", p, reach, gradient=True, every=True)
    within = abs(expected.distance) < reach
    assert within.mean() > 0.05
    assert abs(d - expected.distance)[within].max() < TOLERANCE * size
    assert met == pytest.approx(expected.met, abs=2)
    for mine, theirs in ((gradient, expected.gradient), (register, expected.register)):
        assert (abs(mine - theirs).max(0)[within] > 2e-3).mean() <= loose
    assert (owner != expected.owner)[within].mean() <= loose
    assert (call(plain, "near", p, reach)[0] == d).all()


@pytest.mark.parametrize(
    "name", ["armillary", "bracket", "icecream", "lotus", "floor", "neon", "robot", "teatime", "turned"]
)
def test_points_of_shipped_scenes(name: str) -> None:
    """By torch, as in the next two; `test_kernel_field` holds the kernel to numpy's."""
    hold(of(shipped(name), "torch"))


@pytest.mark.parametrize("leaf", [*LEAVES, "m.teapot"])
def test_points_of_leaves_with_skins_and_warps(leaf: str) -> None:
    operands = " smooth ".join(f"{leaf} {{ {own} }}" for own in OWN)
    text = f'nsg 1; import "std/meshes" as m; camera(eye = [0, 1, 9]); chain {{ {operands} }}'
    hold(of(compile_scene(loads(text)), "torch"), loose=0.03)


@pytest.mark.parametrize("seed", range(6))
def test_points_of_trees(seed: int) -> None:
    """Groups in groups, cuts with rounded edges, media among solids; what is opaque alone, too."""
    plain = again(tree_field(random_tree(np.random.default_rng(seed), 4, (0.0, 0.5)[seed % 2])), "torch")
    hold(plain, seed)
    apart = plain.opaque(0.3)
    assert isinstance(apart, PlainField)
    p, size = points(tables_of(plain), seed)
    expected = KERNEL.field(Tables(network(), *apart.rows, None, 0.3), p, 0.0).distance
    off = abs(call(apart, "near", p, 0.0)[0] - expected)
    assert off[abs(expected) < 0.3].max(initial=0.0) < TOLERANCE * size


def woven() -> SolidField:
    objects = [
        Object("torus", (scaled(1.1), turned(0.8)), paint=Paint(COARSE, STEPS), texture=MOVED),
        Object("sphere", (scaled(0.6, 0.4, 0.6), moved(1, 0, 0.6)), paint=Paint(SPACE)),
        Object("sphere", (scaled(0.5), moved(-1, 0, 0)), rgb=(0.1, 0.2, 0.9)),
    ]
    return field(objects)


@LIBRARIES
def test_textures_and_objects_alone(library: str) -> None:
    """Colours of objects alone are those of the whole field well inside of each."""
    plain = again(woven(), library)
    hold(plain)
    tables, rng = tables_of(plain), np.random.default_rng(1)
    objects, p = rng.integers(0, 3, 2000), rng.uniform(-1, 1, (3, 2000)).astype(np.float32)
    distance, gradient = call(plain, "own", objects, p)
    for mine, theirs in zip((distance, gradient), KERNEL.own(tables, objects, p), strict=False):
        assert mine == pytest.approx(theirs, abs=1e-5)
    (colours,) = call(plain, "worn", objects, p)
    whole = KERNEL.field(tables, p, 0.5, every=True)
    for i in range(3):
        inside = (objects == i) & (distance < -0.05) & (whole.owner == i + 1)
        assert inside.sum() > 5
        assert colours[:, inside] == pytest.approx(whole.register[:3, inside], abs=1e-4)


@LIBRARIES
def test_nothing(library: str) -> None:
    plain = PlainField(NETS[library], np.zeros((0, 64), np.float32), np.zeros(0, np.int8))
    p, some = np.ones((3, 4), np.float32), np.ones(4, np.float32)
    assert call(plain, "near", p, 0.1, every=True)[0].tolist() == [100.0] * 4
    assert call(plain, "near", p[:, :0], 0.1, every=True)[2].shape == (4, 0)
    assert np.isinf(call(plain, "march", p[:, 0].copy(), p, 9 * some, gap=GAP)[0]).all()
    assert call(plain, "shown", p[:, 0].copy(), 0.2, 2 * p, p)[0].tolist() == [1.0] * 4


def test_slopes_are_those_of_torch() -> None:
    """Reverse passes find the gradients that are answered, of smooth trees, warps and displaced leaves."""
    programs = [of(shipped(name), "torch") for name in ("lotus", "robot", "bracket")]
    for plain in programs:
        p, _ = points(tables_of(plain), 3, 400)
        at = torch.from_numpy(p).requires_grad_()
        met = plain.near(at, 0.1, gradient=True)
        (slope,) = torch.autograd.grad(met.distance.sum(), at)
        off = (slope - met.gradient.detach()).abs().amax(0)
        assert (off > 1e-3).float().mean() < 0.01  # on edges either side is right
        assert (slope.norm(dim=0) > 0.5).float().mean() > 0.1


def rays(program: nsg.Program) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eyes, ways and limits of rays, some from the eye, some from anywhere."""
    assert program.stage is not None
    x = np.arange(SIDE) + 0.5
    seen = directions(program.stage.camera, (SIDE, SIDE), x, x[:, None]).reshape(3, -1)
    rng = np.random.default_rng(0)
    ways = rng.normal(size=seen.shape)
    ways = np.concatenate([seen, ways / np.linalg.norm(ways, axis=0)], 1).astype(np.float32)
    eyes = np.repeat(np.reshape(program.stage.camera.eye, (3, 1)), seen.shape[1], 1)
    eyes = np.concatenate([eyes, rng.uniform(-1, 1, seen.shape)], 1).astype(np.float32)
    return eyes, ways, np.full(ways.shape[1], 12.0, np.float32)


@pytest.mark.parametrize("name", ["castle", "lantern", "turned"])
def test_rays_are_the_kernels(name: str) -> None:
    """By torch; `test_kernel_rays` has numpy's."""
    plain, given = of(shipped(name), "torch"), rays(shipped(name))
    expected = KERNEL.rays(tables_of(plain), *given, gap=GAP)
    hit, length, soft, depth, _, work = call(plain, "march", *given, gap=GAP)
    assert (np.isfinite(hit) == np.isfinite(expected.hit)).mean() > 0.998
    both = np.isfinite(hit) & np.isfinite(expected.hit)
    assert (abs(hit[both] - expected.hit[both]) > 1e-4).mean() < 5e-3
    assert (abs(length - expected.length) > 1e-3).mean() < 5e-3
    assert (soft != expected.soft).mean() < 5e-3
    assert (abs(depth - expected.depth) > 1e-2).mean() < 5e-3
    assert work.met == pytest.approx(expected.met, rel=0.01)
    assert 0 < work.near <= len(hit)


@LIBRARIES
def test_one_origin_and_limits(library: str) -> None:
    """Rays from one point are those from as many; a way in a medium begins and ends where rays do."""
    plain = of(shipped("cumulus"), library)
    p, way = np.zeros(3, np.float32), np.tile(np.array([[1.0], [0.0], [0.0]], np.float32), 9)
    begin, limit = np.linspace(0, 0.1, 9, dtype=np.float32), np.linspace(0.12, 0.2, 9, dtype=np.float32)
    start = plain.xp.array(begin, plain.network.codes)
    one = call(plain, "march", p, way, limit, start=start, gap=GAP)
    many = call(plain, "march", np.tile(p[:, None], 9), way, limit, start=start, gap=GAP)
    assert one[1] == pytest.approx(limit - begin, abs=1e-4)
    assert one[1].tolist() == many[1].tolist()
    assert call(plain, "march", p, way, limit + 9, gap=GAP, steps=1)[-1].lost == 9


MIST = "material volumetric {{ color({}); density({}); }}"
MEDIA = (("#d33", 2), ("#36c", 2)), (("#d33", 2), ("#d33", 7)), (("#d33", 1), ("#36c", 5))


@pytest.mark.parametrize(("media", "library"), [*zip(MEDIA, ["torch", "numpy", "torch"], strict=True)])
def test_pieces_of_media(media: Any, library: str) -> None:
    """Sums of the kernel's extinction at many points of rays; pieces are of one density and colour each."""
    one, two = (MIST.format(*medium) for medium in media)
    text = f"sphere {{ {one} }} torus {{ translate(0.5, 0, 0); {two} }} sphere {{ scale(0.4); }}"
    program = compile_scene(loads(text))
    plain, (eyes, ways, limit) = of(program, library), rays(program)
    hit, length, soft, depth, pieces, _ = call(plain, "march", eyes, ways, limit, gap=GAP)
    assert soft.sum() > 20
    ray, begin, end, before, sigma = (np.asarray(plain.xp.to_numpy(part)) for part in pieces)
    assert (np.diff(ray) >= 0).all()
    sums, later = np.zeros((2, len(depth))), np.flatnonzero(ray[1:] == ray[:-1])
    assert len(later) > 50
    np.add.at(sums[0], ray, end - begin)
    np.add.at(sums[1], ray, sigma * (end - begin))
    assert sums[0] == pytest.approx(length, abs=1e-4)
    assert sums[1] == pytest.approx(depth, abs=1e-4)
    assert (begin[later + 1] >= end[later]).all()
    taken = sigma * (before + end - begin)
    assert (sigma * before)[later + 1] == pytest.approx(taken[later], abs=1e-4)
    tables, some, count = tables_of(plain), np.flatnonzero(length > 0.2)[::25], 1000

    def register(ray: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Colours and extinctions (4, K), and a mask of media (K,)."""
        found = KERNEL.field(tables, eyes[:, ray] + ways[:, ray] * t, 0.05, every=True)
        looks = np.concatenate([found.register[:3], plain.extinction(found.register)[None]])
        return looks, (found.distance < 0) & (found.register[-1] > 0.5)

    t = ((np.arange(count) + 0.5) * (limit[0] / count)).astype(np.float32)
    looks, medium = register(np.repeat(some, count), np.tile(t, len(some)))
    lost = (looks[3] * medium).reshape(len(some), -1) * (t < hit[some, None])
    assert abs(lost.sum(1) * (limit[0] / count) - depth[some]).max() < 0.15
    long = np.flatnonzero(end - begin > 0.1)
    assert len(long) > 100
    ends = [register(ray[long], (begin + (end - begin) * np.float32(s))[long])[0] for s in (0.05, 0.95)]
    assert (abs(ends[0] - ends[1]).max(0) < 0.05).mean() > 0.98
    assert abs(ends[0][3] - sigma[long]).max() < 0.1


@LIBRARIES
@pytest.mark.parametrize("name", ["turned", "die"])
def test_lamps_are_shown_as_rays_show_them(name: str, library: str) -> None:
    """Of points of the ground, by rays to as many places of the lamp's disc, by the cosines there."""
    plain, rng, radius = of(shipped(name), library), np.random.default_rng(2), 0.5
    at, up, count = np.array([0.4, 3.0, 0.3]), np.array([0.0, 1.0, 0.0]), 64
    rows = plain.tables.objects.rows
    low = float((rows["centre"][:, 1] - rows["extent"]).min()) - 0.05
    p = np.stack([rng.uniform(-1.6, 1.6, 250), np.full(250, low), rng.uniform(-1.6, 1.6, 250)])
    n = np.repeat(up[:, None], 250, 1)
    apart = plain.opaque((ASIDE + WIDE) * radius)
    given = [part.astype(np.float32) for part in (p, n)]
    share, work = call(apart, "shown", at.astype(np.float32), radius, *given)
    way = at[:, None] - p
    way /= np.linalg.norm(way, axis=0)
    u = np.cross(way.T, [0.6, 0.0, -0.8]).T
    u /= np.linalg.norm(u, axis=0)
    v = np.cross(way.T, u.T).T
    r, turn = np.sqrt((np.arange(count) + 0.5) / count), np.arange(count) * np.pi * (3 - 5**0.5)
    disc = u[..., None] * (r * np.cos(turn)) + v[..., None] * (r * np.sin(turn))
    to = (at[:, None, None] + radius * disc - p[..., None]).reshape(3, -1)
    far = np.linalg.norm(to, axis=0)
    start = np.repeat(p + 1e-3 * n, count, 1).astype(np.float32)
    found = KERNEL.rays(
        Tables(network(), *apart.rows), start, (to / far).astype(np.float32), far.astype(np.float32), gap=GAP
    )
    weight = (to / far)[1].clip(0).reshape(250, -1)
    truth = (np.isinf(found.hit).reshape(250, -1) * weight).sum(1) / weight.sum(1)
    assert ((truth > 0.05) & (truth < 0.95)).mean() > 0.1
    assert abs(share - truth).mean() < 0.02
    assert np.quantile(abs(share - truth), 0.95) < 0.1
    assert work.near > 0


@pytest.mark.parametrize("text", ["", "light([1, 3, 2], radius = 0.4);"])
def test_torch_draws_without_the_kernel(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = loads(f"canvas(20, 16); {text} sphere {{ }} torus {{ translate(1, 0, 0); material volumetric; }}")
    expected = np.asarray(nsg.render(scene))

    def none() -> None:
        raise AssertionError

    monkeypatch.setattr("scenelang.drawing.solid.field.load_kernel", none)
    assert np.asarray(nsg.render(scene, device="cpu")) == pytest.approx(expected, abs=2 / 255)


def test_light_from_everywhere_is_the_kernels() -> None:
    with pytest.raises(RenderError, match=r"light from everywhere \(sky\) is drawn by the kernel alone"):
        nsg.render(loads("canvas(8, 8); sky(); sphere { }"), device="cpu")
