"""What becomes of the bytes of an original, and what may be asked of it."""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

from scenelang.elements.element import TEXELS, Element
from scenelang.elements.zoo import is_said, zoo_bytes
from scenelang.fitting import mesh, outline, picture
from scenelang.fitting.ladder import NEAR, Rung, fit
from scenelang.fitting.mesh import Sign

MOST_OF: Final = {**mesh.MOST_OF, **outline.MOST_OF, **picture.MOST_OF}
"""Bytes of a file, by the suffixes that are read."""


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


def make(request: Mapping[str, Any], data: bytes, tell: Callable[..., None]) -> bytes:
    """The file of what becomes of an original's bytes, in the process that is kept apart.

    Args:
        request: its ``suffix``, the ``name`` of the element, what it says ``about`` itself, the ``wish``.
        tell: called with ``say`` and a line, and ``progress`` and how far what is.

    Raises:
        FitError: nothing does.
    """
    wish, suffix = Wish(**request["wish"]), request["suffix"]
    end_s = time.monotonic() + wish.budget_s
    kind = _texture if wish.paints(suffix) else _shape
    return zoo_bytes([kind(data, suffix, request["name"], wish, request["about"], end_s, tell)])


def _shape(
    data: bytes,
    suffix: str,
    name: str,
    wish: Wish,
    about: dict[str, str | float],
    end_s: float,
    tell: Callable[..., None],
) -> Element:
    """The element of a mesh or an outline."""
    flat = suffix in outline.MOST_OF
    shape = outline.read_outline(data, suffix) if flat else mesh.read_mesh(data, suffix, wish.sign)
    tell("say", f"{name}: {', '.join(shape.notes)}")

    def report(rung: Rung) -> None:
        tell(
            "say",
            f"  {rung.side:>4} a side {rung.bytes:>8,} bytes  error {rung.error:.5f}  "
            f"1 in 100 {rung.worst:.4f}  normals {rung.normal_deg:.1f}°",
        )

    element, tried = fit(
        shape,
        name,
        max_error=wish.max_error,
        budget_s=end_s - time.monotonic(),
        steps=wish.steps,
        about=about,
        report=report,
        progress=lambda side, share: tell("progress", f"{name}, {side} a side", share, 1.0),
    )
    off, asked = float(element.about["error"]), wish.max_error or NEAR[shape.dimension]
    short = "" if off <= asked else f", where {asked:g} was asked"
    shown = f"{element.sides[-1]} distances a side, {len(element.data):,} bytes, error {off:.5f}{short}"
    tell("say", f"{name}: {shown}; {len(tried)} grids tried")
    return element


def _texture(
    data: bytes,
    suffix: str,
    name: str,
    wish: Wish,
    about: dict[str, str | float],
    end_s: float,
    tell: Callable[..., None],
) -> Element:
    """The element of a picture."""
    found = picture.read_picture(data, wish.texels)
    tell("say", f"{name}: {', '.join(found.notes)}")
    element, tried = picture.fit_picture(
        found,
        name,
        max_error=wish.max_error,
        budget_s=end_s - time.monotonic(),
        steps=wish.steps,
        about=about,
        report=lambda coded: tell(
            "say", f"  {coded.form:>12} {coded.bytes:>8,} bytes  error {coded.error:.4f}"
        ),
    )
    height, width = element.sizes
    shown = f"{width} × {height} texels, {len(element.data):,} bytes, error {element.about['error']:.4f}"
    tell("say", f"{name}: {shown}; {len(tried)} forms tried")
    return element
