"""What no 3D scene can be drawn with."""

from __future__ import annotations

from math import degrees, pi
from typing import Final

Triple = tuple[float, float, float]
MOST: Final = 1e12
"""The largest number of a stage: float32 holds what is computed of it."""


def camera_fault(eye: Triple, target: Triple, fov_rad: float) -> tuple[str, str] | None:
    """The argument that leaves a camera without a picture, and why, if one does."""
    if eye == target:
        return "eye", "the eye is the target"
    if not 0.0 < fov_rad < pi:
        return "fov", f"a field of view of {degrees(fov_rad):g}° is not between 0° and 180°"
    if fov_rad < 1.0 / MOST:
        return "fov", f"a field of view of {degrees(fov_rad):g}° is too narrow"
    return None


def light_fault(power: float) -> str | None:
    """Why there is no light of such a power, if there is none."""
    return f"a power of {power:g} is negative" if power < 0.0 else None
