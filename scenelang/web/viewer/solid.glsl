precision highp float;
precision highp int;
precision highp sampler2D;
precision highp isampler2D;
precision highp sampler3D;
precision highp usampler3D;

vec4 swish(vec4 x) { // of a number and its gradient
  float s = 1.0 / (1.0 + exp(-x.x));
  return vec4(x.x * s, x.yzw * (s * (1.0 + x.x * (1.0 - s))));
}

// The network, made for its sizes: decoder(shape, q), decoder(shape, q, g), taking, painting, kind.
//network//

// The field of solids. Of what a scene lacks nothing is compiled: SHAPE_i (a geometry), MEDIA, MIXED (with
// solids), DENSE (media of other densities), COLOURED (media of several colours), GLOWS, LAMPS (how many), TEXTURES, TILTS, GRIDS, TURNS, BUMPS, SKINS, OTHERS (than objects
// that draw), FAR (points from leaves). SLOTS: balls that a ray keeps; DEPTH: groups that are open at once.

const float NEVER = 1e30;
const int SMOOTH = 1;
const int ROW = 16; // numbers of a row, in fours, the first three its map
const int HEAD = 3; // kind of join and flags, shape, scale, usual width of a blend in widths of its own
const int MORE = 4; // amount and frequency of its displacement, where its steps begin, how many
const int AROUND = 5; // centre and squared radius of a ball of the world around it
const int LOW = 6; // of its box behind the map; squared radius of its ball there
const int HIGH = 7; // of its box; rate
const int LOOK = 8; // colour, medium
const int PAINT = 9; // kind of texture, where its colour steps begin, how many; its group
const int PLACE = 10; // two: from the leaf to its picture; where that begins
const int GRID = 12; // side and first slice of a grid, sides of a texture
const int SKIN = 13; // how far it grows, half of its shell, how far behind that; whether displacements are behind it
const int GLOW = 14; // linear
const int TILT = 15; // of a texture, along z

uniform int zero; // keeps compilers from unrolling
uniform sampler2D table; // rows and steps
uniform isampler2D lists; // of each cell begin and count, then numbers of rows, the last first
#ifdef GRIDS
uniform sampler3D grids;
#endif

vec4 part(int row, int which) {
  int at = row * ROW + which;
  return texelFetch(table, ivec2(at & 1023, at >> 10), 0);
}

int listed(int at) {
  return texelFetch(lists, ivec2(at & 1023, at >> 10), 0).x;
}

vec3 mapped(int row, int first, vec3 p) {
  vec4 q = vec4(p, 1.0);
  return vec3(dot(part(row, first), q), dot(part(row, first + 1), q), dot(part(row, first + 2), q));
}

// The derivative of what `mapped` gives.
mat3 linear(int row, int first) {
  return transpose(mat3(part(row, first).xyz, part(row, first + 1).xyz, part(row, first + 2).xyz));
}

#ifdef TURNS
// A point behind a row's map, taken through its turns and further maps to the leaf.
vec3 turned(vec4 more, vec3 p) {
  for (int i = zero; i < int(more.w); i++) {
    int at = 4 * i;
    vec4 step_ = part(int(more.z), at);
    if (step_.x < 0.5) {
      p = mapped(int(more.z), at + 1, p);
    } else if (step_.x < 1.5) {
      vec2 a = direction(step_.y * length(p) + step_.z * p.x);
      p.xy = vec2(a.x * p.x + a.y * p.y, a.x * p.y - a.y * p.x);
    } else {
      vec2 a = direction(step_.y * p.y);
      p.xz = vec2(a.x * p.x + a.y * p.z, a.x * p.z - a.y * p.x);
    }
  }
  return p;
}

// The same with the derivative of what comes out.
vec3 turned(vec4 more, vec3 p, inout mat3 change) {
  for (int i = zero; i < int(more.w); i++) {
    int at = 4 * i;
    vec4 step_ = part(int(more.z), at);
    mat3 own;
    if (step_.x < 0.5) {
      own = linear(int(more.z), at + 1);
      p = mapped(int(more.z), at + 1, p);
    } else {
      bool twist = step_.x > 1.5;
      float r = length(p);
      vec2 a = direction(twist ? step_.y * p.y : step_.y * r + step_.z * p.x);
      float c = a.x, s = a.y;
      vec3 slope = twist ? vec3(0.0, step_.y, 0.0) : step_.y / max(r, 1e-12) * p + vec3(step_.z, 0.0, 0.0);
      mat3 turn = twist ? mat3(c, 0, -s, 0, 1, 0, s, 0, c) : mat3(c, -s, 0, s, c, 0, 0, 0, 1);
      p = turn * p;
      own = turn + outerProduct(twist ? vec3(p.z, 0.0, -p.x) : vec3(p.y, -p.x, 0.0), slope);
    }
    change = own * change;
  }
  return p;
}
#endif

#ifdef GRIDS
// Distances at the nodes of a square across x.
vec4 nodes(ivec3 at) {
  return vec4(texelFetch(grids, at, 0).x, texelFetch(grids, at + ivec3(0, 1, 0), 0).x,
    texelFetch(grids, at + ivec3(0, 0, 1), 0).x, texelFetch(grids, at + ivec3(0, 1, 1), 0).x);
}

// A grid's distance at a point of the leaf.
float gridded(vec4 grid, vec3 q) {
  vec3 at = clamp(q, -1.0, 1.0), off = q - at;
  vec3 place = (at + 1.0) * (0.5 * (grid.x - 1.0)), cell = clamp(floor(place), 0.0, grid.x - 2.0);
  vec3 share = place - cell;
  ivec3 first = ivec3(cell.zyx) + ivec3(0, 0, int(grid.y)); // slices lie along x
  vec4 near = nodes(first), far = nodes(first + ivec3(1, 0, 0));
  near = mix(near, far, share.z);
  near.xy = mix(near.xz, near.yw, share.y);
  float found = mix(near.x, near.y, share.x), beyond = dot(off, off);
  return beyond > 0.0 ? sqrt(found * found + beyond) : found;
}

#ifdef SKINS
const int NEARER = 4; // as in scenelang/drawing/neural/assets.py
const float ALONG = 0.6;

// About the point of a surface that is nearest to a point of the cube, and the unit normal there.
vec3 foot(vec4 grid, vec3 q, out vec3 normal) {
  float h = 1.0 / (grid.x - 1.0);
  vec3 slope;
  for (int i = zero; i < 3; i++) {
    vec3 a = q, b = q;
    a[i] = max(q[i] - h, -1.0);
    b[i] = min(q[i] + h, 1.0);
    slope[i] = (gridded(grid, b) - gridded(grid, a)) / (b[i] - a[i]);
  }
  normal = slope / max(length(slope), 1e-9);
  return q - gridded(grid, q) * normal;
}

// The way to a point outside of the cube from the nearest of the surface, as `GrownShape` there has it.
vec3 beside(vec4 grid, vec3 q) {
  vec3 normal, next, best = foot(grid, clamp(q, -1.0, 1.0), normal);
  for (int i = zero; i < NEARER; i++) {
    vec3 away = q - best, along = best + ALONG * (away - dot(away, normal) * normal);
    vec3 found = foot(grid, clamp(along, -1.0, 1.0), next);
    if (length(q - found) >= length(away)) continue;
    best = found;
    normal = next;
  }
  return q - best;
}
#endif

// Whether a point lies outside of the cube of an object that has a skin, and the way to it from the surface.
bool outside(int row, vec4 grid, vec3 q, out vec3 away) {
#ifdef SKINS
  if (any(notEqual(part(row, SKIN).xyz, vec3(0.0))) && any(greaterThan(abs(q), vec3(1.0)))) {
    away = beside(grid, q);
    return true;
  }
#endif
  return false;
}
#endif

float met; // points and objects that met

// Leaf units at a point of a leaf.
float leaf(int row, vec4 head, vec3 q) {
  met++;
  float d;
  vec3 place = q;
#ifdef FAR
  float r = length(q);
  place *= RADIUS / max(r, RADIUS);
#endif
#ifdef GRIDS
  if (int(head.y) >= GEOMETRIES) {
    vec3 away;
    d = outside(row, part(row, GRID), place, away) ? length(away) : gridded(part(row, GRID), place);
  } else
#endif
  d = decoder(int(head.y), place);
#ifdef FAR
  d += max(r - RADIUS, 0.0);
#endif
  float bump = 0.0;
#ifdef BUMPS
  vec4 more = part(row, MORE);
  vec3 s = sin(more.y * q);
  bump = more.x * s.x * s.y * s.z;
#endif
#ifdef SKINS
  vec4 skin = part(row, SKIN);
  d += (1.0 - skin.w) * bump - skin.x;
  return (skin.y > 0.0 ? abs(d) - skin.y : d) - skin.z + skin.w * bump;
#endif
  return d + bump;
}

// The same and how it changes.
float leaf(int row, vec4 head, vec3 q, out vec3 g) {
  met++;
  float d;
  vec3 place = q;
#ifdef FAR
  float r = length(q), rim = RADIUS / max(r, RADIUS);
  place *= rim;
#endif
#ifdef GRIDS
  if (int(head.y) >= GEOMETRIES) {
    vec4 grid = part(row, GRID);
    float h = 1.0 / (grid.x - 1.0);
    d = gridded(grid, place);
    for (int i = zero; i < 3; i++) {
      vec3 off = vec3(i == 0, i == 1, i == 2) * h;
      g[i] = (gridded(grid, place + off) - gridded(grid, place - off)) / (2.0 * h);
    }
    vec3 away;
    if (outside(row, grid, place, away)) {
      d = length(away);
      g = away / max(d, 1e-9);
    }
  } else
#endif
  d = decoder(int(head.y), place, g);
#ifdef FAR
  if (r > RADIUS) {
    vec3 n = q / r;
    g = rim * (g - dot(g, n) * n) + n;
    d += r - RADIUS;
  }
#endif
  float bump = 0.0;
  vec3 slope = vec3(0.0);
#ifdef BUMPS
  vec4 more = part(row, MORE);
  float f = more.y, amount = more.x;
  vec3 s = sin(f * q), c = cos(f * q);
  bump = amount * s.x * s.y * s.z;
  slope = amount * f * vec3(c.x * s.y * s.z, s.x * c.y * s.z, s.x * s.y * c.z);
#endif
#ifdef SKINS
  vec4 skin = part(row, SKIN);
  d += (1.0 - skin.w) * bump - skin.x;
  g += (1.0 - skin.w) * slope;
  if (skin.y > 0.0) {
    g *= d < 0.0 ? -1.0 : 1.0;
    d = abs(d) - skin.y;
  }
  g += skin.w * slope;
  return d - skin.z + skin.w * bump;
#endif
  g += slope;
  return d + bump;
}
