"""Every limit of the language, met from the command line: a clear error in time, in bounded memory."""

from __future__ import annotations

import json
import resource
import sys
from pathlib import Path

import pytest

import scenelang as nsg
from tests.assets.processes import run
from tests.cli.conftest import Folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no such limits")

MOST_BYTES = 2 << 30


def memory() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))


def codes(text: str, name: str = "a.nsg") -> list[str]:
    """Codes of the errors in a scene, checked by a process with little memory."""
    Path(name).write_text(text, "utf-8")
    done = run("check", name, "--format", "json", preexec_fn=memory)
    assert done.returncode in (0, 1), done.stderr[-500:]
    assert done.stderr == ""
    found = [d["code"] for d in json.loads(done.stdout)["diagnostics"] if d["severity"] == "error"]
    assert bool(found) == done.returncode
    return found


def objects(count: int) -> str:
    one = {"kind": "object", "geometry": "star"}
    return json.dumps({"nodes": [one] * count}, separators=(",", ":"))


def nested(depth: int) -> str:
    node = '{"kind":"object","geometry":"star"}'
    return '{"nodes":[' + '{"kind":"group","children":[' * depth + node + "]}" * depth + "]}"


LIMITS = {
    "objects": ("for (i in 0..<100001) { square; }", ["E0320"]),
    "calls": ("fn f(n) = n <= 1 ? 1 : 1 + f(n - 1); square { scale(f(201)); }", ["E0321"]),
    "modules": ("module m(n) { if (n > 0) { m(n - 1); } square; } m(300);", ["E0321"]),
    "endless": ("module m() { m(); } m();", ["E0321"]),
    "steps": ("for (i in 0..<20000) { for (j in 0..<20000) { let a = i * j; } }", ["E0322"]),
    "vector": ("fn d(v, n) = n < 1 ? v : d([v, v, v, v, v, v, v, v], n - 1); let a = d(1, 7);", ["E0323"]),
    "brackets": ("let a = " + "(" * 5000 + "1" + ")" * 5000 + ";", ["E0120"]),
    "braces": ("group {" * 5000 + "square;" + "}" * 5000, ["E0120"]),
    "operators": ("let a = " + "-" * 50_000 + "1;", ["E0120"]),
    "canvas": ("canvas(8193, 1); square;", ["E0311"]),
    "number": ("let a = 1e999; square;", ["E0125"]),
    "digits": ("let a = " + "9" * 400 + "; square;", ["E0125"]),
    "frames": ("animate(1e9, 240); square;", ["E0311"]),
    "mistakes": ("square { scale(; }\n" * 5000, None),
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name == "steps" else name for name in LIMITS]
)
def test_text(folder: Folder, name: str) -> None:
    text, expected = LIMITS[name]
    found = codes(text)
    if expected is None:
        assert "E0121" in found
        assert len(found) <= 201
    else:
        assert found == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        pytest.param(objects(100_000), [], marks=pytest.mark.slow),
        (objects(100_001), ["E0320"]),
        (nested(400), []),
        (nested(401), ["E0313"]),
        ('{"canvas": [8193, 1]}', ["E0313"]),
        ('{"animation": {"seconds": 1e300, "fps": 240}}', ["E0313"]),
    ],
    ids=["objects", "more-objects", "depth", "more-depth", "canvas", "frames"],
)
def test_json(folder: Folder, text: str, expected: list[str]) -> None:
    assert codes(text, "a.json") == expected


def test_programs_hold_no_more_than_scenes(folder: Folder) -> None:
    """What just fits goes all the way; one more is refused when the Program is made or read."""
    folder.write("a.nsg", "for (i in 0..<20000) { square { scale(0.001); translate(rand(i), 0); } }")
    assert run("compile", "a.nsg", "-o", "a.safetensors").returncode == 0
    assert len(nsg.load_program("a.safetensors")) <= 20_000
