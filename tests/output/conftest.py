"""A dask scheduler and workers on loopback."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture(scope="session")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A scheduler with two workers."""
    with started(tmp_path_factory.mktemp("cluster"), 2) as (at, _):
        yield at


@contextlib.contextmanager
def started(
    folder: Path, workers: int, **variables: str
) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler's address, its process and those of workers, without who would start them again.

    Variables of the environment that name certificates make a scheduler that takes nothing else.
    """
    file = folder / "scheduler.json"
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    quiet["env"] = {**os.environ, **variables}
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", "0"]
    command += ["--host", "127.0.0.1"]
    command += ["--protocol", "tls"] if variables else []
    every = [subprocess.Popen([*command, "--no-dashboard", "--scheduler-file", str(file)], **quiet)]
    try:
        deadline = time.monotonic() + 60
        while not file.exists() or not file.read_text():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        address = json.loads(file.read_text())["address"]
        command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--host", "127.0.0.1"]
        command += ["--nthreads", "1", "--no-dashboard", "--no-nanny", "--local-directory", str(folder)]
        every += [subprocess.Popen(command, **quiet) for _ in range(workers)]
        if not variables:
            distributed = pytest.importorskip("distributed")
            with distributed.Client(address, set_as_default=False) as client:
                client.wait_for_workers(workers, timeout=60)
        yield address, every
    finally:
        for process in every:
            process.kill()
            process.wait()
