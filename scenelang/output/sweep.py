"""Sweeps: pictures of one scene with other values of its params.

A row depends on its number alone, so that a longer sweep begins with the rows of a shorter one, and a further
random param leaves the others unchanged. The table next to the pictures is CSV, with values as ``-D`` takes
them, and is read back. A copy may be Parquet: numbers are float64 in the unit of the column's metadata.
"""

from __future__ import annotations

import csv
import io
import math
import os
import random
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from itertools import cycle, islice, product
from numbers import Real
from pathlib import Path
from typing import Any, Final, Literal, Unpack

from PIL import Image as pillow
from PIL import ImageDraw, ImageFont

from scenelang.assets.files import read_regular, write_output, write_whole
from scenelang.assets.records import Record
from scenelang.compiler.program import program_bytes
from scenelang.drawing.how import How, Options, RenderError
from scenelang.drawing.image import Output, image_format, output_file
from scenelang.language import tree
from scenelang.language.diagnostics import Diagnostic, Diagnostics, plural
from scenelang.language.evaluation import (
    Axis,
    Evaluation,
    Knob,
    ParamError,
    Source,
    check_width,
    knob_of,
    param_named,
    value_at,
    written,
)
from scenelang.language.reports import SceneError
from scenelang.language.scene_text import number
from scenelang.language.statements import literal
from scenelang.language.values import UNITS, RangeValue, Vec, pack, unpack
from scenelang.output.animate import Progress, RenderResult, make
from scenelang.output.frames import Clip, Drawable, FrameStore, Shot, Target, find_target
from scenelang.output.painting import Painter

MOST_ROWS: Final = 1_000_000
MOST_LISTED: Final = 10_000  # values or ranges of a param between commas
_DIGITS: Final = 6  # digits of a value, relative to the width of its range
_RANGE: Final = re.compile(r"(.*?)\.\.(<?)(.*?)(?:/\s*(\d{1,7})|\s+step\s+(.+))?", re.DOTALL)


def rows_of(
    evaluation: Evaluation,
    grid: Mapping[str, str | Iterable[Any]],
    drawn: Mapping[str, str],
    count: int | None = None,
    seed: int = 0,
) -> tuple[list[dict[str, str]], int]:
    """Rows of a grid, by default as many, and random values of ``drawn``: a range, or "" for its own.

    The last param changes fastest, and the grid repeats; its number of values comes second, 0 without others.
    """
    cells: dict[str, tuple[str, ...]] = {}
    for name, asked in grid.items():
        stmt = param_named(evaluation, name)
        texts = values_of(evaluation, stmt, asked) if isinstance(asked, str) else map(text_of, asked)
        cells[name] = tuple(islice(texts, MOST_ROWS + 1))
        if len(cells[name]) > MOST_ROWS:
            raise ParamError(f"more than {MOST_ROWS:,} values of `{name}`")
        if not cells[name]:
            raise ParamError(f"no values for `{name}`")
    for name in drawn:
        if name in cells:
            raise ParamError(f"param `{name}` both in the grid and drawn at random")
    knobs = []
    for name, text in drawn.items():
        stmt, match = param_named(evaluation, name), _RANGE.fullmatch(text)
        if text and (match is None or match[2] or match[4] or match[5]):
            raise ParamError(f"`{text}` is not a range such as 0..1")
        ends = _ends(evaluation, stmt, match[1], match[3])[0] if text and match is not None else None
        knobs.append(ends or knob_of(stmt, evaluation.context))
    whole = math.prod(map(len, cells.values()))
    if not cells and not knobs:
        raise ParamError("no param to change")
    if count is None and not cells:
        raise ParamError("a count is needed where all values are drawn at random")
    total = whole if count is None else count
    if (cells and total < whole) or (total > whole and not knobs):
        fact = f"{plural(total, 'picture')}, where the grid has {whole:,}"
        raise ParamError(fact + " and nothing is drawn at random" * (total > whole))
    if not 0 < total <= MOST_ROWS:
        raise ParamError(f"{total:,} pictures, where 1 to {MOST_ROWS:,} can be made")
    rows = [dict(zip(cells, row, strict=True)) for row in islice(cycle(product(*cells.values())), total)]
    for knob in knobs:
        for index, row in enumerate(rows):
            row[knob.name] = _drawn(knob, seed, index)
    return rows, len(list(cells.values())[-1]) if len(cells) > 1 else 0


def _drawn(knob: Knob, seed: int, index: int) -> str:
    """A random value of a param in a row."""
    items = []
    for axis in knob.axes:
        share = random.Random(f"{seed}/{axis.label}/{index}").random()
        items.append(value_at(axis, int(share * len(axis.choices)) if axis.choices else share, knob.value))
    return _text(knob, Vec(tuple(items)) if knob.inner else items[0])


def values_of(evaluation: Evaluation, stmt: tree.Param, text: str) -> Iterator[str]:
    """Texts of the values that ``text`` describes.

    It has values between commas. ``a..b/n`` is n values from a to b, ``a..<b/n`` n without b; ``a..b step c``
    and ``a..b`` are ranges of the language. Missing ends are those of the param's range. Empty text means
    every choice, or step, of the param.
    """
    words = evaluation.context.value(stmt.name.text).__class__ is str
    for place, item in enumerate(_items(text)):
        if place == MOST_LISTED:
            fact = f"more than {MOST_LISTED:,} values or ranges of `{stmt.name.text}`"
            raise ParamError(f"{fact} between commas")
        match = None if words else _RANGE.fullmatch(item)
        if match is None and item:
            yield item
        elif match is None or not any(match[at] for at in (1, 3, 4, 5)):
            knob = knob_of(stmt, evaluation.context)
            if knob.inner or not knob.axes[0].choices:
                name = stmt.name.text
                raise ParamError(f"param `{name}` has no list of choices: say how many, as in {name}=../10")
            yield from (_text(knob, choice) for choice in knob.axes[0].choices)
        else:
            yield from _spread(evaluation, stmt, match)


def _spread(evaluation: Evaluation, stmt: tree.Param, match: re.Match[str]) -> Iterator[str]:
    first, without, last, parts, step = match.groups()
    knob, low, high, unit = _ends(evaluation, stmt, first, last)
    if parts is None:
        by = 1.0 if step is None else unpack(_number(evaluation, stmt, step))[0]
        stepped = RangeValue(low, high, bool(without), by, unit)
        if not by or not abs((high - low) / by) <= MOST_ROWS or stepped.count() > MOST_ROWS:
            raise ParamError(f"more than {MOST_ROWS:,} values in `{match[0]}`")
        values = (stepped.at(at) for at in range(stepped.count()))
    else:
        count = int(parts)
        if count > MOST_ROWS:
            raise ParamError(f"more than {MOST_ROWS:,} values in `{match[0]}`")
        gaps = max(1, count if without else count - 1)
        values = (low + (high - low) * at / gaps for at in range(count))
    return (written(knob, pack(value, unit), _DIGITS) for value in values)


def _ends(evaluation: Evaluation, stmt: tree.Param, first: str, last: str) -> tuple[Knob, float, float, str]:
    """A param with values in a range, and both its ends in base units, with their kind."""
    like = evaluation.context.value(stmt.name.text)
    if like.__class__ not in UNITS:
        raise ParamError(f"a range for `{stmt.name.text}`, which is not a number")
    ends = [unpack(_number(evaluation, stmt, text))[0] if text else None for text in (first, last)]
    if None in ends:
        axis = knob_of(stmt, evaluation.context).axes[0]
        low, high = axis.low, axis.high
        if axis.choices:
            sides = [unpack(choice)[0] for choice in axis.choices]
            low, high = min(sides), max(sides)
        ends = [own if end is None else end for end, own in zip(ends, (low, high), strict=True)]
    low, high = (end for end in ends if end is not None)
    check_width(stmt.name.text, low, high)
    knob = Knob(stmt, like, (Axis(stmt.name.text, min(low, high), max(low, high)),), False)
    return knob, low, high, unpack(like)[1]


def _number(evaluation: Evaluation, stmt: tree.Param, text: str) -> Any:
    file = evaluation.context
    value, like = literal(text.strip(), file), file.value(stmt.name.text)
    if value.__class__ is float and (value == 0.0 or unpack(like)[1] == "time"):
        value = pack(value, unpack(like)[1])
    if value.__class__ is not like.__class__:
        raise ParamError(f"`{text.strip()}` is not a value of `{stmt.name.text}`, whose default is "
                         f"{stmt.default.span.text}")  # fmt: skip
    return value


def _text(knob: Knob, value: Any) -> str:
    return value if isinstance(value, str) else written(knob, value, _DIGITS)


def text_of(value: Any) -> str:
    """A value of Python as ``-D`` takes it."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Real):
        return number(float(value))
    if isinstance(value, Iterable):
        return f"[{', '.join(map(text_of, value))}]"
    raise ParamError(f"{value!r} is not a value of a param")


def _items(text: str) -> Iterator[str]:
    """The parts between commas, those in brackets and quotes left out."""
    depth, start, quoted = 0, 0, False
    for at, sign in enumerate(f"{text},"):
        quoted ^= sign == '"'
        depth += 0 if quoted else (sign in "([") - (sign in ")]")
        if sign == "," and depth <= 0 and not quoted:
            yield text[start:at].strip()
            start = at + 1


PARQUET: Final = ".parquet"
_FRONT, _BACK = ("picture",), ("digest", "error")
_MOST_BYTES: Final = 1 << 30
_NUMBER: Final = re.compile(r"([-+]?[\d.]+(?:e[-+]?\d+)?)\s*([a-z]*)", re.IGNORECASE)


class TableError(ValueError):
    """A table that cannot be written, or one that is of another sweep."""


class TableRow(Record):
    picture: str  # name of its file; empty where there is none
    values: tuple[str, ...]  # text of each param's value, in order; empty for its default
    digest: str = ""  # of all that determines the picture; empty before it is drawn, or where it is not
    error: str = ""  # of the values; empty without one

    @property
    def cells(self) -> tuple[str, ...]:
        return (self.picture, *self.values, self.digest, self.error)


def table_bytes(path: Path, names: Sequence[str], lines: Sequence[TableRow]) -> bytes:
    """Contents of a table of this name."""
    heads = (*_FRONT, *names, *_BACK)
    if path.suffix.lower() == PARQUET:
        return _parquet(heads, lines)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(line.cells for line in lines)
    return text.getvalue().encode()


def _parquet(heads: Sequence[str], lines: Sequence[TableRow]) -> bytes:
    import pyarrow as arrow
    import pyarrow.parquet

    fields, arrays = [], []
    for name, texts in zip(heads, zip(*(line.cells for line in lines), strict=True), strict=True):
        column = [(text, "") if name in (*_FRONT, *_BACK) else _value(text) for text in texts]
        kinds = {(type(value), unit) for value, unit in column if value is not None}
        values, unit = [value for value, _ in column], next(iter(kinds), (None, ""))[1]
        arrays.append(arrow.array(values if len(kinds) <= 1 else texts))  # None for defaults
        own = {"unit": unit} if unit and len(kinds) == 1 else None
        fields.append(arrow.field(name, arrays[-1].type, metadata=own))
    buffer = io.BytesIO()
    pyarrow.parquet.write_table(arrow.Table.from_arrays(arrays, schema=arrow.schema(fields)), buffer)
    return buffer.getvalue()


def _value(text: str) -> tuple[Any, str]:
    if text in ("", "true", "false"):
        return (None if not text else text == "true"), ""
    if (one := _NUMBER.fullmatch(text)) is not None:
        return float(one[1]), one[2]
    if re.fullmatch(r"#([0-9a-f]{3}|[0-9a-f]{6})", text, re.IGNORECASE):
        digits = text[1:] if len(text) == 7 else "".join(2 * digit for digit in text[1:])
        return [int(digits[at : at + 2], 16) / 255 for at in (0, 2, 4)], ""
    parts = [_value(part.strip()) for part in text[1:-1].split(",")] if text[:1] + text[-1:] == "[]" else []
    if len({(type(value), unit) for value, unit in parts}) == 1 and isinstance(parts[0][0], float):
        return [value for value, _ in parts], parts[0][1]
    return text, ""


TEXTS: Final = {"scene": ".nsg", "program": ".safetensors"}
"""Suffixes of files next to a picture that are not pictures themselves."""
_REPORTED: Final = 3  # rows whose errors are reported in full


class Variants(Clip):
    """Scenes of rows, by the number of the row: one frame of a parsed scene, run for each row's values.

    Their table is written before anything is drawn, and again when all rows are compiled, before pictures are
    moved to their places. So pictures of another sweep are noticed, wherever that sweep was stopped; in its
    folder this raises `TableError`.
    """

    def __init__(
        self,
        source: Source,
        rows: Sequence[Mapping[str, str]],
        frame: int,
        diagnostics: Diagnostics,
        target: Target,
        outputs: Sequence[Kind],
        stem: str,
    ) -> None:
        super().__init__(source.evaluation(diagnostics), diagnostics)
        self._source, self._rows, self._frame = source, rows, frame
        self._memory = None  # rows share no objects
        self.target, self._asked = target, outputs
        self.outputs: tuple[Output, ...] = tuple(name for name in BESIDE if name in outputs)
        self.file = target.path / f"{stem}.csv"
        self.names = tuple(dict.fromkeys(name for row in rows for name in row))
        self.told: dict[int, Sequence[Diagnostic]] = {}  # errors of the first rows that have any, by number
        values = (tuple(row.get(name, "") for name in self.names) for row in rows)
        self.lines = [TableRow(target.file(at).name, own) for at, own in enumerate(values)]
        self._old = self._before()
        target.path.mkdir(parents=True, exist_ok=True)
        if not self._old:
            self._write()

    def _before(self) -> list[TableRow]:
        """Rows of the previous sweep that this one continues."""
        if not self.file.exists():
            if self.target.path.is_dir() and (others := self.target.there()):
                fact = f"pictures of these names without a table, `{others[0].name}` among them"
                raise TableError(f"`{self.target.path}` has {fact}")
            return []
        try:
            text = read_regular(self.file, _MOST_BYTES).decode("utf-8")
            cells = list(csv.reader(io.StringIO(text, newline="")))
        except (ValueError, csv.Error) as error:
            raise TableError(f"`{self.file}` is not a table: {error}") from None
        heads = [*_FRONT, *self.names, *_BACK]
        if not cells or cells[0] != heads or any(len(row) != len(heads) for row in cells):
            raise TableError(f"`{self.file}` is not a table of these params")
        old = [TableRow(row[0], tuple(row[1:-2]), *row[-2:]) for row in cells[1:]]
        for at, (line, now) in enumerate(zip(old, self.lines, strict=False)):
            if line.values != now.values:
                fact = f"{', '.join(line.values)} where {', '.join(now.values)} are asked for"
                raise TableError(f"`{self.file}` has other values in row {at}: {fact}")
        if len(old) > len(self.lines):
            raise TableError(f"`{self.file}` has {len(old):,} rows, and {len(self.lines):,} are asked for")
        return old

    def shot(self, number: int) -> Shot:
        assert isinstance(self._evaluation, Evaluation)
        self._evaluation.inputs.values = {**self._source.values, **self._rows[number]}
        return replace(super().shot(self._frame), number=number)

    def beside(self, frame: Drawable, store: FrameStore) -> Mapping[str, bytes]:
        """Note a row that gives a scene; returns the files next to its picture."""
        line = self.lines[frame.number]
        old = self._old[frame.number] if frame.number < len(self._old) else line
        if old.digest == frame.key:
            file, stored = self.target.file(frame.number), store.file(frame.key)
            files = {output_file(stored, name): output_file(file, name) for name in self.outputs}
            files[stored] = file
            if all(path.is_file() for path in files.values()):
                for into, path in files.items():
                    store.adopt(into, path)
        elif old.digest:
            fact = "of another scene, model, size or version"
            raise TableError(f"`{self.file}` is {fact}: row {frame.number} differs")
        self._note(frame.number, TableRow(line.picture, line.values, frame.key))
        result = {}
        if "scene" in self._asked:
            result[TEXTS["scene"]] = frame.shot.scene.to_nsg().encode()
        if "program" in self._asked:
            if frame.program is None:
                raise RenderError("the reference has no programs to write")
            result[TEXTS["program"]] = program_bytes(frame.program)
        return result

    def failed(self, number: int, error: SceneError) -> None:
        """Note a row whose values give no scene, and forget its errors, so that others can be run."""
        errors = [d for d in error.diagnostics if d.severity == "error"]
        if len(self.told) < _REPORTED:
            self.told[number] = errors
        line = self.lines[number]
        self._note(number, TableRow("", line.values, "", f"{errors[0].code}: {errors[0].message}"))
        old, self.diagnostics = self.diagnostics, Diagnostics()
        for d in old:
            if d.severity == "warning":
                self.diagnostics.add(d.code, d.message, d.span, labels=d.labels, help=d.help, fix=d.fix)
        self._evaluation = self._source.evaluation(self.diagnostics)

    def _note(self, number: int, line: TableRow) -> None:
        self.lines[number] = line
        if number == len(self.lines) - 1:
            self._write()

    def _write(self) -> None:
        write_whole(self.file, table_bytes(self.file, self.names, self.lines))


MOST_SIDE: Final = 4096  # pixels of a sheet
MOST_CELLS: Final = 1024
_CELL, _LEAST, _GAP, _TEXT = 160, 24, 4, 13
_WORTH: Final = 64  # pixels across from which on a picture is labelled


def write_sheet(
    path: Path, folder: Path, names: Sequence[str], lines: Sequence[TableRow], across: int = 0
) -> int:
    """Draw the pictures of ``lines``, ``across`` in a row or in a square, over white; returns how many.

    They are labelled where there is room. Of more than `MOST_CELLS` as many are taken, evenly.
    """
    every = math.ceil(len(lines) / MOST_CELLS)
    lines = lines[::every]
    first = next((line.picture for line in lines if line.digest), None)
    width = height = 1
    if first is not None:
        with pillow.open(folder / first) as image:
            width, height = image.size
    fits = across if every == 1 and 0 < across <= 64 else 0
    columns = min(len(lines), fits or max(1, round(math.sqrt(len(lines) * height / width))))
    rows = math.ceil(len(lines) / columns)
    room = min(MOST_SIDE // columns, MOST_SIDE // rows) - _GAP
    cell = max(1, min(_CELL, room - _TEXT * (room > _WORTH + _TEXT)))
    scale = cell / max(width, height)
    size = max(1, round(width * scale)), max(1, round(height * scale))
    below = _TEXT + 2 if size[0] >= _WORTH else 0
    step = size[0] + _GAP, size[1] + _GAP + below
    sheet = pillow.new("RGB", (columns * step[0] + _GAP, rows * step[1] + _GAP), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(_TEXT - 2)
    for at, line in enumerate(lines):
        x, y = _GAP + at % columns * step[0], _GAP + at // columns * step[1]
        if line.digest:
            with pillow.open(folder / line.picture) as image:
                image.draft("RGB", size)
                shown = image.convert("RGBA").resize(size, pillow.Resampling.LANCZOS)
            sheet.paste(shown, (x, y), shown)
        else:
            draw.rectangle((x, y, x + size[0] - 1, y + size[1] - 1), "#eeeeee")
            draw.text((x + 3, y + 2), line.error[:5], "#aa2222", font)
        if below:
            shares = zip(names, line.values, strict=True)
            label = ", ".join(f"{name} {value}" for name, value in shares if value)
            while label and font.getlength(label) > size[0]:
                label = label[:-2] + "…" if len(label) > 2 else ""
            draw.text((x, y + size[1]), label, "#444444", font)
    buffer = io.BytesIO()
    sheet.save(buffer, image_format(path))
    write_output(path, buffer.getvalue())
    return len(lines)


Kind = Literal["depth", "normal", "object", "alpha", "scene", "program"]
BESIDE: Final[tuple[Output, ...]] = ("depth", "normal", "object", "alpha")


@dataclass(frozen=True, slots=True)
class Sweep:
    """Pictures that were written."""

    table: Path  # file of values, digests and errors
    names: tuple[str, ...]  # of the params
    lines: Sequence[TableRow]  # the table's rows
    failed: Mapping[int, Sequence[Diagnostic]]  # errors of the first few rows without a picture, by number
    warnings: Sequence[Diagnostic]  # all of them, each once
    made: RenderResult  # figures of the run

    @property
    def errors(self) -> int:
        """Number of rows without a picture."""
        return sum(not line.digest for line in self.lines)


def render_many(
    path: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    values: Iterable[Mapping[str, Any]] = (),
    grid: Mapping[str, str | Iterable[Any]] | None = None,
    random: Iterable[str] | Mapping[str, str] = (),
    count: int | None = None,
    seed: int = 0,
    params: Mapping[str, Any] | None = None,
    outputs: Sequence[Kind] = (),
    table: str | os.PathLike[str] | None = None,
    sheet: str | os.PathLike[str] | None = None,
    frame: int = 0,
    size: tuple[int, int] | None = None,
    model: str | None = None,
    root: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    cluster: str | None = None,
    progress: Callable[[Progress], None] = lambda _: None,
    **how: Unpack[Options],
) -> Sweep:
    """Draw a scene file with many values: ``render_many("a.nsg", "out/", grid={"k": "0..1/10"})``.

    Each picture is the one that `scenelang.render` gives for its values. Repeat an interrupted
    call to continue it; one with a larger ``count`` adds to the pictures. Rows whose values give no scene are
    left out and reported.

    Args:
        path: the scene file. Scenes have no params left; `scenelang.animate` draws several.
        out: a folder, or numbered pictures (``out/%05d.png``). The table lies there too, as ``STEM.csv``.
        values: of each picture, as for `scenelang.load`; instead of the next four.
        grid: values of params, of which all combinations are drawn: a list, or text such as ``"0..1/10"``,
            ten from 0 to 1, ``"0.1,0.5"``, ``"0..1 step 0.25"``, or ``""`` for every choice there is.
        random: params that are drawn uniformly from their ranges, or from those of a mapping.
        count: how many pictures; the grid is gone through again and again.
        seed: of random values. A row's values depend on its number, the seed and the param's name alone.
        params: values that all pictures share.
        outputs: files to write next to each picture: ``"depth"`` and so on as `scenelang.render_outputs` has
            them, ``"scene"`` as text without params, and ``"program"``.
        table: a copy of the table, .csv or .parquet.
        sheet: a picture that shows all of them, small.
        frame, size, model, root: as for `scenelang.load`.
        jobs, cluster, progress, **how: as for `scenelang.animate`.

    Returns:
        The files and figures of the sweep, also where some or all rows have errors.

    Raises:
        ParamError: there is no such param, or no such values of it.
        TableError: ``out`` has the pictures of another sweep, of which nothing is changed.
        SceneError: the scene has errors whatever the values are.
        RenderError, OSError, ValueError, TypeError: as for `scenelang.animate`.
    """
    place: object = path
    if not isinstance(place, str | os.PathLike):
        fact = f"{type(path).__name__} where the path of a scene is needed, whose text has the params"
        raise TypeError(f"{fact}; several Scenes are drawn by `animate` and `render_frames`")
    stem = Path(path).stem
    target = find_target(os.fspath(out), stem, 6, film=False)
    if table is not None:
        kind, folder = Path(table).suffix.lower(), Path(table).parent
        if kind not in (".csv", PARQUET):
            raise TableError(f"`{Path(table)}` is not a table; one ends in .csv or {PARQUET}")
        if not folder.is_dir():
            raise TableError(f"cannot write `{Path(table)}`: there is no folder `{folder}`")
        if kind == PARQUET and find_spec("pyarrow") is None:
            raise TableError(f"{PARQUET} needs pyarrow: pip install 'scenelang[parquet]'")
    if sheet is not None:
        image_format(sheet)
    diagnostics = Diagnostics()
    fixed = dict(params or {})
    source = Source(path, params=fixed, model=model, root=root, size=size).parsed(diagnostics)
    first = source.evaluation(diagnostics, frame=frame)
    if first.run(frame)[0] is None or diagnostics.errors:  # those of its syntax are of no row
        raise SceneError(diagnostics)
    given = [{name: text_of(value) for name, value in row.items()} for row in values]
    drawn = dict(random) if isinstance(random, Mapping) else dict.fromkeys(random, "")
    if given and (grid or drawn or count is not None):
        raise ParamError("values are given as they are, and as a grid or at random")
    if len(given) > MOST_ROWS:
        raise ParamError(f"{len(given):,} pictures, where at most {MOST_ROWS:,} can be made")
    for name in dict.fromkeys(name for row in given for name in row):
        if name not in first.inputs.known:
            param_named(first, name)
    rows, across = (given, 0) if given else rows_of(first, grid or {}, drawn, count, seed)
    for name in fixed:
        if any(name in row for row in rows):
            raise ParamError(f"param `{name}` with one value for all pictures, and with others")
    checked = How(**how).checked()
    clip = Variants(source, rows, frame, diagnostics, target, outputs, stem)
    run = make(
        Painter(clip, checked, outputs=clip.outputs), target, range(len(rows)), jobs=jobs,
        cluster=cluster, progress=progress,
    )  # fmt: skip
    if table is not None:
        write_output(table, table_bytes(Path(table), clip.names, clip.lines))
    if sheet is not None:
        write_sheet(Path(sheet), target.path, clip.names, clip.lines, across)
    return Sweep(clip.file, clip.names, clip.lines, clip.told, clip.diagnostics.items, run)
