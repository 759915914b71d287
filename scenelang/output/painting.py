"""Frames to pictures: in this process, in others, and on the workers of a cluster.

Each other process reads compiled Programs from a pipe and ends with it. Processes of `concurrent.futures`
would run an embedder's main module again, and stay where this one is killed. Workers of a cluster get and
return bytes, so that no file system need be shared.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Final, NamedTuple

from scenelang.compiler.program import Program, parse_program, program_bytes
from scenelang.drawing.how import DEFAULT, How, RenderError, threads_for
from scenelang.drawing.image import Image, Output, enlarged, packed
from scenelang.output.frames import Clip, Drawable, Shot, frame_key, put_frame
from scenelang.output.workers import Connection

DRAFT = 4  # pixels across that one of a draft stands for
Progress = Callable[[float], None]
_version = lru_cache(version)


@dataclass(slots=True)
class Painter:
    """Draws a clip's frames."""

    clip: Clip  # the animation
    how: How = DEFAULT  # how they are drawn
    outputs: tuple[Output, ...] = ()  # next to each picture
    load_s: float = 0.0  # time of loading torch

    def prepare(self, shot: Shot) -> Drawable:
        """Compile a frame and compute the key of its files; raises as `Clip.program`, or `RenderError`."""
        program, place = None, "cpu"
        if self.how.backend == "reference":
            scene = self.how.sampled(shot.scene.model_copy(update={"animation": None}))
            key = frame_key("reference", _version("scenelang"), scene.to_json())
            names: tuple[object, ...] = (self.clip.texts,)
        else:
            program = self.how.sampled(self.clip.program(shot))
            place = self._place(program)
            library = place if place == "numpy" else "torch"
            cores = () if place == "numpy" and program.stage is None else (self.split(program),)
            way = self.how.backend, *self.how.care.values()
            key = frame_key(place, _version("scenelang"), _version(library), *way, *cores, program.digest())
            names = program.numbers, program.objects, program.places
        if self.outputs:  # they name objects and their places in the text
            key = frame_key(key, self.outputs, *names)
        return Drawable(shot.number, key, shot, program, place)

    def _place(self, program: Program) -> str:
        """The library or device that draws a Program: numpy, or a torch device."""
        from scenelang.drawing.small import choose_drawer

        how = self.how
        if choose_drawer(program, how.device, exact=how.backend == "exact")[0] == "numpy":
            return "numpy"
        started = time.perf_counter()
        from scenelang.drawing.torch_backend import choose_device

        self.load_s += time.perf_counter() - started
        return choose_device(how.device)

    def split(self, program: Program) -> int:
        """Number of threads for which a picture is split; it affects the last bits of its pixels."""
        return threads_for(program.canvas) if self.how.threads is None else self.how.threads

    def draw(self, frame: Drawable, progress: Progress | None = None) -> Image:
        """Draw a frame; the same picture as `scenelang.render` gives for it on this device, bit for bit."""
        from scenelang.drawing.render import draw, draw_exact

        if frame.program is None:
            return draw_exact(
                self.how.sampled(frame.shot.scene), spans=frame.shot.spans, patient=self.how.patient
            )
        how = self.how._replace(threads=self.split(frame.program))
        place, split = frame.place, how.threads
        return draw(frame.program, how, place=place, split=split, progress=progress).image

    def draft(self, frame: Drawable) -> Image | None:
        """A coarse picture of solids in the frame's size, for about a twentieth of the work; else None."""
        program = frame.program
        if program is None or program.stage is None or min(program.canvas) < DRAFT * DRAFT:
            return None
        from scenelang.drawing.small import draw_small

        width, height = program.canvas
        coarse = replace(program, canvas=(-(-width // DRAFT), -(-height // DRAFT)))
        return enlarged(draw_small(coarse, samples="one", threads=self.how.threads).image, program.canvas)

    def files(self, frame: Drawable, file: Path, progress: Progress | None = None) -> dict[Path, bytes]:
        """Bytes of the files of the picture and its outputs; raises as `scenelang.render_outputs`."""
        from scenelang.drawing.render import outputs_of

        shot, drawn = frame.shot, frame.program or frame.shot.scene
        result = outputs_of(drawn, self.outputs, self.how, spans=shot.spans)
        return packed(self.draw(frame, progress), result, file)


class Errand(NamedTuple):
    """A frame that another process draws, by one thread; its fields are what JSON holds."""

    file: str  # where its picture goes, which names the format
    place: str  # numpy, or a torch device
    split: int  # threads that the picture is split for
    outputs: tuple[Output, ...] = ()  # next to it
    how: How = DEFAULT  # how it is drawn

    def run(self, program: bytes) -> dict[Path, bytes]:
        """Draw a Program's bytes; returns those of its files and raises as `scenelang.render_outputs`."""
        from scenelang.drawing.render import draw, outputs_of

        read, how = parse_program(program), How(*self.how)._replace(threads=1)
        image = draw(read, how, place=self.place, split=self.split).image
        return packed(image, outputs_of(read, self.outputs, how), Path(self.file))


FRAMES_AHEAD = 2  # frames that wait for each process, so that none is idle and few use memory


class Workers:
    """Processes that draw Programs into files, each with one thread."""

    def __init__(self, count: int) -> None:
        self.count = count
        self._free: SimpleQueue[subprocess.Popen[bytes]] = SimpleQueue()
        # in sessions of their own: Ctrl-C reaches this process alone, which ends the others
        command, pipe = [sys.executable, "-m", "scenelang.output.painting"], subprocess.PIPE
        self._all = [
            subprocess.Popen(command, stdin=pipe, stdout=pipe, start_new_session=True) for _ in range(count)
        ]
        for process in self._all:
            self._free.put(process)
        self._pool = ThreadPoolExecutor(count)
        self._waiting: deque[Future[None]] = deque()

    @property
    def waiting(self) -> int:
        """Frames that were submitted and are not known to be done."""
        while self._waiting and self._waiting[0].done():
            self.take()
        return len(self._waiting)

    def submit(self, program: Program, errand: Errand) -> None:
        """Have a Program drawn to files; waits while many are under way. Raises as `take`."""
        while len(self._waiting) >= FRAMES_AHEAD * self.count:
            self.take()
        self._waiting.append(self._pool.submit(self._draw, program_bytes(program), errand))

    def take(self) -> None:
        """Wait for the first submitted frame; raises the `RenderError` or `OSError` by which it failed."""
        self._waiting.popleft().result()

    def _draw(self, program: bytes, errand: Errand) -> None:
        process = self._free.get()
        try:
            assert process.stdin is not None
            assert process.stdout is not None
            head = {"errand": errand._replace(file=os.path.abspath(errand.file)), "bytes": len(program)}
            try:
                process.stdin.write(json.dumps(head).encode() + b"\n" + program)
                process.stdin.flush()
                said = process.stdout.readline()
            except OSError:
                said = b""
            if not said:
                code = process.wait()
                raise RenderError(f"a drawing process ended by itself (code {code}); --jobs 1 needs none")
            answer = json.loads(said)
            if "errno" in answer:
                raise OSError(answer["errno"], answer["error"], answer["file"])
            if "error" in answer:
                raise RenderError(answer["error"])
        finally:
            self._free.put(process)

    def close(self) -> None:
        for future in self._waiting:
            future.cancel()
        for process in self._all:
            process.kill()
        self._pool.shutdown()
        for process in self._all:
            process.communicate()


def main() -> None:
    """Read a line of JSON and a Program, draw, answer in a line, until the input ends."""
    # Answers go to standard output; prints of libraries go to standard error.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    source = sys.stdin.buffer
    while line := source.readline():
        head = json.loads(line)
        program = source.read(head["bytes"])
        if len(program) < head["bytes"]:
            return
        errand, answer = Errand(*head["errand"]), dict[str, Any]()
        try:
            put_frame(errand.run(program))
        except RenderError as error:
            answer = {"error": str(error)}
        except OSError as error:
            answer = {"error": error.strerror or str(error), "errno": error.errno or 5, "file": errand.file}
        try:
            answers.write(json.dumps(answer).encode() + b"\n")
            answers.flush()
        except BrokenPipeError:  # the parent process is gone
            os._exit(0)


if __name__ == "__main__":
    main()

BATCH_S: Final = 0.25  # drawing time of a batch, against which a task's own milliseconds are small
MOST_BATCH: Final = 64
MOST_BYTES: Final = 4 << 20  # of the Programs in a batch; elements make them large


class Cluster:
    """Workers of a scheduler that draw frames, with the methods of `Workers`; raises as `Connection`."""

    def __init__(self, address: str) -> None:
        self._link = Connection(address)
        self.batches = 0  # sent so far
        self._batch: list[tuple[bytes, Errand]] = []
        self._each_s = BATCH_S  # estimated time of a frame

    @property
    def count(self) -> int:
        return self._link.count

    @property
    def waiting(self) -> int:
        while self._link.ready:
            self._receive()
        return len(self._batch) + sum(map(len, self._link.under_way.values()))

    def submit(self, program: Program, errand: Errand) -> None:
        self._batch.append((program_bytes(program), errand))
        large = sum(len(data) for data, _ in self._batch) > MOST_BYTES
        if large or len(self._batch) >= max(1, min(MOST_BATCH, int(BATCH_S / self._each_s))):
            while self._link.full:
                self._receive()
            self._send()

    def take(self) -> None:
        """Send an incomplete batch, and write the next files that come back; raises as `Connection.take`."""
        self._send()
        self._receive()

    def close(self) -> None:
        self._link.close()

    def _receive(self) -> None:
        errands, taken = self._link.take()
        seconds, result = taken()
        self._each_s = 0.5 * (self._each_s + seconds / len(errands))
        for errand, files in zip(errands, result, strict=True):
            folder = Path(errand.file).parent
            put_frame({folder / name: data for name, data in files.items()})

    def _send(self) -> None:
        if self._batch:
            self._link.send([errand for _, errand in self._batch], draw_batch, self._batch)
            self._batch, self.batches = [], self.batches + 1


def draw_batch(batch: Sequence[tuple[bytes, Errand]]) -> tuple[float, list[dict[str, bytes]]]:
    """Draw Programs' bytes on this machine: the processor's seconds, and the files of each by their names."""
    started = time.process_time()  # others on this machine do not make batches smaller
    result = [{p.name: data for p, data in errand.run(program).items()} for program, errand in batch]
    return time.process_time() - started, result
