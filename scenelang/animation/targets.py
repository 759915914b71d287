"""What the name of an output asks for."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

Kind = Literal["sequence", "gif", "webp", "apng", "video"]

_VIDEO: Final[dict[str, Kind]] = dict.fromkeys((".mp4", ".m4v", ".mov", ".mkv", ".webm"), "video")
ENCODED: Final[dict[str, Kind]] = {".gif": "gif", ".webp": "webp", ".apng": "apng", **_VIDEO}
PICTURES: Final = frozenset({".gif", ".webp", ".apng"})
"""Suffixes of animations that hold a single picture as well."""
_NUMBER: Final = re.compile(r"%(0?\d{0,2})d")


class TargetError(ValueError):
    """A name that says nothing about the format, or cannot be written."""


@dataclass(frozen=True, slots=True)
class Target:
    """Where an animation goes."""

    kind: Kind  # how
    path: Path  # the file; for a sequence the folder of its files
    pattern: str = ""  # name of each file of a sequence, with `%04d` for its number

    def file(self, frame: int) -> Path:
        """The file of a frame of a sequence."""
        parts = self.pattern.split("%%")
        filled = [_NUMBER.sub(lambda found: f"{frame:{found[1] or 'd'}}", part) for part in parts]
        return self.path / "%".join(filled)

    def there(self) -> list[Path]:
        """Files of a sequence, of any number, that are there."""
        number = 1_234_567_890
        head, tail = self.file(number).name.split(str(number))
        named = re.compile(rf"{re.escape(head)}\d+{re.escape(tail)}")
        return [path for path in self.path.iterdir() if named.fullmatch(path.name)]

    @property
    def work(self) -> Path:
        """The folder beside it where frames are kept while it is made."""
        if self.kind == "sequence":
            return self.path / f".{self.pattern}.frames"
        return self.path.parent / f".{self.path.name}.frames"


def is_pattern(out: str) -> bool:
    """Whether a name has a place for a number: ``frame-%04d.png``."""
    return "%" in Path(out).name and _NUMBER.search(Path(out).name.replace("%%", "")) is not None


def is_animation(out: str) -> bool:
    """Whether a name asks for an animation if the scene is one."""
    return is_pattern(out) or Path(out).suffix.lower() in ENCODED


def find_target(out: str, stem: str = "frame") -> Target:
    """What ``out`` asks for: a file with one of the suffixes of `ENCODED`, a pattern, or a folder.

    The files in a folder start with ``stem``. Raises `TargetError` where the name fits none of these, or its
    folder is not there.
    """
    path = Path(out)
    if is_pattern(out):
        from scenelang.image import image_format

        bare = path.name.replace("%%", "")
        if len(_NUMBER.findall(bare)) != 1 or "%" in _NUMBER.sub("", bare):
            raise TargetError(
                f"`{path.name}` has more than one place for a number, or a stray `%` (write %%)"
            )
        try:
            image_format(path)
        except ValueError as error:
            raise TargetError(str(error)) from None
        _check_folder(path.parent, out)
        return Target("sequence", path.parent, path.name)
    if out.endswith(("/", "\\")) or path.is_dir():
        if path.exists() and not path.is_dir():
            raise TargetError(f"`{out}` is a file")
        return Target("sequence", path, f"{stem.replace('%', '%%')}-%04d.png")
    kind = ENCODED.get(path.suffix.lower())
    if kind is None:
        raise TargetError(
            f"`{out}` holds one picture; an animation goes to a file with one of the suffixes "
            f"{', '.join(ENCODED)}, to "
            "numbered pictures such as frame-%04d.png, or to a folder, which ends in a slash"
        )
    _check_folder(path.parent, out)
    return Target(kind, path)


def _check_folder(folder: Path, out: str) -> None:
    if not folder.is_dir():
        raise TargetError(f"cannot write `{out}`: there is no folder `{folder}`")
