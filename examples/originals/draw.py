"""Draws the textures of the examples: ``python draw.py`` beside this file. CC0."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

SIDE, FINER = 256, 4


def rgb(text: str) -> np.ndarray:
    return np.array([int(text[at : at + 2], 16) for at in (0, 2, 4)], float)


def grid() -> tuple[np.ndarray, np.ndarray]:
    """x and y in [-1, 1], y up, finer than the picture."""
    at = (np.arange(SIDE * FINER) + 0.5) / (SIDE * FINER) * 2 - 1
    x, y = np.meshgrid(at, -at)
    return x, y


def save(name: str, picture: np.ndarray) -> None:
    small = picture.reshape(SIDE, FINER, SIDE, FINER, 3).mean((1, 3))
    Image.fromarray(np.floor(small + 0.5).astype(np.uint8)).save(Path(__file__).with_name(name))


def tile() -> None:
    """A glazed tile: arcs around two opposite corners, so that turned tiles join to paths."""
    x, y = grid()
    picture = np.broadcast_to(rgb("f3ecdc"), (*x.shape, 3)).copy()
    for corner in (-1, 1):
        far = np.hypot(x - corner, y - corner)
        for inner, outer, color in (
            (0.66, 1.34, "1f4e8c"),
            (0.74, 1.26, "7fb2d9"),
            (0.84, 1.16, "f3ecdc"),
            (0.94, 1.06, "d98e32"),
        ):
            picture[(far > inner) & (far < outer)] = rgb(color)
    save("tile.png", picture)


def wood() -> None:
    """The end of a log: years in rings that waver, narrower outside, and pores."""
    x, y = grid()
    turn = np.arctan2(y - 0.1, x + 0.15)
    far = np.hypot(x + 0.15, y - 0.1) + 0.03 * np.sin(3 * turn + 1) + 0.012 * np.sin(8 * turn)
    year = (far * 9 + 0.25 * np.sin(5 * far)) % 1
    late = np.clip((year - 0.35) / 0.6, 0, 1) ** 2 * np.clip((1 - year) / 0.06, 0, 1)
    picture = rgb("e3b778") + late[..., None] * (rgb("8a4b22") - rgb("e3b778"))
    pores = np.random.default_rng(3).random((SIDE, SIDE)).repeat(FINER, 0).repeat(FINER, 1) > 0.985
    picture -= (14 * pores * (1 - late))[..., None]
    save("wood.png", picture.clip(0, 255))


if __name__ == "__main__":
    tile()
    wood()
