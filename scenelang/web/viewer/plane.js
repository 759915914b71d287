// The drawer of the plane: rows become textures of numbers, and one triangle asks the network at all pixels.

import { floats, linked, target, triangle } from "./gl.js";
import { distances } from "./grids.js";
import { groupsOf, joinsOf } from "./groups.js";
import { rateOf, reaches, skinReach, steepest, tileLists } from "./ways.js";

const WIDE = 1024; // texels of a row of numbers; as in plane.glsl
const MOST_AT_ONCE = 2 ** 28; // pairs of an object and a pixel

/** The fragment shader for shapes in use, with names defined. */
function fragmentText(view, shapes, defines) {
  const head = ["#version 300 es", ...defines.map((name) => `#define ${name}`), view.shader.fragment];
  const used = shapes.filter((shape) => shape < view.network.decoders.length);
  for (const shape of used) {
    const { text, products } = view.network.decoders[shape];
    head.push(`float decoder${shape}(vec2 q) {`, `SPEND(${products});`, text, "}");
  }
  head.push("float learned(int shape, vec2 q) {", "  switch (shape) {");
  for (const shape of used) head.push(`    case ${shape}: return decoder${shape}(q);`);
  head.push("    default: return FAR;", "  }", "}");
  return head.join("\n");
}

/** A texture of one kind of numbers, as wide as every GPU allows. */
function sheet(gl, data, [inner, format, type], channels) {
  const wide = 2048;
  const high = Math.max(1, Math.ceil(data.length / (channels * wide)));
  const padded = new data.constructor(channels * wide * high);
  padded.set(data);
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texImage2D(gl.TEXTURE_2D, 0, inner, wide, high, 0, format, type, padded);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  return texture;
}

/** A step as texels: a map's rows, with 0 and its steepness behind; or a turn's numbers and its rate. */
function texelsOf([kind, a, b, u, c, d, v]) {
  return kind === "map" ? [a, b, u, 0, c, d, v, steepest(a, b, c, d)] : [a, b, u, rateOf([kind, a, b, u])];
}

/** Numbers of all rows and behind them of groups, and the texel at which each row begins; see `rows` of plane.glsl. */
function packed({ network, materials }, leaves, pictures, { rows }, joins, reach, skinned) {
  const head = skinned ? 5 : 4; // texels before a row's steps
  const [numbers, begins] = [[], []];
  const narrow = ({ blend }) => (blend > 0 ? network.blend / blend : 1);
  rows.forEach((row, i) => {
    const { steps, scale } = row;
    const paint = joins[i].draws ? row.paint : -1; // the others leave colours as they are
    begins.push(numbers.length / 4);
    const { bounds, first, side } = leaves[row.shape];
    const moves = steps.reduce((total, [kind]) => total + (kind === "map" ? 2 : 1), 0);
    const albedo = materials[row.material].albedo;
    const colour = row.colour.map((share, k) => Math.min(Math.max(share * albedo[k], 0), 1));
    numbers.push(scale, narrow(joins[i]), flagsOf(joins[i], row), steps.length + (1 - row.opacity) / 2);
    const more = skinned ? skinReach(row) : 0;
    numbers.push(...bounds.map((bound) => bound + more), Math.min(reach[i], 1e30));
    numbers.push(side ? first : row.shape, side, paint < 0 ? 0 : head + moves, 0);
    numbers.push(...colour, scale);
    if (skinned) numbers.push(...(row.skin ?? [0, 0, 0, 0]));
    for (const step of steps) numbers.push(...texelsOf(step));
    if (paint < 0) return;
    const [a, b, u, c, d, v] = row.place; // to shares of the picture's sides, from its upper left corner
    if (row.stops) {
      numbers.push(a, b, u, 0, c, d, v, 0);
      numbers.push(pictures[paint].kind === "linear" ? -1 : -2, row.stops.length, 0, row.paintSteps.length);
      numbers.push(...row.stops.flat());
    } else {
      numbers.push(a / 2, b / 2, (u + 1) / 2 - Math.floor((u + 1) / 2), 0);
      numbers.push(-c / 2, -d / 2, (1 - v) / 2 - Math.floor((1 - v) / 2), 0);
      const picture = pictures[paint];
      numbers.push(picture.wide, picture.high, picture.first, row.paintSteps.length);
    }
    for (const [name, ...amounts] of row.paintSteps) {
      numbers.push(network.paintSteps.indexOf(name), ...amounts, ...Array(3 - amounts.length).fill(0));
    }
  });
  const texels = new Map([[null, 0]]);
  for (const group of groupsOf(joins).groups) {
    texels.set(group, numbers.length / 4);
    numbers.push(group.kind, narrow(group), begins[group.to], texels.get(group.around));
  }
  joins.forEach(({ around }, i) => { numbers[4 * begins[i] + 11] = texels.get(around); });
  return { numbers, begins };
}

/** How a row joins, as plane.glsl has it. */
function flagsOf(join, row) {
  const far = join.always || (join.seen.hidden && join.operator < 2);
  return join.kind + 8 * join.seen.blends + 16 * far + 32 * hides(join, row);
}

/** Whether nothing is seen of what was before, where a row is solid. */
const hides = ({ operator, around, seen }, { opacity }) => (
  operator === 0 && around === null && !seen.blends && opacity === 1
);

/** Radius of a disc within an object whose leaf has one of a radius, 0 where none is known. */
const filled = ({ inner }, { skin = [0, 0, 0] }) => (
  skin[1] > 0 || !inner ? 0 : Math.max(inner + skin[0] + skin[2], 0)
);

/** Tiles' lists as texels: where each begins and how long it is, then texels of rows, four to one. */
function listed({ starts, objects }, begins) {
  const tiles = starts.length - 1;
  let end = tiles;
  for (let at = 0; at < tiles; at++) end += Math.ceil((starts[at + 1] - starts[at]) / 4);
  const numbers = new Float32Array(4 * end);
  end = tiles;
  for (let at = 0; at < tiles; at++) {
    const count = starts[at + 1] - starts[at];
    numbers.set([end, count], 4 * at);
    for (let k = 0; k < count; k++) numbers[4 * end + k] = begins[objects[starts[at] + k]];
    end += Math.ceil(count / 4);
  }
  return numbers;
}

/**
 * Draws the plane.
 * @param view - as `unpack` gives it
 * @returns `draw(program, {width, height})` into the bound framebuffer, premultiplied; `points(program, p)`:
 *   distance, red, green and blue (M * 4, Float32Array) at points (M * 2) of the world;
 *   `operations(program, {width, height})`: multiply-adds a pixel; `dispose()`
 */
export function planeDrawer(gl, view) {
  const { network } = view;
  const programs = new Map(); // by what they were compiled for
  const shapes = new Set(); // seen so far
  let depth = 0; // of groups, likewise
  let skinned = false; // whether a leaf has had a skin
  let clear = false; // whether something was not opaque
  const textures = ["rows", "lists", "nodes", "texels", "points"];
  const held = { rows: floats(gl, new Float32Array(4)), lists: floats(gl, new Float32Array(4)) };
  const kinds = [];
  const brought = view.shapes.slice(network.decoders.length);
  const [nodes, ofShape] = joined(brought.map(nodesOf), Float32Array);
  const [texels, ofPicture] = joined(view.paints.map((paint) => paint.texels ?? []), Uint8Array);
  const leaves = [
    ...network.decoders.map((decoder) => ({ ...decoder, side: 0, first: 0 })),
    ...brought.map(({ bounds, finest }, i) => ({ bounds, inner: 0, side: finest ?? -1, first: ofShape[i] })),
  ];
  const pictures = view.paints.map((paint, i) => ({ ...paint, first: ofPicture[i] / 3 }));
  if (nodes.length) {
    kinds.push("NODES");
    if (brought.some(isOutline)) kinds.push("OUTLINES");
    if (!brought.every(isOutline)) kinds.push("GRIDS");
    held.nodes = sheet(gl, nodes, [gl.R32F, gl.RED, gl.FLOAT], 1);
  }
  if (pictures.length) {
    kinds.push("PICTURES");
    held.texels = sheet(gl, texels, [gl.RGB8, gl.RGB, gl.UNSIGNED_BYTE], 3);
  }

  function compiled(program, joins, define) {
    for (const { shape } of program.rows) shapes.add(shape);
    skinned ||= program.rows.some((row) => row.skin?.some(Boolean));
    depth = Math.max(depth, groupsOf(joins).depth);
    clear ||= program.rows.some(({ opacity }) => opacity < 1);
    const used = [...shapes].sort((a, b) => a - b);
    const defines = [...kinds, ...(depth ? [`DEPTH ${depth}`] : [])];
    defines.push(...(skinned ? ["SKINS"] : []), ...(clear ? ["CLEAR"] : []), ...(define ? [define] : []));
    const key = [...defines, ...used].join();
    if (!programs.has(key)) {
      const found = linked(gl, fragmentText(view, used, defines));
      const place = (name) => gl.getUniformLocation(found, name);
      gl.useProgram(found);
      textures.forEach((name, unit) => gl.uniform1i(place(name), unit));
      gl.uniform4fv(place("cell"), network.cell);
      programs.set(key, { found, place });
    }
    return programs.get(key);
  }

  function run(program, { width, height }, define = "") {
    const joins = joinsOf(program.rows), { found, place } = compiled(program, joins, define);
    const px = 2 / Math.min(width, height);
    const reach = reaches(program.rows, joins, network);
    const widest = program.rows.reduce((most, { blend }) => Math.max(most, blend), network.blend);
    const inner = program.rows.map((row, i) => (hides(joins[i], row) ? filled(leaves[row.shape], row) : 0));
    const { numbers, begins } = packed(view, leaves, pictures, program, joins, reach, skinned);
    const wanted = 8 * Math.ceil(Math.min(width, height) / 400); // few enough for JavaScript
    const lists = define === "POINTS"
      ? { starts: [0, begins.length], objects: [...begins.keys()], tile: height, across: 1, down: 1 }
      : tileLists(program.rows, joins, reach, inner, { width, height, tile: wanted, px });
    floats(gl, new Float32Array(numbers), WIDE, held.rows);
    floats(gl, listed(lists, begins), WIDE, held.lists);
    textures.forEach((name, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, held[name] ?? null);
    });
    gl.useProgram(found);
    const { background } = program;
    gl.uniform4fv(place("background"), background ? [...background, 1] : [0, 0, 0, 0]);
    gl.uniform2f(place("size"), width, height);
    gl.uniform1f(place("px"), define === "POINTS" ? 0 : px);
    gl.uniform1f(place("empty"), (network.empty * widest) / network.blend);
    gl.uniform1f(place("widest"), widest);
    gl.uniform1i(place("most"), 1 + program.samples);
    gl.uniform1f(place("corner"), program.samples > 4 ? 0.54 : 0.36);
    gl.uniform1i(place("tile"), lists.tile);
    gl.uniform1i(place("across"), lists.across);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.BLEND);
    bands(gl, lists, width);
  }

  /** Numbers (width * height * 4) that a variant of the shader answers. */
  function answers(program, size, define) {
    const before = gl.getParameter(gl.FRAMEBUFFER_BINDING);
    const { framebuffer, texture } = target(gl, size.width, size.height);
    const found = new Float32Array(4 * size.width * size.height);
    run(program, size, define);
    gl.readPixels(0, 0, size.width, size.height, gl.RGBA, gl.FLOAT, found);
    gl.bindFramebuffer(gl.FRAMEBUFFER, before);
    gl.deleteFramebuffer(framebuffer);
    gl.deleteTexture(texture);
    return found;
  }

  compiled(view.program, joinsOf(view.program.rows), ""); // throws where it cannot be
  return {
    draw: (program, size) => run(program, size),
    points(program, p) {
      const count = p.length / 2;
      const spread = new Float32Array(4 * count);
      for (let i = 0; i < count; i++) spread.set([p[2 * i], p[2 * i + 1]], 4 * i);
      held.points = floats(gl, spread, WIDE);
      const found = answers(program, { width: WIDE, height: Math.ceil(count / WIDE) }, "POINTS");
      gl.deleteTexture(held.points);
      delete held.points;
      return found.subarray(0, 4 * count);
    },
    operations(program, size) {
      const found = answers(program, size, "OPERATIONS");
      return found.reduce((total, n) => total + n, 0) / found.length;
    },
    dispose() {
      for (const texture of Object.values(held)) gl.deleteTexture(texture);
      for (const { found } of programs.values()) gl.deleteProgram(found);
      programs.clear();
    },
  };
}

/** Draw rows of tiles, as many at a time as a GPU that shows other windows, too, may be kept with. */
function bands(gl, { starts, tile, across, down }, width) {
  gl.enable(gl.SCISSOR_TEST);
  for (let low = 0, high = 1; low < down; low = high++) {
    const met = (end) => (starts[across * end] - starts[across * low]) * tile * tile;
    while (high < down && met(high + 1) < MOST_AT_ONCE) high++;
    gl.scissor(0, low * tile, width, (high - low) * tile);
    triangle(gl);
    if (high < down) gl.flush();
  }
  gl.disable(gl.SCISSOR_TEST);
}

const isOutline = ({ kind }) => kind === "outline";

/** What the shader knows of a shape that was brought: distances, or cells and pieces of its curves. */
function nodesOf(shape) {
  if (!isOutline(shape)) return distances(shape);
  return joined([[shape.cellsAlong], shape.posts, shape.cells, shape.pieces], Float32Array)[0];
}

/** Arrays of a kind one after the other, and where each begins. */
function joined(arrays, Kind) {
  const begins = [0];
  for (const { length } of arrays) begins.push(begins[begins.length - 1] + length);
  const all = new Kind(begins.pop());
  arrays.forEach((array, i) => all.set(array, begins[i]));
  return [all, begins];
}
