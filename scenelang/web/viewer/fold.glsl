
// The fold of the objects that a point meets, and of the groups of the stream that are open there.

const int KIND = 7, DRAWS = 8, CLIPS = 16, HOLDS = 32, ADDS = 64; // of a row's first number; as in solid.js
const int ALL = 1 << 24; // behind every row
const float NOTHING = 10.0; // world units: how far away a group is at most for what it joins

const float EQUAL = 2e-6; // world units: surfaces so near each other lie in one plane
const float NEARLY = 1e-4; // and a point so near them is on them

// What is at a point, as far as rays ask.
float state; // distance
float dense; // whether it is a medium; where there are several densities, 1 more than that
#ifdef DENSE
const float OTHER = 1e-3; // a difference of kinds
#else
const float OTHER = 0.5;
#endif
float change; // how far the kind of material is sure to stay

// What else is seen of it: colour, the same with plain colours in place of textures', gradient of the distance.
vec3 seen, even, slope;
#ifdef GLOWS
vec3 shine; // light that it sends out, of media over their density
#define SHINE shine
#else
#define SHINE vec3(0.0)
#endif

// Nothing is there.
void clear(bool all) {
  state = EMPTY;
  dense = 0.0;
  if (all) seen = even = slope = vec3(0.0);
#ifdef GLOWS
  shine = vec3(0.0);
#endif
}

// Let something join by a kind of the cell, as far as rays ask.
void join(int kind_, float narrow, float d, float medium) {
  int at = kind_ * CELL;
  float before = state, take = taking(at, d * narrow, before * narrow), keep = 1.0 - take;
  vec4 made = cells[at];
  state = take * (d * made.x - keep * made.y / narrow) + keep * before;
#ifdef MIXED
  float gap = abs(d);
  if (kind_ == SMOOTH) gap = min(gap, abs(before - d) / 2.0);
  if (abs(dense - medium) > OTHER) change = min(change, gap);
  dense += kind(at, d * narrow, before * narrow) * (medium - dense);
#endif
}

// The same of all that is seen.
void join(int kind_, float narrow, float d, float medium, vec3 g, vec3 rgb, vec3 plain, vec3 sent) {
  int at = kind_ * CELL;
  float before = state, own = d * narrow, past = before * narrow;
  float take = taking(at, own, past), keep = 1.0 - take;
  vec4 made = cells[at], line = cells[at + 1] * narrow;
  float bump = made.y / narrow;
  state = take * (d * made.x - keep * bump) + keep * before;
  float rate = take > 0.0 && take < 1.0 ? d * made.x - before - (1.0 - 2.0 * take) * bump : 0.0;
  slope = (take * made.x + rate * line.x) * g + (keep + rate * line.y) * slope;
  float gate = painting(at, own, past);
  // on surfaces in one plane the earlier one's material shows, whichever rounding puts in front
  if (kind_ != SMOOTH && abs(d - before) < EQUAL && abs(d) < NEARLY && dense + medium < OTHER) gate = 0.0;
  dense += kind(at, own, past) * (medium - dense);
#ifdef TEXTURES
  even += gate * (plain - even);
#endif
  seen += gate * (rgb - seen);
#ifdef GLOWS
  shine += gate * (sent - shine);
#endif
}

#ifdef DEPTH
bool looking; // whether all that is seen is asked for
int depth, open; // how many groups are open, and the part of the innermost: kind, narrow, last row, around it
struct State { float state, dense; vec3 seen, even, slope; } below[DEPTH]; // what open groups will join
#ifdef GLOWS
vec3 shines[DEPTH];
#endif

// End groups that a row stands behind.
void leave(int row) {
  while (depth > zero) {
    vec4 group = part(0, open);
    if (row <= int(group.z)) break;
    float d = min(state, NOTHING), medium = dense;
    vec3 g = slope, rgb = seen, plain = even, sent = SHINE;
    State outer = below[--depth];
    state = outer.state;
    dense = outer.dense;
    open = int(group.w);
    if (!looking) {
      join(int(group.x), group.y, d, medium);
      continue;
    }
    seen = outer.seen;
    even = outer.even;
    slope = outer.slope;
#ifdef GLOWS
    shine = shines[depth];
#endif
    join(int(group.x), group.y, d, medium, g, rgb, plain, sent);
  }
}

// And begin those that it is in.
void enter(int row) {
  leave(row);
  int group = int(part(row, PAINT).w), more = 0;
  for (int g = group; g != open; g = int(part(0, g).w)) more++;
  for (; more > zero; more--) {
#ifdef GLOWS
    shines[depth] = shine;
#endif
    below[depth++] = State(state, dense, seen, even, slope);
    clear(looking);
  }
  open = group;
}
#endif

// Begin at a point.
void begin(bool all) {
  clear(all);
#ifdef DEPTH
  looking = all;
  depth = open = 0;
#endif
}
