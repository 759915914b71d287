"""Whole animations: the pictures, what is drawn once, what a killed run leaves, what other processes draw."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from PIL import Image

import scenelang as nsg
from scenelang.output.animate import Progress
from scenelang.output.frames import FrameStore, find_target
from tests.output.scenes import DARK, HEAD, tricky

SMALL = (24, 16)
MOVING = HEAD + DARK + "star { scale(0.6); rotate(0.2turn * u); } square { scale(0.2); }"


def write(folder: Path, text: str = MOVING) -> Path:
    path = folder / "a.nsg"
    path.write_text(text, "utf-8")
    return path


def left(folder: Path) -> list[str]:
    return sorted(name for name in os.listdir(folder) if name != "a.nsg")


@pytest.mark.parametrize("name", ["a chain", "a param", "warps", "settings", "hidden and seen"])
def test_pictures_are_what_they_are_alone(name: str, tmp_path: Path) -> None:
    """Bit for bit, on any number of threads."""
    path = write(tmp_path, tricky(name))
    for frame, image in enumerate(nsg.render_frames(path, size=(20, 48), threads=4)):
        scene = nsg.load(path, frame=frame).model_copy(update={"canvas": (20, 48)})
        assert image.tobytes() == nsg.render(scene).tobytes()


def test_equal_frames_are_drawn_once(tmp_path: Path) -> None:
    path = write(tmp_path, HEAD + DARK + "square { scale(frame % 3 == 1 ? 0.5 : 0.3); }")
    made = nsg.animate(path, tmp_path / "%d.png", size=SMALL)
    assert (made.frames, made.drawn) == (6, 2)
    data = [file.read_bytes() for file in made.files]
    assert data[0] == data[2] == data[3] == data[5] != data[1] == data[4]


def test_other_processes_that_fail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path)
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(nsg.RenderError, match="ended by itself"):
        nsg.animate(path, tmp_path / "a.gif", size=SMALL, jobs=2)
    assert left(tmp_path) == []


class Enough(Exception):
    """Raised to stop a run."""


def interrupted(path: Path, out: Path, frames: int, text: str | None = None) -> None:
    """Begin an animation and stop after some frames."""

    def stop(progress: Progress) -> None:
        if progress.stage == "drawing" and progress.done >= frames:
            raise Enough

    with pytest.raises(Enough):
        nsg.animate(path, out, size=SMALL, backend="reference", progress=stop)


@pytest.mark.parametrize("name", ["a.gif", "f-%03d.png"])
def test_a_run_goes_on_where_it_stopped(tmp_path: Path, name: str) -> None:
    path = write(tmp_path)
    interrupted(path, tmp_path / name, 2)
    assert left(tmp_path) == [find_target(str(tmp_path / name)).work.name]
    made = nsg.animate(path, tmp_path / name, size=SMALL, backend="reference")
    assert (made.resumed, made.drawn) == (2, 4)
    whole = nsg.animate(path, tmp_path / f"whole-{name}", size=SMALL, backend="reference")
    assert whole.resumed == 0
    for a, b in zip(made.files, whole.files, strict=True):
        assert a.read_bytes() == b.read_bytes()
    assert not [found for found in os.listdir(tmp_path) if found.startswith(".")]


def test_frames_of_another_scene_are_not_used(tmp_path: Path) -> None:
    """Whatever changed: the text, an import, a param, the size. What means the same is used."""
    (tmp_path / "lib.nsg").write_text("let k = 0.6;")
    text = 'import "lib.nsg" as l; param p = 0.2;' + HEAD + DARK
    text += "star { scale(l.k); rotate(0.2turn * u); } square { scale(p); }"
    path, out = write(tmp_path, text), tmp_path / "a.gif"

    def resumed(**options: object) -> int:
        interrupted(path, out, 3)
        made = nsg.animate(path, out, **{"size": SMALL, "backend": "reference", **options})  # type: ignore[arg-type]
        return made.resumed

    assert resumed() == 3
    assert resumed(params={"p": 0.3}) == 0
    assert resumed(size=(16, 16)) == 0
    assert resumed(fps=12) == 3  # every other of the twelve
    for file, changed, frames in (
        (path, "// a comment\n" + text, 3),
        (path, text.replace("0.2turn", "0.13turn"), 1),  # u = 0
        (tmp_path / "lib.nsg", "let k = 0.5;", 0),
    ):
        interrupted(path, out, 3)
        file.write_text(changed)
        assert nsg.animate(path, out, size=SMALL, backend="reference").resumed == frames


def to_link(frame: Path) -> None:
    elsewhere = frame.parents[1] / "elsewhere"
    elsewhere.write_bytes(frame.read_bytes())
    frame.unlink()
    frame.symlink_to(elsewhere)


def test_a_damaged_frame_is_drawn_again(tmp_path: Path) -> None:
    path = write(tmp_path)
    for name, damage in (
        ("f-%03d.jpg", lambda frame: frame.write_bytes(frame.read_bytes()[:300])),
        ("a.gif", lambda frame: frame.write_bytes(b"no picture")),
        ("a.gif", lambda frame: Image.new("RGB", (5, 5)).save(frame)),
        ("f-%03d.jpg", lambda frame: Image.new("RGB", SMALL).save(frame, "BMP")),
        ("f-%03d.jpg", to_link),
    ):
        out = tmp_path / name
        interrupted(path, out, 3)
        damage(sorted(find_target(str(out)).work.glob("[0-9a-f]*"))[0])
        made = nsg.animate(path, out, size=SMALL, backend="reference")
        assert (made.resumed, made.drawn) == (2, 4)
        whole = nsg.animate(path, tmp_path / f"whole-{name}", size=SMALL, backend="reference")
        for a, b in zip(made.files, whole.files, strict=True):
            assert a.read_bytes() == b.read_bytes()
            assert not a.is_symlink()


def test_two_runs_at_once(tmp_path: Path) -> None:
    path, out = write(tmp_path), tmp_path / "a.gif"
    with FrameStore(find_target(str(out)).work) as store:
        with pytest.raises(nsg.RenderError, match="another process"):
            nsg.animate(path, out, size=SMALL, backend="reference")
        assert left(tmp_path) == [store.folder.name]
        store.remove()
    assert nsg.animate(path, out, size=SMALL, backend="reference").files == [out]


def test_an_error_or_a_full_disk_leaves_an_old_file_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, out = write(tmp_path, HEAD + "square { scale(3 - frame); }"), tmp_path / "a.gif"
    out.write_bytes(b"old")
    with pytest.raises(nsg.SceneError):
        nsg.animate(path, out, size=SMALL, backend="reference")
    write(tmp_path)
    replace = os.replace

    def full(part: os.PathLike[str], file: os.PathLike[str]) -> None:
        if Path(file) == out:
            raise OSError(28, "No space left on device", str(file))
        replace(part, file)

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="No space"):
        nsg.animate(path, out, size=SMALL, backend="reference")
    assert out.read_bytes() == b"old"


@pytest.mark.skipif(sys.platform == "win32", reason="there are no signals to send")
def test_ctrl_c(tmp_path: Path) -> None:
    write(tmp_path, "animate(seconds = 60, fps = 20); star { scale(0.6); rotate(0.2turn * u); }")
    command = [sys.executable, "-m", "scenelang", "render", "a.nsg", "-o", "a.gif", "--backend", "reference"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen([*command, "--size", "24x24"], cwd=tmp_path, **pipes)  # type: ignore[call-overload]
    while len(list((tmp_path / ".a.gif.frames").glob("*.png"))) < 2:
        assert process.poll() is None, process.communicate()
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in said
    assert left(tmp_path) == [".a.gif.frames"]


def test_solids_load_no_torch_and_other_processes_draw_the_same(tmp_path: Path) -> None:
    path = write(
        tmp_path, "animate(1, 3); canvas(64, 48); sphere { translate(u, 0, 0); } torus { rotate(1turn * u); }"
    )
    code = f"""import sys, scenelang as nsg
nsg.animate({str(path)!r}, {str(tmp_path / "one-%d.png")!r}, jobs=1)
made = nsg.animate({str(path)!r}, {str(tmp_path / "two-%d.png")!r}, jobs=2)
assert made.jobs == 2
assert "torch" not in sys.modules"""
    subprocess.run([sys.executable, "-c", code], check=True)
    for number in range(3):
        one, two = (tmp_path / f"{name}-{number}.png" for name in ("one", "two"))
        assert one.read_bytes() == two.read_bytes()
