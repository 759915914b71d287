"""A folder of scenes to run commands in."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from scenelang.cli.main import cli

GOOD = "square { scale(0.5); material flat { color(#d33); } }\nstar { scale(0.3); translate(0.4, 0.4); }\n"


class Folder:
    """A folder of scenes, the working directory, and commands run in it."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def write(self, name: str, text: str = GOOD) -> str:
        """Write a scene; returns its name."""
        target = self.path / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, "utf-8")
        return name

    def read(self, name: str) -> str:
        """A file's text with its line ends."""
        return (self.path / name).read_bytes().decode("utf-8")

    def run(self, *arguments: str, stdin: str | None = None, code: int | None = None) -> Result:
        """Run a command; whatever is not an exit is raised, as is another exit code than a wanted one."""
        result = CliRunner().invoke(cli, arguments, input=stdin, prog_name="scenelang")
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        assert code in (None, result.exit_code), f"{arguments}: {result.exit_code}, {result.output}"
        return result


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Folder:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return Folder(tmp_path)
