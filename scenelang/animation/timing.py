"""Which frames, and how long each is shown."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final, TypeVar

K = TypeVar("K")

_RANGE: Final = re.compile(r"\s*(\d{1,9})\s*(?:\.\.\s*(<?)\s*(\d{1,9})?\s*)?")


class FramesError(ValueError):
    """Not a range of frames, or one that an animation does not have."""


@dataclass(frozen=True, slots=True)
class FrameRange:
    """Frames as they are asked for."""

    first: int = 0  # from 0
    last: int | None = None  # the last one; None for that of the animation

    @classmethod
    def parse(cls, text: str) -> FrameRange:
        """``a..b`` inclusive, ``a..<b`` without b, ``a..`` to the end, or ``a``; else `FramesError`."""
        found = _RANGE.fullmatch(text)
        if found is None or (found[2] and found[3] is None):
            raise FramesError(f"`{text}` is not a range of frames such as 0..23, 0..<24, 12.. or 7")
        first = int(found[1])
        if ".." not in text:
            return cls(first, first)
        if found[3] is None:
            return cls(first)
        last = int(found[3]) - bool(found[2])
        if last < first:
            raise FramesError(f"the range of frames `{text}` is empty")
        return cls(first, last)

    def among(self, frames: int) -> range:
        """The numbers in an animation of ``frames`` frames; raises `FramesError` if some are outside it."""
        last = frames - 1 if self.last is None else self.last
        outside = self.first if self.first >= frames else last if last >= frames else None
        if outside is not None:
            raise FramesError(f"frame {outside} is outside 0..{frames - 1}")
        return range(self.first, last + 1)


def delays(count: int, fps: float, per_second: int, shortest: int = 1) -> list[int]:
    """Ticks that each frame is shown for; 0 where it is left out, as it would be shorter than ``shortest``.

    When a frame starts is rounded by itself, so that errors do not add up and the whole is as long as it
    should be, but no shorter than ``shortest``.
    """
    step = Fraction(per_second) / Fraction(fps)
    at = [math.floor(i * step + Fraction(1, 2)) for i in range(count + 1)]
    shown = [0]
    for index in range(1, count):
        if at[index] - at[shown[-1]] >= shortest:
            shown.append(index)
    found = [0] * count
    for index, following in zip(shown, [*shown[1:], count], strict=True):
        found[index] = at[following] - at[index]
    while len(shown) > 1 and found[shown[-1]] < shortest:
        late = shown.pop()
        found[shown[-1]] += found[late]
        found[late] = 0
    found[shown[0]] = max(found[shown[0]], shortest)
    return found


def runs(keys: Sequence[K], lengths: Iterable[int]) -> list[tuple[K, int]]:
    """Neighbours with the same key as one, as long as all of them; those of length 0 are left out."""
    found: list[tuple[K, int]] = []
    for key, length in zip(keys, lengths, strict=True):
        if length == 0:
            continue
        if found and found[-1][0] == key:
            found[-1] = key, found[-1][1] + length
        else:
            found.append((key, length))
    return found
