"""Folders on the command line stand for the scenes in them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from typing import Final

SUFFIX: Final = ".nsg"


def named(paths: Iterable[str], lost: Callable[[OSError], None]) -> Iterator[str]:
    """The scenes of a command line; ``lost`` is told of folders that cannot be listed."""
    for path in paths:
        try:
            yield from scenes(path)
        except OSError as error:
            lost(error)


def scenes(path: str) -> Iterator[str]:
    """A file itself, ``-`` too, or the scenes of a folder by name; hidden ones and links are left out.

    Raises:
        OSError: a folder cannot be listed.
    """
    if not os.path.isdir(path):
        yield path
        return
    with os.scandir(path) as entries:
        found = sorted(entries, key=lambda entry: entry.name)
    for entry in found:
        if entry.name.startswith(".") or entry.is_symlink():
            continue
        if entry.is_dir():
            yield from scenes(entry.path)
        elif entry.name.endswith(SUFFIX) and entry.is_file():
            yield entry.path
