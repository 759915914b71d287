// Light from everywhere, as `scenelang/web/volume.py` packs it, for the shader.

const MOMENTS = 9;

/** Linear light of 16 bits. */
const lightOf = (number, top) => top * (number / 65535) ** 2;

/** A filtered texture of half floats. */
function halves(gl, target, sizes, data) {
  const texture = gl.createTexture();
  gl.bindTexture(target, texture);
  const load = target === gl.TEXTURE_3D ? "texImage3D" : "texImage2D";
  gl[load](target, 0, gl.RGBA16F, ...sizes, 0, gl.RGBA, gl.FLOAT, data);
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, side, gl.LINEAR);
  for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, wrap, gl.CLAMP_TO_EDGE);
  return texture;
}

/** Textures of the part `around` of a view, none where it has none, and its uniforms where lengths grow by a number. */
export function aroundOf(gl, part) {
  if (!part) return { textures: {}, uniforms: () => ({}) };
  const { low, side, sides: [x, y, z], top, light, ratios, free, floor } = part, count = x * y * z;
  const blocks = MOMENTS + (light.length > 3 * count), high = Math.ceil(blocks / 3) * y, wide = 3 * z;
  const data = new Float32Array(4 * wide * high * x).fill(1);
  for (let rgb = 0; rgb < 3; rgb++) for (let i = 0; i < count; i++) {
    const [a, b, c] = [Math.floor(i / (y * z)), Math.floor(i / z) % y, i % z];
    const mean = lightOf(light[rgb * count + i], top);
    for (let k = 0; k < blocks; k++) {
      const ratio = k && (ratios[((k - 1) * 3 + rgb) * count + i] - 128) / 127;
      const value = k === 0 ? mean : k === MOMENTS ? lightOf(light[(3 + rgb) * count + i], top) : mean * ratio;
      const at = 4 * ((a * high + Math.floor(k / 3) * y + b) * wide + (k % 3) * z + c);
      data[at + rgb] = value;
      data[at + 3] = free[i];
    }
  }
  const textures = { around: halves(gl, gl.TEXTURE_3D, [wide, high, x], data) };
  const uniforms = (by) => ({
    lattice: [...low, side].map((v) => v * by), nodes_: [x, y, z],
    ...(floor && { plane: [...floor.plane.slice(0, 3).map((v) => v * by), floor.plane[3]] }),
  });
  if (floor) {
    const side = floor.side, received = new Float32Array(4 * side * side);
    for (let i = 0; i < floor.light.length; i++) {
      received[4 * (i % (side * side)) + Math.floor(i / (side * side))] = lightOf(floor.light[i], floor.top);
    }
    textures.floor_ = halves(gl, gl.TEXTURE_2D, [side, side], received);
  }
  return { textures, uniforms };
}
