const TURN = Math.PI; // radians for a way as long as the canvas's shorter side
const KEY_TURN = Math.PI / 36;
const KEY_WAY = 0.05; // of the shorter side
const KEY_ZOOM = 1.1;

/** What keys do, by name; with shift the arrows move the camera. */
const KEYS = {
  ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1],
};

/**
 * Let mouse, touch and keys on a viewer's canvas move its camera: one pointer goes round, two fingers and
 * the other buttons move and zoom, and so does the wheel while the canvas has the focus.
 */
export function steer(viewer) {
  const { canvas } = viewer;
  const pointers = new Map(); // id -> [x, y]
  canvas.tabIndex = 0;
  canvas.style.touchAction = "none";

  const side = () => Math.min(canvas.clientWidth, canvas.clientHeight) || 1;
  const middle = (points) => [0, 1].map((axis) => points.reduce((sum, p) => sum + p[axis], 0) / points.length);
  const spread = ([a, b]) => (b ? Math.max(1, Math.hypot(a[0] - b[0], a[1] - b[1])) : 1);

  const handlers = {
    pointerdown(event) {
      if (pointers.size === 2) return;
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      canvas.setPointerCapture(event.pointerId);
      canvas.focus({ preventScroll: true });
    },
    pointermove(event) {
      if (!pointers.has(event.pointerId)) return;
      const before = [...pointers.values()];
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      const after = [...pointers.values()];
      const [x, y] = [0, 1].map((axis) => (middle(after)[axis] - middle(before)[axis]) / side());
      const moves = pointers.size === 2 || event.shiftKey || event.ctrlKey || (event.buttons & 6) !== 0;
      if (moves) viewer.pan(x, -y);
      else viewer.orbit(-TURN * x, TURN * y);
      if (pointers.size === 2) viewer.zoom(spread(before) / spread(after));
    },
    pointerup(event) {
      pointers.delete(event.pointerId);
    },
    pointercancel(event) {
      pointers.delete(event.pointerId);
    },
    wheel(event) {
      if (document.activeElement !== canvas && !event.ctrlKey) return; // the page scrolls
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 20 : 1;
      viewer.zoom(Math.exp(Math.max(-200, Math.min(200, event.deltaY * lines)) / 500));
    },
    contextmenu(event) {
      event.preventDefault();
    },
    keydown(event) {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const way = KEYS[event.key];
      if (way && event.shiftKey) viewer.pan(-way[0] * KEY_WAY, -way[1] * KEY_WAY);
      else if (way) viewer.orbit(way[0] * KEY_TURN, way[1] * KEY_TURN);
      else if (event.key === "+" || event.key === "=") viewer.zoom(1 / KEY_ZOOM);
      else if (event.key === "-" || event.key === "_") viewer.zoom(KEY_ZOOM);
      else if (event.key === "0" || event.key === "Home") viewer.camera = null;
      else return;
      event.preventDefault();
    },
  };
  for (const [name, handler] of Object.entries(handlers)) {
    canvas.addEventListener(name, handler, { passive: false });
  }
}
