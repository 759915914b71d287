"""A folder of scenes to run commands in."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from scenelang.cli.main import cli

GOOD = "square { scale(0.5); material flat { color(#d33); } }\nstar { scale(0.3); translate(0.4, 0.4); }\n"


class Folder:
    """A folder of scenes, and commands run in it.

    Args:
        path: the folder, which is the working directory too.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def write(self, name: str, text: str = GOOD) -> str:
        """Write a scene; returns its name."""
        target = self.path / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, "utf-8")
        return name

    def run(self, *arguments: str, stdin: str | None = None) -> Result:
        """Run a command; whatever is not an exit is raised."""
        result = CliRunner().invoke(cli, arguments, input=stdin, prog_name="scenelang")
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Folder:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return Folder(tmp_path)
