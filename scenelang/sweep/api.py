"""`scenelang.render_many`: pictures of one scene with other values of its params."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, Unpack

from scenelang.animation.painting import Painter
from scenelang.animation.run import Progress, RenderResult, make
from scenelang.animation.targets import Target, TargetError, find_target, is_pattern
from scenelang.backend.options import How, Options
from scenelang.diagnostics.diagnostic import Diagnostic, Diagnostics
from scenelang.diagnostics.error import SceneError
from scenelang.evaluate.evaluation import Evaluation, Source
from scenelang.evaluate.ranges import ParamError, param_named
from scenelang.image import image_format
from scenelang.outputs import Output
from scenelang.sweep.book import TEXTS, Book
from scenelang.sweep.sheet import write_sheet
from scenelang.sweep.table import Line, check_table, write_table
from scenelang.sweep.values import MOST_ROWS, Rows, rows_of, text_of
from scenelang.sweep.variants import Variants

Kind = Literal["depth", "normal", "object", "alpha", "scene", "program"]
BESIDE: Final[tuple[Output, ...]] = ("depth", "normal", "object", "alpha")


@dataclass(frozen=True, slots=True)
class Sweep:
    """Pictures that were written.

    Args:
        table: file of values, digests and errors.
        names: of the params.
        lines: the table's rows.
        failed: what is wrong with the first few of the rows without a picture, by their numbers.
        warnings: each that was met, once.
        made: how they were drawn.
    """

    table: Path
    names: tuple[str, ...]
    lines: Sequence[Line]
    failed: Mapping[int, Sequence[Diagnostic]]
    warnings: Sequence[Diagnostic]
    made: RenderResult

    @property
    def errors(self) -> int:
        """How many rows have no picture."""
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

    Each picture is the one that `scenelang.render` gives for its values. A call that was interrupted goes on
    where it stopped, and one with a larger ``count`` adds to what is there. Rows whose values give no scene
    are left out and told of.

    Args:
        path: the scene file. Scenes have no params left; `scenelang.animate` draws several.
        out: a folder, or numbered pictures (``out/%05d.png``). The table lies there too, as ``STEM.csv``.
        values: of each picture, as for `scenelang.load`; instead of the next four.
        grid: values of params, of which all combinations are drawn: a list, or text such as ``"0..1/10"``,
            ten from 0 to 1, ``"0.1,0.5"``, ``"0..1 step 0.25"``, or ``""`` for every choice there is.
        random: params that are drawn uniformly from their ranges, or from those of a mapping.
        count: how many pictures; the grid is gone through again and again.
        seed: of what is drawn. A row's values hang on its number, the seed and the param's name alone.
        params: values that all pictures share.
        outputs: what to write beside each picture: ``"depth"`` and so on as `scenelang.render_outputs` has
            it, ``"scene"`` as text without params, and ``"program"``.
        table: a copy of the table, .csv or .parquet.
        sheet: a picture that shows all of them, small.
        frame, size, model, root: as for `scenelang.load`.
        jobs, cluster, progress, **how: as for `scenelang.animate`.

    Returns:
        What was written, also where some or all rows have errors.

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
    found = Diagnostics()
    fixed = dict(params or {})
    source = Source(path, params=fixed, model=model, root=root, size=size).parsed(found)
    first = source.evaluation(found, frame=frame)
    if first.run(frame)[0] is None or found.errors:  # those of its syntax are of no row
        raise SceneError(found)
    rows = _rows(first, values, grid or {}, random, count, seed)
    for name in rows.names:
        if name in fixed:
            raise ParamError(f"param `{name}` with one value for all pictures, and with others")
    clip = Variants(source, rows, frame, found)
    beside: list[Output] = [name for name in BESIDE if name in outputs]
    painter = Painter(clip, How(**how).checked(), outputs=tuple(beside), single=True)
    book = Book(target, rows, clip, painter.outputs, [name for name in TEXTS if name in outputs], stem)
    made = make(
        painter, target, range(len(rows)), jobs=jobs, cluster=cluster,
        beside=book.beside, failed=book.failed, progress=progress,
    )  # fmt: skip
    names, lines = rows.names, book.lines
    if table is not None:
        write_table(Path(table), names, lines)
    if sheet is not None:
        last = len(tuple(rows.grid.values())[-1]) if len(rows.grid) > 1 else 0  # a row of the sheet
        write_sheet(Path(sheet), target.path, names, lines, last)
    return Sweep(book.file, names, lines, book.told, clip.diagnostics.items, made)


def _target(out: str, stem: str) -> Target:
    """Where pictures go; raises `TargetError`."""
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
    found = Rows({}, given=given)
    for name in found.names:
        if name not in first.inputs.known:
            param_named(first, name)
    return found
