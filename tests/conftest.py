"""Settings, fixtures and marks of all tests."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests.browser import chromium, viewer_page  # noqa: F401, fixtures

# Seconds decide no test, as they hang on the machine: neither those of an example nor those of drawing it.
# The same cases every time: new ones are what fuzz/ looks for, by the hour.
settings.register_profile(
    "untimed", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("untimed")

# A test run that was started in the background ignores interrupts, and so would the processes that tests
# start and interrupt: without this, `pytest &` waits for them for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def _denormals() -> Iterator[None]:
    """Have each process know the smallest numbers again, which a training has torch take for 0."""
    yield
    if (torch := sys.modules.get("torch")) is not None:
        torch.set_flush_denormal(False)


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("gpu"):
        import torch

        if not torch.cuda.is_available():
            pytest.skip("no CUDA device")


TESTS = Path(__file__).parent
MORE = {"assets", "editors", "fuzz", "inverse", "lab", "output", "play", "web"}
"""Folders whose tests are marked `more`: plain ``pytest`` leaves them to ``-m more``, as `.ci/run` says."""


def usual(config: pytest.Config) -> bool:
    """Whether all tests are asked for, without -m or with one that says what is usual."""
    asked = config.option.markexpr not in config.getini("addopts")
    return not asked and all(Path(arg).resolve() == TESTS for arg in config.args)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Import no folder whose tests the run leaves out, which takes each of its processes seconds."""
    if collection_path.parent != TESTS or not collection_path.is_dir():
        return None
    more = collection_path.name in MORE
    only = config.option.markexpr.startswith("more and ") and not more
    return (more and usual(config)) or only or None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.relative_to(TESTS).parts[0] in MORE:
            item.add_marker("more")
    if usual(config):
        left = [item for item in items if item.get_closest_marker("more")]
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if not item.get_closest_marker("more")]
