"""The page in Chromium."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from tests.browser import watched
from tests.play.client import Server

PATIENCE_MS = 20_000


class Page:
    def __init__(self, page: Any) -> None:
        self.page = page
        page.set_default_timeout(PATIENCE_MS)

    def until(self, script: str, *given: Any) -> Any:
        """Wait until an expression of JavaScript holds; ``given`` is its argument `g`.

        Playwright's own way evaluates text in the page, which its content policy forbids.
        """
        stop = time.monotonic() + PATIENCE_MS / 1000
        while not (found := self.page.evaluate(f"(g) => {script}", list(given))):
            assert time.monotonic() < stop, script
            self.page.wait_for_timeout(30)
        return found

    def text(self) -> str:
        return "\n".join(self.page.locator(".cm-line").all_inner_texts()).replace("\n\n", "\n")

    def has(self, piece: str) -> None:
        """Wait until a line of the editor has a piece of text."""
        self.until(
            "[...document.querySelectorAll('.cm-line')].some((l) => l.textContent.includes(g[0]))", piece
        )

    def click_text(self, piece: str, where: str = "End") -> None:
        """Put the cursor to the end of a line, or elsewhere by a key."""
        self.page.locator(".cm-line", has_text=piece).first.click()
        self.page.keyboard.press(where)

    def picture(self) -> str:
        """Wait for the server's picture of what is shown; its data."""
        self.until("document.getElementById('stage').dataset.shows === 'still'")
        return str(self.page.locator("#still").get_attribute("src"))

    def other_picture(self, than: str) -> str:
        """Wait for another picture of the server than one."""
        self.until(
            "document.getElementById('stage').dataset.shows === 'still'"
            " && document.getElementById('still').src !== g[0]",
            than,
        )
        return self.picture()

    def knows(self) -> None:
        """Wait for the language server."""
        self.page.locator("#problems:enabled", has_text="mistake").wait_for()


@contextmanager
def opened(browser: Any, server: Server, first: str = "", **options: Any) -> Iterator[Page]:
    """The page; fails where it wrote to the console or asked another host. ``first`` runs before all else."""
    with watched(browser, (server.origin,), **options) as page:
        page.add_init_script(first)
        page.goto(server.url)
        yield Page(page)
