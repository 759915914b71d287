"""Drawing frames in other processes.

Each is a plain ``python -m scenelang.animation.workers`` that gets compiled Programs through a pipe, and
ends when its pipe does, so that none outlives this process. Processes of `concurrent.futures` would run an
embedder's main module again, and stay behind where this one is killed.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from queue import SimpleQueue
from typing import Any

from scenelang.animation.painting import Errand
from scenelang.animation.store import put_frame
from scenelang.backend.options import RenderError
from scenelang.program.program import Program, program_bytes
from scenelang.renderers.draw import Kept

AHEAD = 2  # frames that wait for each process, so that none is idle and few are held


class Workers:
    """Processes that draw Programs into files, each with one thread."""

    def __init__(self, count: int) -> None:
        self.count = count
        self._free: SimpleQueue[subprocess.Popen[bytes]] = SimpleQueue()
        # in sessions of their own: Ctrl-C reaches this process alone, which ends the others
        command, pipe = [sys.executable, "-m", "scenelang.animation.workers"], subprocess.PIPE
        self._all = [
            subprocess.Popen(command, stdin=pipe, stdout=pipe, start_new_session=True) for _ in range(count)
        ]
        for process in self._all:
            self._free.put(process)
        self._pool = ThreadPoolExecutor(count)
        self._waiting: deque[Future[None]] = deque()

    @property
    def waiting(self) -> int:
        """Frames that are asked for and not known to be done."""
        while self._waiting and self._waiting[0].done():
            self.take()
        return len(self._waiting)

    def submit(self, program: Program, errand: Errand) -> None:
        """Have a Program drawn to files; waits while many are under way. Raises as `take`."""
        while len(self._waiting) >= AHEAD * self.count:
            self.take()
        self._waiting.append(self._pool.submit(self._draw, program_bytes(program), errand))

    def take(self) -> None:
        """Wait for the first of those asked for; raises the `RenderError` or `OSError` by which it failed."""
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
        """End the processes, whatever they are doing."""
        for future in self._waiting:
            future.cancel()
        for process in self._all:
            process.kill()
        self._pool.shutdown()
        for process in self._all:
            process.communicate()


def main() -> None:
    """Read a line of JSON and a Program, draw, answer in a line, until the input ends."""
    # Answers go where standard output went; whatever prints goes to standard error.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    kept, source = Kept(), sys.stdin.buffer
    while line := source.readline():
        head = json.loads(line)
        program = source.read(head["bytes"])
        if len(program) < head["bytes"]:
            return
        try:
            answers.write(json.dumps(_answer(head, program, kept)).encode() + b"\n")
            answers.flush()
        except BrokenPipeError:  # whoever asked is gone
            os._exit(0)


def _answer(head: dict[str, Any], program: bytes, kept: Kept) -> dict[str, Any]:
    errand = Errand(*head["errand"])
    try:
        put_frame(errand.run(program, kept))
    except RenderError as error:
        return {"error": str(error)}
    except OSError as error:
        return {"error": error.strerror or str(error), "errno": error.errno or 5, "file": errand.file}
    return {}


if __name__ == "__main__":
    main()
