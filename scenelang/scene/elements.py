"""Files of elements that a Scene uses."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pydantic import Field, PrivateAttr

from scenelang.elements.element import Element
from scenelang.elements.zoo import Zoo, load_zoo
from scenelang.scene.fields import Frozen, Word
from scenelang.tensors import TensorError


@dataclass(slots=True)
class _Held:
    """What a file held when it was read; it is not part of the value, which the digest stands for."""

    zoo: Zoo | None = field(default=None, compare=False)


class Elements(Frozen):
    """A file of elements; objects have its geometries as ``name.geometry``."""

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

    def read(self, root: Path) -> tuple[str, str] | None:
        """Read the file, within a folder where its path begins; code and message if that fails."""
        try:
            place = (root / self.path).resolve()
            if not place.is_relative_to(root.resolve()):
                return "E0215", f"`{self.path}` lies outside the import root"
            zoo = load_zoo(place)
        except TensorError as error:
            return "E0217", f"`{self.path}` is not a file of elements: {error}"
        except (OSError, ValueError) as error:
            reason = (getattr(error, "strerror", None) or str(error)).lower()
            return "E0214", f"cannot read `{self.path}`: {reason}"
        if zoo.digest != self.digest:
            return "E0217", f"`{self.path}` is not the file that the scene was made with"
        self._held.zoo = zoo
        return None


def elements_of(files: tuple[Elements, ...]) -> dict[str, Element | None]:
    """All elements of files by the names that objects have them by; the bare names of files not read."""
    found: dict[str, Element | None] = {}
    for file in files:
        if file.zoo is None:
            found[file.name] = None
        else:
            found |= {f"{file.name}.{name}": element for name, element in file.zoo.geometries.items()}
    return found


def load_elements(path: str | Path, name: str | None = None) -> Elements:
    """Read a file of elements for a Scene.

    Args:
        path: the file.
        name: what objects have before the dot; by default the file's, without its suffix.

    Raises:
        OSError: it cannot be read.
        TensorError: it is damaged, or no such file.
        ValueError: its name is not one that objects can have: give another.
    """
    return Elements.of(Path(path).stem if name is None else name, str(path), load_zoo(path))
