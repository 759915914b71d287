import { cameraText, orbited, panned, seenBy, zoomed } from "./camera.js";
import { evaluateForm } from "./evaluate.js";
import { Pace } from "./pace.js";
import { planeDrawer } from "./plane.js";
import { solidDrawer } from "./solid.js";
import { alike, defaultsOf, WITH_ARRAYS } from "./store.js";
import { growthOf } from "./stage.js";
import { Surface } from "./surface.js";

const DRAWN_FROM = ["dimension", ...WITH_ARRAYS]; // what a drawer is made of

/** A scene on a canvas. It draws when something has changed, and coarser while it cannot keep up. */
export class Viewer {
  #view;
  #gl;
  #drawer = null;
  #program = null; // {rows, stage, background}: the last that could be made
  #camera = null; // of the user; null for the scene's
  #changed = null; // name of the param that was set last
  #refused = false; // whether the params give no picture
  #stale = true; // whether rows belong to other params or another frame
  #dirty = false; // whether what is shown is not what is to be shown
  #request = 0;
  #origin = 0; // when frame 0 would have been shown, in ms
  #pace;
  #surface;
  #watchers = new Set();
  #observers = [];
  #shown = true;

  /**
   * @param {HTMLCanvasElement} canvas - drawn at the size that it has on the page, else at its own
   * @param {object} view - as `readView` gives it
   * @param {function} onchange - told {kind: "param" | "frame" | "play" | "camera" | "drawn" | "view"}
   * @param {function} onerror - told {kind: "param" | "shader" | "lost", name, message}; a null message: over
   * @throws {Error} where there is no WebGL2, or the shader does not compile
   */
  constructor(canvas, view, { onchange = () => {}, onerror = () => {} } = {}) {
    this.canvas = canvas;
    this.onerror = onerror;
    this.params = defaultsOf(view);
    this.frame = 0;
    this.playing = false;
    this.#watchers.add(onchange);
    this.#view = view;
    this.#gl = canvas.getContext("webgl2", { antialias: false, depth: false, stencil: false });
    if (!this.#gl) throw new Error("this browser has no WebGL2, or keeps it off");
    this.#surface = new Surface(canvas, this.#gl, view.canvas);
    this.#pace = new Pace(this.#gl, (coarse) => (coarse ? this.#refine() : this.#ask(false)));
    this.#drawer = this.#made(view);
    canvas.addEventListener("webglcontextlost", this);
    canvas.addEventListener("webglcontextrestored", this);
    this.#observe(new ResizeObserver(() => {
      if (this.#surface.resized) this.#touch();
    }));
    this.#observe(new IntersectionObserver(([entry]) => {
      this.#shown = entry.isIntersecting;
      this.#ask(false);
    }));
    this.#touch();
  }

  /** What draws: {draw, points, operations}. */
  get drawer() {
    return this.#drawer;
  }

  /** What is drawn: {rows, stage, background} of these params and this frame. */
  get program() {
    this.#evaluate();
    const stage = this.#camera && this.#program.stage ? seenBy(this.#program.stage, this.#camera) : null;
    return stage ? { ...this.#program, stage } : this.#program;
  }

  get view() {
    return this.#view;
  }

  /** Show another view. Params that were moved stay where they are; a shader that can be is used again. */
  set view(next) {
    const before = this.#view;
    const others = DRAWN_FROM.filter((key) => !alike(before[key], next[key]));
    if (others.join() === "around" && before.around && next.around) {
      this.#drawer.relight(next.around);
    } else if (others.length) {
      const drawer = this.#made(next);
      this.#drawer.dispose();
      this.#drawer = drawer;
    }
    const old = defaultsOf(before);
    const kinds = Object.fromEntries(before.params.map(({ name, kind }) => [name, kind]));
    const params = defaultsOf(next);
    for (const { name, kind } of next.params) {
      const moved = kinds[name] === kind && !alike(this.params[name], old[name]);
      if (moved) params[name] = this.params[name];
    }
    this.params = params;
    this.#view = next;
    this.#surface.aspect = next.canvas;
    this.#program = null;
    if (next.dimension !== before.dimension) this.#camera = null;
    if (!next.animation) this.playing = false;
    this.frame = Math.min(this.frame, this.frames - 1);
    this.#origin = performance.now() - this.#elapsed();
    this.#outdated("view");
  }

  // ---------------------------------------------------------------- params and time

  /** Number of frames; 1 without an animation. */
  get frames() {
    return this.#view.animation?.frames ?? 1;
  }

  /** Give a param another value, in base units. */
  set(name, value) {
    this.params[name] = value;
    this.#changed = name;
    this.#outdated("param");
  }

  /** Give every param its default. */
  reset() {
    this.params = defaultsOf(this.#view);
    this.#outdated("param");
  }

  play() {
    if (!this.#view.animation || this.playing) return;
    if (!this.#view.animation.loop && this.frame === this.frames - 1) this.seek(0);
    this.playing = true;
    this.#origin = performance.now() - this.#elapsed();
    this.#tell("play");
    this.#touch();
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.#tell("play");
    this.#touch();
  }

  /** Show a frame, from 0. */
  seek(frame) {
    this.frame = Math.max(0, Math.min(this.frames - 1, Math.round(frame)));
    this.#origin = performance.now() - this.#elapsed();
    this.#outdated("frame");
  }

  // ---------------------------------------------------------------- camera

  /** {eye, target, fov}: the user's camera or the scene's; null in the plane. */
  get camera() {
    const { eye, target, fov_rad: fov } = this.program.stage?.camera ?? {};
    return eye ? { eye: [...eye], target: [...target], fov } : null;
  }

  /** Null gives the scene its own again. */
  set camera(camera) {
    this.#camera = camera;
    this.#tell("camera");
    this.#touch();
  }

  /** Whether the user has moved the camera. */
  get moved() {
    return this.#camera !== null;
  }

  /** Go round the target, in radians: to the right and upward. */
  orbit(turn, rise) {
    if (this.camera) this.camera = orbited(this.camera, turn, rise);
  }

  /** Make the distance from the target `factor` times as long. */
  zoom(factor) {
    if (this.camera) this.camera = zoomed(this.camera, factor, growthOf(this.program.stage));
  }

  /** Move what is seen to the right and upward, in shares of the shorter side. */
  pan(right, up) {
    if (this.camera) this.camera = panned(this.camera, right, up);
  }

  /** The camera as a line of a scene. */
  cameraLine() {
    return cameraText({ ...this.camera, exposure: this.program.stage.camera.exposure });
  }

  // ---------------------------------------------------------------- drawing

  /** Draw now, at full size. */
  draw() {
    this.#paint(1);
  }

  /** A PNG of what is shown, at full size. */
  snapshot() {
    this.draw();
    return new Promise((done) => this.canvas.toBlob(done, "image/png"));
  }

  /** Be told of changes, as `onchange` is; returns what ends it. */
  watch(watcher) {
    this.#watchers.add(watcher);
    return () => this.#watchers.delete(watcher);
  }

  dispose() {
    cancelAnimationFrame(this.#request);
    this.#request = -1; // never again
    this.#pace.stop();
    this.#surface.drop();
    for (const observer of this.#observers) observer.disconnect();
    this.canvas.removeEventListener("webglcontextlost", this);
    this.canvas.removeEventListener("webglcontextrestored", this);
    this.#drawer.dispose();
    this.#watchers.clear();
  }

  handleEvent(event) {
    if (event.type === "webglcontextlost") {
      event.preventDefault(); // or it would not come back
      this.#pace.stop();
      this.#surface.drop();
      this.onerror({ kind: "lost", message: "the graphics card was taken away for a moment" });
      return;
    }
    try {
      this.#drawer = this.#made(this.#view);
      this.onerror({ kind: "lost", message: null });
      this.#touch();
    } catch (error) {
      this.onerror({ kind: "shader", message: error.message });
    }
  }

  #made(view) {
    const drawer = (view.dimension === 3 ? solidDrawer : planeDrawer)(this.#gl, view);
    this.#pace.begin(drawer.pieces !== undefined);
    return drawer;
  }

  #observe(observer) {
    observer.observe(this.canvas);
    this.#observers.push(observer);
  }

  #tell(kind) {
    for (const watcher of this.#watchers) watcher({ kind });
  }

  #outdated(kind) {
    this.#stale = true;
    this.#tell(kind);
    this.#touch();
  }

  #elapsed() {
    return this.#view.animation ? (1000 * this.frame) / this.#view.animation.fps : 0;
  }

  /** Something has moved: draw at the next chance. */
  #touch() {
    this.#pace.touch();
    this.#ask(true);
  }

  /** Have a frame drawn, if it is called for. */
  #ask(dirty) {
    this.#dirty ||= dirty;
    if ((this.#dirty || this.playing) && this.#shown && this.#request === 0) {
      this.#request = requestAnimationFrame(() => this.#next());
    }
  }

  #next() {
    this.#request = 0;
    if (this.#gl.isContextLost()) return;
    if (this.playing) this.#advance();
    if (this.#dirty && !this.#pace.busy) this.#paint(this.#pace.scale(this.playing));
    if (this.playing) this.#ask(false); // otherwise the end of the frame under way does
  }

  #advance() {
    const { fps, loop } = this.#view.animation;
    const at = Math.max(0, Math.floor(((performance.now() - this.#origin) * fps) / 1000 + 1e-6));
    const frame = loop ? at % this.frames : Math.min(at, this.frames - 1);
    if (frame !== this.frame) {
      this.frame = frame;
      this.#stale = this.#dirty = true;
      this.#tell("frame");
    }
    if (!loop && at >= this.frames - 1) this.pause();
  }

  /** The rows of the present params and frame; where they cannot be made the last ones stay. */
  #evaluate() {
    if (!this.#stale && this.#program) return;
    this.#stale = false;
    const { form, program } = this.#view;
    if (!form) {
      this.#program = program;
      return;
    }
    try {
      this.#program = evaluateForm(form, { params: this.params, frame: this.frame, frames: this.frames });
      if (this.#refused) this.onerror({ kind: "param", name: this.#changed, message: null });
      this.#refused = false;
    } catch (error) {
      this.#program ??= program;
      this.#refused = true;
      this.onerror({ kind: "param", name: this.#changed, message: error.message });
    }
  }

  #paint(scale) {
    if (this.#gl.isContextLost()) return;
    const program = this.program;
    this.#dirty = false;
    this.#pace.start(scale);
    if (this.#tried(() => this.#surface.draw(this.#drawer, program, scale)) === null) return;
    this.#pace.end();
    this.#tell("drawn");
  }

  /** What a call that draws returns; null where it cannot: shaders are made for what a scene shows. */
  #tried(call) {
    try {
      return call();
    } catch (error) {
      this.onerror({ kind: "shader", message: error.message });
      return null;
    }
  }

  /** Draw in full what rests, a piece at a time if that can be. */
  #refine() {
    if (!this.#drawer.pieces) return void this.#ask(true);
    this.#surface.begin(this.#drawer, this.program);
    this.#pace.pieces(() => {
      const more = this.#dirty || this.playing ? null : this.#tried(() => this.#surface.step());
      if (more) return true;
      if (more === false) {
        this.#surface.show();
        this.#pace.start(1);
        this.#tell("drawn");
      }
      this.#ask(false);
      return false;
    });
  }
}
