"""Requirements are open upwards, tested versions pinned, and marked tests have to run in `.ci/marked`."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def name(requirement: str) -> str:
    return re.split(r"[\[<>=!~ ]", requirement)[0].lower().replace("_", "-")


def test_python_and_torch_have_no_upper_bound() -> None:
    """Who embeds the package decides; a bound here would forbid releases that work."""
    (torch,) = (need for need in PROJECT["dependencies"] if name(need) == "torch")
    assert not re.search("[<!~]|==", PROJECT["requires-python"] + torch)


def test_every_need_is_pinned() -> None:
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    pins = {name(line) for line in lines if re.fullmatch(r"[\w.-]+==[\w.]+", line)}
    extras = PROJECT["optional-dependencies"]
    needs = [
        *PROJECT["dependencies"],
        *(need for extra in extras.keys() - {"fuzz"} for need in extras[extra]),
    ]
    assert {name(need) for need in needs} - {"scenelang"} <= pins


def test_commands_install_the_pinned_versions() -> None:
    for page in ("README.md", "CONTRIBUTING.md"):
        commands = re.findall(r"^python3 -m venv .*", (ROOT / page).read_text("utf-8"), re.MULTILINE)
        assert commands
        assert all("-c constraints.txt" in command for command in commands)


SKIPPED = "@pytest.mark.skipif(True, reason='not installed')\n"
MODULE = "import pytest\n@pytest.mark.{mark}\n{skip}def test_one():\n    assert {fine}\n"


def program(path: Path, text: str) -> Path:
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


@pytest.mark.parametrize(
    ("mark", "skip", "fine", "code"),
    [("oracle", "", True, 0), ("oracle", SKIPPED, True, 1), ("other", "", True, 5)],
)
def test_marked_tests_have_to_run(tmp_path: Path, mark: str, skip: str, fine: bool, code: int) -> None:
    python = program(tmp_path / "python", f'exec "{sys.executable}" "$@"')
    program(tmp_path / "povray", "")
    module = tmp_path / "test_module.py"
    module.write_text(MODULE.format(mark=mark, skip=skip, fine=fine))
    path = f"{tmp_path}:{os.environ['PATH']}"
    arguments = [python, module, "-p", "no:cacheprovider", "--noconftest", "-W", "ignore"]
    done = subprocess.run(
        [ROOT / ".ci/marked", "oracle", "povray", *arguments],
        env={**os.environ, "PATH": path, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        capture_output=True,
        check=False,
    )
    assert done.returncode == code, done.stderr


def test_a_missing_program_is_told(tmp_path: Path) -> None:
    """Where nothing can install it."""
    python = program(tmp_path / "python", "")
    for name in ("bash", "dirname"):
        os.symlink(f"/bin/{name}", tmp_path / name)
    done = subprocess.run(
        ["/bin/bash", ROOT / ".ci/marked", "browser", "chromium", python],
        env={"PATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert "chromium is not installed" in done.stderr
