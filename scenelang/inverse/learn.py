"""Elements learned from meshes, drawings and pictures, and fonts.

Fonts of strangers are read as outlines and tables, by HarfBuzz in the sandbox. Contours may overlap or run
either way round. What is kept are the parts of curves that have the inside on one side alone, turned so that
it lies on their left: the outline of their union, by the rule of nonzero winding.
"""

from __future__ import annotations

import errno
import hashlib
import math
import os
import re
import time
from array import array
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, Literal, NamedTuple
from unicodedata import category

import numpy as np
import numpy.typing as npt

from scenelang.assets.element import GRAIN, MOST_CURVES, TEXELS, Element, Facts
from scenelang.assets.element_file import (
    MOST_CLASSES,
    MOST_ELEMENT_BYTES,
    MOST_LETTERS,
    TENSORS,
    UNIT,
    ElementFile,
    Font,
    element_file_bytes,
    is_said,
    read_zoo,
)
from scenelang.assets.files import NotWritten, output_place, read_regular, write_output
from scenelang.assets.tensors import TensorError
from scenelang.drawing.exact import originals, outline
from scenelang.drawing.exact.mesh import FitError as FitError
from scenelang.drawing.exact.mesh import Mesh, Sign, needed, read_solids
from scenelang.drawing.exact.originals import MOST_OF, Shape, said
from scenelang.drawing.neural.outlines import MEET
from scenelang.inverse.grids import NEAR, THIN, Rung, fit, fit_colours
from scenelang.inverse.sandbox import CPU_S, LIBRARIES, Asked, Hear, SandboxProcess, files_beside, run_alone
from scenelang.language.diagnostics import plural
from scenelang.language.scene import Elements, load_elements
from scenelang.output.mesh import crossed
from scenelang.output.workers import GivenUp, by_workers

FilePath = str | os.PathLike[str]
SEEN: Final = 960  # assumed width of a solid in pixels, by which the report states its smallest details
COARSER: Final = 2.0  # most times the error of the whole that a part may have, in its own radii


@dataclass(frozen=True, slots=True)
class LearnOptions:
    """Options of learning elements; those of `learn` are described there."""

    sign: Sign = "auto"
    # in leaf units, `NEAR` if left out; of textures root mean square off of channels in [0, 1]
    max_error: float | None = None
    budget_s: float = math.inf
    steps: int | None = None
    license: str | None = None
    source: str | None = None
    pictures: Literal["texture", "outline"] = "texture"
    texels: int = TEXELS  # most of a texture along its longer side
    parts: bool | None = None
    # root mean square off of a mesh's colours that is near enough, of channels in [0, 1]
    color_error: float | None = None
    letters: str | None = None  # of fonts: ranges of code points, as `ranges_of` reads them
    font: str | None = None  # file of the font that texts of drawings are set in

    def __post_init__(self) -> None:
        if self.letters is not None:
            ranges_of(self.letters)
        for text in (self.license, self.source):
            if text is not None and not is_said(text):
                raise ValueError("a license or a source is at most 2,000 characters, all of them printable")

    def about(self, original: Path, data: bytes) -> Facts:
        """Facts of an element about its origin; equal files and options give equal facts."""
        name = "".join(c if c.isprintable() else "?" for c in original.name)
        said = {"license": self.license, "source": self.source, "original": name}
        said |= {"sha256": hashlib.sha256(data).hexdigest()}
        asked: dict[str, str | float | None]
        asked = {"sign": None if self.sign == "auto" else self.sign, "max_error": self.max_error}
        asked |= {"texels": None if self.texels == TEXELS else self.texels, "color_error": self.color_error}
        asked |= {"letters": self.letters}
        asked |= {"parts": None if self.parts is None else "apart" if self.parts else "together"}
        return {key: value for key, value in (said | asked).items() if value is not None}

    def paints(self, suffix: str) -> bool:
        """Return whether files of a suffix become textures."""
        return self.pictures == "texture" and suffix.lower() in outline.MOST_OF_PICTURE

    def made(self, element: Element | Font, about: Facts) -> bool:
        """Return whether making an element or a font again would give the same one."""
        said = element.about
        usual = self.steps is None and self.budget_s == math.inf
        cut_short = said.get("ended") == "steps" or (said.get("ended") == "time" and not usual)
        # early ones do not say how large they are
        known = isinstance(element, Font) or element.material or element.size is not None
        ended = not cut_short or said.get("steps") == self.steps
        return known and ended and about.items() <= said.items() and not said.keys() & ASKED - about.keys()


ASKED = {"license", "source", "sign", "max_error", "texels", "color_error", "parts", "letters", "font"}


class _Job(NamedTuple):
    """One element to make, and the end of its file's time."""

    options: LearnOptions
    about: Facts
    end_s: float
    tell: Callable[..., None]

    def say(self, line: str) -> None:
        self.tell("say", line)

    @property
    def terms(self) -> dict[str, Any]:
        """Arguments of the fitting functions."""
        return {"budget_s": self.end_s - time.monotonic(), "steps": self.options.steps, "about": self.about}


def make(request: Mapping[str, Any], data: bytes, tell: Callable[..., None]) -> bytes:
    """Make the elements of an original's bytes in the sandbox; returns the bytes of their file.

    The request has ``suffix``, ``name``, facts (``about``), ``options`` and bytes of the ``files`` that the
    original names. ``tell`` is called with ``say`` and a line, or with ``progress`` and its arguments.
    """
    options, suffix, name = LearnOptions(**request["options"]), request["suffix"], request["name"]
    job = _Job(options, request["about"], time.monotonic() + options.budget_s, tell)
    if suffix in MOST_OF_FONT:
        patient, heard = options.budget_s < math.inf, lambda said: job.say(f"{name}: {said}")
        found = read_font(data, request["about"], options.letters, heard, patient)
        job.say(f"{name}: {', '.join(found[1])}")
        return element_file_bytes([], font=found[0])
    if options.paints(suffix):
        return element_file_bytes([_texture(data, name, job)])

    def face(letters: str) -> Font:
        try:
            return read_font(files["font"], {}, ",".join(f"U+{ord(letter):X}" for letter in letters))[0]
        except FitError as error:
            raise FitError(f"the font `{options.font}`: {error}") from None

    files = request["files"]
    if suffix in outline.MOST_OF_DRAWING:
        drawing = outline.read_outline(data, suffix, face if options.font else None)
        brought = originals.drawn_parts(drawing, name, options.parts)
    else:
        solids, notes = read_solids(data, suffix, files)
        brought = originals.solid_parts(solids, name, options.sign, bool(options.parts))
        brought = brought._replace(notes=(*brought.notes, *notes))
    job.say(f"{name}: {', '.join(brought.notes)}")
    group, elements = list(brought.group), []
    for called, shape in brought.shapes.items():
        part = next((part for part in group if part.geometry == called), None)
        number = {"part": brought.numbers[called]} if called in brought.numbers else {}
        own = job._replace(about=job.about | number)
        try:
            elements.append(_shape(shape, called, 1.0 if part is None else part.size, own))
            if part is not None and part.material and isinstance(shape, Mesh):
                elements.append(_colours(shape, called, own))
        except FitError as error:
            if called == name:
                raise
            job.say(f"{called}: left out: {error}")
            group = [part for part in group if part.geometry != called]
    return element_file_bytes(elements, {name: tuple(group)} if group else {})


def _shape(shape: Shape, name: str, size: float, job: _Job) -> Element:
    """The element of a mesh or an outline; a small part of a whole may have a larger relative error."""

    def report(rung: Rung) -> None:
        job.say(
            f"  {rung.side:>4} a side {rung.bytes:>8,} bytes  error {rung.error:.5f}  "
            f"1 in 100 {rung.worst:.4f}  normals {rung.normal_deg:.1f}°"
        )

    def grown(side: int, share: float) -> None:
        job.tell("progress", f"{name}, {side} a side", share, 1.0)

    asked = (job.options.max_error or NEAR[shape.dimension]) * min(COARSER, 1 / size)
    centre = [f"{x:.6g}" for x in shape.centre]
    job.say(f"{name}: {name}_size is {shape.size:.6g}, {name}_centre is [{', '.join(centre)}]")
    element, tried = fit(shape, name, max_error=asked, report=report, progress=grown, **job.terms)
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
    def report(side: int, size: int, error: float) -> None:
        job.say(f"  {side:>4} a side {size:>8,} bytes  colours off by {error:.4f}")

    element = fit_colours(shape, name, max_error=job.options.color_error, report=report, **job.terms)
    shown = f"{element.sides[-1]} colours a side, {len(element.data):,} bytes"
    job.say(f"{name}: {shown}, off by {element.about['error']:.4f}")
    return element


def _texture(data: bytes, name: str, job: _Job) -> Element:
    result = outline.read_picture(data, job.options.texels)
    job.say(f"{name}: {', '.join(result.notes)}")
    element, tried = outline.fit_picture(
        result,
        name,
        max_error=job.options.max_error,
        report=lambda coded: job.say(f"  {coded.form:>12} {coded.bytes:>8,} bytes  error {coded.error:.4f}"),
        **job.terms,
    )
    height, width = element.sizes
    shown = f"{width} × {height} texels, {len(element.data):,} bytes, error {element.about['error']:.4f}"
    job.say(f"{name}: {shown}; {plural(len(tried), 'form')} tried")
    return element


Progress = Callable[[str, float, float], None]
Answers = Generator[tuple[int, Callable[[], bytes]], None, None]
"""Indices of files, in any order, each with a function that returns the made bytes or raises."""


def learn_files(
    files: Sequence[FilePath],
    out: FilePath,
    options: LearnOptions = LearnOptions(),
    *,
    name: str | None = None,
    cluster: str | None = None,
    say: Callable[[str], None] = lambda line: None,
    progress: Progress = lambda what, done, total: None,
) -> list[Element]:
    """Make files elements of the file ``out``, beside those that it holds; called as `learn` is.

    The file is written after each element, whole or not at all. An element that it already holds of the same
    original and options is not made again. So the same call continues work that was interrupted.
    """
    names = names_of(files, options, name)
    first = held = _writable(out)
    results: dict[int, ElementFile] = {}
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
            troubles[index] = f"{error.filename or files[index]}: {(error.strerror or str(error)).lower()}"

    def asked() -> Iterator[tuple[int, Asked]]:
        for index, (file, called) in enumerate(zip(map(Path, files), names, strict=True)):
            with noted(index):
                font = file.suffix.lower() in MOST_OF_FONT
                known = held.font if font else _named(held).get((called, options.paints(file.suffix)))
                result = _request(file, called, options, known)
                if isinstance(result, Font):
                    say(f"{called}: made before of this file")
                    results[index] = replace(ElementFile.of(()), geometries=result.glyphs, font=result)
                elif isinstance(result, Element):
                    say(f"{called}: made before of this file")
                    groups = {called: held.groups[called]} if called in held.groups else {}
                    results[index] = replace(ElementFile.of([result]), groups=groups)
                else:
                    yield index, result

    hear: dict[str, Hear] = {"say": say, "progress": progress}
    with closing(_by_workers(cluster, asked(), hear) if cluster else _here(asked(), hear)) as answers:
        for index, answer in answers:
            with noted(index):
                results[index] = read_zoo(answer())
                held = _written(out, first, [(names[at], results[at]) for at in sorted(results)])
            if cluster:
                progress("files", len(results) + len(troubles), len(files))
    if troubles:
        raise FitError("\n".join(troubles[index] for index in sorted(troubles)))
    return [element for index in sorted(results) for element in results[index].elements]


def _here(asked: Iterable[tuple[int, Asked]], hear: Mapping[str, Hear]) -> Answers:
    """Answer requests one after another, in a sandbox of this machine."""
    with SandboxProcess() as apart:
        for index, (request, data) in asked:
            hear["progress"](request["name"], 0.0, 1.0)
            yield index, partial(apart, request, data, hear)


def _by_workers(cluster: str, asked: Iterable[tuple[int, Asked]], hear: Mapping[str, Hear]) -> Answers:
    """Answer requests by the workers of a cluster, several at a time and in any order."""

    def taken(answer: Callable[[], tuple[list[str], bytes | FitError]]) -> bytes:
        lines, result = answer()
        for line in lines:
            hear["say"](line)
        if isinstance(result, FitError):
            raise result
        return result

    for index, answer in by_workers(cluster, run_alone, asked, LIBRARIES):
        yield index, partial(taken, answer)


def names_of(files: Sequence[FilePath], options: LearnOptions, name: str | None = None) -> list[str]:
    """Names of the elements of files; raises `ValueError` where one is not a name, or two are the same."""
    if name is not None and len(files) > 1:
        raise ValueError("a name is for one file")
    names = [said(Path(file).stem) for file in files]
    names = [f"_{word}" if word[:1].isdigit() else word for word in names]
    if name is not None:
        names = [name] * len(files)
    fonts = [file for file in files if Path(file).suffix.lower() in MOST_OF_FONT]
    if len(fonts) > 1:
        raise ValueError(f"`{fonts[0]}` and `{fonts[1]}` are fonts, of which a file of elements has one")
    owners: dict[tuple[str, bool], FilePath] = {}
    for file, word in zip(files, names, strict=True):
        if not (word.isascii() and word.isidentifier()):
            raise ValueError(f"`{word}` is not a name; letters, digits and _ are, as --name says them")
        first = owners.setdefault((word, options.paints(Path(file).suffix)), file)
        if first is not file:
            raise ValueError(f"`{first}` and `{file}` would both be `{word}`")
    return names


def _writable(out: FilePath) -> ElementFile:
    """Contents of the output file; raises before the work where it could not be written afterwards."""
    place = output_place(out)
    for path, right in ((place.parent, os.W_OK | os.X_OK), (place, os.W_OK)):
        if path != place or place.exists():
            if not path.exists():
                raise NotWritten(errno.ENOENT, f"there is no folder `{path}`", os.fspath(out))
            if not os.access(path, right):
                raise NotWritten(errno.EACCES, os.strerror(errno.EACCES), os.fspath(out))
    try:
        with open(place, "rb") as file:
            return read_zoo(file.read(MOST_ELEMENT_BYTES + 1))
    except FileNotFoundError:
        return ElementFile.of(())
    except TensorError as error:
        raise NotWritten(errno.EINVAL, f"it is not a file of elements: {error}", os.fspath(out)) from None


def _named(zoo: ElementFile) -> dict[tuple[str, bool], Element]:
    letters = {} if zoo.font is None else zoo.font.glyphs
    return {(e.name, e.material): e for e in zoo.elements if e.material or e.name not in letters}


def _written(out: FilePath, held: ElementFile, made: Iterable[tuple[str, ElementFile]]) -> ElementFile:
    """Write a file's elements and the new ones, which replace those of the same names and their groups."""
    elements, groups, font = _named(held), dict(held.groups), held.font
    for name, zoo in made:
        groups.pop(name, None)
        elements, groups, font = elements | _named(zoo), groups | zoo.groups, zoo.font or font
    data = element_file_bytes(elements.values(), groups, font)
    try:
        result = read_zoo(data)
    except TensorError as error:
        raise NotWritten(errno.EFBIG, str(error), os.fspath(out)) from None
    write_output(out, data)
    return result


def _request(
    path: Path, name: str, options: LearnOptions, known: Element | Font | None
) -> Asked | Element | Font:
    """The request of a file to the sandbox and its bytes, or what was made of it before."""
    suffix, sizes = path.suffix.lower(), MOST_OF | MOST_OF_FONT
    if suffix in (".woff", ".woff2"):
        raise FitError("a packed font for the web: unpack it to .ttf or .otf first")
    if suffix not in sizes:
        raise FitError(f"not one of {', '.join(sizes)}")
    data = _read(path, sizes[suffix])
    about, files = options.about(path, data), files_beside(data, suffix, path.parent)
    if options.font is not None and suffix == ".svg":
        files["font"] = _read(Path(options.font), sizes[".ttf"])
        about["font"] = hashlib.sha256(files["font"]).hexdigest()
    if known is not None and options.made(known, about):
        return known
    usual_s = CPU_S * (4 if options.parts else 1)
    limit_s = max(usual_s, 2 * options.budget_s) if options.budget_s < 1e6 else usual_s
    request = {"name": name, "suffix": suffix, "options": asdict(options), "about": about, "cpu_s": limit_s}
    return {**request, "files": files}, data


def _read(path: Path, most: int) -> bytes:
    data = read_regular(path, most)
    if len(data) > most:
        raise FitError(f"`{path.name}` has more than {most >> 20:,} MiB")
    return data


def learn(
    files: FilePath | Sequence[FilePath],
    out: FilePath,
    *,
    name: str | None = None,
    max_error: float | None = None,
    budget_s: float = math.inf,
    steps: int | None = None,
    license: str | None = None,
    source: str | None = None,
    sign: Sign = "auto",
    pictures: Literal["texture", "outline"] = "texture",
    parts: bool | None = None,
    letters: str | None = None,
    font: FilePath | None = None,
    cluster: str | None = None,
    say: Callable[[str], None] = lambda line: None,
) -> Elements:
    """Make files elements, as ``scenelang learn`` does: ``learn("cow.obj", "zoo.safetensors")``.

    Elements that ``out`` holds stay. One that was made before of the same file with the same options is
    reused.

    Args:
        files: meshes, drawings, pictures and fonts, or one.
        out: a file of elements, which may exist.
        name: of the one element; by default that of the file.
        max_error: how far off is near enough, by default what the command says.
        budget_s: for each file; nothing new is begun after so many seconds.
        steps: forms that are tried at most, whatever the time; the same number gives the same bytes.
        license, source: of the originals, kept in the file.
        sign: rule for the inside of a mesh.
        pictures: kind of element that a picture becomes: a texture or, by its outline, a geometry.
        parts: true makes each part of a file an element; if left out, only those of drawings.
        letters: ranges of code points to take of a font, ``"U+20-7E, U+3B1"``; by default all.
        font: a font's file for all texts of drawings, by default those of sans-serif are in `std/letters`.
        cluster: address of a dask scheduler whose workers make them, several at a time, or ``"local"``; needs
            the extra ``dask``, and what makes elements on each.
        say: called with lines of the report; with a cluster, for each file when it is done.

    Returns:
        All elements of ``out``, for a Scene.

    Raises:
        FitError: files cannot be made elements, a line for each; the others were.
        RenderError: ``cluster`` has no workers, or they differ from this machine.
        OSError: ``out`` cannot be read or written.
        ValueError: names that scenes cannot say, or twice the same.
    """
    options = LearnOptions(
        sign=sign, max_error=max_error, budget_s=budget_s, steps=steps,
        license=license, source=source, pictures=pictures, parts=parts, letters=letters,
        font=None if font is None else os.fspath(font),
    )  # fmt: skip
    listed = [files] if isinstance(files, str | os.PathLike) else files
    learn_files(listed, out, options, name=name, cluster=cluster, say=say)
    return load_elements(os.fspath(out))


MOST_OF_FONT: Final = dict.fromkeys((".ttf", ".otf", ".ttc"), 32 << 20)  # bytes of a file
_CUBIC: Final = 2e-5  # em: how far quadratic curves may be off a cubic one
_MOST_CURVES: Final = 1_000_000  # of all letters
_KERNED: Final = 3000  # letters whose pairs are asked,
_KERNED_S: Final = 8.0  # of processor time at most, which some tables make long
# work on outlines, in comparisons of points with edges, 10 to 30 ns each; letters of usual fonts take 100,000
_LETTER_WORK: Final = 50_000_000
_FONT_WORK: Final = 200_000_000  # of a font, and
_USUAL_WORK: Final = 200_000  # more for each letter
_ALPHABETS: Final = 0x2E80  # where those end that fonts kern
_SAMPLES: Final = 8, 64  # edges of a curve, to see whether contours overlap, and where they do
_BESIDE: Final = 1e-7  # of a radius: from a curve to where its sides are asked
_MEET: Final = 1e-5  # of a radius: so near each other curves meet
_CLOSE: Final = 50_000  # pairs of curves of a letter that may meet
_LEAST: Final = 1e-6  # em: the least radius of what shows
Curves = npt.NDArray[np.float64]  # (n, 3, 2) start, control point, end


class _Intricate(Exception):
    """A letter of so many points, or points beside each other, that it takes more than `_LETTER_WORK`."""


def read_font(
    data: bytes,
    about: Facts,
    letters: str | None = None,
    say: Callable[[str], None] = lambda line: None,
    patient: bool = False,
) -> tuple[Font, list[str]]:
    """Read the letters of a font that lie in ranges, by default all, and lines about it; raises `FitError`.

    ``say`` is called when the file is known to be a font, before its letters are read. One that takes far
    more work than usual is refused unless ``patient``.
    """
    with needed("uharfbuzz"):
        import uharfbuzz
    if data[:4] in (b"wOF2", b"wOFF"):
        raise FitError("a packed font for the web: unpack it to .ttf or .otf first")
    face = uharfbuzz.Face(uharfbuzz.Blob(data))
    if not face.glyph_count or not 16 <= face.upem <= 1 << 14:
        raise FitError("damaged or not a TrueType or OpenType font")
    font = uharfbuzz.Font(face)
    codes = [int(code) for code in face.unicodes if category(chr(code)) not in ("Cc", "Cs")]
    held = {code: glyph for code in codes if (glyph := font.get_nominal_glyph(code))}
    if letters is not None:
        ranges = ranges_of(letters)
        held = {code: glyph for code, glyph in held.items() if any(code in some for some in ranges)}
    if not 0 < len(held) <= MOST_LETTERS:
        raise FitError(f"{len(held):,} of these letters, where 1 to {MOST_LETTERS:,} are allowed")
    say(plural(len(held), "letter"))
    codes, numbers, ends, parts = list[int](), list[float](), list[int](), list[bytes]()
    left_out, intricate, count, work = list[str](), list[str](), 0, [0]
    for done, (code, glyph) in enumerate(sorted(held.items())):
        if work[0] > _FONT_WORK + _USUAL_WORK * done and not patient:
            most = f"more than the usual work on its first {plural(done, 'letter')}"
            raise FitError(f"{most}; --letters takes some of them, --budget SECONDS all")
        advance = font.get_glyph_h_advance(glyph) / face.upem
        try:
            disc, outline = _outline(_contours(font, glyph) / face.upem, work)
        except _Intricate:
            intricate.append(f"U+{code:04X}")
            continue
        if not abs(advance) < 50 or len(outline) > MOST_CURVES or not _closed(outline):
            left_out.append(f"U+{code:04X}")
            continue
        count += len(outline)
        if count > _MOST_CURVES:
            raise FitError(f"letters of more than {_MOST_CURVES:,} curves")
        parts.append(outline.tobytes())
        codes.append(code)
        numbers += (advance, *disc)
        ends.append(count)
    if not codes:
        raise FitError("all of these letters are damaged or of too many points")
    glyphs = [held[code] for code in codes]
    classes, kerning, columns, kerned = _kerning(uharfbuzz, font, codes, glyphs, face.upem)
    values: list[Any] = [codes, numbers, ends, classes, kerning, b"".join(parts)]
    tables = {name: array(TENSORS[name][1], value) for name, value in zip(TENSORS, values, strict=True)}
    try:
        result = Font(tables, columns, about)
    except TensorError as error:
        raise FitError(str(error)) from None
    notes = [plural(len(codes), "letter"), plural(count, "curve"), f"{len(kerning):,} pairs of classes"]
    notes += [f"kerning of the first {kerned:,} letters alone, as it takes long"] if kerned >= 0 else []
    for listed, why in ((left_out, "damaged"), (intricate, "of too many points")):
        notes += [f"left out, as they are {why}: {', '.join(listed[:20])}"] if listed else []
    return result, notes


def ranges_of(text: str) -> list[range]:
    """Code points of ranges as style sheets have them: ``U+20-7E, U+2190-2193``; raises `ValueError`."""
    result = []
    for part in text.replace(" ", "").split(","):
        if (match := re.fullmatch(r"[Uu]\+([0-9A-Fa-f]{1,6})(?:-([0-9A-Fa-f]{1,6}))?", part)) is None:
            raise ValueError(f"`{part[:40]}` is not a range of letters such as U+20-7E")
        result.append(range(int(match[1], 16), int(match[2] or match[1], 16) + 1))
    return result


def _contours(font: Any, glyph: int) -> Curves:
    """Closed contours of a glyph, in font units; cubic curves as quadratic ones that are near enough."""
    drawn, begin = list[tuple[Any, ...]](), (0.0, 0.0)

    def add(*points: Any) -> None:
        if len(drawn) <= MOST_CURVES:
            drawn.append(points)

    draw = dict.fromkeys(("lineTo", "qCurveTo", "curveTo"), add)
    end = dict.fromkeys(("closePath", "endPath"), lambda: None)
    pen = SimpleNamespace(moveTo=lambda point: add(None, point), **draw, **end)
    font.draw_glyph_with_pen(glyph, pen)
    found, at = [np.zeros((0, 3, 2))], begin
    for first, *rest in [*drawn, (None, begin)]:
        closes = first is None
        points = np.array([at, begin] if closes else [at, first, *rest], float)
        at = (first, *rest)[-1]
        begin = at if closes else begin
        if len(points) == 2:
            points = np.stack([points[0], points.mean(0), points[1]])
        found.append(_quadratics(points, _CUBIC * font.face.upem) if len(points) == 4 else points[None])
    result = np.concatenate(found)
    result = result[(result != result[:, :1]).any((1, 2))]
    if max(len(drawn), len(result)) > MOST_CURVES:
        raise _Intricate
    return np.asarray(result)


def _quadratics(p: Curves, near: float) -> Curves:
    """Curves (n, 3, 2) that are near enough to a cubic one (4, 2)."""
    a, u, v, w = p[0], 3 * (p[1] - p[0]), 3 * (p[2] - 2 * p[1] + p[0]), p[3] - 3 * p[2] + 3 * p[1] - p[0]
    n = int(np.clip(np.ceil((np.hypot(*w) * 3**0.5 / 36 / near) ** (1 / 3)), 1, 32))
    t = np.linspace(0, 1, n + 1)[:, None]
    point, way = a + t * (u + t * (v + t * w)), u + t * (2 * v + 3 * t * w)
    by = (point[:-1] + point[1:]) / 2 + (way[:-1] - way[1:]) / (4 * n)
    return np.stack([point[:-1], by, point[1:]], 1)


def _edges(curves: Curves, count: int) -> Curves:
    """Edges (n, count, 2, 2) along curves."""
    t = np.linspace(0, 1, count + 1)[:, None]
    a, b, c = (curves[:, k, None] for k in range(3))
    points = (1 - t) ** 2 * a + 2 * t * (1 - t) * b + t**2 * c
    return np.stack([points[:, :-1], points[:, 1:]], 2)


def _part(curve: Curves, s: float, e: float) -> Curves:
    """A curve (3, 2) from a parameter to another."""
    a, u, w = curve[0], 2 * (curve[1] - curve[0]), curve[0] - 2 * curve[1] + curve[2]
    return np.stack([a + s * (u + s * w), a + u * (s + e) / 2 + w * s * e, a + e * (u + e * w)])


def _outline(curves: Curves, work: list[int]) -> tuple[tuple[float, float, float], npt.NDArray[np.int16]]:
    """The disc of contours, and the outline of what they cover in it (n, 3, 2), in steps of `GRAIN`.

    What that takes is added to ``work``, of one number.
    """
    nothing = (0.0, 0.0, 0.0), np.zeros((0, 3, 2), np.int16)
    if not len(curves) or not abs(curves).max() < 50:
        return nothing
    kept = _boundary(curves, work)
    if not len(kept):
        return nothing
    points = _edges(kept, _SAMPLES[1]).reshape(-1, 2)
    middle = (points.min(0) + points.max(0)) / 2
    radius = float(np.hypot(*(points - middle).T).max())
    if radius < _LEAST:
        return nothing
    steps = np.rint((kept - middle) / radius * (GRAIN - 1)).clip(-GRAIN, GRAIN).astype("<i2")
    steps = steps[(steps != steps[:, :1]).any((1, 2))]
    return (float(middle[0]), float(middle[1]), radius * GRAIN / (GRAIN - 1)), steps


def _boundary(curves: Curves, work: list[int]) -> Curves:
    """Parts of closed contours that have the inside on one side alone, turned to have it on their left."""
    size, few = abs(curves - curves.mean((0, 1))).max(), _edges(curves, _SAMPLES[0])
    side = _sides(few, few, size, work)
    if (side == 1).all() or (side == -1).all():
        return curves if side[0, 0] == 1 else curves[::-1, ::-1]
    parts, count = _apart(curves, size, work), _SAMPLES[1]
    many = _edges(parts, count)
    side = _sides(many[:, count // 2], many, size, work)
    return np.asarray(np.where(side[:, None, None] > 0, parts, parts[:, ::-1])[side != 0])


def _apart(curves: Curves, size: float, work: list[int]) -> Curves:
    """Parts of curves, cut where they cross others or end on them; whole ones where that is too much work."""
    low, high, n = curves.min(1) - _MEET * size, curves.max(1) + _MEET * size, _SAMPLES[0]
    close = (low[:, None] <= high).all(2) & (low <= high[:, None]).all(2)
    pairs = np.nonzero(np.triu(close, 1))
    if len(pairs[0]) > _CLOSE:
        return curves
    work[0] += 600 * len(pairs[0])
    edges = _edges(curves, n)
    start, way = edges[:, :, 0], edges[:, :, 1] - edges[:, :, 0]
    between = start[pairs[1]][:, None] - start[pairs[0]][:, :, None]  # (pairs, n, n, 2)
    one, other = way[pairs[0]][:, :, None], way[pairs[1]][:, None]
    turn = crossed(one, other)
    shares = [crossed(between, w) / np.where(turn, turn, 1e-30) for w in (other, one)]
    pair, *place = np.nonzero((abs(np.array(shares) - 0.5) < 0.6).all(0))
    curve = np.array(pairs)[:, pair]
    t = np.array([(k + share[pair, *place]) / n for k, share in zip(place, shares, strict=True)])
    for _ in range(8):  # Newton's method
        (a, u), (b, v) = (_moving(curves[which], x) for which, x in zip(curve, t, strict=True))
        turn = crossed(u, v)
        t = t + np.stack([crossed(b - a, v), crossed(b - a, u)]) / np.where(turn, turn, np.inf)
        t = t.clip(-0.1, 1.1)
    met = (abs(t - 0.5) <= 0.5 + _MEET).all(0) & (np.hypot(*(a - b).T) < _MEET * size)
    which = curve[:, met].reshape(-1)
    if len(which) > 2 * MOST_CURVES:
        raise _Intricate
    work[0] += 3000 * len(which)
    order, result = np.argsort(which), []
    places = np.round(t[:, met].clip(0, 1), 6).reshape(-1)[order]
    firsts = np.searchsorted(which[order], range(len(curves) + 1))
    for at, one in enumerate(curves):
        cuts = np.unique([0, *places[firsts[at] : firsts[at + 1]], 1])
        result += [_part(one, s, e) for s, e in pairwise(cuts)]
    return np.array(result)


def _moving(curves: Curves, t: Curves) -> tuple[Curves, Curves]:
    """Points and derivatives (n, 2) of curves at parameters."""
    u, w, t = 2 * (curves[:, 1] - curves[:, 0]), curves[:, 0] - 2 * curves[:, 1] + curves[:, 2], t[:, None]
    return curves[:, 0] + t * (u + t * w), u + 2 * t * w


def _sides(edges: Curves, around: Curves, size: float, work: list[int]) -> npt.NDArray[np.int8]:
    """1 for edges (…, 2, 2) with the inside of others on the left alone, -1 on the right alone, else 0."""
    flat, others = edges.reshape(-1, 2, 2), around.reshape(-1, 2, 2)
    way, middle = flat[:, 1] - flat[:, 0], flat.mean(1)
    low, high = np.sort([others[..., 1].min(1), others[..., 1].max(1)])
    ends = np.sort(middle[:, 1])[[*range(0, len(flat), outline.STRIP), -1]]
    met = np.searchsorted(low, ends[1:], "right") - np.searchsorted(high, ends[:-1])
    needed = 2 * outline.STRIP * int(met.sum()) + 300 * len(flat)
    if needed > _LETTER_WORK:
        raise _Intricate
    work[0] += needed
    inside = outline.winding(others, odd=False)
    beside = np.stack([-way[:, 1], way[:, 0]], 1) / np.maximum(np.hypot(*way.T), 1e-12)[:, None]
    beside *= _BESIDE * size
    left, right = inside(middle + beside).astype(np.int8), inside(middle - beside).astype(np.int8)
    return np.asarray((left - right).reshape(edges.shape[:-2]))


def _closed(outline: npt.NDArray[np.int16]) -> bool:
    """Return whether every curve of an outline ends where one begins."""
    from scipy.spatial import cKDTree

    starts, ends = outline[:, 0].astype(float), outline[:, 2].astype(float)
    return not len(outline) or bool(cKDTree(starts).query(ends)[0].max() <= MEET * GRAIN)


def _kerning(
    uharfbuzz: Any, font: Any, codes: list[int], glyphs: list[int], upem: int
) -> tuple[list[int], list[int], int, int]:
    """Classes of letters on the left and on the right of pairs, the table of these, its columns, and how many
    letters were asked, -1 where all were.
    """
    end_s, kerned = time.process_time() + _KERNED_S, -1
    asked = [at for at, code in enumerate(codes) if code < _ALPHABETS and category(chr(code))[0] != "M"]
    del asked[_KERNED:]
    advances = np.array([font.get_glyph_h_advance(glyphs[at]) for at in asked], np.int64)
    wanted = [glyphs[at] for at in asked]
    rows: dict[bytes, int] = {np.zeros(len(asked), np.int16).tobytes(): 0}
    classes = np.zeros((2, len(codes)), np.int64)
    plain = dict.fromkeys(("liga", "clig", "calt", "rlig", "dlig"), False) | {"kern": True}
    for at, advance in zip(asked, advances.tolist(), strict=True):
        buffer = uharfbuzz.Buffer()  # the letter before each of all others
        buffer.add_codepoints([code for other in asked for code in (codes[at], codes[other])])
        buffer.guess_segment_properties()
        buffer.direction = "ltr"
        uharfbuzz.shape(font, buffer, plain)
        own = np.zeros(len(asked), np.int64)
        infos = [(info.cluster, info.codepoint) for info in buffer.glyph_infos]
        neighbours = zip(infos, infos[1:], buffer.glyph_positions, strict=False)
        for (first, left), (second, right), place in neighbours:
            k, odd = divmod(first, 2)
            if not odd and second == first + 1 and (left, right) == (glyphs[at], wanted[k]):
                own[k] = place.x_advance - advance  # others join, or become other glyphs
        row = np.rint(own * (UNIT / upem)).clip(-32767, 32767).astype(np.int16)
        if (len(rows) + 1) * len(asked) > MOST_CLASSES or time.process_time() > end_s:
            kerned = asked.index(at)
            break
        classes[0, at] = rows.setdefault(row.tobytes(), len(rows))
    table = np.array([np.frombuffer(row, np.int16) for row in rows])
    columns: dict[bytes, int] = {np.zeros(len(table), np.int16).tobytes(): 0}
    for at, column in zip(asked, table.T, strict=True):
        classes[1, at] = columns.setdefault(np.ascontiguousarray(column).tobytes(), len(columns))
    table = np.array([np.frombuffer(column, np.int16) for column in columns]).T
    return classes.reshape(-1).tolist(), table.reshape(-1).tolist(), len(columns), kerned
