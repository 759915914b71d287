"""Files that users bring, made elements of a file that scenes import."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from scenelang.elements.element import Element
from scenelang.elements.zoo import MOST_BYTES, Zoo, read_zoo, zoo_bytes
from scenelang.files import NotWritten, output_place, read_regular, write_output
from scenelang.fitting.apart import CPU_S, Apart, Hear
from scenelang.fitting.beside import files_beside
from scenelang.fitting.making import MOST_OF, Wish
from scenelang.fitting.mesh import FitError
from scenelang.fitting.parts import said
from scenelang.tensors import TensorError

Progress = Callable[[str, float, float], None]


def learn(
    files: Sequence[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    wish: Wish = Wish(),  # noqa: B008
    *,
    name: str | None = None,
    say: Callable[[str], None] = lambda line: None,
    progress: Progress = lambda what, done, total: None,
) -> list[Element]:
    """Make files elements of the file ``out``, beside those that it holds.

    It is written after each element, whole or not at all; what it holds already of an original and a wish is
    not made again. So work that was interrupted is taken up by asking for it again.

    Args:
        files, out, name, say: as for `scenelang.learn`, which raises the same.
        progress: is told what is done, how far it is and how far that goes.
    """
    names = names_of(files, wish, name)
    held = _writable(out)
    made: list[Element] = []
    troubles = []
    hear: dict[str, Hear] = {"say": say, "progress": progress}
    with Apart() as apart:
        for file, called in zip(map(Path, files), names, strict=True):
            try:
                known = _named(held).get((called, wish.paints(file.suffix)))
                found = _learned(file, called, wish, known, apart, hear)
                if isinstance(found, Zoo):
                    held = _added(out, held, found, called)
                made += found.elements if isinstance(found, Zoo) else [found]
            except FitError as error:
                troubles.append(f"{file}: {error}")
            except NotWritten:
                raise
            except OSError as error:
                troubles.append(f"{file}: {(error.strerror or str(error)).lower()}")
    if troubles:
        raise FitError("\n".join(troubles))
    return made


def names_of(files: Sequence[str | os.PathLike[str]], wish: Wish, name: str | None = None) -> list[str]:
    """What elements of files are called, those of one file ``name``.

    Raises:
        ValueError: scenes cannot say a name, or it is that of two.
    """
    if name is not None and len(files) > 1:
        raise ValueError("a name is for one file")
    names = [_word(Path(file).stem) if name is None else name for file in files]
    owners: dict[tuple[str, bool], str | os.PathLike[str]] = {}
    for file, found in zip(files, names, strict=True):
        if not (found.isascii() and found.isidentifier()):
            raise ValueError(f"`{found}` is not a name; letters, digits and _ are, as --name says them")
        first = owners.setdefault((found, wish.paints(Path(file).suffix)), file)
        if first is not file:
            raise ValueError(f"`{first}` and `{file}` would both be `{found}`")
    return names


def _word(stem: str) -> str:
    """A file's name as an element's."""
    word = said(stem)
    return f"_{word}" if word[:1].isdigit() else word


def _writable(out: str | os.PathLike[str]) -> Zoo:
    """What a file of elements holds; found out before the work, as is whether its result has a place."""
    place = output_place(out)
    for path, right in ((place.parent, os.W_OK | os.X_OK), (place, os.W_OK)):
        if path != place or place.exists():
            if not path.exists():
                raise NotWritten(errno.ENOENT, f"there is no folder `{path}`", os.fspath(out))
            if not os.access(path, right):
                raise NotWritten(errno.EACCES, os.strerror(errno.EACCES), os.fspath(out))
    try:
        with open(place, "rb") as file:
            return read_zoo(file.read(MOST_BYTES + 1))
    except FileNotFoundError:
        return Zoo.of(())
    except TensorError as error:
        raise NotWritten(errno.EINVAL, f"it is not a file of elements: {error}", os.fspath(out)) from None


def _named(zoo: Zoo) -> dict[tuple[str, bool], Element]:
    """Elements by name and whether they are materials."""
    return {(element.name, element.material): element for element in zoo.elements}


def _added(out: str | os.PathLike[str], held: Zoo, made: Zoo, name: str) -> Zoo:
    """Write what was held and what was made of ``name``, in place of what has its names and of its group.

    Raises:
        OSError: it cannot be written, or would be more than can be read.
    """
    groups = {other: group for other, group in held.groups.items() if other != name} | made.groups
    data = zoo_bytes((_named(held) | _named(made)).values(), groups)
    try:
        zoo = read_zoo(data)
    except TensorError as error:
        raise NotWritten(errno.EFBIG, str(error), os.fspath(out)) from None
    write_output(out, data)
    return zoo


def _learned(
    path: Path, name: str, wish: Wish, known: Element | None, apart: Apart, hear: Mapping[str, Hear]
) -> Zoo | Element:
    """What a file brings, or what was made of it before."""
    suffix = path.suffix.lower()
    if suffix not in MOST_OF:
        raise FitError(f"not one of {', '.join(MOST_OF)}")
    data = read_regular(path, MOST_OF[suffix])
    if len(data) > MOST_OF[suffix]:
        raise FitError(f"more than {MOST_OF[suffix] >> 20:,} MiB")
    about = wish.about(path, data)
    if known is not None and wish.made(known, about):
        hear["say"](f"{name}: made before of this file")
        return known
    hear["progress"](name, 0.0, 1.0)
    request = {"name": name, "suffix": suffix, "wish": asdict(wish), "about": about}
    request["files"] = files_beside(data, suffix, path.parent)
    usual_s = CPU_S * (4 if wish.parts else 1)
    limit_s = max(usual_s, 2 * wish.budget_s) if wish.budget_s < 1e6 else usual_s
    made = apart({**request, "cpu_s": limit_s}, data, hear)
    return read_zoo(made)
