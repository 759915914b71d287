"""What is known of each row while a sweep is drawn, and what is found of one before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from scenelang.animation.painting import Drawable
from scenelang.animation.store import Store
from scenelang.animation.targets import Target
from scenelang.backend.options import RenderError
from scenelang.diagnostics.diagnostic import Diagnostic
from scenelang.diagnostics.error import SceneError
from scenelang.files import write_whole
from scenelang.outputs import Output, output_file
from scenelang.program.program import program_bytes
from scenelang.scene.text import to_nsg
from scenelang.sweep.table import Line, TableError, read_table, write_table
from scenelang.sweep.values import Rows
from scenelang.sweep.variants import Variants

TEXTS: Final = {"scene": ".nsg", "program": ".safetensors"}
"""What is written beside a picture that is no picture itself."""
_TOLD: Final = 3  # rows whose errors are told in full


class Book:
    """The table of a sweep, kept as rows are compiled.

    It is written before anything is drawn, and again when all is compiled, before pictures are put in place:
    so values of another sweep are noticed whenever that was stopped.

    Args:
        target: where pictures go.
        rows: the values.
        clip: makes scenes of them.
        outputs: pictures beside each picture.
        texts: of `TEXTS`, beside each picture.
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
        """The rows of a sweep that this one goes on with."""
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
        """Note a row that gives a scene; what is to lie beside its picture."""
        line = self.lines[frame.number]
        old = self._old[frame.number] if frame.number < len(self._old) else line
        if old.digest == frame.key:
            self._adopt(frame, store)
        elif old.digest:
            raise TableError(
                f"`{self.file}` is of another scene, model, size or version: row {frame.number} differs"
            )
        self._note(frame.number, Line(line.picture, line.values, frame.key))
        found = {}
        if "scene" in self.texts:
            found[TEXTS["scene"]] = to_nsg(frame.shot.scene).encode()
        if "program" in self.texts:
            if frame.program is None:
                raise RenderError("the reference has no programs to write")
            found[TEXTS["program"]] = program_bytes(frame.program)
        return found

    def failed(self, number: int, error: SceneError) -> None:
        """Note a row whose values give no scene."""
        errors = [d for d in error.diagnostics if d.severity == "error"]
        if len(self.told) < _TOLD:
            self.told[number] = errors
        line = self.lines[number]
        self._note(number, Line("", line.values, "", f"{errors[0].code}: {errors[0].message}"))
        self.clip.mend()

    def _adopt(self, frame: Drawable, store: Store) -> None:
        """Take the files of a picture that is there."""
        file, kept = self.target.file(frame.number), store.file(frame.key)
        files = {output_file(kept, name): output_file(file, name) for name in self.outputs} | {kept: file}
        if all(path.is_file() for path in files.values()):
            for into, path in files.items():
                store.adopt(into, path)

    def _note(self, number: int, line: Line) -> None:
        self.lines[number] = line
        if number == len(self.lines) - 1:
            write_table(self.file, self.names, self.lines, write_whole)
