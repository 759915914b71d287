
// Rays: the balls that one passes, and the way along it.

const float BEHIND = 3e-5; // world units behind where a surface is foreseen that it is asked for
const float ROUNDING = 2e-7; // of distances, as a part of how far and large things are: what is less deep is not met
const float GAP = 0.009; // by which steps may go beyond what is certain
const int STEPS = 800; // of a ray
const int WINDOWS = 16; // of a ray that passes more balls than it keeps
const int HALVINGS = 16; // of the way on which a medium gives way to a solid

vec3 rayFrom, rayWay;
// The balls that a ray passes: row, -1 less it of one that does not draw; begin, end, rate. Less half of one that adds
// in a group; the rate is less than 0 where what was before ends outside of the ball.
vec4 slots[SLOTS];
int slotCount;
float large; // half of how wide the largest of them is

// Let a point of the ray meet the objects in whose balls it is.
void meet(float t) {
  begin(false);
  change = EMPTY;
  bool touched = false;
  vec3 p = rayFrom + t * rayWay;
  for (int i = slotCount - 1; i >= zero; i--) {
    vec4 slot = slots[i];
    bool outside = t < slot.y || t > slot.z;
#ifdef DEPTH
    if (slot.w >= 0.0)
#endif
    if (outside) continue;
    int row = int(slot.x);
#ifdef OTHERS
    if (slot.x < 0.0) {
      if (!touched) continue;
      row = int(-1.0 - slot.x);
    }
#endif
    touched = true;
    vec4 head = part(row, HEAD);
    int kind_ = int(head.x) & KIND;
#ifdef DEPTH
    enter(row);
    if (outside) { // nothing is left of what came before
      if (kind_ > SMOOTH) clear(false);
      continue;
    }
#endif
    vec3 q = mapped(row, 0, p);
#ifdef TURNS
    q = turned(part(row, MORE), q);
#endif
    float medium = 0.0;
#ifdef MIXED
    medium = part(row, LOOK).w;
#endif
    join(kind_, head.w, leaf(row, head, q) * head.z, medium);
  }
#ifdef DEPTH
  leave(ALL);
#endif
  change = min(change, abs(state));
}

// From where on a ray needs a ball.
float needed(vec4 slot) {
#ifdef DEPTH
  if (slot.w < 0.0) return -NEVER;
#endif
  return slot.y;
}

// Keep the balls of a list that the ray passes between low and high; returns up to where these are all.
float gather(ivec2 list, float low, float high) {
  float sure = high;
  slotCount = 0;
  large = 0.0;
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
        vec3 a = (least.xyz - from) / way, b = (most.xyz - from) / way;
        vec3 first = min(a, b), last = max(a, b);
        begin = max(max(middle - wide, low), max(first.x, max(first.y, first.z)));
        end = min(min(middle + wide, high), min(last.x, min(last.y, last.z)));
        rate = most.w * sqrt(square);
      }
    }
    bool some = begin <= end;
    float name = float(row);
    int flags = int(part(row, HEAD).x);
#ifdef OTHERS
    if ((flags & CLIPS) > 0) { // outside its ball nothing is left of what came before
      low = some ? begin : NEVER;
      high = some ? end : -NEVER;
    }
    if ((flags & DRAWS) == 0) name = -1.0 - name;
#endif
#ifdef DEPTH
    if ((flags & (DRAWS | ADDS)) == ADDS) name -= 0.5;
    if ((flags & HOLDS) > 0) {
      if (!some) begin = NEVER, end = -NEVER;
      rate = min(-rate, -1e-30);
    } else
#endif
    if (!some || begin > sure) continue;
    if (slotCount == SLOTS) { // the farthest has to wait
      int far = 0;
      for (int j = zero; j < SLOTS; j++) if (needed(slots[j]) > needed(slots[far])) far = j;
      float mine = needed(vec4(name, begin, end, rate));
      sure = min(sure, max(mine, needed(slots[far])));
      if (mine >= needed(slots[far])) continue;
      for (int j = far; j < SLOTS - 1; j++) slots[j] = slots[j + 1];
      slotCount--;
    }
    large = max(large, sqrt(around.w));
    slots[slotCount++] = vec4(name, begin, end, rate);
  }
  return sure;
}

// What a ray met: how far the first surface is, how thick media before it are, whether one of these ends there.
float hit, fog;
bool soft;
#ifdef MEDIA
const int PIECES = 12;
vec2 pieces[PIECES]; // ways through media
int pieceCount;
bool seeing; // whether the ray is the eye's
#ifdef DENSE
float density, densities[PIECES]; // where the ray is, and of pieces
#define SIGMA(i) densities[i]
#else
const float density = EXTINCTION;
#define SIGMA(i) EXTINCTION
#endif

void close(float begin, float end) {
  end = max(begin, end);
  if (seeing && pieceCount < PIECES) {
#ifdef DENSE
    densities[pieceCount] = density;
#endif
    pieces[pieceCount++] = vec2(begin, end);
  }
  fog += density * (end - begin);
}
#endif

// Follow a ray: steps go as far as nothing can change, and up to GAP farther where the last two distances let
// expect a surface.
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
#ifdef DEPTH
          if (fract(slot.x) > 0.0 && slot.y > t) to = min(to, slot.y);
#endif
        }
#if defined(MEDIA) && defined(OTHERS)
        if (within && to < NEVER) { // in a medium steps end where something may cut it
          for (int i = zero; i < slotCount; i++) if (slots[i].x < 0.0 && slots[i].y > t) to = min(to, slots[i].y);
        }
#endif
        if (to >= NEVER || to > sure) break;
        if (to > next) {
          past = to * (1.0 - 1e-6);
          before = 0.0;
        }
        next = to > next ? to + BEHIND : to;
        until = sure;
        float rate = 1e-3;
        for (int i = zero; i < slotCount; i++) {
          vec4 slot = slots[i];
          if (slot.y > next) until = min(until, slot.y);
          else if (slot.z >= next) {
            until = min(until, slot.z);
            rate = max(rate, abs(slot.w));
          }
        }
        pace = 1.0 / rate;
      }
      t = next;
      meet(t);
      float far = abs(state), root;
      bool deep = state < -ROUNDING * (t + large);
#ifdef MEDIA
#ifdef MIXED
      bool is = dense > 0.5;
      if (state < 0.0 && is) far = change;
#else
      const bool is = true;
#endif
      bool inside = state < 0.0 && is, done = deep && !is;
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
#ifdef DENSE
      if (inside && within && abs(dense - 1.0 - density) > 1e-3) { // one medium gives way to another
        float a = past, b = t, own = dense - 1.0;
        for (int i = zero; i < HALVINGS; i++) {
          float half_ = 0.5 * (a + b);
          meet(half_);
          if (abs(dense - 1.0 - density) > 1e-3) b = half_; else a = half_;
        }
        close(since, b);
        since = b;
        density = own;
      } else if (inside && !within) density = dense - 1.0;
#endif
      if (inside && !within) since = root;
      if (!inside && within) close(since, root);
      within = inside;
#else
      if (deep) {
        hit = max(past + (t - past) * (before / max(before + far, 1e-9)), t - GAP);
        return;
      }
#endif
      float safe = far * pace, hope = before > 0.0 ? 1.05 * far * (t - past) / max(before - far, 1e-12) : 0.0;
#ifdef MEDIA
      if (state < 0.0 && !inside) hope = 7.0 * BEHIND; // not yet deep: it may be thin
#else
      if (state < 0.0) hope = 7.0 * BEHIND;
#endif
      next = t + min(max(hope + BEHIND, safe), safe + GAP);
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
