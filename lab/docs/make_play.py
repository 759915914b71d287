"""Record the moving picture of the playground: ``python -m lab docs play``, with Chromium and Playwright.

The real page of a real server is used as a person would: text is typed, a slider moved, a solid scene opened
and turned, and its camera written back. A picture is taken behind each step, once what it changes is drawn.
"""

from __future__ import annotations

import io
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PIL import Image as pillow
from playwright.sync_api import sync_playwright

from lab import ROOT
from tests.browser import ARGUMENTS, NAMES

OUT = ROOT / "docs/pictures/play.webp"
SIZE = {"width": 900, "height": 540}
SCENES = "chain", "saturn"
TYPED = "\nstar {\n  scale(0.3);\n  translate(0.4, -0.5);\n  material flat { color(#2a9d8f); }\n}"
QUALITY = 30
SOON_MS, REST_MS, LONG_MS = 70, 350, 1500


@contextmanager
def server() -> Iterator[str]:
    """The address of a playground with copies of the scenes."""
    with tempfile.TemporaryDirectory() as folder:
        for name in SCENES:
            shutil.copy(ROOT / f"examples/{name}.nsg", folder)
        command = [sys.executable, "-m", "scenelang", "play", f"{folder}/{SCENES[0]}.nsg", "--no-browser"]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)
        try:
            assert process.stdout is not None
            result = next(filter(None, (re.search(r"http://\S+", line) for line in process.stdout)))
            yield result[0]
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(20)


class Recording:
    """Pictures of a page and how long each is shown."""

    def __init__(self, page: Any) -> None:
        self._page = page
        self.frames: list[pillow.Image] = []
        self.shown_ms: list[int] = []

    def take(self, shown_ms: int, settle_ms: int = 250) -> None:
        """Wait for what was asked for, and take a picture."""
        self._page.wait_for_timeout(settle_ms)
        data = self._page.screenshot()
        self.frames.append(pillow.open(io.BytesIO(data)).convert("RGB"))
        self.shown_ms.append(shown_ms)

    def save(self, path: Path) -> None:
        """Write a moving picture that starts again at its end."""
        first, *others = self.frames
        first.save(
            path,
            save_all=True,
            append_images=others,
            duration=self.shown_ms,
            loop=0,
            quality=QUALITY,
            method=6,
        )


def record(page: Any, film: Recording) -> None:
    """Use the page."""
    page.locator(".cm-line", has_text="intersect").first.wait_for()
    film.take(LONG_MS, 4000)
    page.locator(".cm-line", has_text=re.compile(r"^\}")).first.click()
    page.keyboard.press("End")
    for at in range(0, len(TYPED), 4):
        page.keyboard.insert_text(TYPED[at : at + 4])
        film.take(SOON_MS)
    film.take(LONG_MS, 1500)
    slider = page.locator("#controls input[type=range]").first
    for value in (0.7, 0.8, 0.9, 1, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0):
        slider.fill(str(value))
        film.take(SOON_MS)
    film.take(LONG_MS, 1500)
    page.locator("#files").select_option(f"{SCENES[1]}.nsg")
    film.take(LONG_MS, 8000)
    box = page.locator("#stage").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 15):
        page.mouse.move(x + 9 * step, y + 3 * step)
        film.take(SOON_MS, 1200)
    page.mouse.up()
    film.take(LONG_MS, 5000)
    page.get_by_role("button", name="Write camera").click()
    film.take(2 * LONG_MS, 5000)


def main() -> None:
    path = next(filter(None, map(shutil.which, NAMES)))
    with server() as url, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(ARGUMENTS))
        page = browser.new_page(viewport=SIZE)
        page.goto(url)
        film = Recording(page)
        record(page, film)
        browser.close()
    film.save(OUT)
    print(f"{len(film.frames)} pictures, {OUT.stat().st_size:,} bytes: {OUT.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
