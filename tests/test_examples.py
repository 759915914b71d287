"""Every example checks, and the network draws what the reference draws."""

from __future__ import annotations

import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.language.formatting import format_text
from tests.pictures import premultiplied, psnr_db

EXAMPLES = Path(__file__).parents[1] / "examples"
SCENES = sorted(EXAMPLES.glob("*.nsg"))
LEAST_DB = 38.0  # PSNR; a scene with a wrong object or operator comes out below 25
# shorter sides, in the plane and in space: small for speed, and odd, as edges through samples are ties
DRAWN_PX, SMALL_PX = {False: 189, True: 31}, {False: 64, True: 24}


def sized(scene: nsg.Scene, shorter_px: int) -> nsg.Scene:
    """The same scene on a canvas whose shorter side is this long."""
    shorter = min(scene.canvas)
    canvas = tuple(max(1, side * shorter_px // shorter) for side in scene.canvas)
    return scene.model_copy(update={"canvas": canvas})


def frames_of(path: Path) -> int:
    animation = nsg.load(path).animation
    return animation.frames if animation is not None else 1


def is_solid(scene: nsg.Scene) -> bool:
    return nsg.compile(scene).stage is not None


ANIMATIONS = [path for path in SCENES if frames_of(path) > 1]


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_example_is_drawn(path: Path) -> None:
    """Without a warning, and as the reference draws it; an animation in its middle."""
    found = nsg.Diagnostics()
    scene = nsg.load(path, diagnostics=found, frame=frames_of(path) // 2)
    nsg.compile(scene, diagnostics=found)
    assert not list(found)
    solid = is_solid(scene)
    scene = sized(scene, DRAWN_PX[solid])
    picture = nsg.render(scene, samples="four" if solid else "adaptive")  # its parts are smaller than a pixel
    if 'import "std/meshes"' in path.read_text("utf-8"):  # what they were made from does not ship
        assert np.ptp(picture) > 0.5
        return
    exact = nsg.render(scene, backend="reference")
    assert psnr_db(premultiplied(picture), premultiplied(exact)) > LEAST_DB


@pytest.mark.parametrize("path", ANIMATIONS, ids=lambda path: path.stem)
def test_animation_compiles_without_a_warning(path: Path) -> None:
    frames = frames_of(path)
    for frame in range(0, frames, max(1, frames // 12)):
        found = nsg.Diagnostics()
        nsg.compile(nsg.load(path, frame=frame, diagnostics=found), diagnostics=found)
        assert not list(found), frame


LOOPS = [path for path in ANIMATIONS if (animation := nsg.load(path).animation) and animation.loop]


@pytest.mark.parametrize("path", LOOPS, ids=lambda path: path.stem)
def test_loop_has_no_seam(path: Path) -> None:
    """From the last frame to the first is no larger a step than those around it."""
    frames = frames_of(path)
    small_px = SMALL_PX[is_solid(nsg.load(path))]
    around = [frame % frames for frame in range(-5, 2)]
    drawn = [
        premultiplied(nsg.render(sized(nsg.load(path, frame=frame), small_px), backend="reference"))
        for frame in around
    ]
    steps = [float(np.abs(a - b).mean()) for a, b in pairwise(drawn)]
    assert steps[4] <= 1.3 * max(steps[:4] + steps[5:]) + 0.002


def test_examples_say_what_they_show_and_are_laid_out() -> None:
    """As `scenelang fmt examples` leaves them."""
    assert len(SCENES) >= 20
    for path in sorted(EXAMPLES.rglob("*.nsg")):
        text = path.read_text("utf-8")
        assert format_text(text) == text, path.name
        assert path not in SCENES or (text.startswith("// ") and "// Change: " in text and "nsg 1;" in text)


def test_script_draws(tmp_path: Path) -> None:
    script, target = EXAMPLES / "spiral.py", tmp_path / "spiral.png"
    subprocess.run([sys.executable, "-W", "error", str(script), str(target)], check=True, capture_output=True)
    assert target.stat().st_size > 1000


def test_suggestions_of_comments_work() -> None:
    """The values that comments of examples suggest to try with -D."""
    found = 0
    for path in SCENES:
        for line in path.read_text("utf-8").splitlines():
            if line.startswith("//") and "-D " in line:
                named = re.search(r"scenelang render (\S+) -o ", line)
                assert named is None or named[1] == path.name
                params = dict(re.findall(r"-D ([\w.]+)=(\S+)", line))
                assert params, line
                assert nsg.compile(nsg.load(path, params=params)).digest()
                found += 1
    assert found > 20
