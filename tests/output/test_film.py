"""Encoded files, decoded by somebody else: the pixels, how long each is shown, loops, alpha."""

from __future__ import annotations

import re
import subprocess
import weakref
import zlib
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from scenelang.drawing.how import RenderError
from scenelang.output.encoders import (
    Census,
    Palette,
    find_codec,
    mapped,
    write_apng,
    write_gif,
    write_video,
    write_webp,
)
from scenelang.output.frames import Film, Pixels

WIDTH, HEIGHT = 21, 13


def quiet(_: float) -> None:
    pass


def stripes(step: int, alpha: bool = False) -> Pixels:
    """A few colours; a block that moves over a still background."""
    pixels = np.full((HEIGHT, WIDTH, 3), (250, 246, 236), np.uint8)
    pixels[2:6, 2 + step : 8 + step] = (209, 73, 91)
    pixels[8:12, 3:18:2] = (0, 61, 91)
    if not alpha:
        return pixels
    cover = np.where((pixels == (250, 246, 236)).all(axis=2), 0, 255).astype(np.uint8)
    return np.dstack([pixels, cover])


def film(folder: Path, pictures: list[Pixels], fps: float = 10, loop: bool = True) -> Film:
    """A film of pictures; equal ones share a file, as in the store."""
    files = [folder / f"{zlib.crc32(picture.tobytes())}.png" for picture in pictures]
    for file, picture in dict(zip(files, pictures, strict=True)).items():
        Image.fromarray(picture).save(file)
    height, width, channels = pictures[0].shape
    return Film(files, fps, loop, (width, height), channels == 4)


def decoded(file: Path, mode: str) -> Iterator[tuple[Pixels, float]]:
    """Pictures and the milliseconds each is shown, as Pillow reads them."""
    with Image.open(file) as image:
        for index in range(getattr(image, "n_frames", 1)):
            image.seek(index)
            yield np.asarray(image.convert(mode)), image.info.get("duration", 0)


def played(file: Path, mode: str, fps: float, count: int) -> list[Pixels]:
    """What is on the screen in the middle of each frame."""
    ends, pictures, at = [], [], 0.0
    for picture, duration in decoded(file, mode):
        at += duration
        ends.append(at)
        pictures.append(picture)
    moments = [(index + 0.5) * 1000 / fps for index in range(count)]
    return [pictures[next(i for i, end in enumerate(ends) if moment < end)] for moment in moments]


def test_gif_is_exact_where_the_colours_fit(tmp_path: Path) -> None:
    """In one palette, or, where each has 200 colours of its own, in one for each."""
    alike, apart = [stripes(step) for step in (0, 1, 2, 2, 5, 0)], [stripes(0) for _ in range(4)]
    for step, picture in enumerate(apart):
        picture.reshape(-1, 3)[:200, 0] = np.arange(200)
        picture.reshape(-1, 3)[:200, 2] = 40 * step
    palettes: tuple[Palette, ...] = ("auto", "global", "frame")
    for pictures, palette in [*((alike, palette) for palette in palettes), (apart, "auto")]:
        write_gif(film(tmp_path, pictures), tmp_path / "a.gif", quiet, palette=palette)
        shown = played(tmp_path / "a.gif", "RGB", 10, len(pictures))
        np.testing.assert_array_equal(shown, pictures)


def test_gif_of_many_colours(tmp_path: Path) -> None:
    """One palette for all is near to all; dithering makes means nearer still, pixels not."""
    y, x = np.mgrid[:48, :64]
    moving = [np.dstack([(4 * x + 2 * step) % 256, 5 * y, 0 * x + 128]) for step in range(8)]
    pictures = [picture.astype(np.uint8) for picture in moving]  # smooth, of 3,072 colours each
    made = film(tmp_path, pictures)
    off = {}
    for dither in (False, True):
        write_gif(made, tmp_path / f"{dither}.gif", quiet, palette="global", dither=dither)
        shown = played(tmp_path / f"{dither}.gif", "RGB", 10, 8)
        errors = np.stack(shown).astype(float) - np.stack(pictures)
        blocks = errors.reshape(8, 12, 4, 16, 4, 3).mean(axis=(2, 4))
        off[dither] = np.abs(errors).mean(), np.abs(blocks).mean()
    assert off[False][0] < 6
    assert off[True][1] < off[False][1]


def test_gif_is_as_long_as_it_should_be(tmp_path: Path) -> None:
    for fps, count in ((24, 24), (30, 31), (7, 5), (60, 60), (0.5, 3)):
        pictures = [stripes(step % 10) for step in range(count)]
        write_gif(film(tmp_path, pictures, fps), tmp_path / "a.gif", quiet)
        times = [duration for _, duration in decoded(tmp_path / "a.gif", "RGB")]
        assert abs(sum(times) - 1000 * count / fps) <= 5
        assert min(times) >= 20  # browsers slow down what is shorter


def test_gif_leaves_out_what_is_transparent(tmp_path: Path) -> None:
    pictures = [stripes(step, alpha=True) for step in (0, 4, 8)]
    pictures[1][0, 0] = (9, 9, 9, 100)  # less than half
    write_gif(film(tmp_path, pictures), tmp_path / "a.gif", quiet)
    pictures[1][0, 0, 3] = 0
    for picture, expected in zip(played(tmp_path / "a.gif", "RGBA", 10, 3), pictures, strict=True):
        np.testing.assert_array_equal(picture[..., 3], expected[..., 3])
        seen = expected[..., 3] > 0
        np.testing.assert_array_equal(picture[seen], expected[seen])


def test_gif_frames_longer_than_the_format_holds(tmp_path: Path) -> None:
    write_gif(film(tmp_path, [stripes(0)] * 800 + [stripes(3)], fps=1), tmp_path / "a.gif", quiet)
    frames = list(decoded(tmp_path / "a.gif", "RGB"))
    assert sum(duration for _, duration in frames) == 801_000
    np.testing.assert_array_equal(frames[1][0], stripes(0))


def test_palettes_hold_small_coloured_things() -> None:
    """A few red pixels on a large grey ramp keep a red."""
    picture = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 200, 0).repeat(3, 2).copy()
    picture[..., 1] = picture[..., 0] // 2 + np.arange(200, dtype=np.uint8)[:, None] // 4
    picture[:3, :3] = (255, 0, 0)
    census = Census(255)
    census.add(picture)
    colours = census.choose()
    assert len(colours) <= 255
    assert np.abs(colours.astype(int) - (255, 0, 0)).sum(axis=1).min() < 60
    index = mapped(picture, colours, False)
    wide = colours.astype(int)
    for y, x in ((0, 0), (100, 100), (199, 3)):
        away = ((wide - picture[y, x]) ** 2).sum(axis=1)
        assert away[index[y, x]] == away.min()


@pytest.mark.parametrize(("alpha", "fps"), [(False, 10), (True, 29.97)])
def test_apng_is_exact(tmp_path: Path, alpha: bool, fps: float) -> None:
    steps = (0, 1, 1, 5, 5, 5, 0)
    pictures = [stripes(step, alpha) for step in steps]
    if alpha:
        pictures[3][4] = (10, 20, 30, 77)
    write_apng(film(tmp_path, pictures, fps), tmp_path / "a.apng", quiet)
    shown = played(tmp_path / "a.apng", "RGBA" if alpha else "RGB", fps, len(steps))
    np.testing.assert_array_equal(shown, pictures)
    frames = list(decoded(tmp_path / "a.apng", "RGB"))
    assert len(frames) == 5 if alpha else 4
    exact = Fraction(1000) / Fraction(fps).limit_denominator(1000)
    assert sum(duration for _, duration in frames) == pytest.approx(float(7 * exact), abs=1e-9)


def test_films_loop_as_the_scene_says(tmp_path: Path) -> None:
    for write, times in ((write_gif, None), (write_apng, 1), (write_webp, 1)):
        for loop in (True, False):
            write(film(tmp_path, [stripes(0), stripes(1)], loop=loop), tmp_path / "a", quiet)
            with Image.open(tmp_path / "a") as image:
                assert image.info.get("loop") == (0 if loop else times)


@pytest.mark.parametrize("alpha", [False, True])
def test_webp_is_exact(tmp_path: Path, alpha: bool) -> None:
    pictures = [stripes(step, alpha) for step in (0, 1, 1, 5, 0)]
    if alpha:
        pictures[3][4] = (10, 20, 30, 77)
    write_webp(film(tmp_path, pictures, 24), tmp_path / "a.webp", quiet)
    shown = played(tmp_path / "a.webp", "RGBA" if alpha else "RGB", 24, 5)
    for picture, expected in zip(shown, pictures, strict=True):
        if alpha:
            expected[expected[..., 3] == 0] = 0  # nobody sees its colour
        np.testing.assert_array_equal(picture, expected)
    times = [duration for _, duration in decoded(tmp_path / "a.webp", "RGB")]
    assert sum(times) == round(5 * 1000 / 24)


def test_frames_are_read_one_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No encoder holds more than the two frames that it compares."""
    most, read, refs = 0, Film.read, list[Any]()

    class Held(np.ndarray):  # type: ignore[type-arg]
        pass

    def watched(self: Film, file: Path) -> Pixels:
        nonlocal most
        pixels = read(self, file).view(Held)
        refs.append(weakref.ref(pixels))
        most = max(most, sum(ref() is not None for ref in refs))
        return pixels

    monkeypatch.setattr(Film, "read", watched)
    made = film(tmp_path, [stripes(step % 11) for step in range(30)])
    for write, name in ((write_gif, "a.gif"), (write_apng, "a.apng"), (write_webp, "a.webp")):
        write(made, tmp_path / name, quiet)
    assert 0 < most <= 3


@pytest.fixture
def ffmpeg() -> str:
    try:
        return find_codec(".mp4")[0]
    except RenderError as error:
        pytest.skip(str(error))


def frames_of(ffmpeg: str, file: Path, size: tuple[int, int], channels: int = 3) -> Pixels:
    """All frames (N, H, W, C) of a video, decoded by ffmpeg with the colours it is tagged with."""
    kind = "rgb24" if channels == 3 else "rgba"
    decoder = ("-c:v", "libvpx-vp9") if channels == 4 else ()
    command = [ffmpeg, "-v", "error", *decoder, "-i", str(file), "-f", "rawvideo", "-pix_fmt", kind, "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    return np.frombuffer(done.stdout, np.uint8).reshape(-1, size[1], size[0], channels)


def flat(colour: tuple[int, ...]) -> Pixels:
    return np.full((48, 64, len(colour)), colour, np.uint8)


def test_video_has_the_right_colours_and_time(tmp_path: Path, ffmpeg: str) -> None:
    colours = [(221, 51, 51), (0, 121, 140), (237, 174, 73), (255, 255, 255), (0, 0, 0)]
    pictures = [flat(colour) for colour in colours for _ in range(4)]
    write_video(film(tmp_path, pictures, 12), tmp_path / "a.mp4", quiet, suffix=".mp4")
    shown = frames_of(ffmpeg, tmp_path / "a.mp4", (64, 48))
    assert len(shown) == 20
    for index, frame in enumerate(shown):
        assert np.abs(frame[10:40, 10:50].astype(int) - colours[index // 4]).max() <= 4
    said = subprocess.run(
        [ffmpeg, "-i", str(tmp_path / "a.mp4")], capture_output=True, text=True, check=False
    )
    assert "yuv420p(tv, bt709" in said.stderr
    assert re.search(r"\b12 fps\b", said.stderr)
    assert "Duration: 00:00:01.67" in said.stderr


def test_video_over_white_and_with_alpha(tmp_path: Path, ffmpeg: str) -> None:
    pictures = [flat((0, 0, 0, 0)), flat((200, 40, 40, 255))] * 2
    made = film(tmp_path, pictures)
    write_video(made, tmp_path / "a.mp4", quiet, suffix=".mp4")
    assert frames_of(ffmpeg, tmp_path / "a.mp4", (64, 48))[0].min() >= 250
    try:
        write_video(made, tmp_path / "a.webm", quiet, suffix=".webm")
    except RenderError as error:
        pytest.skip(str(error))
    shown = frames_of(ffmpeg, tmp_path / "a.webm", (64, 48), 4)
    assert shown[0][..., 3].max() <= 5
    assert shown[1][..., 3].min() >= 250
