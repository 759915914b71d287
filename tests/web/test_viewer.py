"""The viewer in a browser: what it does with time, params, cameras, sizes and lost contexts.

Its drawers paint one colour here; the shaders have tests of their own.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import scenelang as nsg
from scenelang.compiler.spaces import Camera
from tests.web.conftest import ask

pytestmark = pytest.mark.browser

FORM = {"form": {"any": 1}, "params": [{"name": "k", "kind": "number", "value": 1, "low": 0, "high": 4}]}
MOVING = {"animation": {"seconds": 1, "fps": 20, "frames": 20, "loop": True}}
SOLID = "camera(eye = [1, 2, 4], target = [0, 0.5, 0], fov = 40deg); sphere;"


def settled(page: Any) -> None:
    """Wait until the viewer has drawn in full and asks for nothing more."""
    page.wait_for_function("() => drawn.scale === 1")


def test_params_and_what_cannot_be(shown: Any) -> None:
    page = shown(**FORM)
    assert ask(page, "drawn.program.shade") == 0.5
    ask(page, "viewer.set('k', 2), viewer.draw()")
    assert ask(page, "drawn.program.shade") == 1
    ask(page, "viewer.set('k', 3), viewer.draw()")
    assert ask(page, "drawn.program.shade") == 1, "the last good picture stays"
    assert ask(page, "refused") == [{"kind": "param", "name": "k", "message": "`k` is too much"}]
    ask(page, "viewer.reset(), viewer.draw()")
    assert ask(page, "drawn.program.shade") == 0.5
    assert ask(page, "refused[1].message") is None


def test_time_passes_at_its_own_speed(viewer_page: Any, shown: Any) -> None:
    viewer_page.clock.install(time=0)
    page = shown(**FORM, **MOVING)
    page.clock.pause_at(3600)
    ask(page, "(viewer.seek(15), viewer.play())")
    seen = []
    for _ in range(30):
        page.clock.run_for(100)
        seen.append(ask(page, "viewer.frame"))
    for step, frame in enumerate(seen, 1):  # 20 frames a second, seen at the last of the screen's 60
        assert (15 + 2 * step - frame) % 20 in (0, 1)
    ask(page, "viewer.pause()")
    page.clock.run_for(1000)
    assert ask(page, "[viewer.frame, viewer.playing]") == [seen[-1], False]


def test_an_animation_without_loop_ends(shown: Any) -> None:
    page = shown(**FORM, animation={"seconds": 0.2, "fps": 20, "frames": 4, "loop": False})
    ask(page, "viewer.play()")
    page.wait_for_function("() => !viewer.playing")
    assert ask(page, "viewer.frame") == 3
    assert ask(page, "(viewer.play(), viewer.frame)") == 0
    ask(page, "viewer.seek(99)")
    assert ask(page, "viewer.frame") == 3


def test_nothing_is_drawn_at_rest(shown: Any) -> None:
    page = shown(**FORM)
    settled(page)
    page.wait_for_timeout(600)
    count = ask(page, "told.length")
    page.wait_for_timeout(600)
    assert ask(page, "told.length") == count
    ask(page, "viewer.set('k', 0.5)")
    page.wait_for_function("() => drawn.program.shade === 0.25")


def test_it_draws_coarser_while_it_cannot_keep_up(shown: Any) -> None:
    page = shown(**FORM, **MOVING)
    settled(page)
    ask(page, "void (globalThis.slow = 70, viewer.play())")
    page.wait_for_function("() => drawn.scale < 1")
    wide, high, scale = ask(page, "[drawn.width / 64, drawn.height / 48, drawn.scale]")
    assert [wide, high] == pytest.approx([scale, scale], abs=0.02)
    ask(page, "void (globalThis.slow = 0)")
    page.wait_for_function("() => drawn.scale === 1 && viewer.playing")
    ask(page, "void (globalThis.slow = 70)")
    page.wait_for_function("() => drawn.scale < 1")
    ask(page, "viewer.pause()")
    settled(page)


def test_solids_begin_coarse_and_end_full(shown: Any) -> None:
    page = shown(SOLID)
    ask(page, "viewer.orbit(0.1, 0)")
    page.wait_for_function("() => scales.includes(0.25) && drawn.scale === 1 && canvas.width === 64")
    assert ask(page, "pieces.slice(-3)") == [0, 1, 2]


@pytest.mark.parametrize("scale", [0.25, 1])
def test_what_cannot_be_drawn_is_told(shown: Any, scale: float) -> None:
    page = shown(SOLID)
    ask(page, f"void (globalThis.broken = {scale}, viewer.orbit(0.1, 0))")
    page.wait_for_function("() => refused.length > 0")
    assert ask(page, "refused[0]") == {"kind": "shader", "message": "no shader"}


def test_a_lost_context_comes_back(shown: Any) -> None:
    page = shown(**FORM)
    settled(page)
    before = ask(page, "canvas.toDataURL(viewer.draw())")
    lost = "canvas.getContext('webgl2').getExtension('WEBGL_lose_context')"
    ask(page, f"void (globalThis.extension = {lost}, extension.loseContext())")
    page.wait_for_function("() => refused.length === 1")
    assert ask(page, "refused[0].kind") == "lost"
    ask(page, "viewer.draw()")
    ask(page, "void extension.restoreContext()")
    page.wait_for_function("() => refused.length === 2")
    assert ask(page, "refused[1]") == {"kind": "lost", "message": None}
    assert ask(page, "canvas.toDataURL(viewer.draw())") == before
    assert ask(page, "made") == 2


def test_another_view_keeps_what_was_moved(shown: Any) -> None:
    page = shown(**FORM, **MOVING)
    ask(page, "viewer.set('k', 2), viewer.seek(15)")
    ask(page, "void (viewer.view = { ...view, network: { ...view.network } })")
    assert ask(page, "[made, viewer.params.k, viewer.frame]") == [1, 2, 15], "the same shader is used again"
    switch = "[{ name: 'k', kind: 'bool', value: true }]"
    ask(page, f"void (viewer.view = {{ ...view, params: {switch}, animation: null }})")
    assert ask(page, "[made, viewer.params.k, viewer.frame]") == [1, True, 0]
    ask(page, "void (viewer.view = { ...view, shader: { other: 1 } })")
    assert ask(page, "[made, viewer.params.k]") == [2, 1]


def test_orbits_zooms_and_pans(shown: Any) -> None:
    page = shown(SOLID)
    assert ask(page, "viewer.cameraLine()") == "camera(eye = [1, 2, 4], target = [0, 0.5, 0], fov = 40deg);"
    home = np.array([1, 1.5, 4])
    for turn, rise in ((0.5, 0.2), (-3, -9), (0.1, 99), (2, -50)):
        ask(page, f"viewer.orbit({turn}, {rise})")
        camera = ask(page, "viewer.camera")
        way = np.subtract(camera["eye"], camera["target"])
        assert np.linalg.norm(way) == pytest.approx(np.linalg.norm(home))
        assert np.hypot(way[0], way[2]) > 0.05, "clear of the poles"
    for _ in range(80):
        ask(page, "viewer.zoom(0.7)")
    camera = ask(page, "viewer.camera")
    assert 0.01 < np.linalg.norm(np.subtract(camera["eye"], camera["target"])) < 0.1
    ask(page, "void (viewer.camera = null)")
    ask(page, "viewer.pan(0.5, 0)")
    camera = ask(page, "viewer.camera")
    right = Camera((1.0, 2.0, 4.0), (0.0, 0.5, 0.0)).axes()[1]
    moved = -np.array(right) * np.linalg.norm(home) * np.tan(np.radians(20))
    np.testing.assert_allclose(camera["target"], np.add([0, 0.5, 0], moved), atol=1e-9)
    np.testing.assert_allclose(camera["eye"], np.add([1, 2, 4], moved), atol=1e-9)
    line = ask(page, "viewer.cameraLine()")
    stated = nsg.loads(f"{line} sphere;").camera
    assert not isinstance(stated, str)
    np.testing.assert_allclose(stated.eye, camera["eye"], atol=6e-5)
    np.testing.assert_allclose(
        ask(page, "drawn.program.stage.eye && viewer.program.stage.eye"), camera["eye"]
    )
