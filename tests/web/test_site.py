"""The documentation's site in a browser: a click on a scene's picture puts the scene there, drawn live."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.browser import watched
from tests.test_docs import build_site

ROOT = Path(__file__).parents[2]


def seen(data: bytes) -> np.ndarray:
    """A picture in few pixels (24, 24, 3), in [0, 1]."""
    small = Image.open(io.BytesIO(data)).convert("RGB").resize((24, 24), Image.Resampling.BOX)
    return np.asarray(small, np.float64) / 255


@pytest.mark.browser
def test_a_click_brings_a_picture_to_life(chromium: Any, tmp_path: Path) -> None:
    build_site(tmp_path)
    with watched(chromium, viewport={"width": 1200, "height": 900}) as page:
        page.goto((tmp_path / "examples.html").as_uri())
        link = page.locator('a.live[href$="viewers/chain.html"]')
        still = seen((ROOT / "docs/pictures/chain.png").read_bytes())
        link.click()
        frame = page.locator("iframe.live")
        assert frame.get_attribute("sandbox") == "allow-scripts"
        inside = page.frame_locator("iframe.live")
        for _ in range(100):
            live = seen(inside.locator("canvas").screenshot())
            if np.square(live - still).mean() < 1e-3:
                break
            page.wait_for_timeout(100)
        np.testing.assert_allclose(np.square(live - still).mean(), 0, atol=1e-3)
        inside.locator("input[type=range]").fill("0")
        page.wait_for_timeout(1000)
        moved = seen(inside.locator("canvas").screenshot())
        assert np.square(moved - still).mean() > 1e-3
