"""Folders on the command line stand for the scenes in them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from typing import Final

SUFFIX: Final = ".nsg"


def named(paths: Iterable[str], lost: Callable[[OSError], None]) -> Iterator[str]:
    """The scenes of a command line: files, ``-`` too, and those in folders by name; no hidden ones or links.

    ``lost`` is told of folders that cannot be listed.
    """
    for path in paths:
        if not os.path.isdir(path):
            yield path
            continue
        try:
            with os.scandir(path) as entries:
                found = sorted(entries, key=lambda entry: entry.name)
        except OSError as error:
            lost(error)
            continue
        shown = [entry for entry in found if not (entry.name.startswith(".") or entry.is_symlink())]
        inside = [e.path for e in shown if e.is_dir() or (e.name.endswith(SUFFIX) and e.is_file())]
        yield from named(inside, lost)
