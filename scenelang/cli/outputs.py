"""Where pictures go: one file, or a folder of them. Everything is settled before any work."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from scenelang.animation.targets import is_animation
from scenelang.cli.inputs import stem_of

if TYPE_CHECKING:
    from scenelang.outputs import Output

PAGE: Final = ".html"


def targets(names: Sequence[str], out: str, suffix: str = ".png") -> list[Path]:
    """The file that each scene is written to: ``out`` itself for one scene, else one in the folder ``out``.

    The folder is made if need be; for one scene it is one that is there, or ends in a slash.

    Args:
        suffix: of files in a folder: of a picture or of a page.

    Raises:
        click.UsageError: no format has the suffix, two scenes have one name, or a file or link is in the way.
        OSError: the folder cannot be made.
    """
    path = Path(out)
    what, fits = ("a page", page_format) if suffix == PAGE else ("a picture", _picture_format)
    if len(names) == 1 and not path.is_dir() and not out.endswith(("/", "\\")):
        try:
            fits(path)
        except ValueError as error:
            advice = f"{what} has a suffix such as {suffix}, a folder ends in a slash"
            raise click.UsageError(f"cannot write `{out}`: {error if path.suffix else advice}.") from None
        if not path.parent.is_dir():
            raise click.UsageError(f"cannot write `{out}`: there is no folder `{path.parent}`.")
        return [path]
    if path.exists() and not path.is_dir():
        raise click.UsageError(f"`{out}` is a file; {len(names)} scenes need a folder.")
    if not path.exists() and not out.endswith(("/", "\\")):
        with suppress(ValueError):  # no format has the suffix
            what = "an animation" if is_animation(out) else what
            if what != "an animation":
                fits(path)
            raise click.UsageError(f"`{out}` names {what}; {len(names)} scenes need a folder.")
    files = [composed(path / f"{stem_of(name)}{suffix}") for name in names]
    owner: dict[str, str] = {}
    for name, file in zip(names, files, strict=True):
        first = owner.setdefault(file.name.casefold(), name)
        if first is not name:
            raise click.UsageError(f"`{first}` and `{name}` would both be written to `{file}`.")
    path.mkdir(parents=True, exist_ok=True)
    return files


def page_format(path: Path) -> None:
    """Raise `ValueError` where a file is not called like a page."""
    if path.suffix.lower() not in (PAGE, ".htm"):
        raise ValueError(f"a page's file ends in {PAGE}")


def _picture_format(path: Path) -> None:
    from scenelang.image import image_format

    image_format(path)


def check_outputs(paths: Sequence[Path], wanted: Sequence[Output]) -> None:
    """Raise `click.UsageError` where outputs of pictures have no place, or a link is in it."""
    from scenelang.outputs import output_file

    try:
        for path in paths:
            for file in (output_file(path, name) for name in wanted):
                _ = file == path or composed(file)
    except ValueError as error:
        raise click.UsageError(f"{error}.") from None


def composed(file: Path) -> Path:
    """A file whose name no user wrote; raises `click.UsageError` for a link, which may lead anywhere."""
    if file.is_symlink():
        raise click.UsageError(f"`{file}` is a link; it is followed only where -o names it.")
    return file
