"""`scenelang watch`, as a process of its own that files are saved under."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from scenelang.output import watch
from scenelang.output.watch import Screen, settle, stamps

LONG_S = 120  # on a busy machine
HEAD = "canvas(16, 16); background(#000); animate(seconds = 1, fps = 5); param k = 1;\n"


class Watcher:
    """``scenelang watch a.nsg`` in a folder, which Ctrl-C ends."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.folder = folder
        self.process = subprocess.Popen(
            [sys.executable, "-u", "-m", "scenelang", "watch", "a.nsg", *arguments],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Watcher:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        self.process.send_signal(signal.SIGINT if kind is None else signal.SIGKILL)
        code = self.process.wait(LONG_S)
        self._reader.join()
        if kind is None:
            assert (code, "Traceback" in "".join(self.lines)) == (130, False)

    def _read(self) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as stream:
            self.lines.extend(iter(stream.readline, ""))

    def said(self, text: str, times: int = 1) -> None:
        """Wait until it has said something so often."""
        self.until(lambda: sum(text in line for line in self.lines) >= times, f"{text!r} x {times}")

    def until(self, holds: Callable[[], bool], what: str) -> None:
        deadline = time.monotonic() + LONG_S
        while not holds():
            assert self.process.poll() is None, "".join(self.lines)
            assert time.monotonic() < deadline, f"no {what} in:\n{''.join(self.lines)}"
            time.sleep(0.01)

    def shows(self, name: str, value: int, of: Callable[[Image.Image], int]) -> None:
        """Wait until what is read from a picture is a value, or next to it."""

        def holds() -> bool:
            if not (self.folder / name).exists():
                return False
            with Image.open(self.folder / name) as image:
                assert image.size == (16, 16)
                return abs(of(image) - value) <= 1

        self.until(holds, f"{value} in {name}")


def square(red: object) -> str:
    return f"square {{ material flat {{ color([{red} * k * frame / 6 / 255, 0, 0]); }} }}\n"


def save(path: Path, text: str) -> None:
    """As careful editors do: a new file is renamed over the old one."""
    part = path.with_suffix(".tmp")
    part.write_text(text, "utf-8")
    os.replace(part, path)


def test_a_day_of_an_author(tmp_path: Path) -> None:
    """Save, err, mend, import, change the import, lose the file: the picture follows, or stays."""
    scene, lib = tmp_path / "a.nsg", tmp_path / "parts" / "lib.nsg"
    scene.write_text(HEAD + square(50))
    with Watcher(tmp_path, "--backend", "reference", "-D", "k=2", "--frame", "3") as watcher:

        def shows(red: int) -> None:
            watcher.shows("a.png", red, lambda image: int(np.asarray(image.convert("RGB"))[8, 8, 0]))

        shows(50)
        watcher.said("a.png: ")
        watcher.said(" ms (compile ")
        scene.write_text(HEAD + square(60))
        shows(60)
        save(scene, HEAD + "square { scale(foo); }")
        for words in ("E0201", "^^^", "1 error; a.png stays as it was"):
            watcher.said(words)
        shows(60)
        save(scene, HEAD + square(70))
        shows(70)
        save(scene, "// nothing new\n" + HEAD + square(70))
        watcher.said("the same picture")
        save(scene, 'import "parts/lib.nsg" as lib;\n' + HEAD + square("lib.red"))
        watcher.said("E0214")  # which is not there yet, nor is its folder
        lib.parent.mkdir()
        lib.write_text("let red = 80;")
        shows(80)
        save(lib, "let red = 90;")
        shows(90)
        lib.write_text("let red = ;")
        watcher.said("lib.nsg:1")
        lib.write_text("let red = 100;")
        shows(100)
        scene.unlink()
        watcher.said("a.nsg is gone; waiting for it")
        save(scene, HEAD + square(110))
        shows(110)
        (tmp_path / "a.png").unlink()
        save(scene, HEAD + square(110) + " ")
        shows(110)
    assert sorted(os.listdir(tmp_path)) == ["a.nsg", "a.png", "parts"]


def test_animations(tmp_path: Path) -> None:
    (tmp_path / "a.nsg").write_text(HEAD + square(9))
    with Watcher(tmp_path, "-o", "a.gif", "--backend", "reference") as watcher:
        for rate in (5, 8):
            save(tmp_path / "a.nsg", (HEAD + square(90)).replace("fps = 5", f"fps = {rate}"))
            watcher.shows("a.gif", rate, lambda image: getattr(image, "n_frames", 1))
        watcher.said("a.gif: ", 2)
    assert sorted(os.listdir(tmp_path)) == ["a.gif", "a.nsg"]


def test_pictures_in_terminals(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nothing better is known, coloured characters; never more than the screen holds."""
    pytest.importorskip("textual_image")
    picture = Image.new("RGBA", (1000, 750), (200, 10, 20, 255))
    for screen in (Screen("never", False), Screen("auto", False)):
        screen.show(picture)
        assert not screen.shows
    assert capsys.readouterr().out == ""
    Screen("always", False).show(picture)
    shown = capsys.readouterr().out
    assert "▀" in shown
    assert "38;2;200;10;20" in shown
    assert 4 <= shown.count("\n") <= 24
    # Some terminals report a size of 0 columns: the watcher says so once and goes on.
    monkeypatch.setattr(watch, "over_grey", lambda _: 1 // 0)
    screen = Screen("always", False)
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
