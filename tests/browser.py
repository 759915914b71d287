"""Chromium for tests marked ``browser``: a page with the viewer's script that neither complains nor asks."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from scenelang.web.arrays import script

ARGUMENTS = (
    "--headless",
    "--no-sandbox",
    "--no-first-run",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
)
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")


def _path() -> str:
    """The path of Chromium; skips the test where it or Playwright is missing."""
    pytest.importorskip("playwright.sync_api")
    path = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.skip("no Chromium")
    return path


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """A browser (`playwright.sync_api.Browser`) with software GL."""
    path = _path()
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(ARGUMENTS))
        yield browser
        browser.close()


@contextmanager
def watched(browser: Any, allowed: tuple[str, ...] = (), **options: Any) -> Iterator[Any]:
    """A new page; fails where it wrote to the console, threw an error, or made a request.

    Args:
        browser: of the fixture.
        allowed: what addresses of requests may begin with.
        options: of Playwright's `new_page`.
    """
    said: list[str] = []
    page = browser.new_page(**options)
    page.on("console", lambda message: said.append(f"{message.type}: {message.text}"))
    page.on("pageerror", lambda error: said.append(f"error: {error}"))
    page.on("request", lambda request: said.append(f"request: {request.url}"))
    try:
        yield page
    finally:
        page.close()
    fine = ("request: about:", "request: data:", "request: blob:", "request: file:")
    fine += tuple(f"request: {start}" for start in allowed)
    said = [line for line in said if not line.startswith(fine)]
    assert not said, "\n".join(said)


@pytest.fixture
def viewer_page(chromium: Any) -> Iterator[Any]:
    """A blank page in which every function of the viewer's script is global."""
    with watched(chromium) as page:
        page.add_script_tag(content=script())
        yield page
