// Draws solids: rows and light to pictures, by the shader of `solid.glsl` and `light.glsl`.

import { checkedProgram, floats, linking, triangle, unfiltered } from "./gl.js";
import { solidElements } from "./elements.js";
import { cellsOf, cubeOf, listsOf, solidBalls } from "./balls.js";
import { groupsOf, joinsOf } from "./groups.js";
import { axesOf, FADE, growthOf, scaledStage } from "./stage.js";
import { aroundOf } from "./around.js";

const ROW_TEXELS = 16; // as the shader has it
const LIST_WIDTH = 1024;
const TILE_SIDE = 16; // pixels that share a list of balls, along each axis
const CUBE_SIDE = 12; // cells along a side of the cube around a lamp
const BAND = 1 << 14; // pixels drawn at a time
const UNMOVED = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];
const MOST_SLOTS = 256; // balls that a ray keeps
const COLOUR_STEPS = { color: 0, grayscale: 1, hue: 2 };

/** Whether a row wears a medium. */
const isMedium = (view, row) => view.materials[row.material].medium > 0.5;

/** Extinction of a row's medium per world unit. */
const densityOf = (view, row) => row.density ?? view.network.extinction;

/** Rows and stage of the same picture whose view is as large as the usual one, and by how much lengths grew. */
function sized(view, { rows, stage }) {
  const by = growthOf(stage);
  if (by === 1) return { rows, stage, by };
  const grown = rows.map((row) => {
    const [[kind, ...map], ...steps] = row.steps[0]?.[0] === "map" ? row.steps : [["map", ...UNMOVED], ...row.steps];
    const frame = map.map((v, i) => (i % 4 < 3 ? v / by : v)), density = densityOf(view, row) / by;
    return { ...row, steps: [[kind, ...frame], ...steps], scale: row.scale * by, blend: row.blend * by, density };
  });
  return { rows: grown, stage: scaledStage(stage, by), by };
}

/** The lamps of a stage, and dark ones up to a number. */
function lampsOf({ light, lights = [light] }, least = 1) {
  const dark = { position: [0, 0, 0], power: 0, rgb: [0, 0, 0] }, more = Math.max(0, least - lights.length);
  return [...lights, ...new Array(more).fill(dark)].map((lamp) => ({ radius: 0, ...lamp }));
}

/** A row's colour, as far as no texture changes it. */
function plainColour(view, row) {
  return view.materials[row.material].albedo.map((v, i) => Math.min(1, Math.max(0, v * row.colour[i])));
}

/** How a tilted texture's place changes along z. */
function tiltOf({ tilt: [p, q] = [0, 0], stops }) {
  return stops ? [p, q] : [p / 2, -q / 2];
}

/** The rows' numbers for the shader: ROW_TEXELS texels a row, then groups and steps of space and of colours. */
function tableOf(view, rows, joins, balls, elements, dense) {
  const blocks = [], blank = () => new Float32Array(4 * ROW_TEXELS);
  for (let i = 0; i < rows.length; i++) blocks.push(blank());
  const more = (texels) => { // as many rows as hold some texels; the number of the first
    const first = blocks.length, flat = texels.flat();
    for (let at = 0; at < flat.length; at += 4 * ROW_TEXELS) {
      blocks.push(blank());
      blocks.at(-1).set(flat.slice(at, at + 4 * ROW_TEXELS));
    }
    return first;
  };
  const narrow = ({ blend }) => (blend > 0 ? view.network.blend / blend : 1);
  const { groups } = groupsOf(joins), places = new Map([[null, 0]]);
  groups.forEach((group, i) => places.set(group, ROW_TEXELS * blocks.length + i));
  more(groups.map((group) => [group.kind, narrow(group), group.to, places.get(group.around)]));
  rows.forEach((row, i) => {
    const { outer, rest, ball, rate, centre, extent, box } = balls[i];
    const material = view.materials[row.material];
    const steps = rest.map(([kind, ...n]) => (kind === "map" ? [0, 0, 0, 0, ...n]
      : [...(kind === "turn" ? [1, n[0], n[1], 0] : [2, n[0], 0, 0]), ...new Array(12).fill(0)]));
    const paint = row.paint < 0 ? null : elements.paints[row.paint];
    const ops = (paint ? row.paintSteps : []).map(([kind, a, b = 0, c = 0]) => [COLOUR_STEPS[kind], a, b, c]);
    const stops = row.stops ?? [];
    const [a, b, u, c, d, v] = row.place ?? [0, 0, 0, 0, 0, 0], grid = elements.grids[row.shape];
    const turn = (x) => x - Math.floor(x);
    blocks[i].set([
      ...outer,
      flagsOfSolid(joins[i]), row.shape, row.scale, narrow(joins[i]),
      row.amount, row.frequency, steps.length ? more(steps) : 0, steps.length,
      ...centre, extent * extent * (1 + 1e-5) + 1e-9,
      ...box[0], ball * ball,
      ...box[1], rate,
      ...plainColour(view, row), dense && isMedium(view, row) ? 1 + densityOf(view, row) : material.medium,
      paint ? paint.kind : 0, more([...stops, ...ops]), ops.length, places.get(joins[i].around),
      // to (u, v), or to shares of the picture's sides, from its upper left corner
      ...(row.stops ? [a, b, u, 0, c, d, v, stops.length] : [
        a / 2, b / 2, turn((u + 1) / 2), paint ? paint.first : 0, -c / 2, -d / 2, turn((1 - v) / 2), 0,
      ]),
      grid ? grid.side : 0, grid ? grid.first : 0, ...(paint ? paint.sides : [0, 0]),
      ...(row.skin ?? [0, 0, 0, 0]),
      ...(row.glow ?? [0, 0, 0]), 0,
      ...tiltOf(row),
    ]);
  });
  const data = new Float32Array(blocks.length * 4 * ROW_TEXELS);
  blocks.forEach((block, i) => data.set(block, i * 4 * ROW_TEXELS));
  return data;
}

/** How a row joins, as fold.glsl has it. */
function flagsOfSolid({ kind, draws, always, adds, around }) {
  return kind + 8 * draws + (always ? (around ? 32 : 16) : 0) + 64 * adds;
}

/** What the shader has to know of, for some rows and their balls, as names of defines. */
function featuresOf(view, rows, joins, balls) {
  const media = rows.filter((row) => isMedium(view, row)), has = (holds) => rows.some(holds);
  const lookOfMedium = (row) => (row.paint < 0 ? [...plainColour(view, row), row.glow].join() : row.object);
  const colours = new Set(media.map(lookOfMedium));
  const dense = media.some((row) => densityOf(view, row) !== view.network.extinction);
  const shown = [...new Set(rows.map((row) => row.shape))].sort((a, b) => a - b);
  const learned = shown.filter((shape) => shape < view.network.geometries).map((shape) => `SHAPE_${shape}`);
  const others = Object.entries({
    MEDIA: media.length > 0,
    MIXED: dense || (media.length > 0 && media.length < rows.length),
    DENSE: dense,
    GLOWS: has((row) => row.glow?.some(Boolean)),
    COLOURED: colours.size > 1,
    TEXTURES: has((row) => row.paint >= 0),
    TILTS: has((row) => row.tilt),
    GRIDS: learned.length < shown.length,
    TURNS: balls.some((ball) => ball.rest.length > 0),
    FAR: balls.some((ball) => ball.radius > view.network.far),
    BUMPS: has((row) => row.amount !== 0),
    SKINS: has((row) => row.skin?.some(Boolean)),
    OTHERS: joins.some(({ draws }) => !draws),
  }).filter(([, holds]) => holds).map(([name]) => name);
  return [...learned, ...others];
}

/** A texture of whole numbers to fetch. */
function wholes(gl, data, texture) {
  const height = Math.max(1, Math.ceil(data.length / LIST_WIDTH));
  const padded = new Int32Array(LIST_WIDTH * height);
  padded.set(data);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32I, LIST_WIDTH, height, 0, gl.RED_INTEGER, gl.INT, padded);
  unfiltered(gl, gl.TEXTURE_2D);
}

/** A framebuffer with textures of a format. */
function screens(gl, width, height, formats) {
  const framebuffer = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  const textures = formats.map((format, i) => {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
    unfiltered(gl, gl.TEXTURE_2D);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, texture, 0);
    return texture;
  });
  gl.drawBuffers(formats.map((_, i) => gl.COLOR_ATTACHMENT0 + i));
  return { framebuffer, textures, width, height };
}

function dropScreens(gl, { framebuffer, textures }) {
  gl.deleteFramebuffer(framebuffer);
  for (const texture of textures) gl.deleteTexture(texture);
}

/** Sets a uniform to a number, a boolean, three numbers or a struct, whose `on` says whether there is one. */
function setUniforms(gl, at, name, value) {
  if (typeof value === "number") gl.uniform1f(at(name), value);
  else if (typeof value === "boolean") gl.uniform1i(at(name), Number(value));
  else if (Array.isArray(value)) gl.uniform3fv(at(name), value);
  else {
    const parts = Object.entries({ ...value, on: value !== null });
    for (const [key, part] of parts) {
      const several = key === "lights" ? part.map((one, i) => [`${key}[${i}]`, one]) : [[key, part]];
      for (const [field, one] of several) setUniforms(gl, at, `${name}.${field}`, one);
    }
  }
}

/** Draws a view of solids; docs/architecture.md has what drawers do. */
export function solidDrawer(gl, view) {
  const { network } = view, shaders = new Map(), table = gl.createTexture(), lists = gl.createTexture();
  const elements = solidElements(gl, view);
  let around = aroundOf(gl, view.around);
  const features = new Set(); // and slots only grow, so that frames of an animation share a shader
  let slots = 8, depth = 0, lamps = 1, first = null, ready = {};

  const boxOf = (row) => {
    if (row.shape >= network.geometries) return elements.grids[row.shape].box;
    const at = 6 * row.shape, numbers = [...network.boxes.subarray(at, at + 6)];
    return [numbers.slice(0, 3), numbers.slice(3)];
  };

  /** The shader for what is known and some defines more, compiled once; it may be under way yet. */
  const shaderOf = (names) => {
    const sizes = [`SLOTS=${slots}`, ...(depth ? [`DEPTH=${depth}`] : []), ...(lamps > 1 ? [`LAMPS=${lamps}`] : [])];
    const all = [...features, ...sizes, ...names], key = all.join();
    if (!shaders.has(key)) {
      const defines = all.map((name) => `#define ${name}\n`.replace("=", " ")).join("");
      const program = linking(gl, `#version 300 es\n${defines}${view.shader.source}`);
      shaders.set(key, { program, places: null });
    }
    return shaders.get(key);
  };

  /** A shader in use, and a function from names of its uniforms to where these are. */
  const begin = (shader) => {
    shader.places ??= checkedProgram(gl, shader.program) && new Map();
    gl.useProgram(shader.program);
    return (name) => {
      if (!shader.places.has(name)) shader.places.set(name, gl.getUniformLocation(shader.program, name));
      return shader.places.get(name);
    };
  };

  /** Take rows in, and cells for a picture of a size. */
  const prepare = (program, width, height) => {
    if (ready.program === program && ready.width === width && ready.height === height) return;
    const { rows, stage, by } = sized(view, program), joins = joinsOf(rows), balls = solidBalls(rows, joins, network, boxOf);
    const pixel = 2 / Math.min(width, height), near = 1 / Math.tan(stage.camera.fov_rad / 2);
    const tiles = [width, height].map((side) => Math.ceil(side / TILE_SIDE));
    const scale = near / pixel / TILE_SIDE;
    const axes = axesOf(stage.camera.eye, stage.camera.target);
    const seen = cellsOf(stage.camera.eye, axes, [scale, scale],
      [width / 2 / TILE_SIDE, height / 2 / TILE_SIDE], tiles);
    const cubes = lampsOf(stage).flatMap(({ position, radius }) => cubeOf(position, CUBE_SIDE, radius));
    const { data, longest } = listsOf(joins, balls, [seen, ...cubes]);
    for (const name of featuresOf(view, rows, joins, balls)) features.add(name);
    if (view.around) features.add("SKY");
    if (lampsOf(stage).some(({ radius }) => radius > 0)) features.add("SOFT");
    wholes(gl, data, lists);
    floats(gl, tableOf(view, rows, joins, balls, elements, features.has("DENSE")), 1024, table);
    lamps = Math.max(lamps, lampsOf(stage).length);
    depth = Math.max(depth, groupsOf(joins).depth);
    while (slots < Math.min(MOST_SLOTS, longest)) slots *= 2;
    ready = {
      program, stage, by, width, height, pixel, near, axes, cells: [TILE_SIDE, tiles[0], 1 + seen.count, CUBE_SIDE],
    };
  };

  /** Begin to draw by a shader. */
  const use = (names, textures = {}) => {
    const { axes } = ready, at = begin(shaderOf(names));
    const all = { table, lists, ...elements.textures, ...around.textures, ...textures };
    Object.entries(all).forEach(([name, texture], unit) => {
      const space = ["grids", "colours", "around"].includes(name);
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(space ? gl.TEXTURE_3D : gl.TEXTURE_2D, texture);
      gl.uniform1i(at(name), unit);
    });
    gl.uniform1i(at("zero"), 0);
    gl.uniform1i(at("along"), Math.sqrt(ready.program.samples));
    const vectors = {
      forward: axes[0].map((v) => v * ready.near), right: axes[1], up: axes[2],
      canvas: [ready.width, ready.height, ready.pixel],
    };
    for (const [name, value] of Object.entries(vectors)) gl.uniform3fv(at(name), value);
    const { light: _, ground, ...stage } = ready.stage;
    const made = { camera: { exposure: 1, ...stage.camera }, ground: ground && { fade: FADE, ...ground } };
    setUniforms(gl, at, "stage", { ...stage, ...made, lights: lampsOf(ready.stage, lamps) });
    gl.uniform4iv(at("grid"), ready.cells);
    gl.uniform4fv(at("cells"), network.cells);
    for (const [name, value] of Object.entries(around.uniforms(ready.by))) gl[`uniform${value.length}fv`](at(name), value);
  };

  /** Draw a picture in bands, so that no call takes long; stops after each. */
  function* bands() {
    const { width, height } = ready, rows = Math.max(1, Math.floor(BAND / width));
    for (let bottom = 0; bottom < height; bottom += rows) {
      gl.viewport(0, 0, width, height);
      gl.disable(gl.BLEND);
      gl.enable(gl.SCISSOR_TEST);
      gl.scissor(0, bottom, width, rows);
      triangle(gl);
      gl.disable(gl.SCISSOR_TEST);
      gl.flush();
      yield;
    }
  }

  /** One sample of each pixel, then all where these differ. */
  function* render(into, format, names) {
    const { width, height } = ready;
    if (!first || first.width !== width || first.height !== height || first.format !== format) {
      if (first) dropScreens(gl, first);
      first = { ...screens(gl, width, height, [format, gl.RGBA8]), format };
    }
    shaderOf(names);
    shaderOf([...names, "FOUR"]);
    gl.bindFramebuffer(gl.FRAMEBUFFER, first.framebuffer);
    use(names);
    yield* bands();
    gl.bindFramebuffer(gl.FRAMEBUFFER, into);
    use([...names, "FOUR"], { once: first.textures[0], shown: first.textures[1] });
    yield* bands();
  }

  return {
    /** Draw into the bound framebuffer. */
    draw(program, size) {
      for (const _ of this.pieces(program, size));
    },

    /** The same, a band after the other; in between nothing else may draw. */
    *pieces(program, { width, height }) {
      const into = gl.getParameter(gl.FRAMEBUFFER_BINDING);
      prepare(program, width, height);
      yield* render(into, gl.RGBA8, []);
    },

    /** What the field has at points (M * 3): distance, linear colour and medium (M * 5). */
    points(program, p) {
      const count = p.length / 3, width = 1024, height = Math.ceil(count / width);
      const into = gl.getParameter(gl.FRAMEBUFFER_BINDING), found = new Float32Array(5 * count);
      if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("no framebuffers of floats here");
      prepare(program, 16, 16);
      const four = new Float32Array(4 * count);
      for (let i = 0; i < count; i++) four.set(p.subarray(3 * i, 3 * i + 3).map((v) => v * ready.by), 4 * i);
      const places = floats(gl, four, width), screen = screens(gl, width, height, [gl.RGBA32F, gl.RGBA32F]);
      use(["POINTS"], { places });
      gl.viewport(0, 0, width, height);
      triangle(gl);
      const numbers = new Float32Array(4 * width * height);
      [4, 1].forEach((parts, i) => {
        gl.readBuffer(gl.COLOR_ATTACHMENT0 + i);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, numbers);
        for (let at = 0; at < count; at++) {
          found.set(numbers.subarray(4 * at, 4 * at + parts), 5 * at + 4 * i);
        }
      });
      for (let at = 0; at < count; at++) found[5 * at] /= ready.by;
      dropScreens(gl, screen);
      gl.deleteTexture(places);
      gl.bindFramebuffer(gl.FRAMEBUFFER, into);
      return found;
    },

    /** Multiply-adds of the network for a pixel, on average, in a picture of a size. */
    operations(program, { width, height }) {
      const into = gl.getParameter(gl.FRAMEBUFFER_BINDING), numbers = new Float32Array(4 * width * height);
      if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("no framebuffers of floats here");
      prepare(program, width, height);
      const screen = screens(gl, width, height, [gl.RGBA32F]);
      for (const _ of render(screen.framebuffer, gl.RGBA32F, ["COUNT"]));
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, numbers);
      dropScreens(gl, screen);
      gl.bindFramebuffer(gl.FRAMEBUFFER, into);
      let met = 0;
      for (let i = 0; i < numbers.length; i += 4) met += numbers[i];
      return (met / (width * height)) * network.products;
    },

    /** Take other light from everywhere in place of what there is. */
    relight(part) {
      for (const texture of Object.values(around.textures)) gl.deleteTexture(texture);
      around = aroundOf(gl, part);
    },

    dispose() {
      for (const { program } of shaders.values()) gl.deleteProgram(program);
      for (const texture of [table, lists, ...[elements, around].flatMap(({ textures }) => Object.values(textures))]) gl.deleteTexture(texture);
      if (first) dropScreens(gl, first);
    },
  };
}
