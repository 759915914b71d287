precision highp float;
precision highp int;
precision highp sampler2D;
precision highp isampler2D;
precision highp sampler3D;
precision highp usampler3D;

// The network, made for its sizes: decoder(shape, q), decoder(shape, q, g), taking, painting, kind.
//network//

// The field of solids, and the way of a ray through it. Of what a scene lacks nothing is compiled:
// SHAPE_i (a geometry), MEDIA, MIXED (with solids), COLOURED (media of several colours), TEXTURES, GRIDS, TURNS, BUMPS, OTHERS (than
// objects that draw), FAR (points from leaves). SLOTS: balls that a ray keeps.

const float NEVER = 1e30;
const float TOUCH = 1e-5; // world units: so near counts as met
const float GAP = 0.009; // by which steps may go beyond what is certain
const int STEPS = 800; // of a ray
const int WINDOWS = 16; // of a ray that passes more balls than it keeps
const int HALVINGS = 16; // of the way on which a medium gives way to a solid
const int SUBTRACT = 2, INTERSECT = 3;
const int ROW = 13; // numbers of a row, in fours, the first three its map
const int HEAD = 3; // token, shape, scale, usual width of a blend in widths of its own
const int MORE = 4; // amount and frequency of its displacement, where its steps begin, how many
const int AROUND = 5; // centre and squared radius of a ball of the world around it
const int LOW = 6; // of its box behind the map; squared radius of its ball there
const int HIGH = 7; // of its box; rate
const int LOOK = 8; // colour, medium
const int PAINT = 9; // kind of texture, where its colour steps begin, how many
const int PLACE = 10; // two: from the leaf to its picture; where that begins
const int GRID = 12; // side and first slice of a grid, sides of a texture

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

#ifdef TURNS
// Cosine and sine; those of many drivers are right to three digits.
vec2 circle(float a) {
  float k = floor(a * 0.63661977 + 0.5), r = (a - k * 1.5707964) + k * 4.371139e-8, x = r * r;
  float c = 1.0 + x * (-0.5 + x * (1.0 / 24.0 + x * (-1.0 / 720.0 + x / 40320.0)));
  float s = r * (1.0 + x * (-1.0 / 6.0 + x * (1.0 / 120.0 + x * (-1.0 / 5040.0 + x / 362880.0))));
  int turn = int(k) & 3;
  vec2 found = (turn & 1) == 0 ? vec2(c, s) : vec2(-s, c);
  return turn < 2 ? found : -found;
}

// A point behind a row's map, taken through its turns and further maps to the leaf.
vec3 turned(vec4 more, vec3 p) {
  for (int i = zero; i < int(more.w); i++) {
    int at = 4 * i;
    vec4 step_ = part(int(more.z), at);
    if (step_.x < 0.5) {
      p = mapped(int(more.z), at + 1, p);
    } else if (step_.x < 1.5) {
      vec2 a = circle(step_.y * length(p) + step_.z * p.x);
      p.xy = vec2(a.x * p.x + a.y * p.y, a.x * p.y - a.y * p.x);
    } else {
      vec2 a = circle(step_.y * p.y);
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
      own = transpose(mat3(part(int(more.z), at + 1).xyz, part(int(more.z), at + 2).xyz, part(int(more.z), at + 3).xyz));
      p = mapped(int(more.z), at + 1, p);
    } else {
      bool twist = step_.x > 1.5;
      float r = length(p);
      vec2 a = circle(twist ? step_.y * p.y : step_.y * r + step_.z * p.x);
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
float node(ivec3 at) {
  return texelFetch(grids, at, 0).x;
}

// A grid's distance at a point of the leaf.
float gridded(vec4 grid, vec3 q) {
  vec3 at = clamp(q, -1.0, 1.0), off = q - at;
  vec3 place = (at + 1.0) * (0.5 * (grid.x - 1.0)), cell = clamp(floor(place), 0.0, grid.x - 2.0);
  vec3 share = place - cell;
  ivec3 first = ivec3(cell.zyx) + ivec3(0, 0, int(grid.y)); // slices lie along x
  vec4 near = vec4(node(first), node(first + ivec3(0, 1, 0)), node(first + ivec3(0, 0, 1)), node(first + ivec3(0, 1, 1)));
  first.x++;
  vec4 far = vec4(node(first), node(first + ivec3(0, 1, 0)), node(first + ivec3(0, 0, 1)), node(first + ivec3(0, 1, 1)));
  near = mix(near, far, share.z);
  near.xy = mix(near.xz, near.yw, share.y);
  float found = mix(near.x, near.y, share.x), beyond = dot(off, off);
  return beyond > 0.0 ? sqrt(found * found + beyond) : found;
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
  if (int(head.y) >= GEOMETRIES) d = gridded(part(row, GRID), place); else
#endif
  d = decoder(int(head.y), place);
#ifdef FAR
  d += max(r - RADIUS, 0.0);
#endif
#ifdef BUMPS
  vec4 more = part(row, MORE);
  vec3 s = sin(more.y * q);
  d += more.x * s.x * s.y * s.z;
#endif
  return d;
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
#ifdef BUMPS
  vec4 more = part(row, MORE);
  float f = more.y, amount = more.x;
  vec3 s = sin(f * q), c = cos(f * q);
  d += amount * s.x * s.y * s.z;
  g += amount * f * vec3(c.x * s.y * s.z, s.x * c.y * s.z, s.x * s.y * c.z);
#endif
  return d;
}

// What is at a point, as far as rays ask.
float state; // distance
float dense; // whether it is a medium
float change; // how far the kind of material is sure to stay

vec3 rayFrom, rayWay;
vec4 slots[SLOTS]; // the balls that a ray passes: row, -1 less it of one that does not draw; begin, end, rate
int slotCount;

// Let a point of the ray meet the objects in whose balls it is.
void meet(float t) {
  state = EMPTY;
  dense = 0.0;
  change = EMPTY;
  bool touched = false;
  vec3 p = rayFrom + t * rayWay;
  for (int i = slotCount - 1; i >= zero; i--) {
    vec4 slot = slots[i];
    if (t < slot.y || t > slot.z) continue;
    int row = int(slot.x);
#ifdef OTHERS
    if (row < 0) {
      if (!touched) continue;
      row = -1 - row;
    }
#endif
    touched = true;
    vec4 head = part(row, HEAD);
    vec3 q = mapped(row, 0, p);
#ifdef TURNS
    q = turned(part(row, MORE), q);
#endif
    float d = leaf(row, head, q) * head.z, before = state;
    int at = int(head.x) * CELL;
    float take = taking(at, d * head.w, before * head.w), keep = 1.0 - take;
    vec4 made = cells[at];
    state = take * (d * made.x - keep * made.y / head.w) + keep * before;
#ifdef MIXED
    float medium = part(row, LOOK).w, gap = abs(d);
    if (int(head.x) == 1) gap = min(gap, abs(before - d) / 2.0);
    if (abs(dense - medium) > 0.5) change = min(change, gap);
    dense += kind(at, d * head.w, before * head.w) * (medium - dense);
#endif
  }
  change = min(change, abs(state));
}

// Keep the balls of a list that the ray passes between low and high; returns up to where these are all.
float gather(ivec2 list, float low, float high) {
  float sure = high;
  slotCount = 0;
  for (int i = zero; i < list.y; i++) {
    int row = listed(list.x + i);
    vec4 around = part(row, AROUND);
    vec3 to = around.xyz - rayFrom, aside = to - dot(to, rayWay) * rayWay;
    float begin = NEVER, end = -NEVER, rate = 0.0;
    if (dot(aside, aside) <= around.w) {
      vec4 x = part(row, 0), y = part(row, 1), z = part(row, 2), p = vec4(rayFrom, 1.0);
      vec3 from = vec3(dot(x, p), dot(y, p), dot(z, p));
      vec3 way = vec3(dot(x.xyz, rayWay), dot(y.xyz, rayWay), dot(z.xyz, rayWay));
      vec4 least = part(row, LOW), most = part(row, HIGH);
      float square = dot(way, way), middle = -dot(from, way) / square;
      vec3 closest = from + middle * way;
      float left = least.w - dot(closest, closest);
      if (left > 0.0) {
        float wide = sqrt(left / square);
        vec3 a = (least.xyz - from) / way, b = (most.xyz - from) / way, first = min(a, b), last = max(a, b);
        begin = max(max(middle - wide, low), max(first.x, max(first.y, first.z)));
        end = min(min(middle + wide, high), min(last.x, min(last.y, last.z)));
        rate = most.w * sqrt(square);
      }
    }
    bool some = begin <= end;
#ifdef OTHERS
    int token = int(part(row, HEAD).x);
    if (token == INTERSECT) { // outside its ball nothing is left of what came before
      low = some ? begin : NEVER;
      high = some ? end : -NEVER;
    }
    float name = float(token < SUBTRACT ? row : -1 - row);
#else
    float name = float(row);
#endif
    if (!some || begin > sure) continue;
    if (slotCount == SLOTS) { // the farthest has to wait
      int far = 0;
      for (int j = zero; j < SLOTS; j++) if (slots[j].y > slots[far].y) far = j;
      sure = min(sure, max(begin, slots[far].y));
      if (begin >= slots[far].y) continue;
      for (int j = far; j < SLOTS - 1; j++) slots[j] = slots[j + 1];
      slotCount--;
    }
    slots[slotCount++] = vec4(name, begin, end, rate);
  }
  return sure;
}

// What a ray met: how far the first surface is, the way in media before it, whether one of these ends there.
float hit, fog;
bool soft;
#ifdef MEDIA
const int PIECES = 12;
vec2 pieces[PIECES]; // ways through media
int pieceCount;
bool seeing; // whether the ray is the eye's

void close(float begin, float end) {
  end = max(begin, end);
  if (seeing && pieceCount < PIECES) pieces[pieceCount++] = vec2(begin, end);
  fog += end - begin;
}
#endif

// Follow a ray: how far nothing can change, and up to GAP farther where the last distances let expect a surface.
void march(ivec2 list, vec3 from, vec3 way, float limit) {
  rayFrom = from;
  rayWay = way;
  hit = NEVER;
  fog = 0.0;
  soft = false;
  float t = -1.0, next = -1.0, past = -1.0, before = 0.0, low = 0.0, since = 0.0;
  bool within = false;
  int steps = 0;
  for (int window = zero; window < WINDOWS; window++) {
    float sure = gather(list, low, limit), until = -2.0, pace = 1.0;
    for (; steps < STEPS; steps++) {
      if (next > until) { // other objects are met
        float to = NEVER;
        for (int i = zero; i < slotCount; i++) {
          vec4 slot = slots[i];
          float at = slot.y > t ? slot.y : next;
          if (within && slot.z > t) at = min(at, slot.z);
          if (slot.x >= 0.0 && at <= slot.z) to = min(to, at);
        }
        if (to >= NEVER || to > sure) break;
        if (to > next) {
          past = to * (1.0 - 1e-6);
          before = 0.0;
        }
        next = to;
        until = sure;
        float rate = 1e-3;
        for (int i = zero; i < slotCount; i++) {
          vec4 slot = slots[i];
          if (slot.y > next) until = min(until, slot.y);
          else if (slot.z >= next) {
            until = min(until, slot.z);
            rate = max(rate, slot.w);
          }
        }
        pace = 1.0 / rate;
      }
      t = next;
      meet(t);
      float far = abs(state), root;
#ifdef MEDIA
#ifdef MIXED
      bool is = dense > 0.5;
      if (state < 0.0 && is) far = change;
#else
      const bool is = true;
#endif
      bool inside = state < 0.0 && is, done = state < 0.0 && !is;
      root = max(past + (t - past) * (before / max(before + far, 1e-9)), t - GAP);
      if (done) {
        if (within) { // where a medium ends the distance need not be 0
          float a = past, b = t;
          for (int i = zero; i < HALVINGS; i++) {
            float half_ = 0.5 * (a + b);
            meet(half_);
            if (state < 0.0 && dense > 0.5) a = half_; else b = half_;
          }
          close(since, b);
          hit = b;
          soft = true;
        } else {
          hit = root;
        }
        return;
      }
      if (inside && !within) since = root;
      if (!inside && within) close(since, root);
      within = inside;
#else
      if (state < TOUCH) {
        hit = max(past + (t - past) * (before / max(before + far, 1e-9)), t - GAP);
        return;
      }
#endif
      float safe = far * pace, hope = 1.05 * far * (t - past) / max(before - far, 1e-12) + TOUCH;
      next = t + min(max(hope, safe), safe + GAP);
      past = t;
      before = far;
    }
    if (sure >= limit || steps >= STEPS) break;
    low = sure;
  }
#ifdef MEDIA
  if (within) close(since, t);
#endif
}
