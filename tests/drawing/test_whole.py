"""Programs drawn by the paper's renderers."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from scenelang.compiler.program import Program, ProgramError
from scenelang.drawing.neural.paper import Reading, ReadingConfig, Streaming, StreamingConfig, draw_whole
from tests.drawing.copies import Asked

Colour = tuple[float, float, float]
WHITE: Colour = (1.0, 1.0, 1.0)


def some(count: int, canvas: tuple[int, int], background: Colour | None = WHITE) -> Program:
    rng = np.random.default_rng(3)
    tokens = rng.integers(0, 4, count).astype(np.int8)
    tokens[:1] = 0
    return Program(
        vectors=rng.normal(size=(count, 64)).astype(np.float32),
        tokens=tokens,
        bounds=np.zeros((count, 4), np.float32),
        canvas=canvas,
        background=background,
        model="any",
        weights="0" * 64,
        objects=("star",) * count,
        places=(None,) * count,
    )


def reading() -> Reading:
    torch.manual_seed(2)
    return Reading(ReadingConfig(hidden=8, reads=2, octaves=3)).eval()


def test_a_pixel_is_the_mean_of_its_four_samples() -> None:
    network, p = reading(), some(3, (6, 4))
    picture = np.asarray(draw_whole(network, p).image)
    assert picture.shape == (4, 6, 3)
    v, t = torch.from_numpy(p.vectors.copy())[None], torch.from_numpy(p.tokens.astype(np.int64))[None]
    for row, column in ((0, 0), (1, 4), (3, 5)):
        # the shorter side spans [-1, 1]: a pixel is half a unit wide
        x, y = (column + 0.5 - 3) * 0.5, (2 - 0.5 - row) * 0.5
        points = [[x + dx, y + dy] for dx in (-0.125, 0.125) for dy in (-0.125, 0.125)]
        with torch.no_grad():
            expected = network(v, t, torch.tensor([points]))[0].mean(0).clamp(0, 1).numpy()
        np.testing.assert_allclose(picture[row, column], expected, atol=1e-6)


@pytest.mark.parametrize("canvas", [(64, 80), (8, 8)])
def test_a_picture_waits_for_nothing_on_a_device(canvas: tuple[int, int]) -> None:
    """Everything is on its way before the first number is asked for, of a device that has none."""
    streaming = Streaming(StreamingConfig(resolution=8, width=1 / 32)).eval()
    network, share = (streaming if canvas == (8, 8) else reading()).to("meta"), []
    with Asked() as asked, pytest.raises(NotImplementedError, match="Cannot copy out of meta"):
        draw_whole(network, some(3, canvas), progress=share.append)
    assert share[-1] == 1.0
    assert asked.seen["upload"] <= 4


def test_streaming_draws_its_own_size_alone() -> None:
    torch.manual_seed(2)
    network, p = Streaming(StreamingConfig(resolution=8, width=1 / 32)).eval(), some(2, (8, 8))
    picture = np.asarray(draw_whole(network, p).image)
    with torch.no_grad():
        image = network(
            torch.from_numpy(p.vectors.copy())[None], torch.from_numpy(p.tokens.astype(np.int64))[None]
        )[0]
    np.testing.assert_allclose(picture, image.clamp(0, 1).permute(1, 2, 0).numpy(), atol=1e-6)
    with pytest.raises(ProgramError, match="8 x 8"):
        draw_whole(network, some(2, (16, 16)))


def test_white_only_and_nothing_is_white() -> None:
    for background in (None, (1.0, 0.9, 1.0)):
        with pytest.raises(ProgramError, match="white"):
            draw_whole(reading(), some(1, (4, 4), background))
    empty = draw_whole(reading(), some(0, (5, 4)))
    assert np.array_equal(np.asarray(empty.image), np.ones((4, 5, 3), np.float32))
