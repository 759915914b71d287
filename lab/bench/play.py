"""From key press to changed picture in `scenelang play`.

    python -m lab bench play [SCENE] [KEYS] [-o docs/results/play.json]

Chromium with software GL types a digit of the scene's first number and takes it back. Measured in the page,
from the key press to the frame after the network's picture of that text, at the scene's own size; beside it
the server's times of compiling and drawing.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import statistics
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

from lab.about import about, write_json
from tests.browser import ARGUMENTS, _path
from tests.play.client import Server
from tests.play.page import Page

WATCH = """() => {
  const still = document.getElementById("still");
  const first = Number(still.dataset.version);  // each key is one version more
  globalThis.took = [];
  let pressed = 0;
  let keys = 0;
  addEventListener("keydown", (event) => {
    pressed = event.timeStamp;
    keys += 1;
  }, true);
  new MutationObserver(() => {
    if (Number(still.dataset.version) !== first + keys || took.length === keys) return;
    took.push(null);
    const shown = (now) => took.splice(-1, 1, [now - pressed, told.textContent]);
    requestAnimationFrame(() => requestAnimationFrame(shown));
  }).observe(still, { attributeFilter: ["data-version"] });
}"""
PAUSE_MS = 900  # behind each picture: by then it has been drawn as large as it is shown


def main(scene: Path, keys: int, out: Path | None) -> None:
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(shutil.copy(scene, folder))
        load = os.getloadavg()[0]
        with Server(copy, Path(folder, "state")) as server, sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=_path(), args=list(ARGUMENTS))
            page = Page(browser.new_page(viewport={"width": 1280, "height": 800}))
            page.page.goto(server.url)
            page.picture()
            page.knows()
            page.page.evaluate(WATCH)
            number = re.search(r"\((0?\.\d+)", scene.read_text("utf-8"))
            assert number is not None, "no number behind a bracket"
            page.page.get_by_text(number[1], exact=True).first.click()
            page.page.wait_for_timeout(1000)
            for key in range(keys):
                page.page.keyboard.press("Backspace" if key % 2 else "5")
                page.until("took.length > g[0] && took.at(-1)", key)
                page.page.wait_for_timeout(PAUSE_MS)
            took = page.page.evaluate("took")
            browser.close()
    times = sorted(ms for ms, _ in took)
    print(f"{scene.name}: {len(times)} keys; load before {load:.1f}, after {os.getloadavg()[0]:.1f}")
    print(f"median {statistics.median(times):.0f} ms, from {times[0]:.0f} to {times[-1]:.0f} ms")
    drawn = [int(result[1]) for _, told in took if (result := re.search(r"(\d+) ms", told))]
    print(f"of which the server compiles and draws {statistics.median(drawn):.0f} ms; {took[-1][1]}")
    if out:
        figures = {"median_ms": statistics.median(times), "slowest_ms": times[-1], "load": load}
        figures["drawn_ms"] = statistics.median(drawn)
        record = {**about(), "scene": scene.name, "keys": len(times), "cores": os.cpu_count(), **figures}
        write_json(out, record)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scene", nargs="?", type=Path, default=Path("examples/chain.nsg"))
    parser.add_argument("keys", nargs="?", type=int, default=20)
    parser.add_argument("-o", "--out", type=Path, metavar="FILE")
    given = parser.parse_args()
    main(given.scene, given.keys, given.out)
