"""What a picture shares with the one before it.

A tile's pixels depend on the objects that reach the tile, on nothing else, and in no way on how fast or
where they are computed. Where all of those are the same, bit for bit, so are the pixels.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from scenelang.renderers.coverage import Coverage
from scenelang.renderers.frames import ObjectFrame

_ROOM_PX = 2.0  # around a tile: more than a sample lies off its pixel's centre


@dataclass(slots=True)
class Shown:
    """What the tiles of a picture show.

    Args:
        keys: a digest for each tile.
        same: whether the tile showed the same before.
        before: the picture before, premultiplied (H, W, 4).
    """

    keys: list[bytes]
    same: list[bool]
    before: npt.NDArray[np.float32]


@dataclass(slots=True)
class Kept:
    """The last picture of a sequence, what each of its tiles showed, and the frames of its objects."""

    frames: dict[bytes, ObjectFrame] = field(default_factory=dict)
    _keys: list[bytes] = field(default_factory=list)
    _picture: npt.NDArray[np.float32] = field(default_factory=lambda: np.empty((0, 0, 4), np.float32))

    def compare(self, coverage: Coverage, canvas: tuple[int, int], tiles: Sequence[range]) -> Shown:
        """What the tiles of a new picture will show.

        Args:
            coverage: its objects.
            canvas: width and height in pixels.
            tiles: rows of pixels of each tile.
        """
        width, height = canvas
        px = 2 / min(width, height)  # world units
        rows, low, high = _rows(coverage, px)
        common = repr((type(coverage.xp).__name__, canvas, list(tiles))).encode()
        keys = []
        for tile in tiles:
            top = (height / 2 - tile.start + _ROOM_PX) * px
            bottom = (height / 2 - tile.stop - _ROOM_PX) * px
            reaching = rows[(low <= top) & (high >= bottom)]
            keys.append(hashlib.sha256(common + reaching.tobytes()).digest())
        fits = self._picture.shape[:2] == (height, width) and len(self._keys) == len(keys)
        same = [fits and key == self._keys[index] for index, key in enumerate(keys)]
        return Shown(keys, same, self._picture)

    def keep(self, picture: npt.NDArray[np.float32], shown: Shown, frames: dict[bytes, ObjectFrame]) -> None:
        """Take a finished picture as the one before the next."""
        self._picture, self._keys, self.frames = picture.copy(), shown.keys, frames


def _rows(
    coverage: Coverage, px: float
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """All that a row's pixels depend on (N, bytes), and the lowest and highest y that it reaches (N,)."""
    scene = coverage.field
    codes = scene.codes.tobytes()  # decoders are computed together: one for all of a scene's leaves
    found, low, high = [], [], []
    for row, vector in zip(scene.rows, scene.vectors, strict=True):
        reach = row.reach + _ROOM_PX * px * row.frame.growth
        ymin, ymax = (-np.inf, np.inf) if row.reach == float("inf") else row.frame.box(reach)[1::2]
        low.append(ymin)
        high.append(ymax)
        colour = scene.xp.to_numpy(row.colour).tobytes()
        rest = repr((row.token, row.reach)).encode()
        found.append(hashlib.sha256(codes + vector.tobytes() + colour + rest).digest())
    table = np.frombuffer(b"".join(found), np.uint8).reshape(len(found), 32)
    return table, np.array(low), np.array(high)
