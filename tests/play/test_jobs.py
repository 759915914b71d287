"""Jobs of `play` and the processes that do them: pictures and files are the command line's; others end."""

from __future__ import annotations

import asyncio
import base64
import io
import json
import os
import signal
import subprocess
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageSequence

import scenelang as nsg
from scenelang.web import jobs
from scenelang.web.folder import JobFailed
from scenelang.web.pool import Pool
from tests.play.client import below, children

EXAMPLES = Path(__file__).parents[2] / "examples"
SQUARE = "square { scale(0.2 + 0.2 * u); rotate(90deg * u); material flat { color(#27c); } }"
FILM = f"canvas(48, 32); animate(seconds = 1, fps = 3); {SQUARE}"
SLOW = "for (i in 0..2999) { for (j in 0..2999) { let x = i * j; } } square;"


def job(text: str = "square;", **parts: Any) -> dict[str, Any]:
    given = {"do": "network", "path": "/none/a.nsg", "name": "a.nsg", "text": text, "texts": {}, "root": None}
    return {**given, "params": {}, "frame": 0, "size": [32, 32], "message": {}, **parts}


def done(text: str = "square;", **parts: Any) -> bytes:
    return jobs.do(job(text, **parts), lambda share: None).data


def told(text: str = "square;", **parts: Any) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(done(text, **parts))
    return found


def decoded(data: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)


def test_pictures_are_those_of_render() -> None:
    """Also where the picture before was of another scene, or another size of the same."""
    for name, size in (("chain", (64, 64)), ("chain", (48, 64)), ("snowman", (48, 64))):
        path = EXAMPLES / f"{name}.nsg"
        picture = decoded(base64.b64decode(told(path.read_text(), path=str(path), size=[*size])["png"]))
        expected = nsg.render(nsg.load(path), size=size).to_pil().convert("RGB")
        assert np.abs(picture - np.asarray(expected).astype(int)).max() <= 1, (name, size)


def test_films_have_the_frames_of_render(tmp_path: Path) -> None:
    expected = [nsg.render(nsg.loads(FILM, frame=number)).to_uint8().astype(int) for number in range(3)]
    for kind, most, mean in (("apng", 1, 1), ("webp", 40, 4), ("gif", 40, 4)):
        data = done(FILM, do="file", size=None, folder=str(tmp_path), **{"as": kind})
        film = Image.open(io.BytesIO(data))
        frames = [np.asarray(frame.convert("RGB")).astype(int) for frame in ImageSequence.Iterator(film)]
        off = np.abs(np.subtract(frames, expected))
        assert (off.max() <= most, off.mean() <= mean) == (True, True), kind


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
    other = nsg.render(nsg.loads("star { scale(0.9); material flat { color(#0fa); } }"), size=(90, 40))
    monkeypatch.setattr(jobs, "_exact", lambda job, clip: other)
    sheet = decoded(base64.b64decode(told(star, do="difference", size=[90, 40])["png"]))[28:]
    network, exact, far = sheet[:, :90], sheet[:, 94:184], sheet[:, 188:278]
    assert np.abs(network - exact).max() > 200
    assert np.abs(far - np.minimum(255, 8 * np.abs(network - exact))).max() <= 8


def test_figures_count_what_is_written_and_what_is_left() -> None:
    """The second square covers the first, which no row is for."""
    figures = told("square { scale(0.1); } square { scale(0.5); }", do="figures")
    assert (figures["objects"], figures["rows"]) == (2, 1)


def test_what_no_page_draws_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jobs, "MOST_ROWS", 2)
    assert told("square; star;", do="view")["view"] is not None
    view = told("square; star; pentagon;", do="view")
    assert view["view"] is None
    assert (view["problems"][-1]["severity"], "2 objects" in view["problems"][-1]["message"]) == (
        "warning",
        True,
    )


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


def test_nothing_here_loads_torch() -> None:
    code = (
        "import json, sys\nfrom scenelang.web import jobs\njobs.warm()\n"
        "for kind in ('view', 'network', 'reference'):\n"
        "    jobs.do({**json.loads(sys.argv[1]), 'do': kind}, print)\nassert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code, json.dumps(job())], check=True, capture_output=True)


def forked() -> set[int]:
    """Processes of pools, which the one that forks them, a child, has started."""
    return below(os.getpid()) - children(os.getpid())


def within(work: Callable[[Pool], Awaitable[None]], **options: Any) -> None:
    """Do something with a pool, after which none of its processes is there."""

    async def run() -> None:
        pool = Pool(**{"most": 2, **options})
        try:
            await work(pool)
        finally:
            await pool.close()

    before = forked()
    asyncio.run(run())
    assert not forked() - before


def test_a_job_that_takes_too_long_or_is_cancelled_gives_way() -> None:
    async def work(pool: Pool) -> None:
        assert (await pool.run(job(), 60)).data
        with pytest.raises(JobFailed, match=r"more than 0\.2 seconds"):
            await pool.run(job(SLOW), 0.2)
        running = asyncio.create_task(pool.run(job(SLOW), 60))
        await asyncio.sleep(0.3)
        assert not running.done()
        running.cancel()
        with pytest.raises(asyncio.CancelledError):
            await running
        assert (await pool.run(job(), 60)).data

    within(work, most=1)


def test_a_process_that_ends_takes_its_job_alone_with_it() -> None:
    async def work(pool: Pool) -> None:
        await pool.run(job(), 60)
        idle = forked()
        running = asyncio.create_task(pool.run(job(SLOW), 60))
        await asyncio.sleep(0.5)
        for process in idle:  # the one that waited has the job now
            os.kill(process, signal.SIGKILL)
        with pytest.raises(JobFailed, match="has ended"):
            await running
        assert (await pool.run(job(), 60)).data

    within(work)


def test_memory_is_bounded() -> None:
    code = (
        "from scenelang.web.pool import limit_memory\n"
        "import numpy\nlimit_memory(1 << 30)\n"
        "try:\n    numpy.ones(1 << 28)\nexcept MemoryError:\n    print(numpy.ones(1 << 20).sum())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert float(done.stdout) == 1 << 20


def test_more_jobs_than_processes_wait() -> None:
    async def work(pool: Pool) -> None:
        answers = await asyncio.gather(*(pool.run(job(size=[16 + n, 16]), 60) for n in range(12)))
        assert len({answer.data for answer in answers}) == 12
        assert len(forked()) <= 2

    within(work)


def test_a_process_that_does_not_start_is_told() -> None:
    async def work(pool: Pool) -> None:
        with pytest.raises(JobFailed, match="has ended"):
            await pool.run(job(), 60)

    within(work, nice="not a number")
