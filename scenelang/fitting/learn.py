"""Files that users bring, made elements of a file that scenes import."""

from __future__ import annotations

import errno
import hashlib
import math
import os
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from scenelang.elements.element import TEXELS, Element
from scenelang.elements.zoo import MOST_BYTES, is_said, read_zoo, zoo_bytes
from scenelang.files import NotWritten, output_place, read_regular, write_output
from scenelang.fitting import mesh, outline, picture
from scenelang.fitting.ladder import NEAR, Rung, fit
from scenelang.fitting.mesh import FitError, Sign
from scenelang.tensors import TensorError

MOST_OF: Final = {**mesh.MOST_OF, **outline.MOST_OF, **picture.MOST_OF}
"""Bytes of a file, by the suffixes that are read."""
Progress = Callable[[str, float, float], None]


@dataclass(frozen=True, slots=True)
class Wish:
    """How elements are to be made.

    Args:
        sign: what tells inside of a mesh.
        max_error: mean distance off that is near enough, in leaf units, `NEAR` if left out; of textures root
            mean square off of channels in [0, 1], `NEAR_COLOUR` if left out.
        budget_s: for each file; nothing new is begun after it.
        steps: forms that are tried at most, whatever the time; the same number gives the same bytes.
        license: of the originals.
        source: where they are from.
        pictures: what they become.
        texels: most of a texture along its longer side.
    """

    sign: Sign = "auto"
    max_error: float | None = None
    budget_s: float = math.inf
    steps: int | None = None
    license: str | None = None
    source: str | None = None
    pictures: Literal["texture", "outline"] = "texture"
    texels: int = TEXELS

    def __post_init__(self) -> None:
        for text in (self.license, self.source):
            if text is not None and not is_said(text):
                raise ValueError("a license or a source is at most 2,000 characters, all of them printable")

    def about(self, original: Path, data: bytes) -> dict[str, str | float]:
        """What an element says of where it is from; of one file and one wish it is the same."""
        name = "".join(c if c.isprintable() else "?" for c in original.name)
        said = {"license": self.license, "source": self.source, "original": name}
        said |= {"sha256": hashlib.sha256(data).hexdigest()}
        asked = {"sign": None if self.sign == "auto" else self.sign, "max_error": self.max_error}
        asked |= {"texels": None if self.texels == TEXELS else self.texels}
        return {key: value for key, value in (said | asked).items() if value is not None}

    def paints(self, suffix: str) -> bool:
        """Whether files of a suffix become textures."""
        return self.pictures == "texture" and suffix.lower() in picture.MOST_OF

    def made(self, element: Element, about: dict[str, str | float]) -> bool:
        """Whether an element is what would be made again."""
        said = element.about
        ended = said.get("ended") != "steps" or said.get("steps") == self.steps
        return ended and about.items() <= said.items() and not said.keys() & ASKED - about.keys()


ASKED: Final = frozenset(("license", "source", "sign", "max_error", "texels"))


def learn(
    files: Sequence[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    wish: Wish = Wish(),
    *,
    name: str | None = None,
    say: Callable[[str], None] = lambda line: None,
    progress: Progress = lambda what, done, total: None,
) -> list[Element]:
    """Make files elements of the file ``out``, beside those that it holds.

    It is written after each element, whole or not at all; what it holds already of an original and a wish is
    not made again. So work that was interrupted is taken up by asking for it again.

    Args:
        files: meshes, drawings and pictures.
        name: of the one element; by default that of the file.
        say: is told in lines what is found and tried.
        progress: is told what is done, how far it is and how far that goes.

    Raises:
        OSError: ``out`` cannot be read or written.
        FitError: files cannot be made elements, a line for each; the others were.
        ValueError: names that scenes cannot say, or twice the same.
    """
    names = names_of(files, name)
    _writable(out)
    made: list[Element] = []
    troubles = []
    for file, called in zip(map(Path, files), names, strict=True):
        try:
            known = read_elements(out).get((called, wish.paints(file.suffix)))
            element, found = _learned(file, called, wish, known, say, progress)
            if found:
                add_elements(out, [element])
            made.append(element)
        except FitError as error:
            troubles.append(f"{file}: {error}")
        except NotWritten:
            raise
        except OSError as error:
            troubles.append(f"{file}: {(error.strerror or str(error)).lower()}")
    if troubles:
        raise FitError("\n".join(troubles))
    return made


def names_of(files: Sequence[str | os.PathLike[str]], name: str | None = None) -> list[str]:
    """What elements of files are called, those of one file ``name``.

    Raises:
        ValueError: scenes cannot say a name, or it is that of two.
    """
    if name is not None and len(files) > 1:
        raise ValueError("a name is for one file")
    names = [_word(Path(file).stem) if name is None else name for file in files]
    for at, found in enumerate(names):
        if not (found.isascii() and found.isidentifier()):
            raise ValueError(f"`{found}` is not a name; letters, digits and _ are, as --name says them")
        if found in names[:at]:
            raise ValueError(f"`{files[names.index(found)]}` and `{files[at]}` would both be `{found}`")
    return names


def _word(stem: str) -> str:
    """A file's name as an element's."""
    word = "".join(c if c.isascii() and c.isalnum() else "_" for c in stem).strip("_")
    return f"_{word}" if word[:1].isdigit() else word


def _writable(out: str | os.PathLike[str]) -> None:
    """Find out before the work whether its result has a place, and whether it is one."""
    place = output_place(out)
    for path, right in ((place.parent, os.W_OK | os.X_OK), (place, os.W_OK)):
        if path != place or place.exists():
            if not path.exists():
                raise NotWritten(errno.ENOENT, f"there is no folder `{path}`", os.fspath(out))
            if not os.access(path, right):
                raise NotWritten(errno.EACCES, os.strerror(errno.EACCES), os.fspath(out))
    read_elements(out)


def read_elements(out: str | os.PathLike[str]) -> dict[tuple[str, bool], Element]:
    """What a file of elements holds that is to be written again, by name and whether it is a material.

    Raises:
        OSError: it cannot be read, or is something else.
    """
    try:
        with open(out, "rb") as file:
            return _named(read_zoo(file.read(MOST_BYTES + 1)).elements)
    except FileNotFoundError:
        return {}
    except TensorError as error:
        raise NotWritten(errno.EINVAL, f"it is not a file of elements: {error}", os.fspath(out)) from None


def _named(elements: Iterable[Element]) -> dict[tuple[str, bool], Element]:
    return {(element.name, element.material): element for element in elements}


def add_elements(out: str | os.PathLike[str], made: Sequence[Element]) -> None:
    """Put elements into a file, in place of the geometries and materials of their names, whole or not at all.

    Raises:
        OSError: it cannot be written, or would be more than can be read.
    """
    data = zoo_bytes((read_elements(out) | _named(made)).values())
    try:
        read_zoo(data)
    except TensorError as error:
        raise NotWritten(errno.EFBIG, str(error), os.fspath(out)) from None
    write_output(out, data)


def _learned(
    path: Path, name: str, wish: Wish, known: Element | None, say: Callable[[str], None], progress: Progress
) -> tuple[Element, bool]:
    """The element of a file, and whether it is new."""
    started, suffix = time.monotonic(), path.suffix.lower()
    if suffix not in MOST_OF:
        raise FitError(f"not one of {', '.join(MOST_OF)}")
    data = read_regular(path, MOST_OF[suffix])
    if len(data) > MOST_OF[suffix]:
        raise FitError(f"more than {MOST_OF[suffix] >> 20:,} MiB")
    about = wish.about(path, data)
    if known is not None and wish.made(known, about):
        say(f"{name}: made before of this file")
        return known, False
    progress(name, 0.0, 1.0)
    if wish.paints(suffix):
        return _texture(data, name, wish, about, started, say), True
    flat = suffix in outline.MOST_OF
    shape = outline.read_outline(data, suffix) if flat else mesh.read_mesh(data, suffix, wish.sign)
    say(f"{name}: {', '.join(shape.notes)}")

    def tell(rung: Rung) -> None:
        say(
            f"  {rung.side:>4} a side {rung.bytes:>8,} bytes  error {rung.error:.5f}  "
            f"1 in 100 {rung.worst:.4f}  normals {rung.normal_deg:.1f}°"
        )

    element, tried = fit(
        shape,
        name,
        max_error=wish.max_error,
        budget_s=wish.budget_s - (time.monotonic() - started),
        steps=wish.steps,
        about=about,
        report=tell,
        progress=lambda side, share: progress(f"{name}, {side} a side", share, 1.0),
    )
    off, asked = float(element.about["error"]), wish.max_error or NEAR[shape.dimension]
    short = "" if off <= asked else f", where {asked:g} was asked"
    shown = f"{element.sides[-1]} distances a side, {len(element.data):,} bytes, error {off:.5f}{short}"
    say(f"{name}: {shown}; {len(tried)} grids tried")
    return element, True


def _texture(
    data: bytes,
    name: str,
    wish: Wish,
    about: dict[str, str | float],
    started: float,
    say: Callable[[str], None],
) -> Element:
    """The element of a picture."""
    found = picture.read_picture(data, wish.texels)
    say(f"{name}: {', '.join(found.notes)}")
    element, tried = picture.fit_picture(
        found,
        name,
        max_error=wish.max_error,
        budget_s=wish.budget_s - (time.monotonic() - started),
        steps=wish.steps,
        about=about,
        report=lambda coded: say(f"  {coded.form:>12} {coded.bytes:>8,} bytes  error {coded.error:.4f}"),
    )
    height, width = element.sizes
    shown = f"{width} × {height} texels, {len(element.data):,} bytes, error {element.about['error']:.4f}"
    say(f"{name}: {shown}; {len(tried)} forms tried")
    return element
