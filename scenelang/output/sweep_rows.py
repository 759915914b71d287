"""Rows of a sweep: values of params, the table beside the pictures, and their frames.

A row depends on its number alone, so that a longer sweep begins with the rows of a shorter one, and a further
random param leaves the others unchanged.

The table next to the pictures is CSV, with values as ``-D`` takes them, and is read back. A copy may be
Parquet, by pyarrow: numbers are float64 in the unit of the column's metadata, vectors are lists.
"""

from __future__ import annotations

import csv
import io
import math
import random
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from itertools import islice
from numbers import Real
from pathlib import Path
from typing import Any, Final

from scenelang.assets.files import read_regular, write_output
from scenelang.assets.records import Record
from scenelang.language import tree
from scenelang.language.diagnostics import Diagnostics, plural
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
from scenelang.language.scene_text import number
from scenelang.language.statements import literal
from scenelang.language.values import UNITS, RangeValue, Vec, pack, unpack
from scenelang.output.frames import Clip, Shot

MOST_ROWS: Final = 1_000_000
MOST_LISTED: Final = 10_000  # values or ranges of a param between commas
_DIGITS: Final = 6  # digits of a value, relative to the width of its range
_RANGE: Final = re.compile(r"(.*?)\.\.(<?)(.*?)(?:/\s*(\d{1,7})|\s+step\s+(.+))?", re.DOTALL)


class Rows(Record):
    """Values of params, a row for each picture.

    Args:
        grid: texts of the values of each param of the grid; the last param changes fastest.
        random: params with random values.
        count: number of rows; the grid repeats.
        seed: of the random values.
        given: explicit rows, instead of all this.
    """

    grid: Mapping[str, tuple[str, ...]]
    random: tuple[Knob, ...] = ()
    count: int = 0
    seed: int = 0
    given: Sequence[Mapping[str, str]] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the params, in the order of columns."""
        if self.given:
            return tuple(dict.fromkeys(name for row in self.given for name in row))
        return (*self.grid, *(knob.name for knob in self.random))

    def __len__(self) -> int:
        return len(self.given) or self.count

    def __getitem__(self, index: int) -> Mapping[str, str]:
        if self.given:
            return self.given[index]
        result, rest = {}, index
        for name, texts in reversed(list(self.grid.items())):
            rest, at = divmod(rest, len(texts))
            result[name] = texts[at]
        result = {name: result[name] for name in self.grid}
        for knob in self.random:
            items = tuple(self._drawn(knob, axis, index) for axis in knob.axes)
            result[knob.name] = _text(knob, Vec(items) if knob.inner else items[0])
        return result

    def __iter__(self) -> Iterator[Mapping[str, str]]:
        return map(self.__getitem__, range(len(self)))

    def _drawn(self, knob: Knob, axis: Axis, index: int) -> Any:
        share = random.Random(f"{self.seed}/{axis.label}/{index}").random()
        place = int(share * len(axis.choices)) if axis.choices else share
        return value_at(axis, place, knob.value)


def rows_of(
    evaluation: Evaluation,
    grid: Mapping[str, str | Iterable[Any]],
    drawn: Mapping[str, str],
    count: int | None = None,
    seed: int = 0,
) -> Rows:
    """Rows of a grid and of random values.

    Args:
        evaluation: of the scene, after a run.
        grid: values of each param, or text as `values_of` takes it.
        drawn: params with random values, each with a range, or empty text for its own.
        count: number of rows; by default that of the grid.

    Raises:
        ParamError: there is no such param, or no such values of it; or there are none or too many.
    """
    result: dict[str, tuple[str, ...]] = {}
    for name, asked in grid.items():
        stmt = param_named(evaluation, name)
        texts = values_of(evaluation, stmt, asked) if isinstance(asked, str) else map(text_of, asked)
        result[name] = tuple(islice(texts, MOST_ROWS + 1))
        if len(result[name]) > MOST_ROWS:
            raise ParamError(f"more than {MOST_ROWS:,} values of `{name}`")
        if not result[name]:
            raise ParamError(f"no values for `{name}`")
    for name in drawn:
        if name in result:
            raise ParamError(f"param `{name}` both in the grid and drawn at random")
    knobs = tuple(_narrowed(evaluation, param_named(evaluation, name), text) for name, text in drawn.items())
    cells = math.prod(map(len, result.values()))
    if not result and not knobs:
        raise ParamError("no param to change")
    if count is None and not result:
        raise ParamError("a count is needed where all values are drawn at random")
    total = cells if count is None else count
    if result and total < cells:
        raise ParamError(f"{plural(total, 'picture')}, where the grid has {cells:,}")
    if total > cells and not knobs:
        fact = f"{plural(total, 'picture')}, where the grid has {cells:,}"
        raise ParamError(f"{fact} and nothing is drawn at random")
    if not 0 < total <= MOST_ROWS:
        raise ParamError(f"{total:,} pictures, where 1 to {MOST_ROWS:,} can be made")
    return Rows(result, knobs, total, seed)


def values_of(evaluation: Evaluation, stmt: tree.Param, text: str) -> Iterator[str]:
    """Texts of the values that ``text`` describes.

    It has values between commas. ``a..b/n`` is n values from a to b, ``a..<b/n`` n without b; ``a..b step c``
    and ``a..b`` are ranges of the language. Missing ends are those of the param's range. Empty text means
    every choice, or step, of the param.
    """
    words = _default(evaluation, stmt).__class__ is str
    for place, item in enumerate(_items(text)):
        if place == MOST_LISTED:
            raise ParamError(
                f"more than {MOST_LISTED:,} values or ranges of `{stmt.name.text}` between commas"
            )
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
    """The values of a range."""
    first, without, last, parts, step = match.groups()
    low, high, unit = _ends(evaluation, stmt, first, last)
    knob = Knob(
        stmt, _default(evaluation, stmt), (Axis(stmt.name.text, min(low, high), max(low, high)),), False
    )
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


def _narrowed(evaluation: Evaluation, stmt: tree.Param, text: str) -> Knob:
    """A param with random values from its own range or from one in ``text``."""
    if not text:
        return knob_of(stmt, evaluation.context)
    match = _RANGE.fullmatch(text)
    if match is None or match[2] or match[4] or match[5]:
        raise ParamError(f"`{text}` is not a range such as 0..1")
    low, high = sorted(_ends(evaluation, stmt, match[1], match[3])[:2])
    return Knob(stmt, _default(evaluation, stmt), (Axis(stmt.name.text, low, high),), False)


def _ends(evaluation: Evaluation, stmt: tree.Param, first: str, last: str) -> tuple[float, float, str]:
    """Both ends of a range in base units, and their kind."""
    like = _default(evaluation, stmt)
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
    return low, high, unpack(like)[1]


def _number(evaluation: Evaluation, stmt: tree.Param, text: str) -> Any:
    """The value of a literal of the kind of a param."""
    value, like = literal(text.strip(), evaluation.context), _default(evaluation, stmt)
    if value.__class__ is float and (value == 0.0 or unpack(like)[1] == "time"):
        value = pack(value, unpack(like)[1])
    if value.__class__ is not like.__class__:
        raise ParamError(f"`{text.strip()}` is not a value of `{stmt.name.text}`, whose default is "
                         f"{stmt.default.span.text}")  # fmt: skip
    return value


def _default(evaluation: Evaluation, stmt: tree.Param) -> Any:
    file = evaluation.context
    return file.env[file.scope.names[stmt.name.text].slot]


def _text(knob: Knob, value: Any) -> str:
    """A value as ``-D`` takes it."""
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


Writer = Callable[[Path, bytes], None]
PARQUET: Final = ".parquet"
_FRONT, _BACK = ("picture",), ("digest", "error")
_MOST_BYTES: Final = 1 << 30
_NUMBER: Final = re.compile(r"([-+]?[\d.]+(?:e[-+]?\d+)?)\s*([a-z]*)", re.IGNORECASE)


class TableError(ValueError):
    """A table that cannot be written, or one that is of another sweep."""


class Line(Record):
    """One row of a table.

    Args:
        picture: name of its file; empty where there is none.
        values: text of each param's value, in order; empty for its default.
        digest: digest of all that determines the picture; empty before it is drawn, or where it is not.
        error: error of the values; empty without one.
    """

    picture: str
    values: tuple[str, ...]
    digest: str = ""
    error: str = ""

    @property
    def cells(self) -> tuple[str, ...]:
        """Texts of all columns."""
        return (self.picture, *self.values, self.digest, self.error)


def check_table(path: Path) -> None:
    """Raise `TableError` where a table of this name cannot be written."""
    if path.suffix.lower() not in (".csv", PARQUET):
        raise TableError(f"`{path}` is not a table; one ends in .csv or {PARQUET}")
    if not path.parent.is_dir():
        raise TableError(f"cannot write `{path}`: there is no folder `{path.parent}`")
    if path.suffix.lower() == PARQUET and find_spec("pyarrow") is None:
        raise TableError(f"{PARQUET} needs pyarrow: pip install 'scenelang[parquet]'")


def write_table(
    path: Path, names: Sequence[str], lines: Sequence[Line], write: Writer = write_output
) -> None:
    """Write a table whole; raises `OSError`.

    Args:
        write: `write_whole` where no user wrote the name.
    """
    heads = (*_FRONT, *names, *_BACK)
    if path.suffix.lower() == PARQUET:
        write(path, _parquet(heads, lines))
        return
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(line.cells for line in lines)
    write(path, text.getvalue().encode())


def read_table(path: Path, names: Sequence[str]) -> list[Line]:
    """The rows of a table that was written before, as CSV.

    Raises:
        TableError: it has other columns, or is none.
        OSError: it cannot be read.
    """
    try:
        text = read_regular(path, _MOST_BYTES).decode("utf-8")
        rows = list(csv.reader(io.StringIO(text, newline="")))
    except (ValueError, csv.Error) as error:
        raise TableError(f"`{path}` is not a table: {error}") from None
    heads = [*_FRONT, *names, *_BACK]
    if not rows or rows[0] != heads or any(len(row) != len(heads) for row in rows):
        raise TableError(f"`{path}` is not a table of these params")
    return [Line(row[0], tuple(row[1:-2]), *row[-2:]) for row in rows[1:]]


def _parquet(heads: Sequence[str], lines: Sequence[Line]) -> bytes:
    import pyarrow as arrow
    import pyarrow.parquet

    fields, arrays = [], []
    for name, texts in zip(heads, zip(*(line.cells for line in lines), strict=True), strict=True):
        values, unit = (texts, "") if name in (*_FRONT, *_BACK) else _typed(texts)
        arrays.append(arrow.array(values))
        fields.append(arrow.field(name, arrays[-1].type, metadata={"unit": unit} if unit else None))
    buffer = io.BytesIO()
    pyarrow.parquet.write_table(arrow.Table.from_arrays(arrays, schema=arrow.schema(fields)), buffer)
    return buffer.getvalue()


def _typed(texts: Sequence[str]) -> tuple[Sequence[Any], str]:
    """Values of a column, None for defaults, and the unit of its numbers; the texts where kinds differ."""
    result = [_value(text) for text in texts]
    kinds = {type(value) for value, _ in result if value is not None}
    units = {unit for value, unit in result if value is not None}
    if len(kinds) > 1 or len(units) > 1:
        return texts, ""
    return [value for value, _ in result], next(iter(units), "")


def _value(text: str) -> tuple[Any, str]:
    """Value of a text, and its unit."""
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


class Variants(Clip):
    """Scenes of rows, by the number of the row; the text is parsed once and run for each.

    Args:
        source: the scene, parsed, with the values that all rows share.
        rows: values of params.
        frame: number of the frame of an animation.
        diagnostics: as for `Clip`.
    """

    def __init__(self, source: Source, rows: Rows, frame: int, diagnostics: Diagnostics) -> None:
        self._source, self._rows, self._frame = source, rows, frame
        super().__init__(source.evaluation(diagnostics), diagnostics)
        self._memory = None  # rows share no objects

    def shot(self, number: int) -> Shot:
        assert isinstance(self._evaluation, Evaluation)
        self._evaluation.inputs.values = self._source.values | dict(self._rows[number])
        return replace(super().shot(self._frame), number=number)

    def mend(self) -> None:
        """Forget the errors of a row, so that others can be run."""
        old, self.diagnostics = self.diagnostics, Diagnostics()
        for d in old:
            if d.severity == "warning":
                self.diagnostics.add(d.code, d.message, d.span, labels=d.labels, help=d.help, fix=d.fix)
        self._evaluation = self._source.evaluation(self.diagnostics)
