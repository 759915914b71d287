"""Processes that do jobs: those that hang or end are replaced, and all of them end with the server."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from scenelang.web.folder import JobFailed
from scenelang.web.pool import Pool
from tests.play.client import below, children

SLOW = "for (i in 0..2999) { for (j in 0..2999) { let x = i * j; } } square;"


def job(text: str = "square;", **parts: Any) -> dict[str, Any]:
    given = {"do": "network", "path": "/none/a.nsg", "name": "a.nsg", "text": text, "texts": {}, "root": None}
    return {**given, "params": {}, "frame": 0, "size": [32, 32], "message": {}, **parts}


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


def test_a_job_that_takes_too_long_is_ended() -> None:
    async def work(pool: Pool) -> None:
        assert (await pool.run(job(), 60)).data
        with pytest.raises(JobFailed, match=r"more than 0\.2 seconds"):
            await pool.run(job(SLOW), 0.2)
        assert (await pool.run(job(), 60)).data

    within(work, most=1)


def test_a_job_that_is_cancelled_gives_way() -> None:
    async def work(pool: Pool) -> None:
        running = asyncio.create_task(pool.run(job(SLOW), 60))
        await asyncio.sleep(0.5)
        assert not running.done()
        running.cancel()
        with pytest.raises(asyncio.CancelledError):
            await running
        assert (await pool.run(job(), 30)).data

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
        assert len(forked()) <= 2

    within(work)


def test_a_process_that_does_not_start_is_told() -> None:
    async def work(pool: Pool) -> None:
        with pytest.raises(JobFailed, match="has ended"):
            await pool.run(job(), 60)

    within(work, nice="not a number")
