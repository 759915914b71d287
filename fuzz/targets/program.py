"""Any bytes as the file of a Program, which is drawn if it is one."""

from __future__ import annotations

import warnings
from dataclasses import replace
from functools import cache

import numpy as np

from fuzz import tensors, text
from fuzz.target import Target, hold
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import Program, ProgramError, parse_program, program_bytes
from scenelang.drawing.how import RenderError
from scenelang.drawing.render import render
from scenelang.language.evaluation import loads
from scenelang.language.reports import SceneError

SIDE_PX = 12
MOST_DRAWN = 40
"""Objects of a Program that is drawn."""


def check(data: bytes) -> None:
    """Read, write, read again, and draw small."""
    try:
        program = parse_program(data)
    except ProgramError:
        return
    written = program_bytes(program)
    again = parse_program(written)
    hold(program_bytes(again) == written, "Program to bytes and back")
    hold(again.digest() == program.digest(), "digests stay")
    for name in ("vectors", "tokens", "bounds"):
        hold(np.array_equal(getattr(again, name), getattr(program, name)), "tensors stay", name)
    for name in ("canvas", "background", "model", "weights", "objects", "places"):
        hold(getattr(again, name) == getattr(program, name), "settings stay", name)
    if len(program) <= MOST_DRAWN:
        _draw(program)


def _draw(program: Program) -> None:
    """A picture of numbers in [0, 1], or a RenderError, and no warning on the way."""
    width, height = (min(side, SIDE_PX) for side in program.canvas)
    small = replace(program, canvas=(width, height))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            picture = render(small, device="cpu", threads=1)
        except RenderError:
            return
        pixels = picture.to_uint8()
    channels = 4 if program.background is None else 3
    hold(picture.shape == pixels.shape == (height, width, channels), "a picture of the canvas's size")
    hold(np.isfinite(picture).all(), "pixels are numbers", picture)
    hold(((picture >= 0) & (picture <= 1)).all(), "pixels lie in [0, 1]")


@cache
def _programs() -> tuple[bytes, ...]:
    found = []
    for source in text.texts():
        try:
            program = compile_scene(loads(source))
        except SceneError:
            continue
        if len(program) <= 8:
            found.append(program_bytes(replace(program, canvas=(16, 9))))
    return tuple(dict.fromkeys(found))


def seeds() -> list[bytes]:
    """Programs of small scenes, and the beginnings of one."""
    programs = _programs()
    return [*programs, b"", b"\0" * 8, programs[0][:8], programs[0][:-1], b"\x02\0\0\0\0\0\0\0{}"]


def dictionary() -> list[bytes]:
    """Words of the headers."""
    words = "vectors tokens bounds objects places dtype shape data_offsets F32 I8 I32 __metadata__ scenelang"
    return tensors.quoted(f"{words} canvas background model weights files")


TARGET = Target(
    name="program",
    summary="any bytes are a Program or a ProgramError; a Program stays as it is through its file, and is "
    "drawn without a warning in numbers within [0, 1]",
    check=check,
    seeds=seeds,
    mutate=tensors.mutate,
    dictionary=dictionary,
    most_bytes=16_384,
)
