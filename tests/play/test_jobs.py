"""What the processes do: pictures and files are those of the command line, of texts that are nowhere."""

from __future__ import annotations

import base64
import io
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageSequence

import scenelang as nsg
from scenelang.web import jobs
from tests.play.test_pool import job

EXAMPLES = Path(__file__).parents[2] / "examples"
SQUARE = "square { scale(0.2 + 0.2 * u); rotate(90deg * u); material flat { color(#27c); } }"
FILM = f"canvas(48, 32); animate(seconds = 1, fps = 3); {SQUARE}"


def done(text: str = "square;", **parts: Any) -> bytes:
    return jobs.do(job(text, **parts), lambda share: None).data


def told(text: str = "square;", **parts: Any) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(done(text, **parts))
    return found


def decoded(data: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)


@pytest.mark.parametrize("name", ["chain", "hello", "snowman", "moire"])
def test_pictures_are_those_of_render(name: str) -> None:
    """Also where the picture before was of another scene, or another size of the same."""
    path = EXAMPLES / f"{name}.nsg"
    for size in ([64, 64], [48, 64]):
        parts = {"path": str(path), "size": size}
        picture = decoded(base64.b64decode(told(path.read_text(), **parts)["png"]))
        expected = nsg.render(nsg.load(path), size=(size[0], size[1])).to_pil().convert("RGB")
        assert np.abs(picture - np.asarray(expected).astype(int)).max() <= 1


@pytest.mark.parametrize("kind", ["apng", "webp", "gif"])
def test_films_have_the_frames_of_render(tmp_path: Path, kind: str) -> None:
    film = Image.open(io.BytesIO(done(FILM, do="file", size=None, folder=str(tmp_path), **{"as": kind})))
    frames = [np.asarray(frame.convert("RGB")).astype(int) for frame in ImageSequence.Iterator(film)]
    assert len(frames) == 3
    for number, frame in enumerate(frames):
        expected = nsg.render(nsg.loads(FILM, frame=number)).to_uint8().astype(int)
        assert np.abs(frame - expected).max() <= (1 if kind == "apng" else 40)
        assert np.abs(frame - expected).mean() <= (1 if kind == "apng" else 4)


def test_a_frame_behind_the_end_is_the_last() -> None:
    assert told(FILM, frame=2)["png"] == told(FILM, frame=99)["png"] != told(FILM, frame=0)["png"]


def test_what_is_missing_is_none_and_the_difference_plain(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*_: object) -> float:
        raise ImportError

    monkeypatch.setattr(jobs, "flip", missing)
    monkeypatch.setattr(jobs, "ssim", missing)
    figures = told(do="figures")
    assert (figures["flip"], figures["ssim"]) == (None, None)
    assert figures["psnr"] > 40
    star = "star { material flat { color(#fa0); } }"
    other = nsg.render(nsg.loads("star { scale(0.9); material flat { color(#0fa); } }"), size=(40, 40))
    monkeypatch.setattr(jobs, "_exact", lambda job, clip: other)
    sheet = decoded(base64.b64decode(told(star, do="difference", size=[40, 40])["png"]))[14:]
    network, exact, far = sheet[:, :40], sheet[:, 44:84], sheet[:, 88:]
    assert np.abs(network - exact).max() > 200
    assert np.abs(far - np.minimum(255, 8 * np.abs(network - exact))).max() <= 8


def test_figures_count_what_is_written_and_what_is_left() -> None:
    """The second square covers the first, which no row is for."""
    figures = told("square { scale(0.1); } square { scale(0.5); }", do="figures")
    assert (figures["objects"], figures["rows"]) == (2, 1)


def test_what_cannot_be_done_says_why() -> None:
    cases: list[tuple[dict[str, Any], str]] = [
        ({"text": "sqare;"}, "unknown geometry or module `sqare`"),
        ({"params": {"k": 1}}, "no param `k`"),
        ({"text": 'import "/etc/passwd" as x; square;'}, "absolute path"),
        ({"size": [8192, 8192]}, "8192 × 8192"),
    ]
    for parts, message in cases:
        with pytest.raises(jobs.JobFailed, match=message):
            done(**parts)


def test_a_process_has_so_much_memory_and_no_more() -> None:
    code = (
        "from scenelang.web.pool import limit_memory\n"
        "import numpy\nlimit_memory(1 << 30)\n"
        "try:\n    numpy.ones(1 << 28)\nexcept MemoryError:\n    print(numpy.ones(1 << 20).sum())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert float(done.stdout) == 1 << 20


def test_nothing_here_loads_torch() -> None:
    code = (
        "import json, sys\nfrom scenelang.web import jobs\njobs.warm()\n"
        "for kind in ('view', 'network', 'reference'):\n"
        "    jobs.do({**json.loads(sys.argv[1]), 'do': kind}, print)\nassert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code, json.dumps(job())], check=True, capture_output=True)
