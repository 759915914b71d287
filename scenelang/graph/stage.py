"""The stage of a 3D scene: camera, light, ground and sky, with the language's defaults; linear colours."""

from __future__ import annotations

from math import atan, hypot
from typing import TYPE_CHECKING, Any

from scenelang.records import Record
from scenelang.scene.faults import MOST, camera_fault, light_fault

if TYPE_CHECKING:
    from scenelang.scene.schema import Scene

Triple = tuple[float, float, float]

HORIZON: Triple = (0.80, 0.86, 0.92)
ZENITH: Triple = (0.30, 0.50, 0.85)

AMBIENT = (0.12, 0.06)
"""What a surface of normal n receives without the light: ``AMBIENT[0] + AMBIENT[1] n.y``; media the first."""

EXTINCTION = 3.0  # of media, per world unit
FADE = 64.0  # the ground fades into the horizon by exp(-(x² + z²) / FADE)
NEAREST = 1e-3  # the light counts as at least this far away
LIFT = 1e-4  # how far off its surface a ray to the light starts


def decoded(srgb: Triple) -> Triple:
    """The linear colour of an sRGB-encoded one (IEC 61966-2-1)."""
    r, g, b = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in srgb)
    return r, g, b


def encoded(linear: Triple) -> Triple:
    """The inverse of `decoded`."""
    r, g, b = (12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055 for v in linear)
    return r, g, b


class Camera(Record):
    """Where the picture is taken from.

    Args:
        eye, target: world points.
        fov_rad: angle of view across the shorter side of the canvas, in (0, pi).
    """

    eye: Triple = (0.0, 1.2, 6.0)
    target: Triple = (0.0, 0.0, 0.0)
    fov_rad: float = 2.0 * atan(1.0 / 3.0)

    def fault(self) -> str | None:
        """Why there is no picture from here, if there is none."""
        fault = camera_fault(self.eye, self.target, self.fov_rad)
        return None if fault is None else fault[1]

    def axes(self) -> tuple[Triple, Triple, Triple]:
        """Unit vectors forward, right and up; seen straight along y, up is -z."""
        f = _unit(self.target[0] - self.eye[0], self.target[1] - self.eye[1], self.target[2] - self.eye[2])
        upright = hypot(f[0], f[2]) > 1e-9
        right = _unit(*_cross(f, (0.0, 1.0, 0.0) if upright else (0.0, 0.0, -1.0)))
        return f, right, _cross(right, f)


class Light(Record):
    """A point light: at distance r it sends ``power rgb / r²``."""

    position: Triple = (2.5, 4.0, 3.0)
    power: float = 28.0
    rgb: Triple = (1.0, 1.0, 1.0)

    def fault(self) -> str | None:
        """Why there is no such light, if there is none."""
        return light_fault(self.power)


class Ground(Record):
    """A diffuse plane at height ``y``."""

    y: float = -1.0
    rgb: Triple = (0.50, 0.48, 0.45)


class Stage(Record):
    """All of a 3D scene that is not an object.

    Args:
        camera, light: as they say.
        ground: None for a scene without one.
        horizon, zenith: colours of the sky; the ground fades into the first. A plain background is both.
        transparent: the sky is not drawn and the picture has alpha.
    """

    camera: Camera = Camera()
    light: Light = Light()
    ground: Ground | None = Ground()
    horizon: Triple = HORIZON
    zenith: Triple = ZENITH
    transparent: bool = False


def stage_data(stage: Stage) -> dict[str, Any]:
    """A stage as JSON data; camera, light and ground are objects of their fields."""
    data: dict[str, Any] = {name: getattr(stage, name) for name in Stage.__match_args__}
    for name in ("camera", "light", "ground"):
        part = data[name]
        data[name] = None if part is None else {n: getattr(part, n) for n in part.__match_args__}
    return data


def read_stage(data: object) -> Stage:
    """The stage that JSON data holds; the inverse of `stage_data`.

    Raises:
        ValueError: it holds none.
    """
    if not isinstance(data, dict) or data.keys() != set(Stage.__match_args__):
        raise ValueError("fields missing or unknown")
    parts: dict[str, Any] = {name: _read(name, data[name]) for name in data}
    if parts["camera"] is None or parts["light"] is None or type(parts["transparent"]) is not bool:
        raise ValueError("a part missing")
    return Stage(**parts)


_PARTS: dict[str, type[Record]] = {"camera": Camera, "light": Light, "ground": Ground}


def _read(name: str, value: object) -> Any:
    """A field of a stage or of one of its parts."""
    if name in _PARTS:
        if value is None:
            return None
        if not isinstance(value, dict) or value.keys() != set(_PARTS[name].__match_args__):
            raise ValueError(f"`{name}` has fields missing or unknown")
        return _PARTS[name](**{n: _read(n, v) for n, v in value.items()})
    if name == "transparent":
        return value
    three = name not in ("fov_rad", "power", "y")
    numbers = value if three else [value]
    if not isinstance(numbers, list) or len(numbers) != (3 if three else 1):
        raise ValueError(f"`{name}` does not hold what it should")
    if not all(type(v) in (int, float) and abs(v) <= MOST for v in numbers):
        raise ValueError(f"`{name}` is not a finite number")
    return tuple(map(float, numbers)) if three else float(numbers[0])


def stage_of(scene: Scene) -> Stage:
    """The stage that a scene states, over the defaults; written colours are decoded."""
    camera, light, ground, sky = Camera(), Light(), scene.ground, scene.background
    if scene.camera != "default":
        camera = Camera(scene.camera.eye, scene.camera.target, scene.camera.fov)
    if scene.light != "default":
        light = Light(scene.light.position, scene.light.power, decoded(scene.light.color))
    plane = None if ground is None else Ground()
    if ground is not None and ground != "default":
        plane = Ground(ground.y, Ground().rgb if ground.color == "default" else decoded(ground.color))
    if sky is None or sky == "default":
        return Stage(camera, light, plane, transparent=sky is None)
    return Stage(camera, light, plane, decoded(sky), decoded(sky))


def _cross(a: Triple, b: Triple) -> Triple:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(x: float, y: float, z: float) -> Triple:
    length = hypot(x, y, z)
    return x / length, y / length, z / length
