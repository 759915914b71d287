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
class Kept:
    """The last picture of a sequence.

    Args:
        frames: of its objects, by their geometry vectors.
        keys: what each of its tiles showed, a digest.
        picture: premultiplied (H, W, 4).
    """

    frames: dict[bytes, ObjectFrame] = field(default_factory=dict)
    keys: list[bytes] = field(default_factory=list)
    picture: npt.NDArray[np.float32] = field(default_factory=lambda: np.empty((0, 0, 4), np.float32))

    def shows(self, index: int, keys: list[bytes], shape: tuple[int, ...]) -> bool:
        """Whether a tile of a picture with such keys shows what it did before."""
        return self.picture.shape == shape and len(self.keys) == len(keys) and self.keys[index] == keys[index]

    def look(self, coverage: Coverage, canvas: tuple[int, int], tiles: Sequence[range]) -> list[bytes]:
        """A digest of what each tile of a new picture will show.

        Args:
            coverage: its objects.
            canvas: width and height in pixels.
            tiles: rows of pixels of each tile.
        """
        width, height = canvas
        px = 2 / min(width, height)  # world units
        scene = coverage.field
        codes = scene.codes.tobytes()  # decoders are computed together: one for all of a scene's leaves
        found, spans = [], []
        for row, vector in zip(scene.rows, scene.vectors, strict=True):
            box = row.frame.box(row.reach + _ROOM_PX * px * row.frame.growth)
            spans.append((-np.inf, np.inf) if row.reach == float("inf") else box[1::2])
            colour = scene.xp.to_numpy(row.colour).tobytes()
            rest = repr((row.token, row.reach)).encode()
            found.append(hashlib.sha256(codes + vector.tobytes() + colour + rest).digest())
        rows = np.frombuffer(b"".join(found), np.uint8).reshape(len(found), 32)
        low, high = np.array(spans, np.float64).reshape(-1, 2).T
        common = repr((type(scene.xp).__name__, canvas, list(tiles))).encode()
        keys = []
        for tile in tiles:
            top = (height / 2 - tile.start + _ROOM_PX) * px
            bottom = (height / 2 - tile.stop - _ROOM_PX) * px
            reaching = rows[(low <= top) & (high >= bottom)]
            keys.append(hashlib.sha256(common + reaching.tobytes()).digest())
        return keys
