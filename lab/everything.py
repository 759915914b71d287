"""Every measurement that the documentation reports, as command lines, and one run of all of them."""

from __future__ import annotations

import importlib.util
import itertools
import os
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple

from lab import ROOT


class Step(NamedTuple):
    """A command line to format; ``{few}`` is a twentieth of ``{scenes}`` but at least 1."""

    line: str
    # modules, programs or variables of the environment besides the extra `dev`; left out where one lacks
    needs: tuple[str, ...] = ()


STEPS: Final = (
    Step("lab eval shapes2d --all-sets --scenes {scenes} -o {out}/eval"),
    Step("lab eval textures2d --set textures2d --set textures2d-mixed --scenes {scenes} -o {out}/textures2d"),
    Step(
        "lab eval solids3d --set solids3d --set diffuse --set media --set deformed --set booleans "
        "--set shuffled --set wide --set staged --set mixed --scenes {scenes} -o {out}/solids3d"
    ),
    Step("lab eval solids3d --set meshes3d --scenes {scenes} -o {out}/meshes3d", ("SCENELANG_ORIGINALS",)),
    Step("lab stability shapes2d --scenes {few} -o {out}/stability-shapes2d"),
    Step("lab stability textures2d --scenes {few} -o {out}/stability-textures2d"),
    Step("lab stability solids3d --scenes {few} -o {out}/stability-solids3d"),
    Step("lab light --scenes {few} --paths 512 -o {out}/light", needs=("numba",)),
    Step("lab shadows --scenes {scenes} -o {out}/shadows"),
    Step("lab frontier shapes2d --scenes {scenes} -o {out}/frontier-shapes2d"),
    Step("lab frontier shapes2d --verify --scenes {scenes} -o {out}/frontier-shapes2d"),
    Step("lab frontier solids3d --scenes {few} -o {out}/frontier-solids3d"),
    Step("lab fit shapes2d --scenes {few} --params 1 --side 32 -o {out}/fit"),
    Step("lab train shapes2d-reading --budget {budget} -o {out}/train"),
    Step("lab bench floor --exact --frames {few} --scene shapes2d --scene chains"),
    Step("lab bench meshes caterpillar --resolution 48", needs=("igl",)),
    Step("lab bench startup {few}"),
    Step("lab bench compile 100 1000 --json {out}/compile.json"),
    Step("lab bench proof --set shapes2d --scenes {few}"),
    Step("lab bench mutations --count {few}"),
    Step("lab bench lsp 200"),
    Step("lab bench solids --scenes 1 --side 48 -o {out}/solid-rivals.json", needs=("mitsuba", "povray")),
)
"""Commands in their order: each command of the laboratory and each benchmark that a page cites."""

ELSEWHERE: Final = {
    "play": "a browser",
    "viewer": "a browser",
}
"""Benchmarks that pages cite and that are not run here, and what they need."""


def command_lines(out: Path, budget: float, scenes: int) -> list[tuple[list[str], Step]]:
    """The words of each step, for a folder, processor minutes of each training and scenes of evaluations."""
    fields = {
        "{out}": [str(out)],
        "{budget}": [f"{budget:g}"],
        "{scenes}": [str(scenes)],
        "{few}": [str(max(1, scenes // 20))],
    }

    def words(line: str) -> list[str]:
        of = (fields.get(word, [word.replace("{out}", str(out))]) for word in line.split())
        return list(itertools.chain.from_iterable(of))

    return [(words(step.line), step) for step in STEPS]


def run_everything(
    out: Path, budget: float, scenes: int, done: Callable[[list[dict[str, Any]]], None]
) -> list[dict[str, Any]]:
    """Run all steps, also behind those that fail; ``done`` is called with the result so far after each.

    Of each step ``command``, and ``seconds``, ``processor_s`` and ``exit``, or ``needs`` if left out.
    """
    result: list[dict[str, Any]] = []
    for words, step in command_lines(out.resolve(), budget, scenes):
        shown = shlex.join(words).replace(str(out.resolve()), str(out))
        missing = [name for name in step.needs if not _there(name)]
        row: dict[str, Any] = {"command": f"python -m {shown}"}
        if missing:
            row["needs"] = missing
        else:
            started, before = time.perf_counter(), _children_s()
            row["exit"] = subprocess.run([sys.executable, "-m", *words], cwd=ROOT).returncode
            row["seconds"] = round(time.perf_counter() - started, 1)
            row["processor_s"] = round(_children_s() - before, 1)
        result.append(row)
        done(result)
    return result


def _children_s() -> float:
    """Processor time of processes that have ended."""
    times = os.times()
    return times.children_user + times.children_system


def _there(name: str) -> bool:
    return name in os.environ or shutil.which(name) is not None or importlib.util.find_spec(name) is not None
