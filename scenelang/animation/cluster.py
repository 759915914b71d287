"""Drawing frames on the workers of a dask cluster.

Programs go out as bytes, with the elements and textures that they draw, and files come back as bytes: no file
system is shared.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from scenelang.animation.painting import Errand
from scenelang.animation.store import put_frame
from scenelang.cluster import AHEAD, Link
from scenelang.program.program import Program, program_bytes

if TYPE_CHECKING:
    from distributed import Future as Task

BATCH_S: Final = 0.25  # of drawing in a batch, beside which a task's own milliseconds are little
MOST_BATCH: Final = 64
MOST_BYTES: Final = 4 << 20  # of Programs in a batch, where elements make them large
_local = threading.local()


class Cluster:
    """The workers of a scheduler that draw frames, as `Helpers`; arguments and errors are those of `Link`."""

    def __init__(self, address: str) -> None:
        self._link = Link(address)
        self.batches = 0  # sent so far
        self._batch: list[tuple[bytes, Errand]] = []
        self._each_s = BATCH_S  # a frame, as far as is known
        self._under_way: dict[Task[Any], list[Errand]] = {}

    @property
    def count(self) -> int:
        """How many there are."""
        return self._link.count

    @property
    def waiting(self) -> int:
        """Frames that are asked for and not known to be done."""
        while self._under_way and self._link.ready:
            self._receive()
        return len(self._batch) + sum(map(len, self._under_way.values()))

    def submit(self, program: Program, errand: Errand) -> None:
        """Have a Program drawn to files; waits while many are under way. Raises as `take`."""
        self._batch.append((program_bytes(program), errand))
        large = sum(len(data) for data, _ in self._batch) > MOST_BYTES
        if large or len(self._batch) >= max(1, min(MOST_BATCH, int(BATCH_S / self._each_s))):
            while len(self._under_way) >= AHEAD * self.count:
                self._receive()
            self._send()

    def take(self) -> None:
        """Send what waits for others to travel with, and write what comes back next.

        Raises:
            RenderError: it cannot be drawn, several workers ended over it, or the scheduler is gone.
            OSError: a file cannot be written.
        """
        self._send()
        self._receive()

    def close(self) -> None:
        """Call off what is under way."""
        self._link.close()

    def _receive(self) -> None:
        future = self._link.next()
        errands = self._under_way.pop(future)
        seconds, found = self._link.result(future)
        self._each_s = 0.5 * (self._each_s + seconds / len(errands))
        for errand, files in zip(errands, found, strict=True):
            folder = Path(errand.file).parent
            put_frame({folder / name: data for name, data in files.items()})

    def _send(self) -> None:
        if self._batch:
            self._under_way[self._link.send(draw_batch, self._batch)] = [errand for _, errand in self._batch]
            self._batch, self.batches = [], self.batches + 1


def draw_batch(batch: Sequence[tuple[bytes, Errand]]) -> tuple[float, list[dict[str, bytes]]]:
    """Draw Programs on this machine: the processor's seconds, and the files of each by their names.

    Args:
        batch: bytes of Programs, and what is asked of them.

    Raises:
        RenderError: one cannot be drawn.
    """
    from scenelang.renderers.draw import Kept

    kept = _local.__dict__.setdefault("kept", Kept())
    started = time.process_time()  # others on this machine do not make batches smaller
    found = [
        {file.name: data for file, data in errand.run(program, kept).items()} for program, errand in batch
    ]
    return time.process_time() - started, found
