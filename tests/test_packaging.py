"""Requirements are open upwards, and the versions that were tested are pinned."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

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
