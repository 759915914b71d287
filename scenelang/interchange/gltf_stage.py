"""Cameras and lights of glTF files as those of a scene.

Sources: Khronos Group, *glTF 2.0 Specification*, section 3.10; *KHR_lights_punctual*.
"""

from __future__ import annotations

import math
from typing import Final

from scenelang.graph import stage
from scenelang.graph.stage import Triple
from scenelang.graph.steps import Rows
from scenelang.interchange.gltf_file import GltfError, Lamp, View, short, srgb
from scenelang.scene import schema

LEVEL_DEG: Final = 0.5  # a smaller roll does not show
MOST_SIDE: Final = 8192


def camera_of(view: View, world: Rows) -> tuple[schema.Camera, tuple[int, int], list[str]]:
    """The camera of a node with such a matrix, a canvas of its shape, and what of it is left out.

    Raises:
        GltfError: the scene's camera cannot be so.
    """
    if view.type != "perspective" or view.perspective is None:
        raise GltfError("a camera without perspective")
    aspect, half = view.perspective.aspect or 1.0, math.tan(view.perspective.yfov / 2)
    fov = 2 * math.degrees(math.atan(half * min(aspect, 1.0)))
    eye = world[3], world[7], world[11]
    length, far = math.hypot(world[2], world[6], world[10]), math.hypot(*eye) or 1.0
    if not 0.0 < length < math.inf or not far < math.inf:
        raise GltfError("a camera whose numbers are too small or too large")
    ahead = [eye[i] - far * world[4 * i + 2] / length for i in range(3)]
    try:
        found = schema.Camera(_point(eye, far), _point(ahead, far), fov=math.radians(short(fov)))
    except ValueError:
        raise GltfError("a camera whose numbers are too small or too large") from None
    _, right, up = stage.Camera(found.eye, found.target, found.fov).axes()
    across, along = (sum(world[4 * i + 1] * axis[i] for i in range(3)) for axis in (right, up))
    roll = math.degrees(math.atan2(across, along))
    side = 256 * max(aspect, 1.0), 256 / min(aspect, 1.0)
    width, height = (min(MOST_SIDE, round(v)) for v in side)
    return found, (width, height), [f"its roll of {roll:.3g}°"] if abs(roll) > LEVEL_DEG else []


def light_of(lamp: Lamp, world: Rows) -> tuple[schema.Light, list[str]]:
    """The light of a node with such a matrix, and what of it is left out.

    A white surface at distance 1 that faces the lamp reflects intensity / pi candela per square metre, which
    is shown as that share of white.

    Raises:
        GltfError: the scene's light cannot be so.
    """
    if lamp.type != "point":
        raise GltfError(f"a {lamp.type[:20]} light")
    place = world[3], world[7], world[11]
    red, green, blue = map(srgb, lamp.color)
    try:
        found = schema.Light(_point(place, 1.0), short(lamp.intensity / math.pi), (red, green, blue))
    except ValueError:
        raise GltfError("a light whose numbers are too large") from None
    return found, [f"its range of {lamp.range:g}"] if lamp.range is not None else []


def _point(p: Triple | list[float], size: float) -> Triple:
    """In few digits; what is nothing beside ``size`` is 0."""
    x, y, z = (0.0 if abs(v) < 1e-6 * size else short(v) for v in p)
    return x, y, z
