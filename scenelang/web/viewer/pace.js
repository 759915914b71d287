const SLOW_MS = 33; // a frame that takes longer is drawn coarser while something moves
const EASY_MS = 20; // one that would take less is drawn finer again
const REST_MS = 200; // how long nothing moves before it is drawn in full
const MOST_MS = 2000; // nothing that would take longer is begun in one piece: it would hang the screen
const POLL_MS = 4;
const SCALES = [1, 0.75, 0.5, 0.375, 0.25, 0.1875, 0.125];

/** How fine to draw, from how long it takes. One frame is under way at a time, and a fence tells its end. */
export class Pace {
  #gl;
  #wake;
  #moving = 1; // scale of frames while something moves
  #drawn = 0; // scale of what is shown
  #costs = null; // ms that a frame in full would take; a first one tells nothing, as it waits for the compiler
  #first = true;
  #touched = 0;
  #started = 0;
  #fence = null;
  #timer = 0;
  #inPieces = false; // whether a frame in full can be drawn a piece at a time

  /** @param {function} wake - called when another frame can be drawn, with whether what is shown is too coarse */
  constructor(gl, wake) {
    this.#gl = gl;
    this.#wake = wake;
  }

  /** Whether a frame is under way. */
  get busy() {
    return this.#fence !== null;
  }

  /** Begin with a new shader; one that draws in pieces begins coarse. */
  begin(inPieces) {
    this.stop();
    this.#inPieces = inPieces;
    this.#moving = inPieces ? 0.25 : 1;
    this.#first = true;
    this.#costs = null;
  }

  /** Note that something moves. */
  touch() {
    this.#touched = performance.now();
  }

  /** The scale to draw at now: a share of the canvas's sides. */
  scale(playing) {
    return playing || this.#inPieces || this.#rest() > 0 ? this.#moving : this.#finest();
  }

  /** A frame begins. */
  start(scale) {
    this.stop();
    this.#drawn = scale;
    this.#started = performance.now();
  }

  /** It has been handed to the graphics card. */
  end() {
    this.#after(() => {
      this.#learn(performance.now() - this.#started);
      this.#wake(false);
      if (this.#drawn < this.#finest() || (this.#costs === null && this.#drawn < 1)) {
        this.#timer = setTimeout(() => this.#wake(true), this.#rest());
      }
    });
  }

  /** Call `next` again and again, while it returns true, each time when all is done that it handed over. */
  pieces(next) {
    this.stop();
    if (next()) this.#after(() => this.pieces(next));
  }

  /** Forget the frame that is under way. */
  stop() {
    clearTimeout(this.#timer);
    if (this.#fence) this.#gl.deleteSync(this.#fence);
    this.#fence = null;
  }

  /** Call when the graphics card has done all that it was given. */
  #after(act) {
    this.#fence = this.#gl.fenceSync(this.#gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.#gl.flush();
    const look = () => {
      if (this.#gl.clientWaitSync(this.#fence, 0, 0) === this.#gl.TIMEOUT_EXPIRED) {
        this.#timer = setTimeout(look, POLL_MS);
        return;
      }
      this.#gl.deleteSync(this.#fence);
      this.#fence = null;
      act();
    };
    this.#timer = setTimeout(look, 0);
  }

  /** Time until nothing has moved for long enough. */
  #rest() {
    return Math.max(0, this.#touched + REST_MS - performance.now());
  }

  #finest() {
    if (this.#inPieces) return 1;
    return this.#costs === null ? this.#moving : this.#fits(MOST_MS);
  }

  /** The largest scale at which a frame takes at most so long. */
  #fits(ms) {
    return SCALES.find((scale) => this.#costs * scale * scale <= ms) ?? SCALES.at(-1);
  }

  #learn(ms) {
    const first = this.#first;
    this.#first = false;
    if (first) return;
    this.#costs = ms / this.#drawn ** 2;
    const slow = this.#costs * this.#moving ** 2 > SLOW_MS;
    this.#moving = slow ? this.#fits(0.8 * SLOW_MS) : Math.max(this.#moving, this.#fits(EASY_MS));
  }
}
