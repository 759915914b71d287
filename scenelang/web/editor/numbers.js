// A viewer that draws nothing: params and frames where there is no WebGL2 and the server draws all.

const defaults = ({ params }) => Object.fromEntries(params.map(({ name, value }) => [name, value]));

/** As far as `Viewer` is used by controls. */
export class Numbers {
  #watchers = new Set();
  #view;
  params;
  frame = 0;
  playing = false;
  moved = false;
  camera = null;

  constructor(view) {
    this.#view = view;
    this.params = defaults(view);
  }

  get view() {
    return this.#view;
  }

  set view(next) {
    const old = defaults(this.#view);
    const params = defaults(next);
    for (const name of Object.keys(params)) {
      if (name in old && this.params[name] !== old[name]) params[name] = this.params[name];
    }
    this.#view = next;
    this.params = params;
    this.frame = Math.min(this.frame, this.frames - 1);
    this.#tell("view");
  }

  get frames() {
    return this.#view.animation?.frames ?? 1;
  }

  set(name, value) {
    this.params[name] = value;
    this.#tell("param");
  }

  reset() {
    this.params = defaults(this.#view);
    this.#tell("param");
  }

  seek(frame) {
    this.frame = Math.max(0, Math.min(this.frames - 1, Math.round(frame)));
    this.#tell("frame");
  }

  watch(watcher) {
    this.#watchers.add(watcher);
    return () => this.#watchers.delete(watcher);
  }

  play() {}
  pause() {}
  dispose() {}

  #tell(kind) {
    for (const watcher of this.#watchers) watcher({ kind });
  }
}
