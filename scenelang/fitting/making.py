"""What becomes of the bytes of an original, and what may be asked of it."""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

from scenelang.diagnostics.suggest import plural
from scenelang.elements.element import TEXELS, Element
from scenelang.elements.zoo import is_said, zoo_bytes
from scenelang.fitting import parts, picture
from scenelang.fitting.colours import fit_colours
from scenelang.fitting.ladder import NEAR, THIN, Rung, fit
from scenelang.fitting.mesh import FitError, Mesh, Shape, Sign

SEEN: Final = 960  # pixels across which a solid is thought of, to say how small its details may be
COARSER: Final = 2.0  # times as far as the whole a part may be off, in its own radii


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
        parts: whether those of a file are elements of their own; if left out, those of drawings are.
        color_error: root mean square off of a mesh's colours that is near enough, of channels in [0, 1];
            `scenelang.fitting.colours.NEAR` if left out.
    """

    sign: Sign = "auto"
    max_error: float | None = None
    budget_s: float = math.inf
    steps: int | None = None
    license: str | None = None
    source: str | None = None
    pictures: Literal["texture", "outline"] = "texture"
    texels: int = TEXELS
    parts: bool | None = None
    color_error: float | None = None

    def __post_init__(self) -> None:
        for text in (self.license, self.source):
            if text is not None and not is_said(text):
                raise ValueError("a license or a source is at most 2,000 characters, all of them printable")

    def about(self, original: Path, data: bytes) -> dict[str, str | float]:
        """What an element says of where it is from; of one file and one wish it is the same."""
        name = "".join(c if c.isprintable() else "?" for c in original.name)
        said = {"license": self.license, "source": self.source, "original": name}
        said |= {"sha256": hashlib.sha256(data).hexdigest()}
        asked: dict[str, str | float | None]
        asked = {"sign": None if self.sign == "auto" else self.sign, "max_error": self.max_error}
        asked |= {"texels": None if self.texels == TEXELS else self.texels, "color_error": self.color_error}
        asked |= {"parts": None if self.parts is None else "apart" if self.parts else "together"}
        return {key: value for key, value in (said | asked).items() if value is not None}

    def paints(self, suffix: str) -> bool:
        """Whether files of a suffix become textures."""
        return self.pictures == "texture" and suffix.lower() in picture.MOST_OF_PICTURE

    def made(self, element: Element, about: dict[str, str | float]) -> bool:
        """Whether an element is what would be made again."""
        said = element.about
        usual = self.steps is None and self.budget_s == math.inf
        cut_short = said.get("ended") == "steps" or (said.get("ended") == "time" and not usual)
        ended = not cut_short or said.get("steps") == self.steps
        return ended and about.items() <= said.items() and not said.keys() & ASKED - about.keys()


ASKED: Final = frozenset(("license", "source", "sign", "max_error", "texels", "color_error", "parts"))


class _Job(NamedTuple):
    """What is asked of an element, and when its file's time ends."""

    wish: Wish
    about: dict[str, str | float]
    end_s: float
    tell: Callable[..., None]

    def say(self, line: str) -> None:
        self.tell("say", line)

    @property
    def terms(self) -> dict[str, Any]:
        """As what fits takes them."""
        return {
            "budget_s": self.end_s - time.monotonic(),
            "steps": self.wish.steps,
            "about": self.about,
        }


def make(request: Mapping[str, Any], data: bytes, tell: Callable[..., None]) -> bytes:
    """The file of what becomes of an original's bytes, in the process that is kept apart.

    Args:
        request: its ``suffix``, the ``name`` of the element, what it says ``about`` itself, the ``wish``, and
            bytes of the ``files`` that it names.
        tell: called with ``say`` and a line, and ``progress`` and how far what is.

    Raises:
        FitError: nothing does.
    """
    wish, suffix, name = Wish(**request["wish"]), request["suffix"], request["name"]
    job = _Job(wish, request["about"], time.monotonic() + wish.budget_s, tell)
    if wish.paints(suffix):
        return zoo_bytes([_texture(data, name, job)])
    brought = parts.brought(data, suffix, name, request["files"], wish.sign, wish.parts)
    job.say(f"{name}: {', '.join(brought.notes)}")
    group, made = list(brought.group), []
    for called, shape in brought.shapes.items():
        part = next((part for part in group if part.geometry == called), None)
        number = {"part": brought.numbers[called]} if called in brought.numbers else {}
        own = job._replace(about=job.about | number)
        try:
            made.append(_shape(shape, called, 1.0 if part is None else part.size, own))
            if part is not None and part.material and isinstance(shape, Mesh):
                made.append(_colours(shape, called, own))
        except FitError as error:
            if called == name:
                raise
            job.say(f"{called}: left out: {error}")
            group = [part for part in group if part.geometry != called]
    return zoo_bytes(made, {name: tuple(group)} if group else {})


def _shape(shape: Shape, name: str, size: float, job: _Job) -> Element:
    """The element of a mesh or an outline; one that is small in the whole may be off by more of its size."""

    def report(rung: Rung) -> None:
        job.say(
            f"  {rung.side:>4} a side {rung.bytes:>8,} bytes  error {rung.error:.5f}  "
            f"1 in 100 {rung.worst:.4f}  normals {rung.normal_deg:.1f}°",
        )

    asked = (job.wish.max_error or NEAR[shape.dimension]) * min(COARSER, 1 / size)
    element, tried = fit(
        shape,
        name,
        max_error=asked,
        report=report,
        progress=lambda side, share: job.tell("progress", f"{name}, {side} a side", share, 1.0),
        **job.terms,
    )
    off = float(element.about["error"])
    short = "" if off <= asked else f", where {asked:g} was asked"
    if element.about["ended"] == "time":
        short += ", a finer grid would take minutes: --budget"
    if (thin := float(element.about["thin"])) > THIN:
        short += f", {100 * thin:.0f} % of the surface too thin for the grid"
    if shape.dimension == 3:  # light shows more than distances do
        best, cell = min(tried, key=lambda rung: rung.error), SEEN / (element.sides[-1] - 1)
        short += f", normals {best.normal_deg:.1f}° off"
        short += f", details under {cell:.0f} pixels rounded at {SEEN} wide"
    shown = f"{element.sides[-1]} distances a side, {len(element.data):,} bytes, error {off:.5f}{short}"
    job.say(f"{name}: {shown}; {plural(len(tried), 'grid')} tried")
    return element


def _colours(shape: Mesh, name: str, job: _Job) -> Element:
    """The material of a mesh."""
    element = fit_colours(
        shape,
        name,
        max_error=job.wish.color_error,
        report=lambda tried: job.say(
            f"  {tried.side:>4} a side {tried.bytes:>8,} bytes  colours off by {tried.error:.4f}"
        ),
        **job.terms,
    )
    shown = f"{element.sides[-1]} colours a side, {len(element.data):,} bytes"
    job.say(f"{name}: {shown}, off by {element.about['error']:.4f}")
    return element


def _texture(data: bytes, name: str, job: _Job) -> Element:
    """The element of a picture."""
    found = picture.read_picture(data, job.wish.texels)
    job.say(f"{name}: {', '.join(found.notes)}")
    element, tried = picture.fit_picture(
        found,
        name,
        max_error=job.wish.max_error,
        report=lambda coded: job.say(f"  {coded.form:>12} {coded.bytes:>8,} bytes  error {coded.error:.4f}"),
        **job.terms,
    )
    height, width = element.sizes
    shown = f"{width} × {height} texels, {len(element.data):,} bytes, error {element.about['error']:.4f}"
    job.say(f"{name}: {shown}; {plural(len(tried), 'form')} tried")
    return element
