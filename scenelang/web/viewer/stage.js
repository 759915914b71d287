// Camera, light, ground and sky of a scene in space, and the background of one in the plane.

import { bare, numbersOf, radians, refuse } from "./values.js";
import { linearColour } from "./looks.js";

const MOST_OF_STAGE = 1e12; // narrower views are none
const MOST_LAMPS = 8;
export const FADE = 8; // of a ground that does not say it

/** Readers of arguments, by their kinds. */
const KINDS_OF_STAGE = {
  number: bare, power: bare, extent: bare, distance: bare, exposure: exposureFrom, angle: radians, point: (value) => numbersOf(value, 3),
  opaque: (value) => linearColour(sharesOf(value)),
};

/**
 * What `evaluateForm` says besides rows.
 * @param settings - values of the arguments of `background` and of words of the stage, where given
 * @param lamps - those of each `light`
 * @param form - its `stage` has the usual one, and of each word's arguments the field, kind and range
 */
export function stageFrom({ background, ...given }, lamps, { dimension, stage: known }) {
  const paint = background === undefined ? undefined : background[0] === null ? null : sharesOf(background[0]);
  const behind = paint === undefined ? [1, 1, 1] : paint;
  if (dimension === 2) return { stage: null, background: behind };
  const stage = { ...known.usual, sky: null, transparent: paint === null };
  if (paint) stage.horizon = stage.zenith = linearColour(paint);
  const usual = { ...known.usual, sky: { ...known.usual.sky, horizon: stage.horizon, zenith: stage.zenith } };
  for (const [word, values] of Object.entries(given)) stage[word] = partFrom(word, values, { ...known, usual });
  if (stage.sky && !paint) Object.assign(stage, { horizon: stage.sky.horizon, zenith: stage.sky.zenith });
  stage.lights = lamps.length ? lightsFrom(lamps, known) : [stage.light];
  stage.lights = stage.lights.map(({ radius, ...lamp }) => (radius ? { ...lamp, radius } : lamp));
  if (stage.ground?.fade === FADE) {
    const { fade: _, ...ground } = stage.ground;
    stage.ground = ground;
  }
  if (stage.camera.exposure === 1) {
    const { exposure: _, ...camera } = stage.camera;
    stage.camera = camera;
  }
  [stage.light] = stage.lights;
  if (stage.sky || stage.lights.length !== 1 || stage.light.radius) delete stage.light;
  else for (const word of ["sky", "lights"]) delete stage[word]; // as stages were before there was more
  const { eye, target, fov_rad: view } = stage.camera;
  if (eye.every((number, axis) => number === target[axis])) refuse("the eye is the target");
  if (!(view > 1 / MOST_OF_STAGE && view < Math.PI)) refuse("a field of view not between 0° and 180°");
  return { stage, background: behind };
}

function exposureFrom(value) {
  return bare(value) > 0 ? value : refuse(`an exposure of ${value}`);
}

/** By how much lengths grow where a stage's view becomes as large as the usual one, as `scenelang/drawing/size.py`. */
export function growthOf({ growth, camera: { eye, target, fov_rad: view } }) {
  if (growth) return growth;
  const usual = Math.hypot(1.2, 6) / 3, by = usual / (Math.hypot(...eye.map((v, i) => v - target[i])) * Math.tan(view / 2));
  return Math.abs(by - 1) > 1e-6 && Number.isFinite(by) ? by : 1;
}

/** The same picture of a stage with all lengths times a number. */
export function scaledStage({ camera, ground, light, lights, ...stage }, by) {
  const moved = (point) => point.map((v) => v * by);
  const lamp = ({ position, power, radius, ...rest }) => (
    { ...rest, position: moved(position), power: power * by * by, ...(radius && { radius: radius * by }) });
  return {
    ...stage, camera: { ...camera, eye: moved(camera.eye), target: moved(camera.target) },
    ground: ground && { ...ground, y: ground.y * by, fade: (ground.fade ?? FADE) * by },
    ...(light && { light: lamp(light) }), ...(lights && { lights: lights.map(lamp) }),
  };
}

/** The lamps; `light(none)` stands alone. */
function lightsFrom(lamps, known) {
  const dark = lamps.some(([first]) => first === null);
  if (dark && (lamps.length > 1 || lamps[0].some((value, at) => at && value !== undefined))) {
    refuse("`light(none)` beside another light or value");
  }
  if (lamps.length > MOST_LAMPS) refuse(`more than ${MOST_LAMPS} lights`);
  return dark ? [] : lamps.map((values) => partFrom("light", values, known));
}

function partFrom(word, [...values], { usual, fields }) {
  if (word === "ground" && values[0] === null) {
    const more = ["colour", "fade"].filter((_, at) => values[at + 1] !== undefined);
    return more.length ? refuse(`\`ground(none)\` has no ${more[0]}`) : null;
  }
  const part = { ...usual[word] };
  fields[word].forEach(([name, kind, low, high], at) => {
    if (values[at] === undefined) return;
    part[name] = KINDS_OF_STAGE[kind](values[at]);
    const numbers = [part[name]].flat();
    if (!numbers.every((number) => number >= low && number <= high)) refuse(`\`${name}\` is out of range`);
  });
  return part;
}

export function sharesOf(value) {
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
