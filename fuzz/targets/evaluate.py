"""Any text to a Scene, on to the Program that draws it, and back from all its written forms.

The first line may be ``//! frame=3 k=0.5``: values for params and the frame. Limits are made small, so that
what they do not count shows as time or memory.
"""

from __future__ import annotations

import atexit
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from random import Random
from typing import Any, Final

from fuzz import text
from fuzz.oracles import check_compiling, check_diagnostics, same
from fuzz.target import Target, hold, sampled
from scenelang.assets.records import deep_stack
from scenelang.compiler.compile import compile_scene
from scenelang.compiler.program import program_bytes
from scenelang.language import evaluation as evaluating
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.reports import SceneError, render_json
from scenelang.language.scene import Scene

SMALL: Final = {
    "MAX_STEPS": 50_000,
    "MAX_OBJECTS": 300,
    "MAX_PARTS": 3_000,
    "MAX_VECTOR": 5_000,
}
"""Limits while fuzzing: the text says the same with larger numbers, only later."""

LIBRARY: Final[dict[str, str | bytes]] = {
    "lib/parts.nsg": "param size = 1 in 0..2; let a = 1; fn f(x) = x;\n"
    "module dot(p = 1) { star { scale(p); } }",
    "lib/loop.nsg": 'import "loop.nsg" as again; let a = 1;\n',
    "lib/bad.nsg": "let a = ; square { scale(; }\n",
    "lib/bytes.nsg": b"let a = \xff;\n",
    "lib/deep.nsg": 'import "parts.nsg" as parts; let b = parts.a + 1; module m() { parts.dot(2); }\n',
}


@contextmanager
def small_limits() -> Iterator[None]:
    """The evaluator's limits made `SMALL`, in every module that took them."""
    changed: list[tuple[Any, str, Any]] = []
    for name, module in list(sys.modules.items()):
        if name.startswith("scenelang.language"):
            for limit, value in SMALL.items():
                if hasattr(module, limit):
                    changed.append((module, limit, getattr(module, limit)))
                    setattr(module, limit, value)
    try:
        yield
    finally:
        for module, limit, value in changed:
            setattr(module, limit, value)


@cache
def root() -> Path:
    """A folder with files to import, good and bad, and one outside of it."""
    folder = Path(tempfile.mkdtemp(prefix="scenelang-fuzz-"))
    atexit.register(shutil.rmtree, folder, True)
    inside = folder / "root"
    for name, content in LIBRARY.items():
        path = inside / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    (folder / "outside.nsg").write_text("let secret = 1;\n")
    (inside / "link.nsg").symlink_to(folder / "outside.nsg")
    return inside


def check(data: bytes) -> None:
    """Evaluate twice, write the Scene in each form and read it back, compile it."""
    scene_text = text.decode(data)
    values, frame = _outside(scene_text)
    with small_limits():
        one, found = _evaluate(scene_text, values, frame)
        hold((one is None) == bool(found.errors), "a Scene exactly where nothing is wrong", found.errors)
        check_diagnostics(list(found), None)
        if sampled(data, 4):
            other, again = _evaluate(scene_text, values, frame)
            hold(same(list(found), list(again)), "the same text gives the same diagnostics")
            with deep_stack():
                hold(one == other, "the same text gives the same Scene")
        if one is not None:
            _check_scene(one)


def outcome(data: bytes) -> bytes:
    """All that comes of a text: diagnostics, Scene, and Program or why there is none."""
    scene_text = text.decode(data)
    values, frame = _outside(scene_text)
    with small_limits():
        scene, found = _evaluate(scene_text, values, frame)
    told = render_json(list(found)).replace(str(root()), "")
    if scene is not None:
        try:
            program = compile_scene(scene)
        except SceneError as error:
            return f"{told}{scene.to_json()}{render_json(error.diagnostics)}".encode("utf-8", "surrogatepass")
        return f"{told}{scene.to_json()}".encode() + program_bytes(program)
    return told.encode("utf-8", "surrogatepass")


def _outside(scene_text: str) -> tuple[dict[str, str], int]:
    """Values and frame from the first line."""
    first = scene_text.partition("\n")[0]
    if not first.startswith("//!"):
        return {}, 0
    pairs = dict(part.split("=", 1) for part in first[3:].split() if "=" in part)
    frame = pairs.pop("frame", "0")
    return pairs, int(frame) if re.fullmatch(r"[0-9]{1,6}", frame, re.ASCII) else 0


def _evaluate(scene_text: str, values: dict[str, str], frame: int) -> tuple[Scene | None, Diagnostics]:
    found = Diagnostics()
    scene, _ = evaluating.Source(text=SourceFile("fuzz.nsg", scene_text), params=values, root=root()).scene(
        found, frame
    )
    return scene, found


def _check_scene(scene: Scene) -> None:
    with deep_stack():
        hold(Scene.from_json(scene.to_json()) == scene, "Scene to JSON and back")
        again, found = _evaluate(scene.to_nsg(), {}, 0)
        hold(again == scene, "Scene to text and back", [d.message for d in found][:3])
    written = check_compiling(scene)
    if written is not None:
        hold(written == program_bytes(compile_scene(scene)), "the same Scene gives the same Program")


def seeds() -> list[bytes]:
    """Scene texts, some with values from outside."""
    extra = [
        "//! k=0.9\nparam k = 0.6 in 0..1; square { twirl(k); }\n",
        "//! frame=5\nanimate(1s, 12); square { rotate(1turn * u); translate(t, frame / frames); }\n",
        "//! a=30deg c=#d33 b=true s=x v=[1,2]\nparam a = 1rad; param c = #fff;"
        ' param b = false; param s = "q";\n'
        "param v = [0, 0];\n"
        "if (b) { square { rotate(a); translate(v.x, v.y); material flat { color(c); } } }\n",
        'import "lib/parts.nsg" as p; p.dot(p.f(0.5)); square { scale(p.size + p.a); }\n',
        'import "lib/loop.nsg" as l; import "lib/bad.nsg" as b; import "lib/bytes.nsg" as y;\n',
        'import "lib/deep.nsg" as d; d.m() { rotate(1rad); } import "link.nsg" as k;\n',
        'import "lib" as a; import "nothing.nsg" as b; import "/etc/x" as c;\n'
        'import "lib/../lib/parts.nsg" as e;\n',
        "fn f(n) = n < 1 ? 0 : 1 + f(n - 1); square { scale(f(100)); }\n",
        "module m(n) { group { if (n > 0) { m(n - 1); m(n - 1); } } } m(20);\n",
    ]
    return [*text.seeds(), *map(text.encode, extra)]


def mutate(data: bytes, generator: Random) -> bytes:
    """A mutation of the text, sometimes with a line of values before it."""
    changed = text.mutate(data, generator)
    if not changed.startswith(b"//!") and generator.random() < 0.05:
        value = generator.choice((*text.NUMBERS, "30deg", "#d33", "true", '"s"', "[1,[2]]", "nan", "lib.x=1"))
        changed = f"//! frame={generator.choice((0, 1, 7))} k={value}\n".encode() + changed
    return changed


TARGET = Target(
    name="evaluate",
    summary="any text, with imports, params and frames, ends in a Scene or diagnostics, the same each time "
    "and within 2 s; Scenes go to JSON, text and Program and back unchanged, and compiling raises "
    "only SceneError",
    check=check,
    seeds=seeds,
    mutate=mutate,
    dictionary=text.dictionary,
    most_bytes=1200,
)
