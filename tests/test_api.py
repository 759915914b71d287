"""`scenelang.render` and its Image, from an empty scene to 200 objects, and what is not a Program."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.drawing import torch_backend
from scenelang.drawing.how import Device, keep_memory
from scenelang.drawing.neural import files
from scenelang.drawing.neural.draw import draw

SMALL = "canvas(64, 64);"
FOUR = """chain {
  square           { scale(0.8); translate(-0.2, 0); material flat { color(#d33); } }
  smooth pentagon  { twirl(0.6); bend(0.2); scale(0.5); rotate(30deg); }
  subtract star    { scale(0.3); translate(0.1, 0.1); }
  intersect square { rotate(45deg); }
}"""
MANY = "for (i in 0..<200) { star { scale(0.1); translate(2 * rand(i) - 1, 2 * rand(i + 500) - 1); } }"
STEP = 1 / 255
BOTH = pytest.mark.parametrize("device", ["auto", "cpu"], ids=["numpy", "torch"])


def program(text: str) -> nsg.Program:
    return nsg.compile(nsg.loads(text))


def test_an_empty_scene_is_the_background() -> None:
    image = nsg.render(nsg.loads(SMALL + "background(#369);"))
    assert image.shape == (64, 64, 3)
    assert np.abs(image - np.array([0.2, 0.4, 0.6])).max() < STEP
    clear = nsg.render(nsg.loads(SMALL + "background(none);"))
    assert clear.shape == (64, 64, 4)
    assert clear[..., 3].max() < STEP


def test_one_object() -> None:
    image = nsg.render(nsg.loads(SMALL + "square { material flat { color(#d33); } }"))
    assert image.dtype == np.float32
    assert np.abs(image[32, 32] - np.array([0xDD, 0x33, 0x33]) / 255).max() < STEP
    assert np.abs(image[0, 0] - 1).max() < STEP


def test_200_objects() -> None:
    scene = nsg.loads("canvas(128, 128); background(#000);" + MANY)
    drawn, exact = nsg.render(scene), nsg.render(scene, backend="reference")
    assert len(nsg.compile(scene)) == 200
    assert np.abs(drawn - exact).mean() < 0.01


def test_non_square_and_transparent() -> None:
    scene = nsg.loads("canvas(96, 40); background(none); star { translate(1.2, 0); }")
    drawn, exact = nsg.render(scene), nsg.render(scene, backend="reference")
    assert drawn.shape == exact.shape == (40, 96, 4)
    assert np.abs(drawn[..., 3] - exact[..., 3]).mean() < 0.02
    assert drawn[..., 3].max() > 0.99


def test_a_scene_and_its_program_are_one_picture() -> None:
    scene = nsg.loads(FOUR)
    assert np.array_equal(nsg.render(scene), nsg.render(nsg.compile(scene)))


@BOTH
def test_pictures_repeat(device: Device) -> None:
    compiled = program(FOUR)
    first = nsg.render(compiled, device=device)
    nsg.render(program(MANY))
    assert np.array_equal(nsg.render(compiled, device=device), first)
    for threads in (1, 2, 3, 8):
        image = nsg.render(compiled, device=device, threads=threads)
        assert np.abs(image - first).max() <= STEP
        assert np.array_equal(nsg.render(compiled, device=device, threads=threads), image)


def test_tiles_do_not_show() -> None:
    compiled, network = program(FOUR), torch_backend.open_model("shapes2d").network
    arguments = (network, compiled)
    whole = draw(*arguments, tile=1 << 20).image
    for tile in (1, 700, 1 << 12):
        assert np.abs(draw(*arguments, tile=tile).image - whole).max() <= STEP


def test_torch_keeps_its_number_of_threads() -> None:
    import torch

    before = torch.get_num_threads()
    try:
        torch.set_num_threads(3)
        nsg.render(program(SMALL + FOUR), device="cpu", threads=2)
        assert torch.get_num_threads() == 3
    finally:
        torch.set_num_threads(before)


@BOTH
def test_progress_ends_at_1(device: Device) -> None:
    shares: list[float] = []
    nsg.render(program(FOUR), device=device, threads=2, progress=shares.append)
    assert shares
    assert max(shares) == 1.0


def test_models_are_loaded_once() -> None:
    nsg.render(program(SMALL), device="cpu")
    model = torch_backend.open_model("shapes2d")
    nsg.render(program(SMALL + FOUR), device="cpu")
    assert torch_backend.open_model("shapes2d") is model


def test_numbers_that_are_none() -> None:
    good = program(FOUR)
    vectors = good.vectors.copy()
    vectors[1, 7] = np.nan
    with pytest.raises(nsg.ProgramError, match=r"vectors of object 1 .* not finite"):
        dataclasses.replace(good, vectors=vectors)
    tokens = good.tokens.copy()
    tokens[2] = 7
    with pytest.raises(nsg.ProgramError, match="a group that does not end"):
        dataclasses.replace(good, tokens=tokens)


@BOTH
def test_other_weights(device: Device) -> None:
    with pytest.raises(nsg.RenderError, match="compile the scene again"):
        nsg.render(dataclasses.replace(program(SMALL), weights="0" * 64), device=device)
    with pytest.raises(nsg.RenderError, match="unknown model `other`"):
        nsg.render(dataclasses.replace(program(SMALL), model="other"), device=device)


@BOTH
def test_missing_weights(device: Device, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    compiled = program(SMALL)
    torch_backend._load.cache_clear()
    files._load.cache_clear()
    monkeypatch.setattr("scenelang.compiler.weights.weights_path", lambda name, digest: tmp_path / "none")
    with pytest.raises(nsg.RenderError, match="cannot read the weights"):
        nsg.render(compiled, device=device)


def test_what_is_refused() -> None:
    with pytest.raises(nsg.SceneError, match="E0501"):
        nsg.render(nsg.Scene(nodes=(nsg.Object("circle"),)))
    with pytest.raises(nsg.SceneError, match="E0501"):
        nsg.render(nsg.Scene(nodes=(nsg.Object("circle"),)), backend="reference")
    with pytest.raises(nsg.RenderError, match="the reference draws scenes"):
        nsg.render(program(SMALL), backend="reference")
    with pytest.raises(ValueError, match="unknown backend"):
        nsg.render(program(SMALL), backend="magic")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="unknown device"):
        nsg.render(program(SMALL), device="tpu")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="0 threads"):
        nsg.render(program(SMALL), threads=0)


def test_the_reference_draws_what_a_model_does_not() -> None:
    text = SMALL + "subtract { square {} intersect { star {} pentagon {} } }"
    with pytest.raises(nsg.SceneError, match="E0513"):
        nsg.render(nsg.loads('model "shapes2d-reading";' + text))
    image = nsg.render(nsg.loads(text + "background(#000);"), backend="reference")
    assert 0.1 < image.mean() < 0.9


def test_images_save_and_show_themselves(tmp_path: Path) -> None:
    image = nsg.render(nsg.loads(SMALL + "background(none); square {}"))
    assert isinstance(image, nsg.Image)
    image.save(tmp_path / "a.png")
    image.save(tmp_path / "a.bmp")
    assert (tmp_path / "a.png").read_bytes() == image._repr_png_()
    with pytest.raises(ValueError, match="no image format"):
        image.save(tmp_path / "a.nsg")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.bmp", "a.png"]


def test_memory_is_kept_where_the_library_is_glibc() -> None:
    assert keep_memory() in (True, False)
