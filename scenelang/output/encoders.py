"""Encoders of animations, frame by frame: GIF, APNG, WebP and video by ffmpeg.

Pillow's own writers of GIF and APNG, also in 13.0, hold every frame until the last has come. The writers here
hold one, and find a palette that is exact for all frames where there is one.

Sources: CompuServe, Graphics Interchange Format, version 89a; W3C, Portable Network Graphics (PNG)
Specification, third edition, 2025, chapters 4.9 and 11.3.6.
"""

from __future__ import annotations

import io
import os
import shutil
import struct
from collections.abc import Callable, Iterator
from dataclasses import field
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen, run
from typing import Final, Literal

import numpy as np
import numpy.typing as npt
from PIL import GifImagePlugin, Image

from scenelang.assets.records import Record
from scenelang.drawing.how import RenderError
from scenelang.drawing.image import SIGNATURE, chunk
from scenelang.output.frames import VIDEOS, Film, Pixels, changed, delays, runs

Palette = Literal["auto", "global", "frame"]
Progress = Callable[[float], None]
Colours = npt.NDArray[np.uint8]
"""(K, 3)."""

PER_SECOND = 100
SHORTEST = 2  # hundredths of a second; browsers take shorter ones for a tenth
_LONGEST = 65535  # largest number of a delay, 16 bits: hundredths of a second, or a part of a fraction
_KEEP, _CLEAR = 1, 2  # disposal methods: keep a frame under the next one, or clear it
_SAMPLE = 1 << 18  # pixels from which a palette is chosen
_MOST_KNOWN = 1 << 20  # colours that are counted; more are thinned to the most frequent half


def write_gif(
    film: Film, part: Path, progress: Progress, *, palette: Palette = "auto", dither: bool = False
) -> None:
    """Encode a film; in transparent frames, pixels of less than half coverage are left out.

    There is a palette for all frames, or one for each; ``"auto"`` takes the one that is exact, and a global
    one where neither is, as it keeps still parts still. Dithering diffuses its errors over neighbours.
    """
    lengths = delays(len(film.files), film.fps, PER_SECOND, SHORTEST)
    most = 256 - 1  # one index is for pixels that are transparent or unchanged
    census = Census(most)
    count = len(lengths)
    if palette != "frame":
        for done, (file, length) in enumerate(runs(film.files, lengths)):
            census.add(film.read(file), length)
            progress(0.4 * done / count)
    own = palette == "frame" or (palette == "auto" and not census.fits and not census.crowded)
    common = None if own else census.choose()
    with part.open("wb") as out:
        # bits of an index; the colour after the last is the transparent one
        bits = 0 if common is None else max(1, len(common).bit_length())
        flags = 0x70 | (0x80 | (bits - 1) if common is not None else 0)
        out.write(b"GIF89a" + struct.pack("<HHBBB", *film.size, flags, 0, 0))
        if common is not None:
            out.write(common.tobytes().ljust(3 << bits, b"\0"))
        if film.loop:
            out.write(b"!\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")
        shown: npt.NDArray[np.uint8] | None = None
        for done, (file, length) in enumerate(runs(film.files, lengths)):
            pixels = film.read(file)
            if (colours := common) is None:
                one = Census(most)
                one.add(pixels)
                colours = one.choose()
            index, clear = mapped(pixels, colours, dither), len(colours)  # the index after the palette's own
            now, box = colours[index], (0, 0, *film.size)
            if film.alpha:
                index[pixels[..., 3] < 128] = clear
            elif shown is not None:
                box = changed(shown, now)
                index = np.where((now == shown).all(axis=2), np.uint8(clear), index)
            (left, top, right, bottom), shown = box, now
            options = {"disposal": _CLEAR if film.alpha else _KEEP, "transparency": clear}
            options["include_color_table"] = own
            part_of = index[top:bottom, left:right]
            while length > 0:  # a longer time than the format holds is a second picture of nothing
                image = Image.fromarray(np.ascontiguousarray(part_of))
                image.putpalette(np.append(colours, [[0, 0, 0]], axis=0).astype(np.uint8).tobytes())
                options["duration"] = 10 * min(length, _LONGEST)  # Pillow takes milliseconds
                out.writelines(GifImagePlugin.getdata(image, (left, top), **options))
                length -= _LONGEST
                if not film.alpha:
                    part_of = np.full((1, 1), clear, np.uint8)
            progress(0.4 + 0.6 * done / count)
        out.write(b";")


def packed(pixels: Pixels) -> npt.NDArray[np.uint32]:
    """Colours (H, W, 3) as one number each, of any shape before the last axis."""
    wide = pixels[..., :3].astype(np.uint32)
    return np.asarray((wide[..., 0] << 16) | (wide[..., 1] << 8) | wide[..., 2], np.uint32)


def unpacked(numbers: npt.NDArray[np.uint32]) -> Colours:
    """Numbers (K,) as colours (K, 3)."""
    return np.stack([numbers >> 16, (numbers >> 8) & 255, numbers & 255], axis=-1).astype(np.uint8)


class Census(Record, frozen=False):
    """Counts of colours over all pictures, added one picture at a time."""

    most: int  # colours of a palette; `crowded` is true once a single picture has more
    colours: npt.NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, np.uint32))
    counts: npt.NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    crowded: bool = False
    thinned: bool = False

    def add(self, pixels: Pixels, weight: int = 1) -> None:
        """Count the colours of a picture's visible pixels."""
        numbers = packed(pixels)
        shown = numbers[pixels[..., 3] >= 128] if pixels.shape[2] == 4 else numbers
        result, counts = np.unique(shown, return_counts=True)
        self.crowded |= len(result) > self.most
        self.colours, index = np.unique(np.concatenate([self.colours, result]), return_inverse=True)
        total = np.bincount(index, np.concatenate([self.counts, counts * weight]))
        self.counts = total.astype(np.int64)
        if len(self.colours) > _MOST_KNOWN:
            frequent = np.sort(np.argsort(total, kind="stable")[len(total) // 2 :])
            self.colours, self.counts, self.thinned = self.colours[frequent], self.counts[frequent], True

    @property
    def fits(self) -> bool:
        return not self.thinned and len(self.colours) <= self.most

    def choose(self) -> Colours:
        """At most `most` colours, (K, 3): all of them, or a selection near to all.

        That is by median cut over pixels as frequent as the square root of each colour's count, then k-means.
        The square root keeps small coloured things from drowning in a large background.
        """
        if self.fits:
            return unpacked(self.colours)
        share = np.sqrt(self.counts.astype(np.float64))
        repeat = np.maximum(1, np.floor(share * (_SAMPLE / share.sum())).astype(np.int64))
        sample = np.repeat(self.colours, repeat)
        side = int(np.ceil(np.sqrt(len(sample))))
        image = Image.fromarray(unpacked(np.resize(sample, side * side)).reshape(side, side, 3))
        reduced = image.quantize(self.most, method=Image.Quantize.MEDIANCUT, kmeans=2)
        used = len(reduced.getcolors(256) or ())
        table = np.array(reduced.getpalette() or [], np.uint8).reshape(-1, 3)
        return np.unique(table[: max(used, 1)], axis=0)


def mapped(pixels: Pixels, colours: Colours, dither: bool) -> npt.NDArray[np.uint8]:
    """Nearest indices (H, W) of a palette (K, 3); if asked, dithered (Floyd and Steinberg 1976)."""
    result, inverse = np.unique(packed(pixels), return_inverse=True)
    wide = colours.astype(np.float32)  # which holds these squares exactly
    sizes, parts = np.square(wide).sum(1), range(0, len(result), _SAMPLE)
    own = (unpacked(result[at : at + _SAMPLE]).astype(np.float32) for at in parts)
    index = np.concatenate([(sizes - 2 * part @ wide.T).argmin(1) for part in own]).astype(np.uint8)
    if not dither or np.array_equal(colours[index], unpacked(result)):
        return index[inverse].reshape(pixels.shape[:2])
    table = Image.new("P", (1, 1))
    table.putpalette(colours.tobytes())
    image = Image.fromarray(np.ascontiguousarray(pixels[..., :3]))
    index = np.asarray(image.quantize(palette=table, dither=Image.Dither.FLOYDSTEINBERG))
    return np.asarray(np.minimum(index, len(colours) - 1), np.uint8)


def write_apng(film: Film, part: Path, progress: Progress) -> None:
    """Encode a film, losslessly, with alpha where it has any; delays are exact fractions of a second."""
    counted = runs(film.files, [1] * len(film.files))
    shown = [(file, piece) for file, count in counted for piece in _pieces(count, film.fps)]
    with part.open("wb") as out:
        out.write(SIGNATURE)
        sequence, before, last = 0, None, None
        pixels: Pixels | None = None
        for index, (file, (numerator, denominator)) in enumerate(shown):
            if file != last or pixels is None:
                pixels = film.read(file)
            left, top, right, bottom = changed(before, pixels)
            chunks = _png(np.ascontiguousarray(pixels[top:bottom, left:right]))
            if index == 0:
                out.write(chunk(b"IHDR", next(body for kind, body in chunks if kind == b"IHDR")))
                out.write(chunk(b"acTL", struct.pack(">II", len(shown), 0 if film.loop else 1)))
            # dispose_op 0 keeps the shown picture, blend_op 0 replaces its pixels instead of compositing
            control = (sequence, right - left, bottom - top, left, top, numerator, denominator, 0, 0)
            out.write(chunk(b"fcTL", struct.pack(">IIIIIHHBB", *control)))
            sequence += 1
            for kind, body in chunks:
                if kind == b"IDAT" and index == 0:
                    out.write(chunk(b"IDAT", body))
                elif kind == b"IDAT":
                    out.write(chunk(b"fdAT", struct.pack(">I", sequence) + body))
                    sequence += 1
            before, last = pixels, file
            progress((index + 1) / len(shown))
        out.write(chunk(b"IEND", b""))


def _pieces(count: int, fps: float) -> Iterator[tuple[int, int]]:
    """Time of ``count`` frames as fractions of 16-bit numbers; several where one cannot hold it."""
    whole = (count / Fraction(fps).limit_denominator(1_000_000)).limit_denominator(_LONGEST)
    if whole.numerator <= _LONGEST:
        yield whole.numerator, whole.denominator
        return
    for share in (count // 2, count - count // 2):
        yield from _pieces(share, fps) if count > 1 else [(min(_LONGEST, round(float(whole))), 1)]


def _png(pixels: Pixels) -> list[tuple[bytes, bytes]]:
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "PNG")
    raw, at, result = data.getvalue(), len(SIGNATURE), []
    while at < len(raw):
        (size,) = struct.unpack_from(">I", raw, at)
        result.append((raw[at + 4 : at + 8], raw[at + 8 : at + 8 + size]))
        at += 12 + size
    return result


WEBP_PER_SECOND = 1000


class _Reel(Image.Image):
    """A film as Pillow's writer takes it: reads each frame when the writer seeks it, and holds one."""

    def __init__(self, film: Film, files: list[Path], progress: Progress) -> None:
        super().__init__()
        self._film, self._files, self._progress = film, files, progress
        self.n_frames = len(files)
        self.seek(0)

    def seek(self, frame: int) -> None:
        self._progress(frame / self.n_frames)
        image = Image.fromarray(self._film.read(self._files[frame]))
        self.im, self._mode, self._size = image.im, image.mode, image.size
        self._at = frame

    def tell(self) -> int:
        return self._at


def write_webp(film: Film, part: Path, progress: Progress) -> None:
    """Encode a film, losslessly, with alpha where it has any; of equal pictures it becomes a still."""
    shown = runs(film.files, delays(len(film.files), film.fps, WEBP_PER_SECOND))
    reel = _Reel(film, [file for file, _ in shown], progress)
    with part.open("wb") as out:
        still = {"lossless": True, "quality": 80, "method": 4}  # of the search, not of the picture
        times, loop = [length for _, length in shown], 0 if film.loop else 1
        reel.save(out, "WEBP", save_all=True, duration=times, loop=loop, **still)


_H264: Final = ("libx264", "-preset", "medium", "-crf", "16")
_OTHERS: Final = (("libopenh264", "-b:v", "8M"), ("mpeg4", "-q:v", "2"))
_VP9: Final = ("libvpx-vp9", "-crf", "18", "-b:v", "0", "-row-mt", "1")
_SCALE: Final = "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int+full_chroma_inp"
MISSING: Final = "video needs ffmpeg, which is not on the PATH: install it, or pip install 'scenelang[video]'"


@lru_cache(maxsize=len(VIDEOS))
def find_codec(suffix: str) -> tuple[str, tuple[str, ...]]:
    """An ffmpeg that can write files of a suffix, and its options for that; raises `RenderError` without.

    It is the one on the PATH, or the one that imageio-ffmpeg brings.
    """
    if (ffmpeg := shutil.which("ffmpeg")) is None:
        try:
            import imageio_ffmpeg

            ffmpeg = str(imageio_ffmpeg.get_ffmpeg_exe())
        except (ImportError, RuntimeError, OSError):
            raise RenderError(MISSING) from None
    done = run([ffmpeg, "-hide_banner", "-encoders"], capture_output=True, check=False, stdin=DEVNULL)
    lines = done.stdout.decode(errors="replace").splitlines()
    known = [words[1] for line in lines if len(words := line.split()) > 1]
    wanted = (_VP9,) if suffix == ".webm" else (_H264, *_OTHERS)
    for codec in wanted:
        if codec[0] in known:
            return ffmpeg, codec
    raise RenderError(f"`{ffmpeg}` has no encoder {' or '.join(c[0] for c in wanted)}, which {suffix} needs")


def write_video(film: Film, part: Path, progress: Progress, *, suffix: str) -> None:
    """Encode a film as 4:2:0 video with BT.709 colours; only WebM keeps alpha, the others lie over white.

    A side of odd length gets one more row or column, a copy of its neighbour. Raises `RenderError`
    where there is none, or it fails.
    """
    ffmpeg, codec = find_codec(suffix)
    keeps = film.alpha and suffix == ".webm"
    width, height = (side + side % 2 for side in film.size)
    command = [
        *(ffmpeg, "-hide_banner", "-loglevel", "error", "-nostdin", "-y"),
        *("-f", "rawvideo", "-pix_fmt", "rgba" if keeps else "rgb24", "-s", f"{width}x{height}"),
        *("-r", str(Fraction(film.fps).limit_denominator(100_000)), "-i", "-"),
        *("-vf", _SCALE, "-c:v", *codec, "-pix_fmt", "yuva420p" if keeps else "yuv420p"),
        *(("-auto-alt-ref", "0") if keeps else ()),
        *("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"),
        *(("-movflags", "+faststart") if VIDEOS[suffix] in ("mp4", "mov") else ()),
        *("-f", VIDEOS[suffix], os.fspath(part)),
    ]
    # in a session of its own, so that Ctrl-C reaches us alone and we end it
    with Popen(command, stdin=PIPE, stdout=DEVNULL, stderr=PIPE, start_new_session=True) as process:
        assert process.stdin is not None
        assert process.stderr is not None
        try:
            last, data = None, b""
            for index, file in enumerate(film.files):
                if file != last:
                    data, last = _even(film.read(file), keeps).tobytes(), file
                process.stdin.write(data)
                progress((index + 1) / len(film.files))
            process.stdin.close()
        except BrokenPipeError:
            pass  # its standard error says why
        except BaseException:
            process.kill()
            raise
        said = process.stderr.read().decode(errors="replace").strip()
    if process.returncode != 0:
        raise RenderError(f"ffmpeg failed: {said.splitlines()[-1] if said else process.returncode}")


def _even(pixels: Pixels, keeps: bool) -> Pixels:
    """Pixels with even sides, and without alpha unless it is kept."""
    if pixels.shape[2] == 4 and not keeps:
        alpha = pixels[..., 3:].astype(np.uint16)
        over = pixels[..., :3] * alpha + 255 * (255 - alpha)
        pixels = ((over + 127) // 255).astype(np.uint8)
    height, width = pixels.shape[:2]
    if height % 2 or width % 2:
        pixels = np.pad(pixels, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
    return np.ascontiguousarray(pixels)
