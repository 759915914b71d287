"""Names of files on the command line: scenes in folders, and where results go; imports nothing heavy."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from scenelang.assets.files import write_output
from scenelang.cli.main import describe
from scenelang.cli.say import STDOUT, say_trouble

if TYPE_CHECKING:
    from scenelang.drawing.image import Output

STDIN: Final = "-"
SCENE, PROGRAM, PAGE = ".nsg", ".safetensors", ".html"
HERE: Final = os.path.join(".", "")
DRAWING: Final = ".svg"
SHAPES: Final = (DRAWING, ".stl", ".glb", ".ply", ".obj")  # what holds outlines or a surface, no pixels
WRITES: Final = {
    PAGE: "export",
    ".htm": "export",
    PROGRAM: "compile",
}  # commands, by suffixes that they alone write


def scenes_of(paths: Iterable[str]) -> tuple[list[str], bool]:
    """The scenes that paths name: files, ``-`` too, and those in folders by name; no hidden ones or links.

    False where a folder cannot be listed or there are none, after a report.
    """
    lost: list[OSError] = []
    names = list(_walk(paths, lost))
    for error in lost:
        say_trouble(describe(error))
    if not names and not lost:
        say_trouble(f"no scenes (*{SCENE}) there")
    return names, bool(names) and not lost


def _walk(paths: Iterable[str], lost: list[OSError]) -> Iterator[str]:
    for path in paths:
        if not os.path.isdir(path):
            yield path
            continue
        try:
            with os.scandir(path) as entries:
                shown = sorted(entries, key=lambda entry: entry.name)
        except OSError as error:
            lost.append(error)
            continue
        shown = [entry for entry in shown if not (entry.name.startswith(".") or entry.is_symlink())]
        inner = [
            e.path.removeprefix(HERE) for e in shown if e.is_dir() or (e.name.endswith(SCENE) and e.is_file())
        ]
        yield from _walk(inner, lost)


def streamed(ctx: click.Context, out: str, suffix: str) -> str:
    """The file to write where ``out`` is standard output, a pipe or a device, to which it is handed on whole.

    Any other ``out`` unchanged. Raises `click.UsageError` for standard output that is a terminal.
    """
    if out not in STDOUT and (not os.path.exists(out) or os.path.isfile(out) or os.path.isdir(out)):
        return out
    if out in STDOUT and sys.stdout.isatty():
        raise click.UsageError("standard output is a terminal, which shows no such data; name a file.")
    file = Path(ctx.with_resource(tempfile.TemporaryDirectory()), f"stdout{suffix}")
    ctx.meta[str(file)] = "standard output" if out in STDOUT else out

    @ctx.call_on_close
    def hand_on() -> None:
        if file.exists():
            data = file.read_bytes()
            click.echo(data, nl=False) if out in STDOUT else write_output(out, data)

    return str(file)


def shown(path: str | os.PathLike[str]) -> str:
    """The name of an output in messages: a stream's own in place of the file that is handed on to it."""
    name = os.fspath(path)
    return str(click.get_current_context().meta.get(name, name))


def stem_of(name: str) -> str:
    """The stem of names of files that are made from a scene."""
    return "stdin" if name == STDIN else Path(name).stem


def targets(names: Sequence[str], out: str, suffix: str = ".png") -> list[Path]:
    """The file that each scene is written to: ``out`` itself for one scene, else one in the folder ``out``.

    The folder is created if need be, its files have the suffix; for one scene it exists or ends in a slash.
    Raises `click.UsageError`: no format has the suffix, two scenes have one name, or something is in the way.
    """
    path = Path(out)
    what = "a page" if suffix == PAGE else "a picture"
    if len(names) == 1 and not path.is_dir() and not out.endswith(("/", "\\")):
        try:
            _check_format(path, suffix)
        except ValueError as error:
            advice = f"{what} has a suffix such as {suffix}, a folder ends in a slash"
            if path.suffix:
                other = "render" if suffix == PAGE else WRITES.get(path.suffix.lower())
                advice = f"{error}" + f"; `scenelang {other}` writes other files" * bool(other)
            raise click.UsageError(f"cannot write `{shown(out)}`: {advice}.") from None
        if not path.parent.is_dir():
            raise click.UsageError(f"cannot write `{out}`: there is no folder `{path.parent}`.")
        return [path]
    if path.exists() and not path.is_dir():
        raise click.UsageError(f"`{out}` is a file; {len(names)} scenes need a folder.")
    if not path.exists() and not out.endswith(("/", "\\")):
        from scenelang.output.frames import is_animation

        with suppress(ValueError):  # no format has the suffix
            what = "an animation" if is_animation(out) else what
            if what != "an animation":
                _check_format(path, suffix)
            raise click.UsageError(f"`{shown(out)}` names {what}; {len(names)} scenes need a folder.")
    files = [composed(path / f"{stem_of(name)}{suffix}") for name in names]
    owner: dict[str, str] = {}
    for name, file in zip(names, files, strict=True):
        first = owner.setdefault(file.name.casefold(), name)
        if first is not name:
            raise click.UsageError(f"`{first}` and `{name}` would both be written to `{file}`.")
    path.mkdir(parents=True, exist_ok=True)
    return files


def _check_format(path: Path, suffix: str) -> None:
    """Raise `ValueError` where a file is not called like a page or a picture."""
    if suffix != PAGE:
        from scenelang.drawing.image import image_format

        image_format(path)
    elif path.suffix.lower() not in (PAGE, ".htm"):
        raise ValueError(f"a page's file ends in {PAGE}")


def check_outputs(paths: Iterable[Path], wanted: Sequence[Output]) -> None:
    """Raise `click.UsageError` where outputs of pictures have no place, or a link is in it."""
    from scenelang.drawing.image import output_file

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
