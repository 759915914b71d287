// Camera, light, ground and sky of a scene in space, and the background of one in the plane.

import { bare, numbersOf, radians, refuse } from "./values.js";
import { linearColour } from "./looks.js";

const MOST_OF_STAGE = 1e12; // of a stage's numbers
const USUAL_SKY = { horizon: [0.8, 0.86, 0.92], zenith: [0.3, 0.5, 0.85] };
const USUAL_GROUND = [0.5, 0.48, 0.45]; // linear

/**
 * What `evaluateForm` says besides rows.
 * @param settings - values of the arguments of `background`, `camera`, `light` and `ground`, where given
 */
export function stageFrom({ background, camera = [], light = [], ground = [] }, dimension) {
  const sky = background === undefined ? undefined : background[0] === null ? null : shares(background[0]);
  const behind = sky === undefined ? [1, 1, 1] : sky;
  if (dimension === 2) return { stage: null, background: behind };
  const [eye, target, fov] = camera;
  const at = pointFrom(eye, [0, 1.2, 6]);
  const to = pointFrom(target, [0, 0, 0]);
  const view = fov === undefined ? 2 * Math.atan(1 / 3) : radians(fov);
  if (at.every((number, axis) => number === to[axis])) refuse("the eye is the target");
  if (!(view > 1 / MOST_OF_STAGE && view < Math.PI)) refuse("a field of view not between 0° and 180°");
  const [position, power, rgb] = light;
  const strength = power === undefined ? 28 : bounded(bare(power));
  if (strength < 0) refuse(`a power of ${strength} is negative`);
  const stage = {
    eye: at,
    axes: axesOf(at, to),
    target: to,
    fov: view,
    light: pointFrom(position, [2.5, 4, 3]),
    power: strength,
    lightRgb: rgb === undefined ? [1, 1, 1] : linearColour(shares(rgb)),
    ground: groundFrom(ground),
    ...(sky ? { horizon: linearColour(sky), zenith: linearColour(sky) } : USUAL_SKY),
    transparent: sky === null,
  };
  return { stage, background: behind };
}

function groundFrom([y, rgb]) {
  if (y === null) return rgb === undefined ? null : refuse("`ground(none)` has no colour");
  const height = y === undefined ? -1 : bounded(bare(y));
  return { y: height, rgb: rgb === undefined ? USUAL_GROUND : linearColour(shares(rgb)) };
}

function bounded(number) {
  return Math.abs(number) <= MOST_OF_STAGE ? number : refuse("a number of the stage is too large");
}

function pointFrom(value, otherwise) {
  return value === undefined ? otherwise : numbersOf(value, 3).map(bounded);
}

function shares(value) {
  const rgb = numbersOf(value, 3);
  return rgb.every((part) => part >= 0 && part <= 1) ? rgb : refuse("a colour is outside 0..1");
}

/** Unit vectors forward, right and up; seen straight along y, up is -z. */
export function axesOf(eye, target) {
  const unit = (v) => v.map((number) => number / Math.hypot(...v));
  const cross = (a, b) => [
    a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
  ];
  const forward = unit(target.map((number, axis) => number - eye[axis]));
  const right = unit(cross(forward, Math.hypot(forward[0], forward[2]) > 1e-9 ? [0, 1, 0] : [0, 0, -1]));
  return [forward, right, cross(right, forward)];
}
