"""Ctrl-C at random moments of whole processes: code 130, no traceback, nothing half-written."""

from __future__ import annotations

import random
import signal
import sys
import time
from pathlib import Path

import pytest

from tests.assets.processes import SOON_S, leavings, started
from tests.cli.conftest import Folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no such signal")

MANY = "for (i in 0..<300) { star { scale(0.9); rotate(1turn * rand(i)); } }\n"
# Command -> its words, and the moments (s) among which one is drawn.
LONG = {
    "check": (("check", "long.nsg"), 1.0),
    "fmt": (("fmt", "--check", "long.nsg"), 1.0),
    "compile": (("compile", "long.nsg", "-o", "out.safetensors"), 1.5),
    "convert": (("convert", "long.nsg", "-o", "out.json"), 1.0),
    "graph": (("dump", "long.nsg", "-o", "out.dot"), 1.0),
    "render": (("render", "many.nsg", "-o", "out.png", "--size", "3000x3000"), 5.0),
    "reference": (
        ("render", "many.nsg", "-o", "out.png", "--size", "2000x2000", "--backend", "reference"),
        3.0,
    ),
    "animation": (("render", "moving.nsg", "-o", "out.gif", "--size", "512x512"), 5.0),
    "compare": (("compare", "many.nsg", "-o", "out.png", "--size", "2000x2000"), 5.0),
}
QUICK = ("compile", "render")


def cases() -> list[object]:
    rng = random.Random(7)
    found: list[object] = []
    for name, (_, most_s) in LONG.items():
        for turn in range(3):
            marks = () if name in QUICK and turn == 0 else (pytest.mark.slow,)
            found.append(pytest.param(name, rng.uniform(0, most_s), marks=marks, id=f"{name}-{turn}"))
    return found


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("name", "moment_s"), cases())
def test_interrupted(folder: Folder, name: str, moment_s: float, number: signal.Signals) -> None:
    line = "square { scale(0.1); translate(0.5, -0.5); material flat { color(#d33); } }\n"
    folder.write("long.nsg", line * 8_000)
    folder.write("many.nsg", MANY)
    folder.write("moving.nsg", f"animate(20s, 24);\ngroup {{ {MANY} rotate(1turn * u); }}")
    arguments, _ = LONG[name]
    with started(*arguments) as process:
        time.sleep(moment_s)
        process.send_signal(number)
        _, said = process.communicate(timeout=SOON_S)
    if process.returncode in (0, 1):
        pytest.skip("it was done before")
    assert process.returncode == 128 + number, said
    assert "Traceback" not in said
    assert "Exception ignored" not in said
    left = {file for file in leavings(folder.path) if not file.endswith(".nsg")}
    assert not [file for file in left if file.endswith(".part")], left
    target = next((word for word in arguments if word.startswith("out.")), None)
    assert target is None or not Path(target).exists()
