"""What a frame of an animation costs, and what is saved by what it shares with the one before.

For each scene: CPU time to compile a frame by itself (read, parse, evaluate, compile) and as part of an
animation; to draw it whole and as part of one; and the ratio of the sums. Frames are compared: they are the
same, byte for byte. CPU time of one thread, so that a busy machine shows less; each figure is a median.

    python -m lab bench animate [FRAMES] [SCENE …]
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from lab import ROOT
from scenelang.animation.clip import open_clip
from scenelang.animation.painting import Painter
from scenelang.diagnostics.diagnostic import Diagnostics
from scenelang.evaluate.evaluation import load_scene
from scenelang.program.compile import compile_scene

T = TypeVar("T")

MANY = """animate(seconds = 2, fps = 24);
for (i in 0..<1000) {
  star {
    scale(0.03); rotate(7deg * i); translate(1.8 * rand(i) - 0.9, 1.8 * rand(i + 5000) - 0.9);
    material flat { color(hsv(rand(i), 0.5, 1)); }
  }
}
square { scale(0.1); rotate(1turn * u); translate(0.5, 0.5); }
"""
MOVING = MANY.replace("7deg * i", "7deg * i + 1turn * u")
STILL = MANY.replace("1turn * u", "20deg")
SCENES = {
    "1,000 objects, 1 moves": MANY,
    "1,000 objects, 1 moves, 1024 x 1024": "canvas(1024, 1024);" + MANY,
    "1,000 objects, all move": MOVING,
    "1,000 objects, none moves": STILL,
}


def timed(work: Callable[[], T]) -> tuple[float, T]:
    """CPU milliseconds of a call, and what it gives."""
    started = time.process_time()
    result = work()
    return 1e3 * (time.process_time() - started), result


def measure(name: str, path: Path, most: int) -> None:
    """Print the figures of one scene."""
    together, alone = Painter(open_clip(path), threads=1), Painter(open_clip(path, reuse=False), threads=1)
    clip = together.clip
    frames = range(min(most, clip.animation.frames))
    times: dict[str, list[float]] = {"compile alone": [], "compile": [], "draw alone": [], "draw": []}
    shown = None
    for number in frames:

        def by_itself(number: int = number) -> object:
            scene, spans = load_scene(path, diagnostics=Diagnostics(), frame=number)
            assert scene is not None
            return compile_scene(scene, spans=spans)

        compile_alone, _ = timed(by_itself)
        compile_ms, frame = timed(lambda number=number: together.prepare(clip.shot(number)))
        draw_ms = 0.0
        if shown is None or frame.key != shown[0]:
            draw_ms, image = timed(lambda frame=frame: together.draw(frame))
            shown = frame.key, image
        draw_alone, expected = timed(lambda frame=frame: alone.draw(frame))
        assert shown[1].tobytes() == expected.tobytes()
        if number:  # the first frame has nothing before it
            for key, value in zip(times, (compile_alone, compile_ms, draw_alone, draw_ms), strict=True):
                times[key].append(value)
    found = {key: statistics.median(values) for key, values in times.items()}
    before, after = found["compile alone"] + found["draw alone"], found["compile"] + found["draw"]
    print(
        f"{name}: compile {found['compile alone']:.1f} -> {found['compile']:.1f} ms "
        f"({found['compile alone'] / found['compile']:.1f} x), draw {found['draw alone']:.1f} -> "
        f"{found['draw']:.1f} ms, together {before / after:.1f} x"
    )


def main() -> None:
    """Measure the scenes above, and those given or the examples that are animations."""
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    examples = ROOT / "examples"
    given = [Path(name) for name in sys.argv[2:]] or [
        path for path in sorted(examples.glob("*.nsg")) if "\nanimate(" in path.read_text("utf-8")
    ]
    with tempfile.TemporaryDirectory() as folder:
        for name, text in SCENES.items():
            path = Path(folder) / "scene.nsg"
            path.write_text(text, "utf-8")
            measure(name, path, most)
    for path in given:
        measure(path.name, path, most)


if __name__ == "__main__":
    main()
