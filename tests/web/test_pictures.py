"""What a page shows after its controls were moved is what `scenelang render` draws of the same values."""

from __future__ import annotations

import base64
import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import scenelang as nsg
from scenelang.drawing.metrics import psnr
from scenelang.language.evaluation import Source
from scenelang.web.export import viewed

pytestmark = pytest.mark.browser
EXAMPLES = sorted(Path(__file__).parents[2].joinpath("examples").glob("*.nsg"))
SIZE = 128, 128
LEAST_DB = 40
OPEN = """async (message) => {
  document.body.replaceChildren(element("canvas", { id: "canvas", width: 128, height: 128 }));
  globalThis.viewer?.dispose();
  globalThis.refused = [];
  const onerror = ({ message }) => refused.push(message);
  globalThis.viewer = new Viewer(canvas, await readView(message), { onerror });
}"""
SNAPSHOT = """async (params) => {
  for (const [name, value] of Object.entries(params)) viewer.set(name, value);
  const picture = new FileReader();
  picture.readAsDataURL(await viewer.snapshot());
  await new Promise((done) => (picture.onload = done));
  return picture.result.split(",")[1];
}"""


def opened(page: Any, path: Path) -> dict[str, Any]:
    """Open a viewer of a scene's file; its view."""
    view, _ = viewed(Source(path, size=SIZE), path.stem)
    page.evaluate(OPEN, json.loads(view.message()))
    return view.data


def picture(page: Any, **params: Any) -> np.ndarray:
    """What it shows of params, in [0, 1]."""
    data = base64.b64decode(page.evaluate(SNAPSHOT, params))
    assert page.evaluate("refused") == []
    with Image.open(io.BytesIO(data)) as image:
        return np.asarray(image.convert("RGBA"), np.float32) / 255


def drawn(scene: nsg.Scene) -> np.ndarray:
    """What the network draws, with alpha."""
    image = np.asarray(nsg.render(scene))
    return np.dstack([image, np.ones(image.shape[:2], np.float32)]) if image.shape[2] == 3 else image


def over_grey(image: np.ndarray) -> np.ndarray:
    return image[..., :3] * image[..., 3:] + 0.5 * (1 - image[..., 3:])


@pytest.mark.parametrize("name", ["caterpillar", "die", "saturn"])
def test_the_line_of_a_moved_camera_gives_its_picture(viewer_page: Any, tmp_path: Path, name: str) -> None:
    path = next(path for path in EXAMPLES if path.stem == name)
    opened(viewer_page, path)
    before = picture(viewer_page)
    viewer_page.evaluate("viewer.orbit(0.7, 0.3), viewer.zoom(0.9), viewer.pan(0.05, -0.08)")
    after = picture(viewer_page)
    assert psnr(after[..., :3], before[..., :3]) < 30
    line = viewer_page.evaluate("viewer.cameraLine()")
    text, times = re.subn(r"^camera\(.*$", line, path.read_text("utf-8"), flags=re.MULTILINE)
    assert times == 1
    assert psnr(over_grey(after), over_grey(drawn(nsg.loads(text, size=SIZE, root=path.parent)))) >= LEAST_DB
