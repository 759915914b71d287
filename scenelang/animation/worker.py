"""A process that draws Programs which `scenelang.animation.workers` sends it, until its input ends."""

from __future__ import annotations

import json
import os
import struct
import sys
from pathlib import Path
from typing import BinaryIO

from scenelang.animation.painting import paint
from scenelang.animation.store import put_frame
from scenelang.backend.errors import RenderError
from scenelang.program.store import parse_program
from scenelang.renderers.kept import Kept


def main() -> None:
    """Read a head and a Program, draw, answer in a line; again and again."""
    # Answers go where standard output went; whatever prints goes to standard error.
    answers = os.fdopen(os.dup(1), "wb")
    kept = Kept()
    os.dup2(2, 1)
    source = sys.stdin.buffer
    while sizes := source.read(8):
        head_size, program_size = struct.unpack("<II", sizes)
        head = json.loads(_exactly(source, head_size))
        answer = _answer(head, _exactly(source, program_size), kept)
        try:
            answers.write(json.dumps(answer).encode() + b"\n")
            answers.flush()
        except BrokenPipeError:  # whoever asked is gone
            os._exit(0)


def _exactly(source: BinaryIO, size: int) -> bytes:
    data = source.read(size)
    if len(data) < size:
        raise SystemExit(0)
    return data


def _answer(head: dict[str, object], data: bytes, kept: Kept) -> dict[str, object]:
    file, split = Path(str(head["file"])), int(str(head["split"]))
    try:
        put_frame(file, paint(parse_program(data), "cpu", threads=1, split=split, kept=kept))
    except RenderError as error:
        return {"error": str(error)}
    except OSError as error:
        return {"error": error.strerror or str(error), "errno": error.errno or 5, "file": str(file)}
    return {}


if __name__ == "__main__":
    main()
