"""Files of elements that a Scene uses."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

from pydantic import Field, PrivateAttr

from scenelang.elements.element import Element
from scenelang.elements.zoo import Zoo, load_zoo
from scenelang.scene import library
from scenelang.scene.fields import Frozen, Word
from scenelang.scene.groups import objects_of
from scenelang.scene.nodes import Group, Object
from scenelang.tensors import TensorError


@dataclass(slots=True)
class _Held:
    """What a file held when it was read; it is not part of the value, which the digest stands for."""

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
        made = Elements(name, path, zoo.digest)
        made._held.zoo = zoo
        return made

    @property
    def zoo(self) -> Zoo | None:
        """What is in the file; None where it has not been read."""
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
