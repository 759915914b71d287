"""The plane and the solid world: maps and deformations that stay in them, bounds of leaves, the stage.

Nothing else in the compiler asks whether a scene is flat: a model's manifest states the dimension.

Maps and turns. A warp turns (x, y), a twist (x, z); call that plane P, and its axis a. Let M keep P and a
apart and be s times an orthogonal matrix Q on P, with no shift in P, and m times a coordinate, plus c, along
a. As R(w) turns P alone, M^-1 R(w) M is R(+-w), the sign being the determinant of Q. So M trades places with
the turn by an angle w if w(M u) is an angle of the same kind:

- A twist has w = k y. With c = 0 it is k m times y.
- A bend has w = k x, which is k s times the entry of Q^T's first column: it stays a bend along x where Q
  keeps that axis, whatever m and c are; slots of a vector hold no other.
- A twirl has w = k |M u|, which is k s |u| where |m| = s and c = 0.

Bounds. A leaf lies in the unit disc or ball and its distance grows no faster than 1, so the points below a
level lie within a radius of 1 + level / stretch; a `Skin` widens that by its reach. A turn keeps
lengths, so that it carries a ball into the one about the origin that encloses it. In the plane, where it
turns each point by an angle that is bounded over any sector about the origin, it carries a sector into one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import asin, atan, atan2, cos, dist, hypot, inf, isfinite, pi, sqrt, tan, tau
from struct import pack, unpack
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from scenelang.assets.records import Record
from scenelang.compiler.geometries import GEOMETRIES
from scenelang.compiler.steps import (
    IDENTITY,
    Affine,
    Own,
    Rows,
    Skin,
    Step,
    Turn,
    Twist,
    Warp,
    compose,
    composed,
    inverted,
)
from scenelang.language import scene
from scenelang.language.nodes import LAMPS, MOST, camera_fault, light_fault

if TYPE_CHECKING:
    from scenelang.language.scene import Scene

Triple = tuple[float, float, float]

HORIZON: Triple = (0.80, 0.86, 0.92)
ZENITH: Triple = (0.30, 0.50, 0.85)

AMBIENT = (0.12, 0.06)
"""Ambient light on a surface of normal n: ``AMBIENT[0] + AMBIENT[1] n.y``; on media the first alone."""

EXTINCTION = 3.0  # of media, per world unit
FADE = 8.0  # distance from the y axis over which the ground fades, unless it says another
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
    """The camera: world points, and the angle of view, in (0, pi), across the canvas's shorter side.

    All light is multiplied by ``exposure`` before it is clamped and encoded.
    """

    eye: Triple = (0.0, 1.2, 6.0)
    target: Triple = (0.0, 0.0, 0.0)
    fov_rad: float = 2.0 * atan(1.0 / 3.0)
    exposure: float = 1.0

    def __repr__(self) -> str:
        return _said(self)

    def axes(self) -> tuple[Triple, Triple, Triple]:
        """Unit vectors forward, right and up; seen straight along y, up is -z."""
        f = _unit(self.target[0] - self.eye[0], self.target[1] - self.eye[1], self.target[2] - self.eye[2])
        upright = hypot(f[0], f[2]) > 1e-9
        right = _unit(*_cross(f, (0.0, 1.0, 0.0) if upright else (0.0, 0.0, -1.0)))
        return f, right, _cross(right, f)


class Light(Record):
    """A lamp: at distance r it sends ``power rgb / r²``; one of a ``radius`` is a sphere of even radiance."""

    position: Triple = (2.5, 4.0, 3.0)
    power: float = 28.0
    rgb: Triple = (1.0, 1.0, 1.0)
    radius: float = 0.0

    def __repr__(self) -> str:
        return _said(self)


class Sky(Record):
    """The sky as it lights a scene: ``power`` times these linear colours, from everywhere."""

    power: float = 1.0
    horizon: Triple = HORIZON
    zenith: Triple = ZENITH


class Ground(Record):
    """A diffuse plane at height ``y``, which fades into the horizon by exp(-(x² + z²) / fade²)."""

    y: float = -1.0
    rgb: Triple = (0.50, 0.48, 0.45)
    fade: float = FADE

    def __repr__(self) -> str:
        return _said(self)


class Stage(Record):
    """A 3D scene without its objects; the ground fades into ``horizon``, ``transparent`` draws no sky.

    Light goes on from surface to surface where there is a ``sky``, and there is no ambient light.
    """

    camera: Camera = Camera()
    lights: tuple[Light, ...] = (Light(),)  # LAMPS at most
    ground: Ground | None = Ground()
    horizon: Triple = HORIZON
    zenith: Triple = ZENITH
    transparent: bool = False
    sky: Sky | None = None

    @property
    def plain(self) -> bool:
        """Whether one point light lights it, and no sky: what stages were before there was more."""
        return self.sky is None and len(self.lights) == 1 and not self.lights[0].radius

    @property
    def size(self) -> float:
        """World units from the middle of the view to its nearer edges, where the camera looks at."""
        return dist(self.camera.eye, self.camera.target) * tan(self.camera.fov_rad / 2)

    @property
    def growth(self) -> float:
        """By how much the lengths of its world grow where its view becomes as large as the usual one."""
        by = _USUAL / max(self.size, 1e-30)
        return by if isfinite(by) and abs(by - 1.0) > 1e-9 else 1.0

    def scaled(self, by: float) -> Stage:
        """The same picture with all lengths of the world times a number."""

        def moved(p: Triple) -> Triple:
            return p[0] * by, p[1] * by, p[2] * by

        camera, ground = self.camera, self.ground
        lights = [
            replace(lamp, position=moved(lamp.position), power=lamp.power * by * by, radius=lamp.radius * by)
            for lamp in self.lights
        ]
        return replace(
            self,
            camera=replace(camera, eye=moved(camera.eye), target=moved(camera.target)),
            lights=tuple(lights),
            ground=ground and replace(ground, y=ground.y * by, fade=ground.fade * by),
        )

    def __repr__(self) -> str:
        return _said(self)

    def fault(self) -> str | None:
        """Say why it shows nothing, None where it does."""
        camera = camera_fault(self.camera.eye, self.camera.target, self.camera.fov_rad)
        faults = [] if camera is None else [camera[1]]
        faults += [] if self.camera.exposure > 0.0 else [f"an exposure of {self.camera.exposure:g}"]
        faults += [f"more than {LAMPS} lights"] if len(self.lights) > LAMPS else []
        faults += [f"a radius of {light.radius:g} is negative" for light in self.lights if light.radius < 0.0]
        powers = [light.power for light in self.lights] + ([self.sky.power] if self.sky else [])
        faults += [fault for power in powers if (fault := light_fault(power))]
        return faults[0] if faults else None


_USUAL: Final = Stage().size


def _fields(part: Record) -> dict[str, Any]:
    """The fields of a stage or a part of it, of a plain one those that it had when there was no more."""
    names: tuple[str, ...] = part.__match_args__
    fields = {name: getattr(part, name) for name in names}
    if isinstance(part, Light) and not part.radius:
        del fields["radius"]
    if isinstance(part, Ground) and part.fade == FADE:
        del fields["fade"]
    if isinstance(part, Camera) and part.exposure == 1.0:
        del fields["exposure"]
    if isinstance(part, Stage) and part.plain:
        del fields["sky"]
        (light,) = part.lights
        return {"light" if n == "lights" else n: light if n == "lights" else v for n, v in fields.items()}
    return fields


def _said(part: Record) -> str:
    """The text of a stage or a part of it, which digests of Programs hold."""
    return f"{type(part).__name__}({', '.join(f'{n}={v!r}' for n, v in _fields(part).items())})"


def stage_data(part: Any) -> Any:
    """A stage, or a part of it, as JSON data: an object of its fields. A plain stage has one ``light``."""
    if isinstance(part, tuple) and part and isinstance(part[0], Record):
        return [stage_data(each) for each in part]
    if not isinstance(part, Record):
        return part
    return {name: stage_data(value) for name, value in _fields(part).items()}


def read_stage(data: object) -> Stage:
    """Read a stage from JSON data, the inverse of `stage_data`; raises ValueError for other data."""
    if isinstance(data, dict) and "light" in data:
        data = {"lights" if n == "light" else n: [v] if n == "light" else v for n, v in data.items()}
        data.setdefault("sky", None)
    return cast("Stage", _read(Stage(), data, "stage"))


def _read(usual: Any, value: Any, name: str) -> Any:
    """A value of the kind that the default has."""
    if name == "lights":
        if not isinstance(value, list) or len(value) > LAMPS:
            raise ValueError(f"`lights` are not a list of {LAMPS} at most")
        return tuple(_read(Light(), each, "light") for each in value)
    if name in {"ground", "sky"} and value is None:
        return None
    usual = Sky() if name == "sky" else usual
    if isinstance(usual, Record):
        names: tuple[str, ...] = usual.__match_args__
        if isinstance(usual, Light | Ground | Camera) and isinstance(
            value, dict
        ):  # what was not there at first
            value = {names[-1]: getattr(usual, names[-1]), **value}
        if not isinstance(value, dict) or value.keys() != set(names):
            raise ValueError(f"`{name}` has fields missing or unknown")
        return type(usual)(**{n: _read(getattr(usual, n), value[n], n) for n in names})
    numbers = value if type(usual) is tuple else [value]
    if not isinstance(numbers, list) or len(numbers) != (3 if type(usual) is tuple else 1):
        raise ValueError(f"`{name}` does not hold what it should")
    kinds = (bool,) if type(usual) is bool else (int, float)
    if not all(type(v) in kinds and abs(v) <= MOST for v in numbers):
        raise ValueError(f"`{name}` is not a finite number or a boolean")
    return type(usual)(map(float, value) if type(usual) is tuple else value)


def stage_of(scene: Scene) -> Stage:
    """The stage of a scene, with defaults for what it does not state; written colours are decoded."""
    camera, ground, backdrop = Camera(), scene.ground, scene.background
    lights: tuple[Light, ...] = (Light(),)
    if scene.camera != "default":
        camera = Camera(scene.camera.eye, scene.camera.target, scene.camera.fov, scene.camera.exposure)
    if scene.light != "default":
        written = scene.light if isinstance(scene.light, tuple) else (scene.light,)
        lamps = [lamp for lamp in written if lamp is not None]
        lights = tuple([Light(at.position, at.power, decoded(at.color), at.radius) for at in lamps])
    plane = None if ground is None else Ground()
    if ground is not None and ground != "default":
        colour = Ground().rgb if ground.color == "default" else decoded(ground.color)
        plane = Ground(ground.y, colour, ground.fade)
    horizon, zenith, own = HORIZON, ZENITH, scene.sky
    if painted := backdrop is not None and backdrop != "default":
        horizon = zenith = decoded(backdrop)
    if own == "default":
        return Stage(camera, lights, plane, horizon, zenith, backdrop is None)
    low = horizon if own.horizon == "default" else decoded(own.horizon)
    high = zenith if own.zenith == "default" else decoded(own.zenith)
    if not painted:  # the eye sees what lights
        horizon, zenith = low, high
    return Stage(camera, lights, plane, horizon, zenith, backdrop is None, Sky(own.power, low, high))


def _cross(a: Triple, b: Triple) -> Triple:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(x: float, y: float, z: float) -> Triple:
    length = hypot(x, y, z)
    return x / length, y / length, z / length


Box = tuple[float, float, float, float, float, float]
"""xmin, ymin, xmax, ymax, zmin, zmax in the world; what lies in the plane has z = 0."""

EVERYWHERE: Final[Box] = (-inf, -inf, inf, inf, -inf, inf)

SINGULAR: Final = 1e-12
"""Smallest to largest stretch at which a map counts as singular.

The determinant of a 2 x 2 block carries a rounding error of about 1e-16 of the squared largest stretch,
so that ratio is still known to four digits here, while nothing that thin can be seen at 8192 pixels.
"""

REACH: Final = 1e30
"""Stretches outside ``1/REACH .. REACH`` leave the range of float32 when inverted, as do far offsets."""


class Refusal(NamedTuple):
    """The reason why a transform has no step: a code, the fact and advice."""

    code: str
    message: str
    help: str


ALIKE = 1e-12
"""Relative tolerance below which entries of a map, stretches or a right angle count as equal."""

_ROUNDING = 1e-9
"""Balls and boxes grow by this much, relative, to cover the rounding of float64."""


class Space:
    """The geometry of the solid world; `Plane` has that of the plane."""

    dimension = 3
    shown: tuple[tuple[int, ...], ...] = ((0, 1, 2, 3), (4, 5, 6, 7), (8, 9, 10, 11))
    """Entries of `Rows` that determine a map of this space, row by row."""
    thinner = "a plane, a line or a point"
    """The image of everything under a singular map, in words."""

    def fitted(self, transform: scene.Transform, rows: Rows) -> Rows | Refusal:
        """The map within this space, or the reason why the transform leaves the space."""
        return rows

    def idle(self, transform: scene.Transform) -> str | None:
        """The part of a transform that has no effect in this space, if there is one."""
        return None

    def inked(self, op: scene.MaterialOp) -> scene.MaterialOp:
        """An operation of a material in the space that colours are averaged in; here linear, as light is."""
        if isinstance(op, scene.Color | scene.Stop):
            return op.model_copy(update={"rgb": decoded(op.rgb)})
        return op

    def written(self, rgb: Triple) -> Triple:
        """The inverse of `inked` for a colour: as it is written."""
        return encoded(rgb)

    def holds(self, rows: Rows) -> bool:
        """True for maps that `fitted` may give."""
        return True

    def stretches(self, rows: Rows) -> tuple[float, float]:
        """The smallest and largest singular value of the linear block."""
        a, b, c = rows[0], rows[1], rows[2]
        d, e, f = rows[4], rows[5], rows[6]
        g, h, i = rows[8], rows[9], rows[10]
        # Eigenvalues of the symmetric A^T A by cyclic Jacobi rotations: three sweeps reach float64 accuracy
        # from any start that matters here; eight leave no doubt.
        m = [
            [a * a + d * d + g * g, a * b + d * e + g * h, a * c + d * f + g * i],
            [0.0, b * b + e * e + h * h, b * c + e * f + h * i],
            [0.0, 0.0, c * c + f * f + i * i],
        ]
        m[1][0], m[2][0], m[2][1] = m[0][1], m[0][2], m[1][2]
        for _ in range(8):
            for p, q in ((0, 1), (0, 2), (1, 2)):
                if m[p][q] == 0.0:
                    continue
                theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q])
                t = (1.0 if theta >= 0.0 else -1.0) / (abs(theta) + hypot(theta, 1.0))
                co = 1.0 / hypot(t, 1.0)
                si = t * co
                for r in range(3):
                    m[r][p], m[r][q] = co * m[r][p] - si * m[r][q], si * m[r][p] + co * m[r][q]
                for r in range(3):
                    m[p][r], m[q][r] = co * m[p][r] - si * m[q][r], si * m[p][r] + co * m[q][r]
        values = sorted(max(m[r][r], 0.0) for r in range(3))
        largest, middle = sqrt(values[2]), sqrt(values[1])
        det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
        smallest = abs(det) / (largest * middle) if largest * middle > 0.0 else 0.0
        return min(smallest, middle), largest

    def before(self, rows: Rows, turn: Turn) -> Turn | None:
        """The turn before the map ``rows`` with the effect of ``turn`` after it; see the module."""
        # P is the plane of x and j, k the axis a; entry (r, c) of the map is rows[4 r + c].
        j, k = (2, 1) if isinstance(turn, Twist) else (1, 2)
        a, b, c, d, along = rows[0], rows[j], rows[4 * j], rows[5 * j], rows[5 * k]
        scale = sqrt(abs(a * d - b * c))
        near = ALIKE * scale
        sign = 1.0 if a * d > b * c else -1.0
        # no shift in P, and nothing that mixes P and a
        apart = (rows[3], rows[4 * j + 3], rows[k], rows[4 * k], rows[4 * j + k], rows[4 * k + j])
        if max(abs(a - sign * d), abs(b + sign * c), *map(abs, apart)) > near:
            return None
        shift = abs(rows[4 * k + 3]) > near
        if isinstance(turn, Twist):
            return None if shift else Twist(sign * along * turn.twist)
        if turn.twirl and (shift or abs(abs(along) - scale) > near):
            return None
        if (bend := turn.bend[0]) and abs(b) > near:
            return None
        return type(turn)(sign * scale * turn.twirl, (sign * a * bend, 0.0)) if not turn.bend[1] else None

    def after(self, rows: Rows, turn: Turn) -> Turn | None:
        """The turn after the map ``rows`` that has the effect of ``turn`` before it, if there is one."""
        return self.before(inverted(rows), turn)

    def box(self, geometry: str, steps: Sequence[Step], level: float) -> Box:
        """A box of all points of the world at a distance below ``level`` >= 0 of a leaf with such steps."""
        (x, y, z), radius, rows = self._ball(steps, level)
        sides = []
        for row in (rows[:4], rows[4:8], rows[8:]):
            middle = row[0] * x + row[1] * y + row[2] * z + row[3]
            half = radius * hypot(*row[:3])
            half += _ROUNDING * (1.0 + abs(middle) + half)
            if not half < inf:  # NaN compares false: what overflowed may be anywhere
                return EVERYWHERE
            sides += [middle - half, middle + half]
        xmin, xmax, ymin, ymax, zmin, zmax = sides
        return xmin, ymin, xmax, ymax, zmin, zmax

    def bound(self, geometry: str, steps: Sequence[Step], level: float) -> tuple[float, float, float, float]:
        """The bound of a leaf in a Program: centre and radius of a ball, in the plane the flat box."""
        (x, y, z), radius, rows = self._ball(steps, level)
        x, y, z = _mapped(rows, (x, y, z))
        radius *= self.stretches(rows)[1]
        return x, y, z, radius + _ROUNDING * (1.0 + hypot(x, y, z) + radius)

    def _ball(self, steps: Sequence[Step], level: float) -> tuple[Triple, float, Rows]:
        """Centre and radius of a ball around all points below a level, and the affine map behind it."""
        radius, pending = 1.0 + Skin.of(steps).reach, IDENTITY
        if level > 0.0:
            stretch = self.stretches(composed(steps))[0]
            radius += level / stretch if stretch else inf
        centre = 0.0, 0.0, 0.0
        for step in steps:
            if isinstance(step, Affine):
                pending = compose(step.rows, pending)
            elif not isinstance(step, Own):
                if pending is not IDENTITY:
                    centre, radius = _mapped(pending, centre), radius * self.stretches(pending)[1]
                    pending = IDENTITY
                centre, radius = (0.0, 0.0, 0.0), radius + hypot(*centre)
        return centre, radius, pending

    def disc(self, geometry: str, steps: Sequence[Step]) -> tuple[float, Rows] | None:
        """Radius of a disc or ball within a leaf, and the map from the world to the leaf; None if unknown."""
        row = GEOMETRIES.get(geometry)
        maps = [isinstance(step, Affine) for step in steps if not isinstance(step, Own)]
        if row is None or any(maps[:-1]) or not all(maps[-1:]):
            return None
        skin = Skin.of(steps)
        inner = row.inner + skin.grow - abs(skin.amount)
        filled = inner > 0.0 and row.inner > 0.0 and not skin.shell
        return (inner, inverted(composed(steps))) if filled else None

    def usable(self, rows: Rows) -> bool:
        """True where the map has an inverse in float64 that float32 can hold."""
        smallest, largest = self.stretches(rows)
        offset = max(abs(rows[3]), abs(rows[7]), abs(rows[11]), 1.0)
        # Written so that NaN and infinity fail.
        return smallest > SINGULAR * largest and offset < REACH * smallest and largest < REACH


def _mapped(rows: Rows, p: Triple) -> Triple:
    x, y, z = p
    a, b, c, u, d, e, f, v, g, h, i, w = rows
    return a * x + b * y + c * z + u, d * x + e * y + f * z + v, g * x + h * y + i * z + w


class Plane(Space):
    """The plane z = 0; maps of it leave z alone."""

    dimension = 2
    shown = ((0, 1, 3), (4, 5, 7))
    thinner = "a line or a point"

    def fitted(self, transform: scene.Transform, rows: Rows) -> Rows | Refusal:
        kind = transform.kind
        if isinstance(transform, scene.Rotate) and transform.angle != 0.0 and any(transform.axis[:2]):
            axis = ", ".join(f"{v:g}" for v in transform.axis)
            fact = f"`rotate` about [{axis}] leaves the plane"
            return Refusal("E0505", fact, "a 2D model turns about Z: leave `axis` out")
        if rows[11] != 0.0:
            fact = f"`{kind}` by z = {rows[11]:g} leaves the plane"
            return Refusal("E0505", fact, "a 2D model has no z: leave the third component out")
        if isinstance(transform, scene.Shear) and transform.k != 0.0 and "z" in transform.axes:
            fact = f"`shear({transform.axes})` leaves the plane"
            return Refusal("E0505", fact, "a 2D model shears `xy` or `yx`")
        if isinstance(transform, scene.Matrix) and (rows[2] or rows[6] or rows[8] or rows[9]):
            help = "for a 2D model the third row and column are those of the identity"
            return Refusal("E0505", "`matrix` mixes z with x and y", help)
        return flattened(rows)

    def idle(self, transform: scene.Transform) -> str | None:
        if not isinstance(transform, scene.Scale) or transform.z in (1.0, transform.x):
            return None  # `scale(s)` has the same factor along all axes
        return f"`scale` by {transform.z:g} along z"

    def inked(self, op: scene.MaterialOp) -> scene.MaterialOp:
        return op

    def written(self, rgb: Triple) -> Triple:
        return rgb

    def holds(self, rows: Rows) -> bool:
        return not rows[2] and not rows[6] and rows[8:] == IDENTITY[8:]

    def stretches(self, rows: Rows) -> tuple[float, float]:
        return stretches(rows[0], rows[1], rows[4], rows[5])

    def usable(self, rows: Rows) -> bool:
        """As for any space; nor may the inverse be singular in float32, as a thin, slanted one can be."""
        if not super().usable(rows):
            return False
        a, b, _, _, c, d = rows[:6]
        det = a * d - b * c
        p, q, r, s = unpack("4f", pack("4f", d / det, b / det, c / det, a / det))
        return bool(p * s != q * r)

    def before(self, rows: Rows, turn: Turn) -> Turn | None:
        """A warp for similarities about the origin; `scenelang.compiler.chain.normal` has the proof."""
        if (alike := _similarity(rows)) is None or not isinstance(turn, Warp):
            return None
        scale, sign = alike
        x, y = turn.bend
        bend = (sign * (rows[0] * x + rows[4] * y), sign * (rows[1] * x + rows[5] * y))
        return Warp(sign * scale * turn.twirl, bend)

    def box(self, geometry: str, steps: Sequence[Step], level: float) -> Box:
        rows, reach = composed(steps), Skin.of(steps).reach
        if level > 0.0:
            stretch = self.stretches(rows)[0]
            if stretch == 0.0:
                return EVERYWHERE
            reach += level / stretch
        if any(isinstance(step, Warp) for step in steps):
            return _grown(_warped(steps, 1.0 + reach))
        row = GEOMETRIES.get(geometry)
        a, b, x, c, d, y = rows[0], rows[1], rows[3], rows[4], rows[5], rows[7]
        wide, high = reach * hypot(a, b), reach * hypot(c, d)
        if row is None or not row.corners:
            wide, high = wide + hypot(a, b), high + hypot(c, d)
            return _grown((x - wide, y - high, x + wide, y + high))
        across = [a * p + b * q for p, q in row.corners]
        along = [c * p + d * q for p, q in row.corners]
        low = x + min(across) - wide, y + min(along) - high
        return _grown((*low, x + max(across) + wide, y + max(along) + high))

    def bound(self, geometry: str, steps: Sequence[Step], level: float) -> tuple[float, float, float, float]:
        return self.box(geometry, steps, level)[:4]


class Sheet(Space):
    """Maps of space by what is left of a point that they carry back: x and y, as textures have them."""

    def stretches(self, rows: Rows) -> tuple[float, float]:
        try:
            a, b, c, _, d, e, f, *_ = inverted(rows)
        except ZeroDivisionError:
            return 0.0, 1.0
        p, q, r = a * a + b * b + c * c, a * d + b * e + c * f, d * d + e * e + f * f
        largest = sqrt((p + r) / 2.0 + hypot((p - r) / 2.0, q))
        area = hypot(a * e - b * d, b * f - c * e, c * d - a * f)
        return (1.0 / largest, largest / area) if largest and area else (0.0, 1.0)


def flattened(rows: Rows) -> Rows:
    """The same map of the plane with z left alone."""
    return (rows[0], rows[1], 0.0, rows[3], rows[4], rows[5], 0.0, rows[7], 0.0, 0.0, 1.0, 0.0)


def stretches(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """The smallest and largest singular value of the matrix [[a, b], [c, d]]."""
    largest = 0.5 * (hypot(a + d, c - b) + hypot(a - d, c + b))
    # |det| / largest keeps its digits where the difference of the two lengths would lose them.
    return (abs(a * d - b * c) / largest if largest else 0.0), largest


def _similarity(rows: Rows) -> tuple[float, float] | None:
    """The scale of a similarity of the plane about the origin and 1, -1 where it mirrors; else None."""
    a, b, c, d = rows[0], rows[1], rows[4], rows[5]
    s = sqrt(abs(a * d - b * c))
    near = ALIKE * s
    if abs(rows[3]) > near or abs(rows[7]) > near:
        return None
    if abs(a - d) <= near and abs(b + c) <= near:
        return s, 1.0
    if abs(a + d) <= near and abs(b - c) <= near:
        return s, -1.0
    return None


def _grown(box: tuple[float, float, float, float]) -> Box:
    left, bottom, right, top = box
    more = _ROUNDING * (1.0 + max(abs(left), abs(bottom), abs(right), abs(top)))
    grown = (left - more, bottom - more, right + more, top + more, 0.0, 0.0)
    # NaN compares false: what overflowed may be anywhere.
    return grown if grown[0] < grown[2] and grown[1] < grown[3] else EVERYWHERE


class _Sector(Record, frozen=False):
    """Points about the origin: radii ``near``..``far``, angles ``first``..``last`` (a full turn: all)."""

    near: float
    far: float
    first: float
    last: float

    @property
    def whole(self) -> bool:
        return not self.last - self.first < tau

    def furthest(self, x: float, y: float) -> float:
        """An upper bound of (x, y) . p over the sector."""
        length = hypot(x, y)
        if length == 0.0:
            return 0.0
        if self.whole:
            return length * self.far
        ahead = (atan2(y, x) - self.first) % tau
        if ahead <= self.last - self.first:
            return length * self.far
        c = max(cos(ahead), cos(ahead - (self.last - self.first)))
        return length * c * (self.far if c >= 0.0 else self.near)

    def turned(self, warp: Warp) -> _Sector:
        """A sector around the image of this one: each point turns by ``twirl |p| + bend . p``."""
        if self.whole:
            return self
        twist = sorted((warp.twirl * self.near, warp.twirl * self.far))
        x, y = warp.bend
        most = hypot(x, y) * self.far
        low, high = twist[0] - most, twist[1] + most
        if most > 0.0:
            # `p` is the turned point. Its angle is now known roughly, which bounds the bend better.
            rough = _Sector(self.near, self.far, self.first + low, self.last + high)
            low, high = twist[0] - rough.furthest(-x, -y), twist[1] + rough.furthest(x, y)
        return _Sector(self.near, self.far, self.first + low, self.last + high)

    def mapped(self, rows: Rows) -> _Sector:
        """A sector around the image of this one under an affine map."""
        x, y = rows[3], rows[7]
        smallest, largest = stretches(rows[0], rows[1], rows[4], rows[5])
        away, radius = hypot(x, y), largest * self.far
        if away == 0.0:
            return _Sector(smallest * self.near, radius, 0.0, tau)
        if not away > radius:
            return _Sector(0.0, away + radius, 0.0, tau)
        middle, half = atan2(y, x), asin(radius / away)
        return _Sector(away - radius, away + radius, middle - half, middle + half)


def _warped(steps: Sequence[Step], radius: float) -> tuple[float, float, float, float]:
    sector = _Sector(0.0, radius, -pi, pi)
    pending = IDENTITY
    for step in steps:
        if isinstance(step, Affine):
            pending = compose(step.rows, pending)
        if isinstance(step, Affine | Own):
            continue
        if not isinstance(step, Warp):
            return EVERYWHERE[:4]
        if pending is not IDENTITY:
            sector, pending = sector.mapped(pending), IDENTITY
        sector = sector.turned(step)
    a, b, x = pending[0], pending[1], pending[3]
    c, d, y = pending[4], pending[5], pending[7]
    low = x - sector.furthest(-a, -b), y - sector.furthest(-c, -d)
    return *low, x + sector.furthest(a, b), y + sector.furthest(c, d)


PLANE: Final = Plane()
SHEET: Final = Sheet()
SPACES: Final[dict[int, Space]] = {2: PLANE, 3: Space()}
