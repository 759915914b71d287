"""The table of a sweep: for each picture its file, the values, what decides its pixels, what went wrong.

The one that lies beside the pictures is CSV, with values as ``-D`` takes them, and is read back. A copy may
be Parquet, by pyarrow: numbers are float64 in the unit that the column's metadata name, vectors are lists.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from scenelang.files import read_regular, write_output
from scenelang.records import Record

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
        digest: of all that decides the picture; empty before it is drawn, or where it is not.
        error: what is wrong with the values; empty where nothing is.
    """

    picture: str
    values: tuple[str, ...]
    digest: str = ""
    error: str = ""

    @property
    def cells(self) -> tuple[str, ...]:
        """Of all columns."""
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
    made = io.BytesIO()
    pyarrow.parquet.write_table(arrow.Table.from_arrays(arrays, schema=arrow.schema(fields)), made)
    return made.getvalue()


def _typed(texts: Sequence[str]) -> tuple[Sequence[Any], str]:
    """Values of a column, None for defaults, and the unit of its numbers; the texts where kinds differ."""
    found = [_value(text) for text in texts]
    kinds = {type(value) for value, _ in found if value is not None}
    units = {unit for value, unit in found if value is not None}
    if len(kinds) > 1 or len(units) > 1:
        return texts, ""
    return [value for value, _ in found], next(iter(units), "")


def _value(text: str) -> tuple[Any, str]:
    """What a text stands for, and its unit."""
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
