"""`scenelang watch`, as a process of its own that files are saved under."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from scenelang.output.watch import settle, stamps

LONG_S = 120  # on a busy machine
HEAD = "canvas(16, 16); background(#000);\n"


class Watcher:
    """``scenelang watch`` in a folder.

    Args:
        folder: where it runs.
        arguments: after ``watch``.
    """

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.folder = folder
        self.process = subprocess.Popen(
            [sys.executable, "-u", "-m", "scenelang", "watch", *arguments],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        self.lines.extend(iter(self.process.stdout.readline, ""))

    def said(self, text: str, times: int = 1) -> None:
        """Wait until it has said something so often."""
        self.until(lambda: sum(text in line for line in self.lines) >= times, f"{text!r} x {times}")

    def until(self, holds: Callable[[], bool], what: str) -> None:
        deadline = time.monotonic() + LONG_S
        while not holds():
            assert self.process.poll() is None, "".join(self.lines)
            assert time.monotonic() < deadline, f"no {what} in:\n{''.join(self.lines)}"
            time.sleep(0.005)

    def shows(self, red: int, name: str = "a.png") -> None:
        """Wait until the picture's middle has this much red."""

        def holds() -> bool:
            if not (self.folder / name).exists():
                return False
            with Image.open(self.folder / name) as image:
                assert image.size == (16, 16)
                return abs(int(np.asarray(image.convert("RGB"))[8, 8, 0]) - red) <= 1

        self.until(holds, f"picture with red {red}")

    def end(self) -> int:
        """Send Ctrl-C; the exit code."""
        self.process.send_signal(signal.SIGINT)
        code = self.process.wait(LONG_S)
        self._reader.join()
        return code


def square(red: int) -> str:
    return f"square {{ material flat {{ color([{red} / 255, 0, 0]); }} }}\n"


def save(path: Path, text: str) -> None:
    """As careful editors do: a new file is renamed over the old one."""
    part = path.with_suffix(".tmp")
    part.write_text(text, "utf-8")
    os.replace(part, path)


@pytest.fixture
def watcher(tmp_path: Path) -> Iterator[Watcher]:
    (tmp_path / "a.nsg").write_text(HEAD + square(50))
    found = Watcher(tmp_path, "a.nsg", "--backend", "reference")
    yield found
    found.process.kill()
    found.process.communicate()


def test_a_day_of_an_author(watcher: Watcher) -> None:
    """Save, err, mend, import, change the import, lose the file: the picture follows, or stays."""
    scene, lib = watcher.folder / "a.nsg", watcher.folder / "parts" / "lib.nsg"
    watcher.shows(50)
    scene.write_text(HEAD + square(60))
    watcher.shows(60)
    save(scene, HEAD + "square { scale(foo); }")
    watcher.said("E0201")
    watcher.said("^^^")
    watcher.said("1 error; a.png stays as it was")
    watcher.shows(60)
    save(scene, HEAD + square(70))
    watcher.shows(70)
    save(scene, "// nothing new\n" + HEAD + square(70))
    watcher.said("the same picture")
    save(scene, 'import "parts/lib.nsg" as lib;\n' + HEAD + square(0).replace("0 / 255", "lib.red"))
    watcher.said("E0214")  # which is not there yet, nor is its folder
    lib.parent.mkdir()
    lib.write_text("let red = 80 / 255;")
    watcher.shows(80)
    save(lib, "let red = 90 / 255;")
    watcher.shows(90)
    lib.write_text("let red = ;")
    watcher.said("lib.nsg:1")
    lib.write_text("let red = 100 / 255;")
    watcher.shows(100)
    scene.unlink()
    watcher.said("a.nsg is gone; waiting for it")
    save(scene, HEAD + square(110))
    watcher.shows(110)
    (watcher.folder / "a.png").unlink()
    save(scene, HEAD + square(110) + " ")
    watcher.shows(110)
    assert watcher.end() == 130
    assert "Traceback" not in "".join(watcher.lines)
    assert sorted(os.listdir(watcher.folder)) == ["a.nsg", "a.png", "parts"]


def test_params_frames_and_times(tmp_path: Path) -> None:
    text = (
        HEAD
        + "animate(seconds = 1, fps = 5); param k = 1; "
        + square(0).replace("0 / 255", "k * frame / 255")
    )
    (tmp_path / "a.nsg").write_text(text)
    watcher = Watcher(tmp_path, "a.nsg", "-o", "b.png", "-D", "k=40", "--frame", "3")
    try:
        watcher.shows(120, "b.png")
        watcher.said("b.png: ")
        watcher.said(" ms (compile ")
        save(tmp_path / "a.nsg", text.replace("animate", "// \nanimate").replace("square", "star"))
        watcher.said("b.png: ", 2)
        watcher.shows(120, "b.png")
        assert watcher.end() == 130
    finally:
        watcher.process.kill()
        watcher.process.communicate()


def test_animations(tmp_path: Path) -> None:
    text = HEAD + "animate(seconds = 1, fps = 5);" + square(0).replace("0 / 255", "frame / 9")
    (tmp_path / "a.nsg").write_text(text)
    watcher = Watcher(tmp_path, "a.nsg", "-o", "a.gif", "--backend", "reference")

    def has(frames: int) -> None:
        def holds() -> bool:
            if not (tmp_path / "a.gif").exists():
                return False
            with Image.open(tmp_path / "a.gif") as image:
                return image.n_frames == frames

        watcher.until(holds, f"{frames} frames")

    try:
        has(5)
        save(tmp_path / "a.nsg", text.replace("fps = 5", "fps = 7"))
        has(7)
        watcher.said("a.gif: ", 2)
        assert watcher.end() == 130
    finally:
        watcher.process.kill()
        watcher.process.communicate()
    assert sorted(os.listdir(tmp_path)) == ["a.gif", "a.nsg"]


def test_pictures_in_terminals(capsys: pytest.CaptureFixture[str]) -> None:
    """Where nothing better is known, coloured characters; never more than the screen holds."""
    pytest.importorskip("textual_image")
    from scenelang.output.watch import Screen

    picture = Image.new("RGBA", (4000, 3000), (200, 10, 20, 255))
    never, auto = Screen("never", False), Screen("auto", False)
    for screen in (never, auto):
        screen.show(picture)
        assert not screen.shows
    assert capsys.readouterr().out == ""
    Screen("always", False).show(picture)
    shown = capsys.readouterr().out
    assert "▀" in shown
    assert "38;2;200;10;20" in shown
    assert 4 <= shown.count("\n") <= 24


def test_terminals_that_misbehave(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some report a size of 0 columns: the watcher says so once and goes on."""
    pytest.importorskip("textual_image")
    from scenelang.output import watch as module

    monkeypatch.setattr(module, "over_grey", lambda _: 1 // 0)
    screen = module.Screen("always", False)
    picture = Image.new("RGB", (8, 8))
    screen.show(picture)
    screen.show(picture)
    assert capsys.readouterr().out.count("cannot show pictures in this terminal") == 1


def test_settling_waits_for_a_file_that_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "a.nsg"
    threading.Timer(0.1, path.write_text, ["square;"]).start()
    settle([path])
    assert path.read_text() == "square;"
    before = stamps([path])
    save(path, "square;")
    assert stamps([path]) != before
