"""MP4 and other video, by ffmpeg, which gets raw frames through a pipe."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen, run
from typing import Final

import numpy as np

from scenelang.animation.store import Film, Pixels
from scenelang.backend.options import RenderError

_H264: Final = ("libx264", "-preset", "medium", "-crf", "16")
_OTHERS: Final = (("libopenh264", "-b:v", "8M"), ("mpeg4", "-q:v", "2"))
_VP9: Final = ("libvpx-vp9", "-crf", "18", "-b:v", "0", "-row-mt", "1")
_SCALE: Final = "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int+full_chroma_inp"
_FORMATS: Final = {".mp4": "mp4", ".m4v": "mp4", ".mov": "mov", ".mkv": "matroska", ".webm": "webm"}
MISSING: Final = "video needs ffmpeg, which is not on the PATH: install it, or pip install 'scenelang[video]'"


class NoFfmpeg(RenderError):
    """There is no ffmpeg, or it cannot encode."""


@lru_cache(maxsize=1)
def find_ffmpeg() -> str:
    """The ffmpeg on the PATH, or the one that imageio-ffmpeg brings; raises `NoFfmpeg` without either."""
    found = shutil.which("ffmpeg")
    if found is not None:
        return found
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError, OSError):
        raise NoFfmpeg(MISSING) from None


@lru_cache(maxsize=1)
def _encoders(ffmpeg: str) -> frozenset[str]:
    command = [ffmpeg, "-hide_banner", "-encoders"]
    done = run(command, capture_output=True, check=False, stdin=DEVNULL)
    lines = done.stdout.decode(errors="replace").splitlines()
    return frozenset(words[1] for line in lines if len(words := line.split()) > 1)


def find_codec(suffix: str) -> tuple[str, tuple[str, ...]]:
    """An ffmpeg that can write files of a suffix, and its options for that; raises `NoFfmpeg` without."""
    ffmpeg = find_ffmpeg()
    known = _encoders(ffmpeg)
    wanted = (_VP9,) if suffix == ".webm" else (_H264, *_OTHERS)
    for codec in wanted:
        if codec[0] in known:
            return ffmpeg, codec
    raise NoFfmpeg(f"`{ffmpeg}` has no encoder {' or '.join(c[0] for c in wanted)}, which {suffix} needs")


def write_video(film: Film, part: Path, progress: Callable[[float], None], *, suffix: str) -> None:
    """Encode a film as 4:2:0 video with BT.709 colours; only WebM keeps alpha, the others lie over white.

    A side of odd length gets one more row or column, a copy of its neighbour. Raises `NoFfmpeg`, or
    `RenderError` where it fails.
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
        *(("-movflags", "+faststart") if _FORMATS[suffix] in ("mp4", "mov") else ()),
        *("-f", _FORMATS[suffix], os.fspath(part)),
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
            pass  # it says why
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
