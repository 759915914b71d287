"""Odd and hostile files, and limits of the language, from the command line: refused in words, in time."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import scenelang as nsg
from scenelang.assets.files import read_regular
from scenelang.drawing.small import draw_small
from tests.assets.processes import SOON_S, one_line, run
from tests.cli.conftest import Folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no such files")

COMMANDS = [
    ("check", "{}.nsg"),
    ("check", "{}.json"),
    ("fmt", "{}.nsg"),
    ("render", "{}.nsg", "-o", "out.png"),
    ("render", "{}.safetensors", "-o", "out.png"),
    ("compile", "{}.nsg", "-o", "out.safetensors"),
    ("compare", "{}.nsg", "-o", "out.png"),
    ("convert", "{}.json", "-o", "out.nsg"),
    ("dump", "{}.nsg"),
]
ODD = {
    "pipe": os.mkfifo,
    "zeros": lambda path: os.symlink("/dev/zero", path),
    "directory": os.mkdir,
    "loop": lambda path: os.symlink(path, path),
    "secret": lambda path: os.symlink("/proc/self/mem", path),  # closed even to the superuser
}


@contextmanager
def soon() -> Iterator[None]:
    """Fails where something waits."""

    def ring(number: int, frame: object) -> None:
        raise AssertionError("it waits")

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(SOON_S)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("kind", ODD)
def test_odd_files_are_refused(folder: Folder, kind: str) -> None:
    if kind == "secret" and not Path("/proc/self/mem").exists():
        pytest.skip("no such file")
    for suffix in ("nsg", "json", "safetensors"):
        ODD[kind](f"it.{suffix}")  # type: ignore[operator]
    before = sorted(os.listdir())
    for arguments in COMMANDS:
        with soon():
            result = folder.run(*(word.format("it") for word in arguments))
        assert result.exit_code == 2, (arguments, result.output)
        assert "Error: " in result.stderr
        assert kind != "pipe" or result.stderr.endswith("not a regular file\n")
        assert sorted(os.listdir()) == before
    folder.write("a.nsg", 'import "it.nsg" as lib; square {}')
    with soon():
        result = folder.run("check", "a.nsg", "--format", "concise")
    assert (result.exit_code, result.stderr) == (1, "")
    assert "[E0214]" in result.stdout or "[E0215]" in result.stdout


def test_pipes_of_whole_processes(folder: Folder) -> None:
    """Pipes in folders are refused, pipes of shells are read."""
    os.mkfifo("it.nsg")
    assert one_line(run("check", "it.nsg")) == "it.nsg: not a regular file"
    read, write = os.pipe()
    os.write(write, b"square { scale(0.5); }")
    os.close(write)
    done = run("check", f"/dev/fd/{read}", pass_fds=(read,))
    os.close(read)
    assert (done.returncode, done.stdout) == (0, "no mistakes in 1 scene\n")


OUTSIDE = (
    "../outside.nsg", "sub/../../outside.nsg", "./.././outside.nsg", "..//outside.nsg", "/etc/passwd",
    "//etc/passwd", "/proc/self/environ", "C:/x.nsg", "c:x.nsg", "C:\\\\x.nsg", "\\\\\\\\server\\\\x.nsg",
    "\\\\x.nsg", "//server/share/x.nsg", "\\\\\\\\?\\\\C:\\\\x.nsg", "link.nsg", "folder/outside.nsg",
    "loop/../../outside.nsg", "sub/../link.nsg", "file:///etc/passwd", "http://localhost/x.nsg",
    "..\\\\outside.nsg", "LINK.NSG", "~/x.nsg", "$HOME/x.nsg", "fd/0", "x.nsg\\u0000",
)  # fmt: skip


def test_imports_stay_inside(folder: Folder) -> None:
    """However a path is spelt, nothing outside the folder is read: its name would be known then."""
    (folder.path / "outside.nsg").write_text("let secret = 1;")
    root = folder.path / "root"
    (root / "sub").mkdir(parents=True)
    os.symlink(folder.path / "outside.nsg", root / "link.nsg")
    os.symlink(folder.path, root / "folder")
    os.symlink("loop", root / "loop")
    os.symlink("/dev/fd", root / "fd")
    for path in OUTSIDE:
        (root / "a.nsg").write_text(f'import "{path}" as lib; square {{ scale(lib.secret); }}')
        result = folder.run("check", "root/a.nsg", "--format", "concise")
        assert result.exit_code == 1, path
        codes = {line.partition("[")[2][:5] for line in result.stdout.splitlines()}
        assert codes <= {"E0214", "E0215", "E0119", "E0113"}, (path, result.stdout)


def test_long_files_are_read_in_part(folder: Folder) -> None:
    Path("a").write_bytes(b"x" * 1000)
    assert len(read_regular("a", 10)) == 11
    for name, size in (("a.nsg", 10_000_000), ("b.nsg", 10_000_001), ("b.json", 10_000_001)):
        Path(name).write_bytes(b"// " + b" " * (size - 3))
    done = run("check", "a.nsg", "b.nsg", "b.json", "--format", "concise")
    assert done.stdout.count("E0324") == done.stdout.count("error") == 2
    assert "a.nsg" not in done.stdout


CHECKS = """
import json, resource, sys
from click.testing import CliRunner
from scenelang.cli.main import cli
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
for name in sys.argv[1:]:
    done = CliRunner().invoke(cli, ["check", name, "--format", "json"])
    found = json.loads(done.stdout)["diagnostics"]
    assert len(done.stdout) < 20_000 or len(found) > 20
    print(done.exit_code, *(d["code"] for d in found if d["severity"] == "error"))
"""


def errors(files: dict[str, str]) -> dict[str, list[str]]:
    """Codes of the errors in scenes, checked by a process with little memory."""
    for name, text in files.items():
        Path(name).write_text(text, "utf-8")
    command = [sys.executable, "-c", CHECKS, *files]
    done = subprocess.run(command, capture_output=True, text=True, timeout=SOON_S, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    found = dict(zip(files, map(str.split, done.stdout.splitlines()), strict=True))
    assert {name: bool(codes) for name, (_, *codes) in found.items()} == {
        name: code == "1" for name, (code, *_) in found.items()
    }
    return {name: codes for name, (_, *codes) in found.items()}


BOMBS = {
    "brackets": "[" * 1_000_000,
    "objects": '{"nodes":' * 1_000_000,
    "pairs": "[]," * 500_000,
    "escapes": '"' + '\\"' * 900_000,
    "digits": '{"canvas": [' + "9" * 1_500_000 + ", 1]}",
    "exponents": '{"background": [1e' + "9" * 1_000_000 + ", 0, 0]}",
    "fractions": '{"background": [0.' + "1" * 1_500_000 + ", 0, 0]}",
    "keys": '{"' + "k" * 1_500_000 + '": 1}',
    "many keys": "{" + ",".join(f'"k{at}": 0' for at in range(80_000)) + "}",
    "texts": '{"model": "' + "x" * 1_500_000 + '"}',
    "nodes": '{"nodes": [' + ",".join(['{"kind":"object"}'] * 60_000) + "]}",
    "groups": '{"nodes": [' + '{"kind":"group","children":[' * 300_000,
    "nulls": '{"nodes": [' + "null," * 300_000 + "null]}",
    "unicode": '{"model": "' + "\\ud800" * 300_000 + '"}',
}


def test_json_that_is_made_to_explode(folder: Folder) -> None:
    """Within the size limit: an error in words, in bounded memory."""
    found = errors({f"{name}.json": text for name, text in BOMBS.items()})
    assert [name for name, codes in found.items() if not codes] == ["fractions.json"]  # a number like others


def objects(count: int) -> str:
    one = {"kind": "object", "geometry": "star"}
    return json.dumps({"nodes": [one] * count}, separators=(",", ":"))


def nested(depth: int) -> str:
    node = '{"kind":"object","geometry":"star"}'
    return '{"nodes":[' + '{"kind":"group","children":[' * depth + node + "]}" * depth + "]}"


LIMITS = {
    "objects.json": (objects(100_001), ["E0320"]),
    "depth.json": (nested(400), []),
    "deeper.json": (nested(401), ["E0313"]),
    "canvas.json": ('{"canvas": [8193, 1]}', ["E0313"]),
    "frames.json": ('{"animation": {"seconds": 1e300, "fps": 240}}', ["E0313"]),
    "objects.nsg": ("for (i in 0..<100001) { square; }", ["E0320"]),
    "calls.nsg": ("fn f(n) = n <= 1 ? 1 : 1 + f(n - 1); square { scale(f(201)); }", ["E0321"]),
    "modules.nsg": ("module m(n) { if (n > 0) { m(n - 1); } square; } m(300);", ["E0321"]),
    "endless.nsg": ("module m() { m(); } m();", ["E0321"]),
    "vector.nsg": (
        "fn d(v, n) = n < 1 ? v : d([v, v, v, v, v, v, v, v], n - 1); let a = d(1, 7);",
        ["E0323"],
    ),
    "brackets.nsg": ("let a = " + "(" * 5000 + "1" + ")" * 5000 + ";", ["E0120"]),
    "braces.nsg": ("group {" * 5000 + "square;" + "}" * 5000, ["E0120"]),
    "operators.nsg": ("let a = " + "-" * 50_000 + "1;", ["E0120"]),
    "canvas.nsg": ("canvas(8193, 1); square;", ["E0311"]),
    "number.nsg": ("let a = 1e999; square;", ["E0125"]),
    "digits.nsg": ("let a = " + "9" * 400 + "; square;", ["E0125"]),
    "frames.nsg": ("animate(1e9, 240); square;", ["E0311"]),
    "mistakes.nsg": ("square { scale(; }\n" * 5000, None),
}


def test_limits_of_the_language(folder: Folder) -> None:
    found = errors({name: text for name, (text, _) in LIMITS.items()})
    mistakes = found["mistakes.nsg"]
    assert "E0121" in mistakes
    assert len(mistakes) <= 201
    wanted: dict[str, Any] = {name: codes for name, (_, codes) in LIMITS.items()}
    assert found == wanted | {"mistakes.nsg": mistakes}


def test_many_objects_go_all_the_way(folder: Folder) -> None:
    folder.write("a.nsg", "for (i in 0..<20000) { square { scale(0.001); translate(rand(i), 0); } }")
    assert run("compile", "a.nsg", "-o", "a.safetensors").returncode == 0
    assert len(nsg.load_program("a.safetensors")) <= 20_000


MIST = """canvas(24, 24);
chain { sphere { material volumetric; } smooth torus { displace(1e6, 14.2); material volumetric; }
    scale(0.12, 0.57, 1); }"""
THIN = """intersect { triangle { bend(1e9); bend(-0.59);
    matrix([[-1e9, 1e9, 0, -0.2], [-0.450325, 0.852922, 0, 0.34], [0, 0, 1, 0], [0, 0, 0, 1]]);
    matrix([[0.528718, -0.40560837304466, 0, -0.4], [0.467313, 0.816853, 0, -0.1], [0, 0, 1, 0],
        [0, 0, 0, 1]]); } triangle { } }"""


def test_a_map_whose_float32_inverse_is_singular_is_refused() -> None:
    codes = [found.code for found in nsg.check_text(THIN) if found.severity == "error"]
    assert codes == ["E0406"]


def test_a_march_has_an_end() -> None:
    """Steps are counted, and no ray goes on in the light of rays that were lost."""
    program = nsg.compile(nsg.loads(MIST))
    start = time.process_time()
    work = draw_small(program, threads=1).work
    assert work is not None
    assert work.lost > 0
    assert time.process_time() - start < 30  # a second on an idle machine
    work = draw_small(
        nsg.compile(nsg.loads("canvas(24, 24); torus { material volumetric; }")), threads=1
    ).work
    assert work is not None
    assert work.lost == 0


def test_the_exact_march_has_an_end() -> None:
    with pytest.raises(nsg.RenderError, match="more than 5,000 steps"):
        nsg.render(nsg.loads(MIST), backend="reference")
