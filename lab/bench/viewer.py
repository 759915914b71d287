"""Frames of the viewer's shader in Chromium with software GL, and operations a pixel.

    python -m lab bench viewer [--side N] [--frames K] [-o docs/results/viewer.json] [names …]

Draws each scene K times on a canvas of N pixels a side and says how long the first frame took, compilation of
the shader with it, how long the fastest of the others, and the multiply-adds a pixel takes on average, with
all that is left out left out. What a GPU takes can be estimated by them; software GL has few cores and no
texture units, so its times are upper bounds.
"""

from __future__ import annotations

import argparse
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import scenelang as nsg
from lab import ROOT
from lab.about import about, write_json
from lab.bench.floor import stars
from scenelang.web.arrays import script
from scenelang.web.export import view_of
from tests.browser import ARGUMENTS, NAMES

EXAMPLES = ROOT / "examples"
SMALL = "200 small objects"
NIGHT = "night, 200 stars"
PLANE = ("chain", "tangram", "flower", NIGHT, SMALL)
SOLID = ("chess", "lotus", "clouds")

TIMED = """async ([message, side, frames]) => {
  const view = await readView(JSON.parse(message));
  const canvas = Object.assign(document.createElement("canvas"), { width: side, height: side });
  const gl = canvas.getContext("webgl2", { antialias: false, depth: false, stencil: false });
  const size = { width: side, height: side, scale: 1 };
  const pixel = new Uint8Array(4);
  const times = [];
  let started = performance.now();
  const drawer = (view.dimension === 3 ? solidDrawer : planeDrawer)(gl, view);
  for (let frame = 0; frame <= frames; frame++) {
    drawer.draw(view.program, size);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // waits for the frame
    times.push(performance.now() - started);
    started = performance.now();
  }
  const operations = drawer.operations(view.program, size);
  drawer.dispose();
  gl.getExtension("WEBGL_lose_context").loseContext();
  return { first: times[0], least: Math.min(...times.slice(1)), operations };
}"""


def scene(name: str, side: int) -> nsg.Scene:
    """A scene by the name of an example, `SMALL` or `NIGHT`."""
    if name == SMALL:
        return stars(0, 200, 0.05, side)  # type: ignore[no-any-return]
    if name == NIGHT:
        return nsg.load(EXAMPLES / "night.nsg", params={"stars": 200}).sized((side, side))
    return nsg.load(EXAMPLES / f"{name}.nsg").sized((side, side))


def timed(page: Any, name: str, side: int, frames: int) -> dict[str, float]:
    """Milliseconds of the first frame and of the fastest other, and multiply-adds a pixel."""
    view = view_of(nsg.compile(scene(name, side)))
    result: dict[str, float] = page.evaluate(TIMED, [view.message(), side, frames])
    return result


def in_chromium(work: Callable[[Any], None]) -> None:
    """Do work with a page that has the viewer's script."""
    from playwright.sync_api import sync_playwright

    path = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(ARGUMENTS))
        page = browser.new_page()
        page.on("console", lambda message: print(message.text))
        page.add_script_tag(content=script())
        try:
            work(page)
        finally:
            browser.close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--side", type=int, default=256, help="pixels along a side")
    parser.add_argument("--frames", type=int, default=5, help="frames after the first")
    parser.add_argument("names", nargs="*", default=PLANE + SOLID, help="of examples")
    parser.add_argument("-o", "--out", type=Path, metavar="FILE")
    given = parser.parse_args()
    rows: dict[str, dict[str, float]] = {}

    def work(page: Any) -> None:
        print(f"{'scene':20} {'first ms':>9} {'frame ms':>9} {'operations a pixel':>19}")
        for name in given.names:
            result = rows[name] = timed(page, name, given.side, given.frames)
            print(f"{name:20} {result['first']:9.0f} {result['least']:9.1f} {result['operations']:19,.0f}")

    print(f"{given.side} x {given.side} pixels; {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    in_chromium(work)
    if given.out:
        record = {
            **about(),
            "side": given.side,
            "frames": given.frames,
            "cores": os.cpu_count(),
            "scenes": rows,
        }
        write_json(given.out, record)


if __name__ == "__main__":
    main()
