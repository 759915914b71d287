"""Every example checks, and the network draws what the reference draws."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import scenelang as nsg
from scenelang.drawing.exact import picture as picture_of_paths
from tests.pictures import premultiplied, psnr_db

EXAMPLES = Path(__file__).parents[1] / "examples"
SCENES = sorted(EXAMPLES.glob("*.nsg"))
LEAST_DB = {False: 48.0, True: 38.0}  # PSNR; a scene with a wrong object or operator comes out below 25
UNDER_SKY_DB = 23.0  # the reference alone is 25 dB off in a closed room
# the reference takes seconds, or its paths miss what lights them
UNTRACED = {"clouds", "cumulus", "fog", "neon", "paperlamp"}
# shorter sides, in the plane and in space: small for speed, and odd, as edges through samples are ties
DRAWN_PX, SMALL_PX = {False: 41, True: 17}, {False: 40, True: 10}


def sized(scene: nsg.Scene, shorter_px: int) -> nsg.Scene:
    """The same scene on a canvas whose shorter side is this long."""
    shorter = min(scene.canvas)
    canvas = tuple(max(1, side * shorter_px // shorter) for side in scene.canvas)
    return scene.model_copy(update={"canvas": canvas})


def frames_of(path: Path) -> int:
    animation = nsg.load(path).animation
    return animation.frames if animation is not None else 1


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_example_is_drawn(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a warning in any frame, as the reference draws it in the middle, and without a seam."""
    frames = frames_of(path)
    for frame in {*range(0, frames, max(1, frames // 4)), frames // 2}:
        found = nsg.Diagnostics()
        program = nsg.compile(nsg.load(path, frame=frame, diagnostics=found), diagnostics=found)
        assert not list(found), frame
    solid = program.stage is not None
    lit = program.stage is not None and program.stage.sky is not None
    scene = sized(nsg.load(path, frame=frames // 2), SMALL_PX[solid] if lit else DRAWN_PX[solid])
    picture = nsg.render(scene, samples="four" if solid else "adaptive")  # its parts are smaller than a pixel
    # what meshes were made from does not ship
    if path.stem in UNTRACED or 'import "std/meshes"' in path.read_text("utf-8"):
        assert np.ptp(picture) > 0.4
        return
    paths = 16 if path.stem == "room" else 6  # in a closed room few paths meet the light
    monkeypatch.setattr(picture_of_paths, "sky_light", partial(picture_of_paths.sky_light, paths=paths))
    exact = nsg.render(scene, backend="reference")
    least = UNDER_SKY_DB if lit else LEAST_DB[solid]
    assert psnr_db(premultiplied(picture), premultiplied(exact)) > least
    if scene.animation is not None and scene.animation.loop:
        # from the last frame to the first is no larger a step than those around it
        around = [sized(nsg.load(path, frame=frame % frames), SMALL_PX[solid]) for frame in range(-4, 2)]
        drawn = [premultiplied(nsg.render(scene)) for scene in around]
        steps = [float(np.abs(a - b).mean()) for a, b in pairwise(drawn)]
        assert steps[3] <= 1.3 * max(steps[:3] + steps[4:]) + 0.002


def test_examples_say_what_they_show() -> None:
    assert len(SCENES) >= 20
    for path in SCENES:
        text = path.read_text("utf-8")
        assert text.startswith("// "), path.name
        assert "// Change: " in text, path.name
        assert "nsg 1;" in text, path.name


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
