// The few calls of WebGL2 that all drawers share.

const CORNERS = `#version 300 es
void main() {
  gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);
}`;

/** A linked program that draws a triangle over everything; throws an Error with the compiler's log. */
export function linked(gl, fragment, vertex = CORNERS) {
  return checkedProgram(gl, linking(gl, fragment, vertex));
}

/** The same while it is still compiled, so that several are at a time. */
export function linking(gl, fragment, vertex = CORNERS) {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader);
  }
  gl.linkProgram(program);
  return program;
}

/** A program of `linking` once it is done; throws an Error with the compiler's log. */
export function checkedProgram(gl, program) {
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
    const log = [...logs, gl.getProgramInfoLog(program)].join("\n").trim();
    gl.deleteProgram(program);
    throw new Error(`the shader does not compile: ${log}`);
  }
  return program;
}

/**
 * A texture of numbers to fetch, four a texel; the last row is filled with zeros.
 * @param {Float32Array} data - of any length
 * @param {number} width - texels in a row
 */
export function floats(gl, data, width = 1024, texture = gl.createTexture()) {
  const height = Math.max(1, Math.ceil(data.length / (4 * width)));
  const padded = new Float32Array(4 * width * height);
  padded.set(data);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, padded);
  unfiltered(gl, gl.TEXTURE_2D);
  return texture;
}

/** Have the bound texture's texels as they are. */
export function unfiltered(gl, target) {
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, side, gl.NEAREST);
}

/** Draw the triangle with a program in use. */
export function triangle(gl) {
  gl.drawArrays(gl.TRIANGLES, 0, 3);
}

/** A framebuffer with a float texture (width, height) to draw numbers into; needs EXT_color_buffer_float. */
export function target(gl, width, height) {
  if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("no framebuffers of floats here");
  const texture = floats(gl, new Float32Array(4 * width * height), width);
  const framebuffer = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  return { framebuffer, texture };
}
