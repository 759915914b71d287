// What users brought to a scene of solids, as textures: grids of distances, pictures, colours of space.

import { unfiltered } from "./gl.js";
import { distances, spaceColours } from "./grids.js";

const UNIT = 65535; // of colours of space

/** The box [low, high] of the cells of a grid (side^3, x outermost) with something inside. */
function filledBox(grid, side) {
  const low = [side, side, side], high = [-1, -1, -1];
  for (let at = 0; at < grid.length; at++) {
    if (grid[at] > 0) continue;
    [Math.floor(at / side / side), Math.floor(at / side) % side, at % side].forEach((node, axis) => {
      low[axis] = Math.min(low[axis], node - 1);
      high[axis] = Math.max(high[axis], node + 1);
    });
  }
  const place = (node) => (Math.min(side - 1, Math.max(0, node)) * 2) / (side - 1) - 1;
  return high[0] < 0 ? [[-1, -1, -1], [1, 1, 1]] : [low.map(place), high.map(place)];
}

function checkSide(side, most) {
  if (side > most) throw new Error(`elements need a texture of ${side} texels a side, at most ${most} here`);
}

/** Cubes of texels one above the other in a texture of space; throws an Error where that is too high. */
function stacked(gl, cubes, internal, format, type, empty) {
  const width = Math.max(1, ...cubes.map((cube) => cube.side));
  const depth = Math.max(1, cubes.reduce((sum, cube) => sum + cube.side, 0)), texture = gl.createTexture();
  checkSide(Math.max(width, depth), gl.getParameter(gl.MAX_3D_TEXTURE_SIZE));
  gl.bindTexture(gl.TEXTURE_3D, texture);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texStorage3D(gl.TEXTURE_3D, 1, internal, width, width, depth);
  for (const { first, side, data } of cubes) {
    gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, first, side, side, side, format, type, data);
  }
  if (!cubes.length) gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, 0, 1, 1, 1, format, type, empty);
  unfiltered(gl, gl.TEXTURE_3D);
  return texture;
}

/** Pictures one above the other in a texture; sRGB, so that texels are linear. */
function atlas(gl, pictures) {
  const width = Math.max(1, ...pictures.map((picture) => picture.wide));
  const height = Math.max(1, pictures.reduce((sum, picture) => sum + picture.high, 0));
  const texture = gl.createTexture();
  checkSide(Math.max(width, height), gl.getParameter(gl.MAX_TEXTURE_SIZE));
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.SRGB8, width, height);
  for (const { first, wide, high, texels } of pictures) {
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, first, wide, high, gl.RGB, gl.UNSIGNED_BYTE, texels);
  }
  unfiltered(gl, gl.TEXTURE_2D);
  return texture;
}

/** Parts with where each begins, when they lie one behind the other. */
function placed(parts, size) {
  let first = 0;
  return parts.map((part) => {
    const found = { ...part, first };
    first += part[size];
    return found;
  });
}

/**
 * The elements of a view of solids.
 * @returns {{grids: object[], paints: object[], textures: object}} by numbers of shapes {side, first, box};
 *   by numbers of paints {kind: 1 picture, 2 colours, 3 linear, 4 radial, first, sides: as the shader takes
 *   them}; by samplers
 */
export function solidElements(gl, view) {
  const grids = [], paints = [], cubes = [];
  view.shapes.forEach((shape, at) => {
    if (shape.kind !== "grid") return;
    const data = distances(shape), side = shape.finest;
    cubes.push({ at, side, data, box: filledBox(data, side) });
  });
  const spaces = [], pictures = [];
  view.paints.forEach((paint, at) => {
    if (paint.kind === "linear") paints[at] = { kind: 3, first: 0, sides: [0, 0] };
    else if (paint.kind === "radial") paints[at] = { kind: 4, first: 0, sides: [0, 0] };
    else if (paint.kind === "picture") pictures.push({ at, ...paint });
    else spaces.push({ at, side: paint.sides.at(-1), data: spaceColours(paint, UNIT) });
  });
  const [solid, coloured, flat] = [placed(cubes, "side"), placed(spaces, "side"), placed(pictures, "high")];
  for (const { at, side, first, box } of solid) grids[at] = { side, first, box };
  for (const { at, side, first } of coloured) paints[at] = { kind: 2, first, sides: [side, 0] };
  for (const { at, wide, high, first } of flat) paints[at] = { kind: 1, first, sides: [wide, high] };
  const textures = {};
  if (cubes.length) textures.grids = stacked(gl, solid, gl.R32F, gl.RED, gl.FLOAT);
  if (view.paints.length) {
    textures.pictures = atlas(gl, flat);
    const none = new Uint16Array(3);
    textures.colours = stacked(gl, coloured, gl.RGB16UI, gl.RGB_INTEGER, gl.UNSIGNED_SHORT, none);
  }
  return { grids, paints, textures };
}
