import { alike } from "./store.js";

/** A canvas that is drawn into at once, or in full a piece at a time behind what it shows. */
export class Surface {
  #canvas;
  #gl;
  #own; // width and height of a canvas that is not on the page
  #drawnFor = null; // pixels of the screen that the canvas had
  #behind = null; // {pieces, framebuffer, texture} of a picture that is under way

  /** Give the canvas a scene's aspect, and where no style gives it a size the one that it has now. */
  constructor(canvas, gl, aspect) {
    this.#canvas = canvas;
    this.#gl = gl;
    this.#own = [canvas.width, canvas.height];
    this.aspect = aspect;
    const before = canvas.getBoundingClientRect();
    canvas.width *= 2;
    if (canvas.getBoundingClientRect().width !== before.width) canvas.style.width = `${before.width}px`;
    canvas.width /= 2;
  }

  /** @param {number[]} canvas - width and height of a scene */
  set aspect([width, height]) {
    this.#canvas.style.aspectRatio = `${width}/${height}`;
  }

  /** Whether it has another size on the page than when it was drawn. */
  get resized() {
    return !alike(this.#full(), this.#drawnFor);
  }

  /** Draw now, at a share of its size. */
  draw(drawer, program, scale) {
    this.drop();
    this.#drawnFor = this.#full();
    const [width, height] = this.#drawnFor.map((side) => Math.max(1, Math.round(side * scale)));
    this.#fit(width, height);
    drawer.draw(program, { width, height, scale });
  }

  /** Begin to draw in full; nothing else may draw until it is shown or dropped. */
  begin(drawer, program) {
    this.drop();
    const gl = this.#gl;
    const [width, height] = this.#full();
    const [texture, framebuffer] = [gl.createTexture(), gl.createFramebuffer()];
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    const pieces = drawer.pieces(program, { width, height, scale: 1 });
    this.#behind = { pieces, framebuffer, texture, width, height };
  }

  /** Draw a piece; whether there are more. */
  step() {
    return !this.#behind.pieces.next().done;
  }

  /** Show what was drawn in pieces. */
  show() {
    const gl = this.#gl;
    const { framebuffer, width, height } = this.#behind;
    this.#drawnFor = [width, height];
    this.#fit(width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.clear(gl.COLOR_BUFFER_BIT); // a browser may not show what is only copied
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, framebuffer);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    this.drop();
  }

  /** Forget what is drawn in pieces. */
  drop() {
    if (!this.#behind) return;
    const gl = this.#gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(this.#behind.framebuffer);
    gl.deleteTexture(this.#behind.texture);
    this.#behind = null;
  }

  #fit(width, height) {
    if (this.#canvas.width !== width) this.#canvas.width = width;
    if (this.#canvas.height !== height) this.#canvas.height = height;
  }

  /** Pixels of the screen that the canvas has. */
  #full() {
    const box = this.#canvas.getBoundingClientRect();
    if (!box.width || !box.height) return this.#own;
    return [box.width * devicePixelRatio, box.height * devicePixelRatio].map(Math.round);
  }
}
