// The framed network at points of the plane, as scenelang/drawing/neural/field.py computes it, and the pixels that
// take 4 or 16 samples, as in scenelang/drawing/neural/coverage.py. In front stand sizes and angles.glsl, behind it the
// decoders.

uniform sampler2D rows; // of each object: some texels, its steps, the place and the steps of its picture; of groups
uniform sampler2D lists; // of tiles, where each one's begins and its length; then texels of rows, four in one
uniform sampler2D nodes; // distances and curves of elements
uniform sampler2D texels; // of pictures
uniform vec4 cell[KINDS * (LINES + 2)]; // of each kind of join: lines in distance, state and 1; then candidate, bump
uniform vec4 background; // premultiplied
uniform vec2 size; // of the frame, pixels
uniform float px; // side of a pixel, world units; 0: single points
uniform float empty; // the state before the first object
uniform float widest; // of the blends, world units
uniform int most; // times that a pixel asks, 5 or 17; a number here would have compilers write the loop out
uniform float corner; // pixels from the centre to a sample, a little rounded up
uniform int tile; // side of a tile, pixels
uniform int across; // tiles in a row
#ifdef POINTS
uniform sampler2D points;
#endif
#ifdef OPERATIONS
#define SPEND(n) spent += float(n)
float spent = 0.0; // multiply-adds
#else
#define SPEND(n)
#endif
out vec4 shown;

const float FAR = 1e15; // leaf units: float32 holds its square
#define NEAR (corner + 0.49) // pixels: farther from an outline a pixel has one colour
#ifdef CLEAR
#define INK vec4 // premultiplied, with the coverage
#else
#define INK vec3
#endif
const float NARROW = 1.0 / 16.0; // of a pixel by a blend's width: above it colours change across the pixel
const float LEAST = 1e-4; // of a colour, that counts as part of what a point shows
const int BLENDS = 8, EVERYWHERE = 16, HIDES = 32; // flags of rows, over kinds of joins; as in plane.js
#ifdef SKINS
const int BODY = 5; // texels of a row before its steps, the last for its skin
#else
const int BODY = 4;
#endif
const int END = 1 << 24; // behind all texels

/** The place of a pixel's middle, 0, or of its samples from 1 on, pixels from the middle. */
vec2 place(int k) {
  int side = most > 5 ? 4 : 2;
  return k == 0 ? vec2(0) : (vec2((k - 1) % side, (k - 1) / side) + 0.5) / float(side) - 0.5;
}

float learned(int shape, vec2 q);

vec4 texel(sampler2D data, int at) {
  return texelFetch(data, ivec2(at & 1023, at >> 10), 0);
}

// ------------------------------------------------------------ the way to the leaf

/**
 * A point behind an object's steps.
 * @param spread radius of a disc around the point, world units; then of one in which the points of that lie
 */
vec2 local(vec2 p, int at, int steps, inout float spread) {
  for (int i = 0; i < steps; i++) {
    vec4 a = texel(rows, at++); // the upper row of a map and 0, or a turn's numbers and its rate
    if (a.w == 0.0) {
      vec4 b = texel(rows, at++);
      p = vec2(dot(a.xy, p) + a.z, dot(b.xy, p) + b.z);
      spread *= b.w;
      SPEND(5);
    } else {
      float radius = length(p);
      vec2 turn = direction(a.x * radius + dot(a.yz, p));
      p = vec2(dot(p, turn), dot(p, vec2(-turn.y, turn.x)));
      spread *= 1.0 + (radius + spread) * a.w;
      SPEND(26);
    }
    p = clamp(p, -FAR, FAR);
  }
  return p;
}

// ------------------------------------------------------------ elements

#ifdef SKINS
const int NEARER = 4; // as in scenelang/drawing/neural/assets.py
const float ALONG = 0.6;

/** Whether an object reaches farther out than its leaf. */
bool grows(int at) {
  return dot(texel(rows, at + 4).xyz, vec3(1.0)) > 0.0;
}
#endif

#ifdef NODES
float node(int at) {
  return texelFetch(nodes, ivec2(at & 2047, at >> 11), 0).r;
}

#endif
#ifdef GRIDS
float edge(int at, float share) {
  return mix(node(at), node(at + 1), share);
}

/** A distance by a grid over [-1, 1]^2, and beyond it the least that it can be. */
float lattice(vec2 q, int first, int side) {
  vec2 inside = clamp(q, -1.0, 1.0), off = q - inside;
  vec2 at = (inside + 1.0) * (0.5 * float(side - 1));
  ivec2 corner = min(ivec2(at), side - 2);
  vec2 share = at - vec2(corner);
  first += corner.x * side + corner.y;
  float found = mix(edge(first, share.y), edge(first + side, share.y), share.x);
  SPEND(12);
  return off == vec2(0) ? found : sqrt(found * found + dot(off, off));
}

#ifdef SKINS
/** About the point of an outline that is nearest to a point of the square, and the unit normal there. */
vec2 foot(vec2 q, int first, int side, out vec2 normal) {
  vec2 a = max(q - 1.0 / float(side - 1), -1.0), b = min(q + 1.0 / float(side - 1), 1.0);
  float across_ = lattice(vec2(b.x, q.y), first, side) - lattice(vec2(a.x, q.y), first, side);
  float up = lattice(vec2(q.x, b.y), first, side) - lattice(vec2(q.x, a.y), first, side);
  vec2 slope = vec2(across_, up) / (b - a);
  normal = slope / max(length(slope), 1e-9);
  return q - lattice(q, first, side) * normal;
}

/** A distance by a grid of what grows out of the square, as `GrownShape` of scenelang/drawing/neural/assets.py. */
float grown(vec2 q, int first, int side) {
  vec2 inside = clamp(q, -1.0, 1.0), normal, next;
  if (q == inside) return lattice(q, first, side);
  vec2 best = foot(inside, first, side, normal);
  for (int i = 0; i < NEARER; i++) {
    vec2 away = q - best;
    inside = clamp(best + ALONG * (away - dot(away, normal) * normal), -1.0, 1.0);
    vec2 found = foot(inside, first, side, next);
    if (length(q - found) >= length(away)) continue;
    best = found;
    normal = next;
  }
  return length(q - best);
}
#endif
#endif

#ifdef OUTLINES
const float WIDE = 4.0 / 3.0, LAST = 16.0; // as in scenelang/drawing/neural/outlines.py

vec2 pair(int at) {
  return vec2(node(at), node(at + 1));
}

float cross2(vec2 a, vec2 b) {
  return a.x * b.y - a.y * b.x;
}

/** A step of Newton's method towards the nearest point of a curve. */
float nearer(vec2 a, vec2 u, vec2 w, float t, vec2 q) {
  vec2 off = a + t * (u + t * w) - q, way = u + 2.0 * t * w;
  float speed = dot(way, way), bend = max(speed + 2.0 * dot(off, w), 0.25 * speed);
  return clamp(t - dot(off, way) / max(bend, 1e-12), 0.0, 1.0);
}

/**
 * A distance by curves, see scenelang/drawing/neural/outlines.py: how many cells there are along an axis, their
 * posts, where their lists of what may be nearest begin, and of what passes them, these lists, and pieces.
 */
float outlined(vec2 q, int first) {
  float radius = length(q), least = FAR, t = 0.0;
  q *= LAST / max(radius, LAST);
  vec2 place = clamp(q, -1.0, 1.0) * (WIDE - (WIDE - 1.0) / max(abs(q), vec2(1.0)));
  int side = int(node(first)), cells = side * side, starts = first + 1 + 3 * cells;
  ivec2 at = clamp(ivec2((place + WIDE) * (float(side) / (2.0 * WIDE))), 0, side - 1);
  int cell = at.y * side + at.x, passes = starts + cells + 1, lists = passes + cells + 1;
  int passing = lists + int(node(passes - 1)), pieces = passing + int(node(lists - 1)), best = pieces;
  int end = lists + int(node(starts + cell + 1));
  for (int k = lists + int(node(starts + cell)); k < end; k++) {
    int piece = pieces + 8 * int(node(k));
    vec2 a = pair(piece), u = pair(piece + 2), w = pair(piece + 4), way = pair(piece + 6) - a;
    float share = clamp(dot(q - a, way) / max(dot(way, way), 1e-12), 0.0, 1.0);
    if (w != vec2(0)) share = nearer(a, u, w, share, q);
    vec2 off = a + share * (u + share * w) - q;
    SPEND(20);
    if (dot(off, off) >= least) continue;
    least = dot(off, off);
    best = piece;
    t = share;
  }
  vec2 post = pair(first + 1 + 3 * cell), walk = q - post;
  float turns = node(first + 3 + 3 * cell);
  end = passing + int(node(passes + cell + 1));
  for (int k = passing + int(node(passes + cell)); k < end; k++) {
    int item = int(node(k)), piece = pieces + 8 * (item / 2);
    vec2 a = pair(piece), w = pair(piece + 4), c = pair(piece + 6), way = c - a, v = q - a;
    float beside = cross2(way, v), bent = cross2(way, w), off = cross2(v, w);
    bool left = beside >= 0.0;
    SPEND(16);
    if ((cross2(walk, a - post) >= 0.0) != (cross2(walk, c - post) >= 0.0) && left != (item % 2 == 1)) {
      turns += left ? 1.0 : -1.0;
    }
    if (left != bent > 0.0 && off * off < bent * (beside + off)) turns -= left ? 1.0 : -1.0;
  }
  vec2 a = pair(best), u = pair(best + 2), w = pair(best + 4);
  t = nearer(a, u, w, t, q);
  float away = length(a + t * (u + t * w) - q);
  SPEND(40);
  return (abs(turns) > 0.5 ? -away : away) + max(radius - LAST, 0.0);
}
#endif

#ifdef PICTURES
vec3 dot_of_picture(int first, ivec2 at, ivec2 sides) {
  at -= sides * ivec2(floor(vec2(at) / vec2(sides)));
  first += at.y * sides.x + at.x;
  return texelFetch(texels, ivec2(first & 2047, first >> 11), 0).rgb;
}

vec3 turned(vec3 rgb, float turns) {
  float value = max(max(rgb.r, rgb.g), rgb.b), chroma = value - min(min(rgb.r, rgb.g), rgb.b);
  vec3 gaps = (rgb.gbr - rgb.brg) / max(chroma, 1e-12);
  float hue = value == rgb.r ? gaps.r : value == rgb.g ? gaps.g + 2.0 : gaps.b + 4.0;
  hue = fract(hue / 6.0 + turns) * 6.0;
  vec3 shares = vec3(abs(hue - 3.0) - 1.0, 2.0 - abs(hue - 2.0), 2.0 - abs(hue - 4.0));
  return value - chroma + chroma * clamp(shares, 0.0, 1.0);
}

/** The colour of a gradient between stops at (u, v). */
vec3 graded(vec2 spot, int at, int count, bool straight) {
  float s = straight ? 0.5 * spot.x + 0.5 : length(spot);
  vec4 before = texel(rows, at);
  vec3 rgb = before.yzw;
  for (int i = 1; i < count; i++) {
    vec4 next = texel(rows, at + i);
    float over = next.x - before.x;
    rgb = mix(rgb, next.yzw, over > HARD ? clamp((s - before.x) / over, 0.0, 1.0) : step(next.x, s));
    before = next;
  }
  SPEND(8 * count);
  return rgb;
}

/** The colour of a picture, which repeats, at coordinates in it. */
vec3 pictured(vec2 spot, vec4 about) {
  spot = fract(spot) * about.xy - 0.5;
  ivec2 corner = ivec2(floor(spot)), sides = ivec2(about.xy);
  vec2 share = spot - vec2(corner);
  int first = int(about.z);
  vec3 above = mix(dot_of_picture(first, corner, sides),
                   dot_of_picture(first, corner + ivec2(1, 0), sides), share.x);
  vec3 below = mix(dot_of_picture(first, corner + ivec2(0, 1), sides),
                   dot_of_picture(first, corner + ivec2(1, 1), sides), share.x);
  SPEND(20);
  return mix(above, below, share.y);
}

/** The colour of a picture or a gradient at leaf coordinates. */
vec3 painted(vec2 q, int at) {
  vec4 a = texel(rows, at), b = texel(rows, at + 1), about = texel(rows, at + 2);
  vec2 spot = vec2(dot(a.xy, q) + a.z, dot(b.xy, q) + b.z);
  bool picture = about.x > 0.0;
  vec3 rgb = picture ? pictured(spot, about) : graded(spot, at + 3, int(about.y), about.x > -1.5);
  at += picture ? 3 : 3 + int(about.y);
  for (int i = 0; i < int(about.w); i++) {
    vec4 op = texel(rows, at + i);
    if (op.x == COLOR) rgb *= op.yzw;
    else if (op.x == GRAYSCALE) rgb += op.y * (dot(LUMA, rgb) - rgb);
    else rgb = turned(rgb, op.y);
    rgb = clamp(rgb, 0.0, 1.0);
    SPEND(6);
  }
  return rgb;
}
#endif

// ------------------------------------------------------------ the cell

float level(vec4 line, float narrow, float distance, float state) {
  return narrow * (line.x * distance + line.y * state) + line.z;
}

/** Whether no gate opens, however much farther away than a distance an object is. */
bool idle(int gate, float narrow, float distance, float state) {
  for (int k = 0; k <= LINES; k++) {
    vec4 line = cell[gate + k];
    if (line.x > 0.0 || level(line, narrow, distance, state) > 0.0) return false;
  }
  return true;
}

// What a point that has met some objects shows.
float state;
INK ink;
// How near to an outline a pixel around the point has more than one colour, world units, 0 for one of its
// samples; whether it has; whether colours change across it where nothing is seen, and whether a blend shows that.
float gap;
bool near, tied, doubtful;

/** How far a colour comes in. */
float paints(int gate, float narrow, float distance) {
  float paint = 0.0;
  for (int k = 1; k <= LINES; k++) paint = max(paint, level(cell[gate + k], narrow, distance, state));
  return min(paint, 1.0);
}

/** Note what a pixel's samples may see where an object joins whose outline is `room` about a point at most. */
void notice(int kind, float narrow, float distance, float paint, float room) {
  float margin = abs(state / UNIT - distance);
  near = near || abs(distance) < room;
  if (kind == SMOOTH) {
    doubtful = doubtful || (tied && paint > LEAST && paint < 1.0 - LEAST);
#ifdef PICTURES
    float width = BLEND / narrow;
    doubtful = doubtful || (px > NARROW * width && margin < width + corner * (px + room / NEAR));
#endif
  } else if (kind == UNION) {
    tied = tied || margin < 2.0 * corner * px;
#ifdef CLEAR
    near = near || (paint > 0.0 && abs(state) < gap * UNIT);
#endif
  }
}

void join(int gate, float narrow, float distance, float paint, INK own) {
#ifdef CLEAR
  if (gate == UNION) own += clamp(0.5 - state * SLOPE, 0.0, 1.0) * (1.0 - own.a) * ink;
#endif
  float take = clamp(level(cell[gate], narrow, distance, state), 0.0, 1.0);
  vec2 ends = cell[gate + LINES + 1].xy;
  state += take * (ends.x * distance - state) - take * (1.0 - take) * ends.y / narrow;
  ink += paint * (own - ink);
  SPEND(3 * (LINES + 1) + 11);
}

// ------------------------------------------------------------ groups

#ifdef DEPTH
INK below[DEPTH]; // colours and states that open groups will join
float under[DEPTH];
int depth = 0, open = 0; // how many are open, and the texel of the innermost: kind, narrow, last row, around it

/** End groups that an object, or the end, stands behind. */
void leave(int at) {
  while (depth > 0) {
    vec4 group = texel(rows, open);
    if (float(at) <= group.z) break;
    int kind = int(group.x), gate = kind * (LINES + 2);
    float distance = state / UNIT;
    INK own = ink;
    ink = below[--depth];
    state = under[depth];
    open = int(group.w);
    float paint = paints(gate, group.y, distance);
    if (gap > 0.0) notice(kind, group.y, distance, paint, gap);
    join(gate, group.y, distance, paint, own);
  }
}

/** Begin all groups that are not open yet, down to one. */
void enter(int group) {
  int more = 0;
  for (int g = group; g != open; g = int(texel(rows, g).w)) more++;
  for (; more > 0; more--) {
    under[depth] = state;
    below[depth++] = ink;
    state = empty;
    ink = INK(0.0);
  }
  open = group;
}
#endif

// Of the first objects of a tile what a pixel's middle said: a distance that its samples can do with, too.
#define KNOWN 32
const float SKIPPED = 3e38; // it changes nothing
const float OPEN = 2e38; // its outline is near, or a blend needs it exactly
float known[KNOWN];
int first = 0; // the last object that hides all before it

/** Let a point meet its objects; where `near` comes true the answer is of no use. */
void meet(vec2 p, ivec2 span) {
  state = empty;
  ink = INK(0.0);
  bool middle = gap > 0.0;
  near = tied = doubtful = false;
  for (int i = first; i < span.y; i++) {
    float distance = OPEN, room = 0.0;
    if (!middle && px > 0.0 && i < KNOWN) distance = known[i];
    if (distance == SKIPPED) continue;
    int at = int(texel(lists, span.x + (i >> 2))[i & 3]);
    vec4 a = texel(rows, at);
    float scale = a.x, narrow = a.y;
    int flags = int(a.z), steps = int(a.w), kind = flags & 7, gate = kind * (LINES + 2);
    vec4 c = texel(rows, at + 2), own = texel(rows, at + 3);
    bool bare = false; // whether its group holds nothing yet
#ifdef DEPTH
    leave(at);
    bare = int(c.w) != open;
#endif

    if (distance == OPEN) {
      // no decoder where the leaf is proved so far away that nothing changes
      vec4 b = texel(rows, at + 1);
      room = gap;
      vec2 q = local(p, at + BODY, steps, room);
      room *= scale;
      float radius = length(q);
      float least = own.a * max(max(abs(q.x) - b.x, abs(q.y) - b.y), radius - b.z) - room;
      SPEND(8 + 3 * (LINES + 1));
      bool skipped = bare ? kind > SMOOTH : least > 0.0 && idle(gate, narrow, least, state);
#ifndef POINTS
      skipped = skipped || scale * (radius - b.w) > room;
      if (middle && i < KNOWN) known[i] = SKIPPED;
#endif
      if (skipped) continue;
      distance = least;
#ifndef POINTS
      if ((flags & EVERYWHERE) == 0 || least < FARTHEST * widest)
#endif
      {
#ifdef GRIDS
#ifdef SKINS
        if (c.y > 0.0 && grows(at)) distance = grown(q, int(c.x), int(c.y)); else
#endif
        if (c.y > 0.0) distance = lattice(q, int(c.x), int(c.y)); else
#endif
#ifdef OUTLINES
        if (c.y < 0.0) distance = outlined(q, int(c.x)); else
#endif
        distance = learned(int(c.x), q);
#ifdef SKINS
        vec4 skin = texel(rows, at + 4);
        distance -= skin.x;
        distance = (skin.y > 0.0 ? abs(distance) - skin.y : distance) - skin.z;
#endif
        distance *= scale;
      }
    }
#ifdef DEPTH
    enter(int(c.w));
#endif

    float paint = paints(gate, narrow, distance);
    if (middle) {
      if (i < KNOWN) {
        bool exact = abs(distance) < room + ((flags & BLENDS) > 0 ? FARTHER * widest : 0.0);
        known[i] = exact ? OPEN : distance;
      }
      notice(kind, narrow, distance, paint, room);
      if ((flags & HIDES) > 0 && distance < -room) {
        first = i;
        near = tied = doubtful = false;
      }
    }
#ifdef PICTURES
    if (c.z > 0.0 && paint > LEAST) {
      // over a pixel, colours of pictures are a mean as they are of four samples
      own.rgb = vec3(0.0);
      int count = middle ? most - 1 : 1;
      for (int k = 0; k < count; k++) {
        vec2 spot = middle ? p + px * place(k + 1) : p;
        own.rgb += painted(local(spot, at + BODY, steps, room), at + int(c.z)) / float(count);
      }
    }
#endif
#ifdef CLEAR
    float opacity = 1.0 - 2.0 * fract(a.w); // behind the number of steps
    join(gate, narrow, distance, paint, opacity * vec4(own.rgb, 1.0));
#else
    join(gate, narrow, distance, paint, own.rgb);
#endif
  }
#ifdef DEPTH
  leave(END);
#endif
  near = near || abs(state) < gap * UNIT || (doubtful && state * SLOPE < 0.5);
}

void main() {
#ifdef POINTS
  int number = int(gl_FragCoord.x) + 1024 * int(gl_FragCoord.y);
  gap = 0.0;
  meet(texel(points, number).xy, ivec2(texel(lists, 0).xy));
  shown = vec4(state / UNIT, ink.rgb);
#else
  ivec2 at = ivec2(gl_FragCoord.xy) / tile, span = ivec2(texel(lists, at.y * across + at.x).xy);
  vec2 middle = (gl_FragCoord.xy - 0.5 * size) * px;
  vec4 sum = vec4(0.0);
  for (int k = 0; k < most; k++) {
    gap = k == 0 ? NEAR * px : 0.0;
    meet(middle + px * place(k), span);
    float alpha = clamp(0.5 - state * SLOPE, 0.0, 1.0);
#ifdef CLEAR
    vec4 picture = ink * alpha;
#else
    vec4 picture = vec4(ink * alpha, alpha);
#endif
    if (k > 0) {
      sum += picture / float(most - 1);
    } else if (!near) {
      sum = picture;
      break;
    }
  }
  shown = sum + (1.0 - sum.a) * background;
#endif
#ifdef OPERATIONS
  shown = vec4(spent);
#endif
}
