import { axesOf, growthOf } from "./stage.js";

// The camera of a 3D scene, moved by hand. Lengths are in world units, angles in radians, y is up.

const NEAREST_POLE = 0.02; // an orbit stays this far from straight above and below the target
const NEAREST_EYE = 0.05; // of a view of the usual size, as the next
const FARTHEST_EYE = 1e4;

const vecMinus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const vecPlus = (a, b, times = 1) => [a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]];

/** A camera that has gone round its target, by `turn` to the right and `rise` upward. */
export function orbited(camera, turn, rise) {
  const from = vecMinus(camera.eye, camera.target);
  const distance = Math.hypot(...from);
  const azimuth = Math.atan2(from[0], from[2]) + turn;
  const most = Math.PI / 2 - NEAREST_POLE;
  const height = Math.asin(Math.max(-1, Math.min(1, from[1] / distance))) + rise;
  const elevation = Math.max(-most, Math.min(most, height));
  const across = distance * Math.cos(elevation);
  const way = [across * Math.sin(azimuth), distance * Math.sin(elevation), across * Math.cos(azimuth)];
  return { ...camera, eye: vecPlus(camera.target, way) };
}

/** A camera whose distance from its target is `factor` times as long; `by` is as of `growthOf`. */
export function zoomed(camera, factor, by = 1) {
  const from = vecMinus(camera.eye, camera.target);
  const distance = Math.hypot(...from);
  const wanted = Math.max(NEAREST_EYE / by, Math.min(FARTHEST_EYE / by, distance * factor));
  return { ...camera, eye: vecPlus(camera.target, from, wanted / distance) };
}

/** A camera moved so that what it looks at goes by (right, up), in shares of the canvas's shorter side. */
export function panned(camera, right, up) {
  const [, side, above] = axesOf(camera.eye, camera.target);
  const distance = Math.hypot(...vecMinus(camera.eye, camera.target));
  const span = 2 * distance * Math.tan(camera.fov / 2);
  const way = vecPlus(vecPlus([0, 0, 0], side, -right * span), above, -up * span);
  return { ...camera, eye: vecPlus(camera.eye, way), target: vecPlus(camera.target, way) };
}

/** A stage as another camera sees it, drawn in the unit that its own asks for. */
export function seenBy(stage, { eye, target, fov }) {
  return { ...stage, growth: growthOf(stage), camera: { ...stage.camera, eye, target, fov_rad: fov } };
}

/** The line of a scene that says where a camera is; its numbers are rounded to 1e-4 and finer
 * from nearby, fov to 1e-3 degrees. */
export function cameraText(camera) {
  const digits = 4 - Math.floor(Math.log10(Math.hypot(...vecMinus(camera.eye, camera.target))));
  const point = (p) => `[${p.map((v) => plainNumber(v, Math.max(4, Math.min(20, digits)))).join(", ")}]`;
  const fov = plainNumber((camera.fov * 180) / Math.PI, 3);
  const times = camera.exposure === undefined ? "" : `, exposure = ${camera.exposure}`;
  return `camera(eye = ${point(camera.eye)}, target = ${point(camera.target)}, fov = ${fov}deg${times});`;
}

/** A number with at most so many places, none of them idle. */
export function plainNumber(value, places) {
  const text = value.toFixed(places);
  return (text.includes(".") ? text.replace(/\.?0+$/, "") : text).replace(/^-0$/, "0");
}
