"""A process that draws Programs which `scenelang.animation.workers` sends it, until its input ends."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

from scenelang.animation.painting import paint
from scenelang.animation.store import put_frame
from scenelang.backend.errors import RenderError
from scenelang.program.store import parse_program
from scenelang.renderers.kept import Kept


def main() -> None:
    """Read a line of JSON and a Program, draw, answer in a line; again and again."""
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


def _answer(head: dict[str, Any], data: bytes, kept: Kept) -> dict[str, Any]:
    file = Path(head["file"])
    try:
        put_frame(file, paint(parse_program(data), "cpu", threads=1, split=head["split"], kept=kept))
    except RenderError as error:
        return {"error": str(error)}
    except OSError as error:
        return {"error": error.strerror or str(error), "errno": error.errno or 5, "file": str(file)}
    return {}


if __name__ == "__main__":
    main()
