"""glTF 2.0 files, read as if a stranger had written them: nodes, names, base colours, cameras and lights.

Neither buffers nor pictures are needed, so no URI is ever followed, and of a .glb only the first chunk is
read.

Source: Khronos Group, *glTF 2.0 Specification* (ISO/IEC 12113:2022), sections 3.5, 3.9, 3.10 and 4, and
*KHR_lights_punctual*.
"""

from __future__ import annotations

import math
import os
import struct
from typing import Annotated, Any, Final

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from scenelang.files import read_json, read_regular
from scenelang.scene.fields import Finite

MOST_BYTES: Final = 10_000_000  # of the JSON; buffers do not count where they lie in a .glb or beside a .gltf
MOST_NODES: Final = 100_000
LIGHTS: Final = "KHR_lights_punctual"
DIGITS: Final = 6  # digits of what is written: files hold float32, whose eighth is noise
_HEADER: Final = 20  # of a .glb and its first chunk

Index = Annotated[int, Field(strict=True, ge=0)]


class GltfError(Exception):
    """A file that is not glTF 2.0, or one that cannot become a scene; the message says why."""


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


class Asset(_Part):
    version: str


class Roots(_Part):
    nodes: tuple[Index, ...] = ()


class Node(_Part):
    """A node of the hierarchy; ``matrix`` is column by column, ``rotation`` a quaternion (x, y, z, w)."""

    name: str | None = None
    children: tuple[Index, ...] = ()
    mesh: Index | None = None
    camera: Index | None = None
    skin: Index | None = None
    matrix: Annotated[tuple[Finite, ...], Field(min_length=16, max_length=16)] | None = None
    translation: tuple[Finite, Finite, Finite] = (0.0, 0.0, 0.0)
    rotation: tuple[Finite, Finite, Finite, Finite] = (0.0, 0.0, 0.0, 1.0)
    scale: tuple[Finite, Finite, Finite] = (1.0, 1.0, 1.0)
    extensions: dict[str, Any] = {}

    @property
    def light(self) -> int | None:
        """Index of its light."""
        held = self.extensions.get(LIGHTS)
        index = held.get("light") if isinstance(held, dict) else None
        return index if type(index) is int else None


class Primitive(_Part):
    material: Index | None = None


class Mesh(_Part):
    name: str | None = None
    primitives: tuple[Primitive, ...] = ()


Share = Annotated[Finite, Field(ge=0, le=1)]


class Pbr(_Part):
    """Colours are linear."""

    model_config = ConfigDict(populate_by_name=True)

    factor: Annotated[tuple[Share, Share, Share, Share], Field(alias="baseColorFactor")] = (
        1.0,
        1.0,
        1.0,
        1.0,
    )
    texture: Annotated[Any, Field(alias="baseColorTexture")] = None


class Look(_Part):
    name: str | None = None
    pbr: Annotated[Pbr, Field(alias="pbrMetallicRoughness")] = Pbr()


class Perspective(_Part):
    """Angle of view from top to bottom in radians, and width by height."""

    yfov: Annotated[Finite, Field(gt=0, lt=math.pi)]
    aspect: Annotated[Finite | None, Field(alias="aspectRatio", ge=1e-4, le=1e4)] = None


class View(_Part):
    type: str
    perspective: Perspective | None = None


class Lamp(_Part):
    """A light; ``color`` is linear, ``intensity`` of a point in candela."""

    type: str
    color: tuple[Share, Share, Share] = (1.0, 1.0, 1.0)
    intensity: Annotated[Finite, Field(ge=0)] = 1.0
    range: Finite | None = None


class Lamps(_Part):
    lights: tuple[Lamp, ...] = ()


class Extensions(_Part):
    lamps: Annotated[Lamps, Field(alias=LIGHTS)] = Lamps()


class Gltf(_Part):
    """What of a file becomes a scene."""

    asset: Asset
    scene: Index | None = None
    scenes: tuple[Roots, ...] = ()
    nodes: Annotated[tuple[Node, ...], Field(max_length=MOST_NODES)] = ()
    meshes: tuple[Mesh, ...] = ()
    materials: tuple[Look, ...] = ()
    cameras: tuple[View, ...] = ()
    extensions: Extensions = Extensions()

    @property
    def lights(self) -> tuple[Lamp, ...]:
        """Lights of the file."""
        return self.extensions.lamps.lights


def short(number: float) -> float:
    """A number in `DIGITS` digits."""
    return float(f"{number:.{DIGITS}g}")


def srgb(linear: float) -> float:
    """The sRGB-encoded value of a linear one, both in [0, 1]: a level of 8 bits, or four decimals.

    Source: IEC 61966-2-1.
    """
    value = 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055
    level = round(255 * value)
    return level / 255 if abs(255 * value - level) < 1e-4 else round(value, 4)


def read_gltf(path: str | os.PathLike[str]) -> Gltf:
    """Read a .gltf or .glb file.

    Raises:
        GltfError: it is not glTF 2.0, or larger than is read.
        OSError: it cannot be read.
    """
    return parse_gltf(read_regular(path, MOST_BYTES + _HEADER))


def parse_gltf(data: bytes) -> Gltf:
    """What a file's bytes say; of a .glb its beginning is enough.

    Raises:
        GltfError: they are not glTF 2.0.
    """
    text = _first_chunk(data) if data[:4] == b"glTF" else data
    if len(text) > MOST_BYTES:
        advice = "keep buffers and pictures in a .glb or beside the .gltf"
        raise GltfError(f"more than {MOST_BYTES // 1_000_000} MB of JSON: {advice}")
    try:
        value = read_json(text, most_depth=200)
    except ValueError as error:
        raise GltfError(f"not glTF: {error}") from None
    version = value.get("asset", {}) if isinstance(value, dict) else None
    said = version.get("version") if isinstance(version, dict) else None
    if isinstance(said, str) and said.partition(".")[0] != "2":
        raise GltfError(f"glTF of version {said[:20]!r}, not 2")
    try:
        found = Gltf.model_validate(value)
    except ValidationError as error:
        raise GltfError(_first_problem(error)) from None
    _check_references(found)
    return found


def _first_chunk(data: bytes) -> bytes:
    """The JSON of a .glb: a header of 12 bytes, then the chunk's length, its kind and itself."""
    if len(data) < _HEADER:
        raise GltfError("a .glb file that ends in its header")
    version, _, length, kind = struct.unpack("<4xII I4s", data[:_HEADER])
    if version != 2:
        raise GltfError(f"a .glb file of version {version}, not 2")
    if kind != b"JSON":
        raise GltfError("a .glb file that does not begin with JSON")
    if length > MOST_BYTES:
        raise GltfError(f"more than {MOST_BYTES // 1_000_000} MB of JSON")
    if len(data) < _HEADER + length:
        raise GltfError("a .glb file that ends within its JSON")
    return data[_HEADER : _HEADER + length]


def _check_references(found: Gltf) -> None:
    """Every index names something there is."""
    counts = {"node": len(found.nodes), "mesh": len(found.meshes), "material": len(found.materials)}
    counts |= {"camera": len(found.cameras), "light": len(found.lights)}

    def check(owner: str, kind: str, index: int | None) -> None:
        if index is not None and not 0 <= index < counts[kind]:
            raise GltfError(f"{owner} names {kind} {index}, and there are {counts[kind]}")

    if found.scene is not None and found.scene >= len(found.scenes):
        raise GltfError(f"scene {found.scene} is the first, and there are {len(found.scenes)}")
    for at, roots in enumerate(found.scenes):
        for index in roots.nodes:
            check(f"scene {at}", "node", index)
    for at, node in enumerate(found.nodes):
        check(f"node {at}", "mesh", node.mesh)
        check(f"node {at}", "camera", node.camera)
        check(f"node {at}", "light", node.light)
        for index in node.children:
            check(f"node {at}", "node", index)
    for at, mesh in enumerate(found.meshes):
        for primitive in mesh.primitives:
            check(f"mesh {at}", "material", primitive.material)


def _first_problem(error: ValidationError) -> str:
    item = error.errors(include_url=False, include_input=False)[0]
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in item["loc"]).lstrip(".")
    said = item["msg"].removeprefix("Input ")
    return f"not glTF: {path}: {said[:1].lower()}{said[1:]}" if path else f"not glTF: {said}"
