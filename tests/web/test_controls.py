"""Controls in a browser: made of params, working both ways, with strangers' names as text."""

from __future__ import annotations

from math import pi
from typing import Any

import pytest

from tests.web.conftest import ask

pytestmark = pytest.mark.browser

ODD = "\u202eevil</script><img src=x onerror=alert(1)>"
PARAMS = [
    {"name": "k", "kind": "number", "value": 1, "low": 0, "high": 4, "step": 0.5, "label": ODD},
    {"name": "far", "kind": "number", "value": 1.25, "low": 1, "high": 2, "exclusive": True},
    {"name": "n", "kind": "number", "value": 7},
    {"name": "turn", "kind": "angle", "value": pi / 6, "low": 0, "high": pi / 2, "unit": "deg"},
    {"name": "wait", "kind": "time", "value": 0.25, "low": 0, "high": 2, "unit": "ms"},
    {"name": "on", "kind": "bool", "value": False},
    {"name": "ink", "kind": "color", "value": [1, 0.5, 0]},
    {"name": "look", "kind": "string", "value": "day", "choices": ["day", ODD]},
    {"name": "size", "kind": "number", "value": 2, "choices": [1, 2, 4]},
    {"name": "said", "kind": "string", "value": ODD},
    {"name": "list", "kind": "vector", "value": [1, [0.5, 2]]},
    {"name": "side", "kind": "number", "value": 1},
]
FIXED = [{"name": "side", "reason": ODD}]


@pytest.fixture
def controls(shown: Any) -> Any:
    page = shown(form={"any": 1}, params=PARAMS, fixed=FIXED)
    ask(page, "void (globalThis.controls = paramControls(viewer), document.body.append(controls.box))")
    return page


def put(page: Any, selector: str, value: Any) -> Any:
    """Put a value into a control as a user does; what the viewer has then."""
    box = page.locator(selector)
    box.evaluate(
        """(input, value) => {
          if (input.type === "checkbox") input.click();
          else {
            input.value = value;
            for (const kind of ["input", "change"]) input.dispatchEvent(new Event(kind, { bubbles: true }));
          }
        }""",
        value,
    )
    return ask(page, "viewer.params")


def test_controls_set_params(controls: Any) -> None:
    for selector, value, name, expected in (
        ("#param-k", "2.5", "k", 2.5),
        ("[aria-label=k]", "2.3", "k", 2.5),
        ("[aria-label=k]", "9", "k", 4),
        ("[aria-label=far]", "2", "far", pytest.approx(1.999999)),
        ("#param-n", "-3e5", "n", -300000),
        ("#param-n", "", "n", 7),
        ("#param-turn", "45", "turn", pytest.approx(pi / 4)),
        ("#param-wait", "1500", "wait", 1.5),
        ("#param-on", "", "on", True),
        ("#param-ink", "#3366ff", "ink", [0.2, 0.4, 1]),
        ("#param-look", "1", "look", ODD),
        ("#param-size", "2", "size", 4),
        ("#param-said", "</script>", "said", "</script>"),
        ("#param-list", "[1, [2, 3]]", "list", [1, [2, 3]]),
        ("#param-list", "alert(1)", "list", [1, [0.5, 2]]),
    ):
        ask(controls, "viewer.reset()")
        assert put(controls, selector, value)[name] == expected, (selector, value)


def test_controls_show_params(controls: Any) -> None:
    shown = controls.evaluate("() => Array.from(document.querySelectorAll('.param'), (row) => row.innerText)")
    assert "°" in shown[3]
    assert "ms" in shown[4]
    assert controls.locator("#param-turn").input_value() == "30"
    assert controls.locator("#param-wait").get_attribute("max") == "2000"
    assert controls.locator("#param-ink").input_value() == "#ff8000"
    assert controls.locator("#param-list").input_value() == "[1, [0.5, 2]]"
    assert controls.locator("[role=switch]").count() == 1
    assert controls.locator("#param-side").count() == 0
    put(controls, "#param-k", "2.5")
    assert controls.locator("[aria-label=k]").input_value() == "2.5"
    controls.get_by_text("Reset").click()
    assert ask(controls, "viewer.params.k") == 1
    assert controls.locator("#param-k").input_value() == "1"


def test_reasons_stand_beside_their_control(controls: Any) -> None:
    ask(controls, f"controls.refuse('k', {ODD!r})")
    row = controls.locator(".param", has=controls.locator("#param-k"))
    assert "⟨U+202E⟩evil</script>" in row.locator(".why").text_content()
    ask(controls, "controls.refuse('k', null)")
    assert row.locator(".why").text_content() == ""


def test_names_and_texts_of_strangers_are_texts(controls: Any) -> None:
    assert controls.locator("img, script[src]").count() == 0
    text = controls.locator("body").text_content()
    assert "\u202e" not in text
    assert text.count("⟨U+202E⟩evil</script><img") == 3  # a comment, a choice, a reason
    assert controls.evaluate("(text) => listing(text).textContent", f"a\r\n\tb{ODD}") == (
        "a\n\tb⟨U+202E⟩evil</script><img src=x onerror=alert(1)>"
    )
    assert controls.evaluate("() => plainText('\\ud800 \\u{1f600} é')") == "⟨U+D800⟩ \U0001f600 é"


def test_the_timeline(shown: Any) -> None:
    page = shown(animation={"seconds": 2, "fps": 10, "frames": 20, "loop": True})
    ask(page, "document.body.append(timeline(viewer).box)")
    assert page.locator("output").text_content() == "0.00 / 2 s"
    page.get_by_text("Play").click()
    assert ask(page, "viewer.playing")
    put(page, ".time", "13")
    assert ask(page, "[viewer.playing, viewer.frame]") == [False, 13]
    assert page.locator("output").text_content() == "1.30 / 2 s"
    assert page.get_by_text("Play").count() == 1


def test_steering_by_mouse_touch_and_keys(shown: Any) -> None:
    page = shown("canvas(64, 48); camera(eye = [0, 0, 4]); sphere;")
    ask(page, "(steer(viewer), document.body.append(cameraControls(viewer).box))")
    ask(page, "void (canvas.style.width = '200px')")

    def eye() -> list[float]:
        found: list[float] = ask(page, "viewer.camera.eye")
        return found

    box = page.locator("#canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 75, y)
    page.mouse.up()
    assert eye() == pytest.approx([4, 0, 0], abs=1e-9), "half the shorter side is a quarter of the way round"
    page.mouse.move(x, y - 40)
    assert eye() == pytest.approx([4, 0, 0], abs=1e-9), "no button is down"
    page.get_by_text("Reset camera").click()
    assert eye() == [0, 0, 4]
    page.locator("#canvas").focus()
    page.keyboard.press("ArrowUp")
    assert eye()[1] > 0.3
    page.keyboard.press("Home")
    page.keyboard.press("+")
    assert eye() == pytest.approx([0, 0, 4 / 1.1])
    page.keyboard.press("-")
    page.keyboard.press("Shift+ArrowRight")
    assert ask(page, "viewer.camera.target[0]") > 0
    page.keyboard.press("0")
    page.mouse.move(x, y)
    page.mouse.wheel(0, 100)
    page.wait_for_function("() => viewer.moved")
    assert eye()[2] > 4
    page.keyboard.press("0")
    touch = """(moves) => {
      for (const [type, id, x, y] of moves) {
        const given = { pointerId: id, pointerType: "touch", clientX: x, clientY: y, buttons: 1 };
        canvas.dispatchEvent(new PointerEvent(type, given));
      }
    }"""
    ask(page, "void (canvas.setPointerCapture = () => {})")
    down = [["pointerdown", 1, x - 10, y], ["pointerdown", 2, x + 10, y]]
    page.evaluate(touch, [*down, ["pointermove", 1, x - 30, y], ["pointermove", 2, x + 30, y]])
    assert eye()[2] == pytest.approx(4 / 3), "two fingers thrice as far apart"
    page.evaluate(touch, [["pointermove", 1, x - 30, y + 30], ["pointermove", 2, x + 30, y + 30]])
    assert ask(page, "viewer.camera.target[1]") > 0
    page.evaluate(touch, [["pointerup", 1, x, y], ["pointercancel", 2, x, y], ["pointermove", 1, 0, 0]])
    page.get_by_text("Copy camera line").click()
    page.wait_for_function("() => document.body.innerText.includes('Copied')")
