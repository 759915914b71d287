"""A viewer in a browser, whose drawers paint one colour that tells what they were given."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

import scenelang as nsg
from scenelang.web.export import view_of

SETUP = """
const [message, more] = JSON.parse(TEXT);
globalThis.told = [];
globalThis.refused = [];
globalThis.scales = [];
globalThis.pieces = [];
globalThis.made = 0;
planeDrawer = solidDrawer = (gl, view) => {
  made += 1;
  const inPieces = view.dimension === 3 && {
    *pieces(program, size) {
      for (let piece = 0; piece < 3; piece += 1) {
        pieces.push(piece);
        yield;
      }
      this.draw(program, size);
    },
  };
  return {
    ...inPieces,
    draw(program, { width, height, scale }) {
      if (globalThis.broken === scale) throw new Error("no shader");
      gl.viewport(0, 0, width, height);
      gl.clearColor(program.shade ?? 0, scale, program.stage ? 0.5 : 0, 1);
      gl.clear(gl.COLOR_BUFFER_BIT);
      scales.push(scale);
      globalThis.drawn = { program, width, height, scale };
      for (const end = performance.now() + (globalThis.slow ?? 0); performance.now() < end;);
    },
    dispose() {},
  };
};
evaluateForm = (form, { params, frame }) => {
  if (params.k > 2) throw new Error("`k` is too much");
  return { rows: [], stage: null, background: null, shade: params.k / 2, frame };
};
const canvas = document.createElement("canvas");
canvas.id = "canvas";
canvas.width = 64;
canvas.height = 48;
document.body.replaceChildren(canvas);
return readView({ ...message, ...more }).then((view) => {
  globalThis.view = view;
  globalThis.viewer = new Viewer(canvas, view, {
    onchange: ({ kind }) => told.push(kind), onerror: (error) => refused.push(error),
  });
  viewer.draw();
});
"""


@pytest.fixture
def shown(viewer_page: Any) -> Callable[..., Any]:
    """Opens a viewer of a scene's text in the page, whose data may be changed."""

    def opened(text: str = "canvas(64, 48); star;", **more: Any) -> Any:
        view = view_of(nsg.compile(nsg.loads(text)))
        data = json.dumps(json.dumps([json.loads(view.message()), more]))
        viewer_page.evaluate("(code) => new Function(code)()", SETUP.replace("TEXT", data))
        return viewer_page

    return opened


def ask(page: Any, expression: str) -> Any:
    return page.evaluate(f"() => ({expression})")
