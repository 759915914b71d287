"""Contents of a Scene: settings, files of elements, ready groups and nodes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Self

from pydantic import Field, PrivateAttr

from scenelang.assets.element import Element, Part
from scenelang.assets.tensors import TensorError
from scenelang.assets.zoo import Zoo, load_zoo
from scenelang.language import library
from scenelang.language.diagnostics import listing
from scenelang.language.nodes import (
    EITHER,
    STATED,
    Animation,
    Camera,
    Color,
    Frozen,
    Ground,
    Group,
    Light,
    Material,
    Matrix,
    Object,
    Opaque,
    Pixels,
    Scale,
    SceneNode,
    Transform,
    Translate,
    Unsaid,
    Version,
    Word,
)


def objects_of(zoo: Zoo, file: str, name: str) -> tuple[Object, ...]:
    """The parts of a group in their places and looks, in order of painting.

    Args:
        file: what a Scene calls the file.

    Raises:
        KeyError: there is no such group.
    """
    if name not in zoo.groups:
        raise KeyError(f"`{file}` has no group `{name}`; it has {listing(zoo.groups) or 'none'}")
    return tuple(
        Object(
            f"{file}.{part.geometry}",
            _moves(part),
            _look(part, file, "flat" if zoo.geometries[part.geometry].dimension == 2 else "diffuse"),
        )
        for part in zoo.groups[name]
    )


def _moves(part: Part) -> tuple[Transform, ...]:
    moves: list[Transform] = []
    if part.turn:
        rows = [[*row, *[0.0] * (4 - len(row))] for row in part.turn]
        rows += [[float(k == at) for k in range(4)] for at in range(len(rows), 4)]
        moves.append(Matrix(tuple(tuple(row) for row in rows)))
    if part.size != 1.0:
        moves.append(Scale(part.size))
    if any(part.place):
        moves.append(Translate(*part.place))
    return tuple(moves)


def _look(part: Part, file: str, plain: str) -> Material | None:
    if part.material:
        return Material(f"{file}.{part.material}")
    return Material(plain, Color(part.color)) if part.color else None


@dataclass(slots=True)
class _Held:
    """Contents of a file when it was read; not part of the value, which the digest identifies."""

    zoo: Zoo | None = field(default=None, compare=False)


class Elements(Frozen):
    """A file of elements; objects have its geometries as ``name.geometry``, and its materials likewise."""

    name: Word
    path: Annotated[
        str, Field(pattern=r'^[^"\\\x00-\x1f]+$', description="of the file, from the scene's folder")
    ]
    digest: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$", description="SHA-256 of the file")]
    _held: _Held = PrivateAttr(default_factory=_Held)

    if TYPE_CHECKING:

        def __init__(self, name: str, path: str, digest: str) -> None: ...

    @staticmethod
    def of(name: str, path: str, zoo: Zoo) -> Elements:
        """A file that has been read."""
        elements = Elements(name, path, zoo.digest)
        elements._held.zoo = zoo
        return elements

    @property
    def zoo(self) -> Zoo | None:
        """Contents of the file; None where it has not been read."""
        return self._held.zoo

    def group(self, name: str) -> Group | Object:
        """A ready group: its parts in their places and looks; of one part that alone.

        Raises:
            KeyError: the file has no such group, or has not been read.
        """
        if self.zoo is None:
            raise KeyError(f"`{self.path}` has not been read")
        objects = objects_of(self.zoo, self.name, name)
        return objects[0] if len(objects) == 1 else Group(objects)

    def read(self, root: Path) -> tuple[str, str] | None:
        """Read the file, within a folder where its path begins; code and message if that fails."""
        try:
            place = library.find(self.path) or (root / self.path).resolve()
            if not library.owns(place) and not place.is_relative_to(root.resolve()):
                return "E0215", f"`{self.path}` lies outside the import root"
            zoo = load_zoo(place)
        except TensorError as error:
            return "E0217", f"`{self.path}` is not a file of elements: {error}"
        except (OSError, RuntimeError, ValueError) as error:
            reason = (getattr(error, "strerror", None) or str(error)).lower()
            return "E0214", f"cannot read `{self.path}`: {reason}"
        if zoo.digest != self.digest and not library.owns(place):  # what ships is mended at times
            return "E0217", f"`{self.path}` is not the file that the scene was made with"
        self._held.zoo = zoo
        return None


class Brought(NamedTuple):
    """Elements by the names that scenes have them by."""

    geometries: dict[str, Element]
    materials: dict[str, Element]
    unread: frozenset[str]  # names of files that have not been read

    @staticmethod
    def of(files: tuple[Elements, ...]) -> Brought:
        """All elements of files."""
        zoos = [(file.name, file.zoo) for file in files if file.zoo is not None]
        return Brought(
            {f"{name}.{key}": element for name, zoo in zoos for key, element in zoo.geometries.items()},
            {f"{name}.{key}": element for name, zoo in zoos for key, element in zoo.materials.items()},
            frozenset(file.name for file in files if file.zoo is None),
        )


def load_elements(path: str | Path, name: str | None = None) -> Elements:
    """Read a file of elements for a Scene.

    Args:
        path: the file, or one that ships: ``"std/meshes"``.
        name: what objects have before the dot; by default the file's, without its suffix.

    Raises:
        OSError: it cannot be read.
        TensorError: it is damaged, or no such file.
        ValueError: its name is not one that objects can have: give another.
    """
    zoo = load_zoo(library.find(str(path)) or path)
    return Elements.of(Path(path).stem if name is None else name, str(path), zoo)


class SceneData(Frozen):
    """Fields of a `Scene`."""

    version: Version = 1
    model: Annotated[
        str | None,
        Field(
            pattern=r'^[^"\\\x00-\x1f]+$',
            description="the model to draw with; null: the usual one",
        ),
    ] = None
    canvas: Annotated[tuple[Pixels, Pixels], Field(description="width and height in pixels")] = (256, 256)
    background: Annotated[
        Annotated[Opaque | None, STATED] | Unsaid,
        EITHER,
        Field(description="default: white in 2D, the sky in 3D; null: an image with alpha"),
    ] = "default"
    camera: Annotated[Annotated[Camera, STATED] | Unsaid, EITHER, Field(description="3D")] = "default"
    light: Annotated[Annotated[Light, STATED] | Unsaid, EITHER, Field(description="3D")] = "default"
    ground: Annotated[
        Annotated[Ground | None, STATED] | Unsaid, EITHER, Field(description="3D; null: without one")
    ] = "default"
    animation: Annotated[
        Animation | None, Field(description="the animation that this Scene is one frame of")
    ] = None
    elements: Annotated[tuple[Elements, ...], Field(description="files of elements")] = ()
    nodes: Annotated[tuple[SceneNode, ...], Field(description="a union, the last on top")] = ()

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            version: Literal[1] = 1,
            model: str | None = None,
            canvas: tuple[int, int] = (256, 256),
            background: tuple[float, float, float] | str | None = "default",
            camera: Camera | Unsaid = "default",
            light: Light | Unsaid = "default",
            ground: Ground | Unsaid | None = "default",
            animation: Animation | None = None,
            elements: Iterable[Elements] | Elements = (),
            nodes: Iterable[SceneNode] | SceneNode = (),
        ) -> None: ...

    @classmethod
    def _arranged(cls, args: tuple[Any, ...], data: dict[str, Any]) -> dict[str, Any]:
        if args:
            raise TypeError(f"Scene takes its arguments by name: {', '.join(cls._names())}")
        return super()._arranged(args, data)

    def sized(self, size: tuple[int, int]) -> Self:
        """The same scene on a canvas of that width and height in pixels.

        Raises:
            ValueError: not two numbers from 1 to 8192.
        """
        canvas = type(self)(canvas=size).canvas
        return self.model_copy(update={"canvas": canvas})

    def of_model(self, model: str | None) -> Self:
        """The same scene for a model of that name; itself where there is none."""
        return self if model in (None, self.model) else self.model_copy(update={"model": model})
