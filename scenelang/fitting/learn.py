"""Files that users bring, made elements of a file that scenes import."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

from scenelang.cluster import GivenUp, by_workers
from scenelang.elements.element import Element
from scenelang.elements.zoo import MOST_BYTES, Zoo, read_zoo, zoo_bytes
from scenelang.files import NotWritten, output_place, read_regular, write_output
from scenelang.fitting.apart import CPU_S, LIBRARIES, Apart, Asked, Hear, made_apart
from scenelang.fitting.beside import files_beside
from scenelang.fitting.making import Wish
from scenelang.fitting.mesh import FitError
from scenelang.fitting.parts import MOST_OF, said
from scenelang.tensors import TensorError

Progress = Callable[[str, float, float], None]
Answers = Generator[tuple[int, Callable[[], bytes]], None, None]
"""Files by their places, in whatever order, and what gives what was made of one or raises why nothing was."""


def learn(
    files: Sequence[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    wish: Wish = Wish(),  # noqa: B008
    *,
    name: str | None = None,
    cluster: str | None = None,
    say: Callable[[str], None] = lambda line: None,
    progress: Progress = lambda what, done, total: None,
) -> list[Element]:
    """Make files elements of the file ``out``, beside those that it holds.

    It is written after each element, whole or not at all; what it holds already of an original and a wish is
    not made again. So work that was interrupted is taken up by asking for it again.

    Args:
        files, out, name, cluster, say: as for `scenelang.learn`, which raises the same.
        progress: is told what is done, how far it is and how far that goes.
    """
    names = names_of(files, wish, name)
    first = held = _writable(out)
    made: dict[int, Zoo] = {}
    troubles: dict[int, str] = {}

    @contextmanager
    def noted(index: int) -> Iterator[None]:
        """An error of one file does not stop the others."""
        try:
            yield
        except (FitError, GivenUp, TensorError) as error:
            troubles[index] = f"{files[index]}: {error}"
        except NotWritten:
            raise
        except OSError as error:
            troubles[index] = f"{files[index]}: {(error.strerror or str(error)).lower()}"

    def asked() -> Iterator[tuple[int, Asked]]:
        for index, (file, called) in enumerate(zip(map(Path, files), names, strict=True)):
            with noted(index):
                known = _named(held).get((called, wish.paints(file.suffix)))
                found = _request(file, called, wish, known)
                if isinstance(found, Element):
                    say(f"{called}: made before of this file")
                    groups = {called: held.groups[called]} if called in held.groups else {}
                    made[index] = replace(Zoo.of([found]), groups=groups)
                else:
                    yield index, found

    hear: dict[str, Hear] = {"say": say, "progress": progress}
    with closing(_by_workers(cluster, asked(), hear) if cluster else _here(asked(), hear)) as answers:
        for index, answer in answers:
            with noted(index):
                made[index] = read_zoo(answer())
                held = _written(out, first, [(names[at], made[at]) for at in sorted(made)])
            if cluster:
                progress("files", len(made) + len(troubles), len(files))
    if troubles:
        raise FitError("\n".join(troubles[index] for index in sorted(troubles)))
    return [element for index in sorted(made) for element in made[index].elements]


def _here(asked: Iterable[tuple[int, Asked]], hear: Mapping[str, Hear]) -> Answers:
    """What becomes of requests, one after another."""
    with Apart() as apart:
        for index, (request, data) in asked:
            hear["progress"](request["name"], 0.0, 1.0)
            yield index, partial(apart, request, data, hear)


def _by_workers(cluster: str, asked: Iterable[tuple[int, Asked]], hear: Mapping[str, Hear]) -> Answers:
    """What becomes of requests, several at a time and in any order."""

    def taken(answer: Callable[[], tuple[list[str], bytes | FitError]]) -> bytes:
        lines, found = answer()
        for line in lines:
            hear["say"](line)
        if isinstance(found, FitError):
            raise found
        return found

    for index, answer in by_workers(cluster, made_apart, asked, LIBRARIES):
        yield index, partial(taken, answer)


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


def _written(out: str | os.PathLike[str], held: Zoo, made: Iterable[tuple[str, Zoo]]) -> Zoo:
    """Write what was held and what was made, in place of what has the same names and of their groups.

    Raises:
        OSError: it cannot be written, or would be more than can be read.
    """
    elements, groups = _named(held), dict(held.groups)
    for name, zoo in made:
        groups.pop(name, None)
        elements, groups = elements | _named(zoo), groups | zoo.groups
    data = zoo_bytes(elements.values(), groups)
    try:
        found = read_zoo(data)
    except TensorError as error:
        raise NotWritten(errno.EFBIG, str(error), os.fspath(out)) from None
    write_output(out, data)
    return found


def _request(path: Path, name: str, wish: Wish, known: Element | None) -> Asked | Element:
    """What `Apart` is asked of a file, with its bytes, or what was made of it before."""
    suffix = path.suffix.lower()
    if suffix not in MOST_OF:
        raise FitError(f"not one of {', '.join(MOST_OF)}")
    data = read_regular(path, MOST_OF[suffix])
    if len(data) > MOST_OF[suffix]:
        raise FitError(f"more than {MOST_OF[suffix] >> 20:,} MiB")
    about = wish.about(path, data)
    if known is not None and wish.made(known, about):
        return known
    usual_s = CPU_S * (4 if wish.parts else 1)
    limit_s = max(usual_s, 2 * wish.budget_s) if wish.budget_s < 1e6 else usual_s
    request = {"name": name, "suffix": suffix, "wish": asdict(wish), "about": about, "cpu_s": limit_s}
    return {**request, "files": files_beside(data, suffix, path.parent)}, data
