// Cosines and sines that are float32's on every GPU: GLSL's own may be off by 2^-11.

/** (cos, sin) of an angle, by quarters of a turn and Cephes' polynomials around zero. */
vec2 direction(float angle) {
  float quarter = floor(angle * 0.6366197723675814 + 0.5);
  float x = angle - quarter * 1.5703125 - quarter * 4.838267948966e-4, s = x * x;
  vec2 found = vec2(
      1.0 - 0.5 * s + s * s * (4.166664568298827e-2 + s * (-1.388731625493765e-3 + s * 2.443315711809948e-5)),
      x + x * s * (-1.6666654611e-1 + s * (8.3321608736e-3 - s * 1.9515295891e-4)));
  quarter -= 4.0 * floor(0.25 * quarter);
  if (quarter == 1.0 || quarter == 3.0) found = vec2(-found.y, found.x);
  return quarter >= 2.0 ? -found : found;
}
