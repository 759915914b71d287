"""Answers for whole segments, against closed forms and the march."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from lab.training.checkpoint import save_tensors
from scenelang.compiler.spaces import Light, Stage
from scenelang.compiler.steps import Displace, Step, Twist
from scenelang.drawing.neural.files import solid_arrays
from scenelang.drawing.neural.load import Solids
from scenelang.drawing.solid import draw
from scenelang.drawing.solid.draw import draw_solids
from scenelang.drawing.solid.field import SolidField
from scenelang.drawing.solid.march import march
from scenelang.drawing.solid.network import SolidArrays, SolidConfig
from tests.drawing.solids import Object, field, moved, network, psnr, scaled, turned, weights

TORUS = 0.7, 0.3  # radii of its circle and of its tube
LAMP = np.array([1.5, 2.6, 1.8], np.float32)
PLACE = (scaled(0.6, 0.5, 0.8), turned(0.7), moved(0.2, 0.1, -0.1))
MIST = Object("torus", PLACE, "volumetric", (0.9, 0.5, 0.2))
BETWEEN = (scaled(0.5, 0.5, 0.5), moved(*(0.6 * LAMP).tolist()))  # the light and the mist
FAR = Object("sphere", (scaled(0.3, 0.4, 0.3), moved(-1.1, -0.3, 0.9)), "volumetric", (0.2, 0.5, 0.9))


def marching() -> SolidArrays:
    """The shipped network without its answers, as files of before had it."""
    return SolidArrays(SolidConfig(), {k: v for k, v in weights().items() if not k.startswith("segment")})


def rays(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions from the light to about the origin (3, count), and where they end."""
    rng = np.random.default_rng(4)
    way = rng.normal(size=(3, count)) * 0.4 - LAMP[:, None]
    reach = np.linalg.norm(way, axis=0)
    limit = reach * rng.uniform(0.7, 1.6, count)
    return (way / reach).astype(np.float32), limit.astype(np.float32)


def lengths(solids: SolidField) -> np.ndarray:
    way, limit = (solids.xp.array(a, solids.network.codes) for a in rays(2000))
    with solids.xp.inference():
        lamp = solids.xp.array(LAMP, solids.network.codes)
        return np.asarray(march(solids, lamp, way, limit, whole=True).length)


@pytest.mark.parametrize(("leaf", "near", "far"), [("sphere", 0.006, 0.025), ("torus", 0.015, 0.06)])
def test_lengths_are_those_of_closed_forms(leaf: str, near: float, far: float) -> None:
    """By the signs of the leaf's polynomial at 3000 points of each ray; of one object."""
    (way, limit), back = rays(2000), np.eye(4)
    for step in PLACE:
        back = np.vstack([np.reshape(step.rows, (3, 4)), (0, 0, 0, 1)]) @ back
    back = np.linalg.inv(back)
    share = (np.arange(3000) + 0.5) / 3000
    start = back[:3, :3] @ LAMP + back[:3, 3]
    q = start[:, None, None] + (back[:3, :3] @ way * limit)[:, :, None] * share
    square = (q * q).sum(0)
    ring = 4 * TORUS[0] ** 2 * (q[0] ** 2 + q[2] ** 2)
    inside = square < 1 if leaf == "sphere" else (square + TORUS[0] ** 2 - TORUS[1] ** 2) ** 2 < ring
    wrong = abs(lengths(field([MIST._replace(leaf=leaf)])) - inside.mean(1) * limit)
    wrong = wrong[inside.any(1)]
    assert len(wrong) > 500
    assert np.sqrt((wrong**2).mean()) < near
    assert np.quantile(wrong, 0.99) < far


def more(*steps: Step) -> list[Object]:
    return [MIST._replace(steps=(*steps, *PLACE))]


@pytest.mark.parametrize(
    "objects",
    [
        more(Twist(0.5)),
        more(Displace(0.05, 5.0)),
        [MIST._replace(steps=(turned(1.5), scaled(3.0, 3.0, 3.0), *BETWEEN))],  # the light is in its ball
        [MIST, Object("sphere", BETWEEN, "volumetric", token="subtract")],
        [MIST, Object("torus", (scaled(2.0, 2.0, 2.0), *BETWEEN))],
        [MIST, Object("sphere", (scaled(1.2, 1.2, 1.2),), "volumetric", token="intersect")],
        [MIST, MIST._replace(token="smooth")],
        [MIST, Object("sphere", (scaled(1.1, 1.1, 1.1),), "volumetric")],
        [Object("torus", (scaled(1.5, 1.5, 1.5),)), MIST],
    ],
)
def test_where_they_do_not_hold_rays_are_marched(objects: list[Object]) -> None:
    touched = lengths(field([MIST])) > 0  # others may pass one ball alone
    asked, marched = lengths(field(objects))[touched], lengths(field(objects, marching()))[touched]
    assert (marched > 0).sum() > 300
    np.testing.assert_allclose(asked, marched, rtol=0, atol=1e-5)  # batches round differently


def test_random_weights_draw_other_light_and_none_march() -> None:
    wrong = SolidArrays(network().config, weights())
    wrong.segment_w = [
        np.random.default_rng(1).normal(size=w.shape).astype(np.float32) for w in wrong.segment_w
    ]
    other = Solids(network().config, 2, 2)
    other.load_state_dict({name: torch.from_numpy(value) for name, value in weights().items()})
    stage = Stage(light=Light(tuple(LAMP.tolist())))
    mine, noise, none, theirs = (
        draw_solids(field([MIST, FAR], net), stage, (64, 64))[0]
        for net in (network(), wrong, marching(), other)
    )
    assert psnr(mine, noise) < 40
    assert 50 < psnr(mine, none) < 90
    assert psnr(mine, theirs) > 80


def test_tiles_leave_no_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, _ = draw_solids(field([MIST, FAR]), Stage(), (48, 40))
    monkeypatch.setattr(draw, "TILE", 48 * 7)
    assert abs(draw_solids(field([MIST, FAR]), Stage(), (48, 40))[0] - whole).max() < 2e-4


def test_files_of_before_load(tmp_path: Path) -> None:
    old = {k: torch.from_numpy(v) for k, v in weights().items() if not k.startswith("segment")}
    sizes = {"code": 4, "material_code": 2, "width": 8, "paint_lines": 2, "kind_lines": 2}
    save_tensors(tmp_path / "old", old, {"format": 1, "config": {"network": sizes}})
    found = solid_arrays((tmp_path / "old").read_bytes(), 2, 2)
    assert (lengths(field([MIST], found)) == lengths(field([MIST], marching()))).all()
