"""Scenes of circles, as discs and as the polygons that circles were made of before: objects, time, accuracy.

    python -m lab bench circles [--rounds N] [--show FOLDER]

Each scene is drawn twice, its circles as leaves and with ``-D sides=true`` as polygons of the sides that
`std/shapes` chose. Processor time of one thread, the least of several drawings, with what stands before it in
one number: reading, compiling and drawing. PSNR, uncapped, is against the exact picture of the discs.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

import scenelang as nsg
from scenelang.drawing.how import keep_memory
from scenelang.drawing.metrics import UNCAPPED_DB, psnr
from scenelang.drawing.small import draw_small

HEAD = """nsg 1; canvas(512, 512); import "std/shapes" as s; param sides = false;
fn n(r) = sides ? s.sides_of(r) : 0;
"""
SCENES = {
    "logo": """background(#f7f4ec);
      module eye(at) {
        group {
          s.disc(0.17, n(0.17)) { material flat { color(#fff); } }
          s.disc(0.08, n(0.08)) { material flat { color(#1d3557); } }
          s.disc(0.025, n(0.025)) { translate(0.03, 0.03); material flat { color(#fff); } }
          translate(at);
        }
      }
      s.disc(0.9, n(0.9)) { material flat { color(#1d3557); } }
      s.ring(0.86, 0.05, n(0.86)) { material flat { color(#e9c46a); } }
      s.disc(0.76, n(0.76)) { material flat { color(#2a9d8f); } }
      for (i in 0..<12) {
        s.disc(0.035, n(0.035)) { translate(0.68 * cos(30deg * i), 0.68 * sin(30deg * i)); }
      }
      eye([-0.25, 0.15]);
      eye([0.25, 0.15]);
      s.arc(0.4, 0.07, 200deg, 340deg, n(0.4)) { material flat { color(#fff); } }
      for (x in [-1, 1]) {
        s.ellipse(0.09, 0.05, n(0.09)) { translate(0.42 * x, -0.14); material flat { color(#e76f51); } }
      }
    """,
    "infographic": """background(#fdfcf9);
      let paints = [#e76f51, #2a9d8f, #e9c46a, #264653];
      let ends = [0, 0.34, 0.61, 0.83, 1];
      group {
        for (i in 0..<4) {
          s.pie(0.42, 1turn * ends[i], 1turn * ends[i + 1], n(0.42)) { material flat { color(paints[i]); } }
        }
        s.disc(0.2, n(0.2)) { material flat { color(#fdfcf9); } }
        translate(-0.48, 0.45);
      }
      for (i in 0..<4) {
        group {
          s.disc(0.06, n(0.06)) { material flat { color(paints[i]); } }
          s.capsule([0.14, 0], [0.3 + 0.18 * i, 0], 0.06, n(0.03)) { material flat { color(#264653); } }
          translate(0.12, 0.75 - 0.2 * i);
        }
      }
      s.path([for (i in 0..8) [-0.85 + 0.2125 * i, -0.5 + 0.22 * sin(0.21turn * i)]], 0.03, n(0.015)) {
        material flat { color(#2a9d8f); }
      }
      for (i in 0..8) {
        s.disc(0.035, n(0.035)) {
          translate(-0.85 + 0.2125 * i, -0.5 + 0.22 * sin(0.21turn * i)); material flat { color(#e76f51); }
        }
      }
      s.rounded(1.8, 0.03, 0.015, n(0.015)) { translate(0, -0.85); material flat { color(#264653); } }
    """,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9, metavar="N")
    parser.add_argument("--show", type=Path, metavar="FOLDER", help="write the pictures, too")
    given = parser.parse_args()
    keep_memory()
    for name, text in SCENES.items():
        exact = nsg.render(nsg.loads(HEAD + text), backend="reference")
        for way in ("discs", "polygons"):
            least = float("inf")
            for _ in range(given.rounds):
                started = time.process_time()
                scene = nsg.loads(HEAD + text, params={"sides": way == "polygons"})
                program = nsg.compile(scene)
                drawn = draw_small(program)
                least = min(least, time.process_time() - started)
            off = psnr(np.asarray(drawn.image), np.asarray(exact), UNCAPPED_DB)
            count = len(program.vectors)
            print(f"{name}, {way}: {count} objects, {1e3 * least:.0f} ms, {off:.1f} dB", flush=True)
            if given.show:
                given.show.mkdir(parents=True, exist_ok=True)
                drawn.image.save(given.show / f"{name}-{way}.png")


if __name__ == "__main__":
    main()
