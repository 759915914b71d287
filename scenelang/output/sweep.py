"""Sweeps: pictures of one scene with other values of its params.

`sweep_rows` gives the values, the scenes and the table; here the table is kept up to date while rows are
drawn, `write_sheet` shows the pictures, and `render_many` runs it all.
"""

from __future__ import annotations

import io
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, Unpack

from PIL import Image as pillow
from PIL import ImageDraw, ImageFont

from scenelang.assets.files import write_output, write_whole
from scenelang.compiler.program import program_bytes
from scenelang.drawing.how import How, Options, RenderError
from scenelang.drawing.image import Output, image_format, output_file
from scenelang.language.diagnostics import Diagnostic, Diagnostics
from scenelang.language.evaluation import Evaluation, ParamError, Source, param_named
from scenelang.language.reports import SceneError
from scenelang.output.animate import Progress, RenderResult, make
from scenelang.output.frames import Store, Target, TargetError, find_target, is_pattern
from scenelang.output.painting import Drawable, Painter
from scenelang.output.sweep_rows import (
    MOST_ROWS,
    Line,
    Rows,
    TableError,
    Variants,
    check_table,
    read_table,
    rows_of,
    text_of,
    write_table,
)

TEXTS: Final = {"scene": ".nsg", "program": ".safetensors"}
"""Suffixes of files next to a picture that are not pictures themselves."""
_REPORTED: Final = 3  # rows whose errors are reported in full


class SweepTable:
    """Table of a sweep, updated as rows are compiled.

    It is written before anything is drawn, and again when all rows are compiled, before pictures are moved to
    their places. So pictures of another sweep are noticed, wherever that sweep was stopped.

    Args:
        target: files of the pictures.
        rows: the values.
        clip: makes scenes of them.
        outputs: further pictures next to each picture.
        texts: kinds of `TEXTS` next to each picture.
        stem: name of the table.

    Attributes:
        file: the table.
        lines: its rows.
        told: errors of the first rows that have any, by number.

    Raises:
        TableError: the folder has the pictures of another sweep.
        OSError: the table cannot be read or written.
    """

    def __init__(
        self,
        target: Target,
        rows: Rows,
        clip: Variants,
        outputs: Sequence[Output],
        texts: Sequence[str],
        stem: str,
    ) -> None:
        self.target, self.clip, self.outputs, self.texts = target, clip, outputs, texts
        self.file, self.names = target.path / f"{stem}.csv", rows.names
        self.told: dict[int, Sequence[Diagnostic]] = {}
        self.lines = [
            Line(target.file(at).name, tuple(row.get(name, "") for name in self.names))
            for at, row in enumerate(rows)
        ]
        self._old = self._before()
        target.path.mkdir(parents=True, exist_ok=True)
        if not self._old:
            write_table(self.file, self.names, self.lines, write_whole)

    def _before(self) -> list[Line]:
        """Rows of the previous sweep that this one continues."""
        if not self.file.exists():
            if self.target.path.is_dir() and (others := self.target.there()):
                fact = f"pictures of these names without a table, `{others[0].name}` among them"
                raise TableError(f"`{self.target.path}` has {fact}")
            return []
        old = read_table(self.file, self.names)
        for at, (line, now) in enumerate(zip(old, self.lines, strict=False)):
            if line.values != now.values:
                fact = f"{', '.join(line.values)} where {', '.join(now.values)} are asked for"
                raise TableError(f"`{self.file}` has other values in row {at}: {fact}")
        if len(old) > len(self.lines):
            raise TableError(f"`{self.file}` has {len(old):,} rows, and {len(self.lines):,} are asked for")
        return old

    def beside(self, frame: Drawable, store: Store) -> Mapping[str, bytes]:
        """Note a row that gives a scene; returns the files next to its picture."""
        line = self.lines[frame.number]
        old = self._old[frame.number] if frame.number < len(self._old) else line
        if old.digest == frame.key:
            self._adopt(frame, store)
        elif old.digest:
            raise TableError(
                f"`{self.file}` is of another scene, model, size or version: row {frame.number} differs"
            )
        self._note(frame.number, Line(line.picture, line.values, frame.key))
        result = {}
        if "scene" in self.texts:
            result[TEXTS["scene"]] = frame.shot.scene.to_nsg().encode()
        if "program" in self.texts:
            if frame.program is None:
                raise RenderError("the reference has no programs to write")
            result[TEXTS["program"]] = program_bytes(frame.program)
        return result

    def failed(self, number: int, error: SceneError) -> None:
        """Note a row whose values give no scene."""
        errors = [d for d in error.diagnostics if d.severity == "error"]
        if len(self.told) < _REPORTED:
            self.told[number] = errors
        line = self.lines[number]
        self._note(number, Line("", line.values, "", f"{errors[0].code}: {errors[0].message}"))
        self.clip.mend()

    def _adopt(self, frame: Drawable, store: Store) -> None:
        """Reuse the files of an existing picture."""
        file, stored = self.target.file(frame.number), store.file(frame.key)
        files = {output_file(stored, name): output_file(file, name) for name in self.outputs} | {stored: file}
        if all(path.is_file() for path in files.values()):
            for into, path in files.items():
                store.adopt(into, path)

    def _note(self, number: int, line: Line) -> None:
        self.lines[number] = line
        if number == len(self.lines) - 1:
            write_table(self.file, self.names, self.lines, write_whole)


MOST_SIDE: Final = 4096  # pixels of a sheet
MOST_CELLS: Final = 1024
_CELL, _LEAST, _GAP, _TEXT = 160, 24, 4, 13
_WORTH: Final = 64  # pixels across from which on a picture is labelled


def write_sheet(
    path: Path, folder: Path, names: Sequence[str], lines: Sequence[Line], across: int = 0
) -> int:
    """Draw the pictures of ``lines`` in rows, over white, labelled where there is room; returns how many.

    Of more than `MOST_CELLS` as many are taken, evenly.

    Args:
        path: the sheet.
        folder: of the pictures.
        across: pictures in a row; by default as many as make a square.

    Raises:
        OSError: a picture cannot be read, or the sheet be written.
    """
    every = math.ceil(len(lines) / MOST_CELLS)
    lines = lines[::every]
    first = next((line.picture for line in lines if line.digest), None)
    width, height = (1, 1) if first is None else _size(folder / first)
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
            sheet.paste(_small(folder / line.picture, size), (x, y))
        else:
            draw.rectangle((x, y, x + size[0] - 1, y + size[1] - 1), "#eeeeee")
            draw.text((x + 3, y + 2), line.error[:5], "#aa2222", font)
        if below:
            label = ", ".join(
                f"{name} {value}" for name, value in zip(names, line.values, strict=True) if value
            )
            draw.text((x, y + size[1]), _cut(label, size[0], font), "#444444", font)
    buffer = io.BytesIO()
    sheet.save(buffer, image_format(path))
    write_output(path, buffer.getvalue())
    return len(lines)


def _size(file: Path) -> tuple[int, int]:
    with pillow.open(file) as image:
        return image.size


def _small(file: Path, size: tuple[int, int]) -> pillow.Image:
    with pillow.open(file) as image:
        image.draft("RGB", size)
        shown = image.convert("RGBA").resize(size, pillow.Resampling.LANCZOS)
    return pillow.alpha_composite(pillow.new("RGBA", size, "white"), shown).convert("RGB")


def _cut(text: str, width: int, font: ImageFont.FreeTypeFont | ImageFont.ImageFont) -> str:
    while text and font.getlength(text) > width:
        text = text[:-2] + "…" if len(text) > 2 else ""
    return text


Kind = Literal["depth", "normal", "object", "alpha", "scene", "program"]
BESIDE: Final[tuple[Output, ...]] = ("depth", "normal", "object", "alpha")


@dataclass(frozen=True, slots=True)
class Sweep:
    """Pictures that were written.

    Args:
        table: file of values, digests and errors.
        names: of the params.
        lines: the table's rows.
        failed: errors of the first few rows without a picture, by number.
        warnings: all warnings, each once.
        made: figures of the run.
    """

    table: Path
    names: tuple[str, ...]
    lines: Sequence[Line]
    failed: Mapping[int, Sequence[Diagnostic]]
    warnings: Sequence[Diagnostic]
    made: RenderResult

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
    given: object = path
    if not isinstance(given, str | os.PathLike):
        fact = f"{type(path).__name__} where the path of a scene is needed, whose text has the params"
        raise TypeError(f"{fact}; several Scenes are drawn by `animate` and `render_frames`")
    stem = Path(path).stem
    target = _target(os.fspath(out), stem)
    if table is not None:
        check_table(Path(table))
    if sheet is not None:
        image_format(sheet)
    diagnostics = Diagnostics()
    fixed = dict(params or {})
    source = Source(path, params=fixed, model=model, root=root, size=size).parsed(diagnostics)
    first = source.evaluation(diagnostics, frame=frame)
    if first.run(frame)[0] is None or diagnostics.errors:  # those of its syntax are of no row
        raise SceneError(diagnostics)
    rows = _rows(first, values, grid or {}, random, count, seed)
    for name in rows.names:
        if name in fixed:
            raise ParamError(f"param `{name}` with one value for all pictures, and with others")
    clip = Variants(source, rows, frame, diagnostics)
    beside: list[Output] = [name for name in BESIDE if name in outputs]
    painter = Painter(clip, How(**how).checked(), outputs=tuple(beside), single=True)
    sweep_table = SweepTable(
        target, rows, clip, painter.outputs, [name for name in TEXTS if name in outputs], stem
    )
    run = make(
        painter, target, range(len(rows)), jobs=jobs, cluster=cluster,
        beside=sweep_table.beside, failed=sweep_table.failed, progress=progress,
    )  # fmt: skip
    names, lines = rows.names, sweep_table.lines
    if table is not None:
        write_table(Path(table), names, lines)
    if sheet is not None:
        last = len(tuple(rows.grid.values())[-1]) if len(rows.grid) > 1 else 0  # a row of the sheet
        write_sheet(Path(sheet), target.path, names, lines, last)
    return Sweep(sweep_table.file, names, lines, sweep_table.told, clip.diagnostics.items, run)


def _target(out: str, stem: str) -> Target:
    """Files of the pictures; raises `TargetError`."""
    if is_pattern(out):
        return find_target(out)
    path = Path(out)
    if path.is_file() or (path.suffix and not path.is_dir() and not out.endswith(("/", "\\"))):
        raise TargetError(f"`{out}` is one file; many pictures go to a folder, or to files such as %05d.png")
    return Target("sequence", path, f"{stem.replace('%', '%%')}-%06d.png")


def _rows(
    first: Evaluation,
    values: Iterable[Mapping[str, Any]],
    grid: Mapping[str, str | Iterable[Any]],
    random: Iterable[str] | Mapping[str, str],
    count: int | None,
    seed: int,
) -> Rows:
    given = tuple({name: text_of(value) for name, value in row.items()} for row in values)
    drawn = dict(random) if isinstance(random, Mapping) else dict.fromkeys(random, "")
    if not given:
        return rows_of(first, grid, drawn, count, seed)
    if grid or drawn or count is not None:
        raise ParamError("values are given as they are, and as a grid or at random")
    if len(given) > MOST_ROWS:
        raise ParamError(f"{len(given):,} pictures, where at most {MOST_ROWS:,} can be made")
    rows = Rows({}, given=given)
    for name in rows.names:
        if name not in first.inputs.known:
            param_named(first, name)
    return rows
