"""Processes that do jobs: those that hang or end are replaced, and all of them end with the server."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from scenelang.play.pool import JobFailed, Pool
from tests.play.client import children, is_there

SLOW = "for (i in 0..2999) { for (j in 0..2999) { let x = i * j; } } square;"


def job(text: str = "square;", **parts: Any) -> dict[str, Any]:
    given = {"do": "network", "path": "/none/a.nsg", "name": "a.nsg", "text": text, "texts": {}, "root": None}
    return {**given, "params": {}, "frame": 0, "size": [32, 32], "message": {}, **parts}


def within(work: Callable[[Pool], Awaitable[None]], **options: Any) -> None:
    """Do something with a pool, after which none of its processes is there."""

    async def run() -> None:
        pool = Pool(**{"most": 2, "warm": 1, **options})
        pool.start()
        try:
            await work(pool)
        finally:
            await pool.close()

    before = children(os.getpid())
    asyncio.run(run())
    assert not children(os.getpid()) - before


def test_a_job_that_takes_too_long_is_ended() -> None:
    async def work(pool: Pool) -> None:
        assert (await pool.run(job(), 60)).data
        with pytest.raises(JobFailed, match=r"more than 0\.2 seconds"):
            await pool.run(job(SLOW), 0.2)
        assert (await pool.run(job(), 60)).data

    within(work, most=1)


def test_a_job_that_is_cancelled_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scenelang.play.pool.GRACE_S", 60.0)  # however busy the machine is

    async def work(pool: Pool) -> None:
        assert (await pool.run(job(), 60)).data
        (process,) = children(os.getpid())
        running = asyncio.create_task(pool.run(job(SLOW), 60))
        await asyncio.sleep(0.5)
        assert not running.done()
        running.cancel()
        with pytest.raises(asyncio.CancelledError):
            await running
        assert (await pool.run(job(), 60)).data
        assert is_there(process)  # it stopped by itself, and did the next

    within(work, most=1)


def test_a_process_that_ends_is_replaced() -> None:
    async def work(pool: Pool) -> None:
        await pool.run(job(), 60)
        running = asyncio.create_task(pool.run(job(SLOW), 60))
        await asyncio.sleep(0.5)
        for child in children(os.getpid()):
            os.kill(child, signal.SIGKILL)
        with pytest.raises(JobFailed, match="has ended"):
            await running
        assert (await pool.run(job(), 60)).data

    within(work, most=1)


def test_memory_is_bounded() -> None:
    """What needs too much fails by itself, and the process goes on."""

    async def work(pool: Pool) -> None:
        with pytest.raises(JobFailed):
            await pool.run(job("canvas(60000, 60000); square;", size=None), 60)
        with pytest.raises(JobFailed):
            await pool.run(job(size=[8192, 8192]), 60)
        assert (await pool.run(job(), 60)).data

    within(work)


def test_more_jobs_than_processes_wait() -> None:
    async def work(pool: Pool) -> None:
        answers = await asyncio.gather(*(pool.run(job(size=[16 + n, 16]), 60) for n in range(12)))
        assert len({answer.data for answer in answers}) == 12
        assert len(children(os.getpid())) <= 2

    within(work)


def test_a_process_that_does_not_start_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    async def work(pool: Pool) -> None:
        with pytest.raises(JobFailed, match="does not start"):
            await pool.run(job(), 60)

    monkeypatch.setattr("sys.executable", "/bin/true")
    within(work)
