"""What a fit found: values, how sure they are, how near the picture is, and what stands in the way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from scenelang.image import Image
from scenelang.inverse.search import Matrix
from scenelang.inverse.space import Point, Space
from scenelang.inverse.target import Blur
from scenelang.scene.schema import Scene

TIED: Final = 0.9  # correlation from which two numbers explain each other
LEVEL: Final = 1 / 255
_UNSEEN: Final = 1e-4  # root mean square change over a whole range that is none


@dataclass(frozen=True, slots=True)
class Number:
    """One number that was found, or one of a vector.

    Args:
        label: ``k``, or ``ink.2`` of a vector.
        low, high: its range, in base units.
        value: what was found, in base units.
        felt: how far it has to move for the picture to change by 1/255 (root mean square of all channels), in
            shares of its range; inf where the picture does not show it, NaN of a choice.
    """

    label: str
    low: float
    high: float
    value: float
    felt: float


@dataclass(frozen=True, slots=True)
class Fit:
    """What `scenelang.fit` found.

    Args:
        text: the scene with what was found as defaults, comments and layout as they were.
        values: what was found, as text of the language, by param.
        psnr: how near the picture of ``text`` is to the target, dB, over pixels that count; at most 100.
        blur: of the target, as far as it tells.
        blurred_psnr: how near the picture is once it is blurred as much.
        start_psnr: of the picture before.
        size: of the pictures that were compared, width and height.
        done: whether the search came to an end by itself.
        notes: what stands in the way of a nearer picture or a surer value, in sentences without a full stop.
        numbers: of continuous params, how much the picture feels them.
        tied: pairs of their labels and how far they are correlated, from `TIED` on.
        others: values of other places whose pictures are about as near.
        frames: pictures that were drawn.
        before, after, target: pictures (H, W, 3) of that size, of several targets one below the other.
        way: scenes from the start to what was found, as `scenelang.animate` takes them.
    """

    text: str = field(repr=False)
    values: dict[str, str]
    psnr: float
    blur: Blur
    blurred_psnr: float
    start_psnr: float
    size: tuple[int, int]
    done: bool
    notes: tuple[str, ...]
    numbers: tuple[Number, ...]
    tied: tuple[tuple[str, str, float], ...]
    others: tuple[dict[str, str], ...]
    frames: int
    before: Image = field(repr=False)
    after: Image = field(repr=False)
    target: Image = field(repr=False)
    way: tuple[Scene, ...] = field(repr=False)

    def told(self) -> list[str]:
        """The report, line by line."""
        felt = {one.label: one.felt for one in self.numbers}
        lines = [f"PSNR to the target {self.psnr:.1f} dB, before {self.start_psnr:.1f} dB (more is nearer)"]
        if self.blur.sigma:
            seen = "out of focus" if self.blur.light else "blurred, in sRGB"
            lines.append(
                f"the target is {seen}: after a blur of {self.blur.sigma:.2f} pixels the PSNR is "
                f"{self.blurred_psnr:.1f} dB"
            )
        for name, text in self.values.items():
            shares = [share for label, share in felt.items() if label.partition(".")[0] == name]
            said = ""
            if shares and not any(map(math.isnan, shares)):
                most = max(shares)
                said = (
                    "  not seen" if math.isinf(most) else f"  ± {most:.2%} of its range changes it by 1/255"
                )
            lines.append(f"  {name} = {text}{said}")
        lines += [f"`{a}` and `{b}` explain each other here (correlation {r:.2f})" for a, b, r in self.tied]
        for other in self.others:
            said = ", ".join(f"{name} = {text}" for name, text in other.items())
            lines.append(f"about as near: {said}")
        return [*lines, *self.notes]

    def sheet(self) -> Image:
        """Before, after and target side by side."""
        gap = np.ones((self.target.shape[0], 4, 3), np.float32)
        parts = [np.asarray(part, np.float32) for part in (self.before, self.after, self.target)]
        return np.concatenate([parts[0], gap, parts[1], gap, parts[2]], 1).view(Image)


def numbers_of(space: Space, u: Point, slopes: Matrix | None) -> tuple[Number, ...]:
    """What is known of each continuous axis."""
    found = []
    for at in np.flatnonzero(space.smooth).tolist():
        axis = space.axes[at]
        rate = 0.0 if slopes is None else float(np.linalg.norm(slopes[:, at]))
        share = math.nan if slopes is None else LEVEL / rate if rate > _UNSEEN else math.inf
        value = axis.low + float(u[at]) * (axis.high - axis.low)
        found.append(Number(axis.label, axis.low, axis.high, value, share))
    return tuple(found)


def ties(space: Space, slopes: Matrix | None) -> tuple[tuple[str, str, float], ...]:
    """Pairs of axes of which one makes up for what the other does."""
    if slopes is None:
        return ()
    seen = np.flatnonzero(np.linalg.norm(slopes, axis=0) > _UNSEEN)
    unit = slopes[:, seen] / np.linalg.norm(slopes[:, seen], axis=0)
    spread = np.linalg.inv(unit.T @ unit + 1e-6 * np.eye(len(seen)))  # the same columns may stand twice
    size = np.sqrt(np.diag(spread))
    found = []
    for i in range(len(seen)):
        for j in range(i):
            r = float(spread[i, j] / (size[i] * size[j]))
            if abs(r) >= TIED:
                found.append((space.axes[seen[j]].label, space.axes[seen[i]].label, r))
    return tuple(found)


def hindrances(
    space: Space,
    u: Point,
    numbers: Sequence[Number],
    psnr: float,
    done: bool,
    worst: tuple[str, Matrix],
    noise: bool,
) -> tuple[str, ...]:
    """Why the picture is no nearer, as far as can be told.

    Args:
        worst: which picture of several is farthest off, and the errors (H, W) of its pixels.
        noise: whether these are like noise.
    """
    notes = []
    if not done:
        notes.append("not converged: the last rounds still found nearer pictures, or time was out")
    ends = np.flatnonzero(space.smooth & ~space.wraps & (np.minimum(u, 1 - u) < 1e-6)).tolist()
    notes += [f"`{space.axes[at].label}` is at an end of its range" for at in ends]
    unseen = [f"`{one.label}`" for one in numbers if math.isinf(one.felt)]
    if unseen:
        notes.append(f"the picture does not show {', '.join(unseen)} here, so any value would do")
    if psnr < GOOD_DB and noise:
        notes.append("what differs is like noise, of which no values come nearer")
    elif psnr < GOOD_DB:
        name, gap = worst
        rows, columns = (np.arange(length) for length in gap.shape)
        y, x = (gap.sum(1) @ rows / gap.sum(), gap.sum(0) @ columns / gap.sum())
        top, left = divmod(int(gap.argmax()), gap.shape[1])
        notes.append(
            f"no values that were tried come nearer: the scene differs from the target most at pixel "
            f"{left}, {top} of {gap.shape[1]} × {gap.shape[0]}{name}, on average around "
            f"{x:.0f}, {y:.0f}"
        )
    return tuple(notes)


GOOD_DB: Final = 35.0
"""From here on nothing is said of where a picture differs."""
