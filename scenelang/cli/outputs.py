"""Where pictures go: one file, or a folder of them. Everything is settled before any work."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from scenelang.animation.targets import is_animation
from scenelang.cli.inputs import stem_of

if TYPE_CHECKING:
    from scenelang.outputs import Output


def targets(names: Sequence[str], out: str) -> list[Path]:
    """The file that each scene is drawn to: ``out`` itself for one scene, else one in the folder ``out``.

    The folder is made if need be; for one scene it is one that is there, or ends in a slash.

    Raises:
        click.UsageError: no format has the suffix, two scenes have one name, or a file or link is in the way.
        OSError: the folder cannot be made.
    """
    from scenelang.image import image_format

    path = Path(out)
    if len(names) == 1 and not path.is_dir() and not out.endswith(("/", "\\")):
        try:
            image_format(path)
        except ValueError as error:
            advice = "a picture has a suffix such as .png, a folder ends in a slash"
            raise click.UsageError(f"cannot write `{out}`: {error if path.suffix else advice}.") from None
        if not path.parent.is_dir():
            raise click.UsageError(f"cannot write `{out}`: there is no folder `{path.parent}`.")
        return [path]
    if path.exists() and not path.is_dir():
        raise click.UsageError(f"`{out}` is a file; {len(names)} scenes need a folder.")
    if not path.exists() and not out.endswith(("/", "\\")):
        with suppress(ValueError):  # no format has the suffix
            what = "an animation" if is_animation(out) else "a picture"
            if what == "a picture":
                image_format(path)
            raise click.UsageError(f"`{out}` names {what}; {len(names)} scenes need a folder.")
    files = [composed(path / f"{stem_of(name)}.png") for name in names]
    owner: dict[str, str] = {}
    for name, file in zip(names, files, strict=True):
        first = owner.setdefault(file.name.casefold(), name)
        if first is not name:
            raise click.UsageError(f"`{first}` and `{name}` would both be drawn to `{file}`.")
    path.mkdir(parents=True, exist_ok=True)
    return files


def check_outputs(paths: Sequence[Path], wanted: Sequence[Output]) -> None:
    """Raise `click.UsageError` where outputs of pictures have no place, or a link is in it."""
    from scenelang.image import output_file

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
