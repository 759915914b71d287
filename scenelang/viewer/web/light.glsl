
// What rays from the eye see under the light. Colours are linear.

const float INTO = 3e-5; // behind a surface where its material is asked for
const float CLEAR = 2e-4; // before a surface where rays from the light end

uniform vec3 eye, forward, right, up; // the camera; forward over the tangent of half the angle of view
uniform vec3 lamp, power, horizon, zenith;
uniform vec4 ground; // colour, height
uniform bool grounded, transparent;
uniform vec3 canvas; // width, height, world units of a pixel at the focus
uniform ivec4 grid; // pixels along a side, cells in a row; first of the light's, these along a side of a cube
#ifdef TEXTURES
uniform sampler2D pictures;
uniform usampler3D colours;
#endif

// What is at a point: colour, the same with plain colours in place of textures', gradient of the distance.
vec3 seen, even, slope;
bool worn; // whether there is a texture

#ifdef TEXTURES
vec3 hued(vec3 rgb, float turns) {
  float value = max(rgb.r, max(rgb.g, rgb.b)), least = min(rgb.r, min(rgb.g, rgb.b)), chroma = value - least;
  float sixth = 1.0 / max(chroma, 1e-12);
  float hue = value == rgb.r ? (rgb.g - rgb.b) * sixth
    : value == rgb.g ? (rgb.b - rgb.r) * sixth + 2.0 : (rgb.r - rgb.g) * sixth + 4.0;
  hue = fract(hue / 6.0 + turns) * 6.0;
  return least + chroma * clamp(vec3(abs(hue - 3.0) - 1.0, 2.0 - abs(hue - 2.0), 2.0 - abs(hue - 4.0)), 0.0, 1.0);
}

vec3 texel(ivec3 at) {
  return vec3(texelFetch(colours, at, 0).rgb) / 65535.0;
}

// The colour that a row's texture has at a point of the leaf.
vec3 textured(int row, vec4 paint, vec3 q) {
  vec4 u = part(row, PLACE), v = part(row, PLACE + 1), size = part(row, GRID);
  vec3 rgb;
  if (paint.x < 1.5) {
    vec2 sides = size.zw, place = vec2(dot(u.xyz, vec3(q.xy, 1.0)), dot(v.xyz, vec3(q.xy, 1.0)));
    place = fract(place) * sides - 0.5;
    vec2 cell = floor(place), share = place - cell;
    ivec2 a = ivec2(mod(cell, sides)), b = ivec2(mod(cell + 1.0, sides)), top = ivec2(0, int(u.w));
    vec3 low = mix(texelFetch(pictures, a + top, 0).rgb, texelFetch(pictures, ivec2(b.x, a.y) + top, 0).rgb, share.x);
    vec3 high = mix(texelFetch(pictures, ivec2(a.x, b.y) + top, 0).rgb, texelFetch(pictures, b + top, 0).rgb, share.x);
    rgb = mix(low, high, share.y);
  } else {
    vec3 place = (clamp(q, -1.0, 1.0) + 1.0) * (0.5 * (size.z - 1.0));
    vec3 cell = clamp(floor(place), 0.0, size.z - 2.0), share = place - cell;
    ivec3 at = ivec3(cell.zyx) + ivec3(0, 0, int(u.w));
    rgb = vec3(0.0);
    for (int i = zero; i < 8; i++) {
      ivec3 off = ivec3(i & 1, i >> 1 & 1, i >> 2);
      vec3 part_ = mix(1.0 - share.zyx, share.zyx, vec3(off));
      rgb += part_.x * part_.y * part_.z * texel(at + off);
    }
  }
  for (int i = zero; i < int(paint.z); i++) {
    vec4 op = part(int(paint.y), i);
    if (op.x < 0.5) rgb *= op.yzw;
    else if (op.x < 1.5) rgb = mix(rgb, vec3(dot(rgb, vec3(0.2126, 0.7152, 0.0722))), op.y);
    else rgb = hued(rgb, op.y);
    rgb = clamp(rgb, 0.0, 1.0);
  }
  return rgb;
}
#endif

// Let a point a little off another one, p, meet the objects of a list in whose balls that is.
void look(ivec2 list, vec3 p, vec3 off) {
  bool touched = false;
  worn = false;
  state = EMPTY;
  dense = 0.0;
  seen = even = slope = vec3(0.0);
  for (int i = list.y - 1; i >= zero; i--) {
    int row = listed(list.x + i);
    vec4 head = part(row, HEAD);
    vec3 q = mapped(row, 0, p), g;
    int token = int(head.x);
    if (dot(q, q) > part(row, LOW).w) {
#ifdef OTHERS
      if (token == INTERSECT) { // nothing is left of what came before
        touched = worn = false;
        state = EMPTY;
        dense = 0.0;
        seen = even = slope = vec3(0.0);
      }
#endif
      continue;
    }
#ifdef OTHERS
    if (token >= SUBTRACT && !touched) continue;
#endif
    touched = true;
    mat3 way = transpose(mat3(part(row, 0).xyz, part(row, 1).xyz, part(row, 2).xyz));
    q += way * off;
#ifdef TURNS
    q = turned(part(row, MORE), q, way);
#endif
    float d = leaf(row, head, q, g) * head.z, before = state;
    g = g * way * head.z;
    int at = token * CELL;
    float own = d * head.w, past = before * head.w;
    float take = taking(at, own, past), keep = 1.0 - take;
    vec4 made = cells[at], line = cells[at + 1] * head.w;
    float bump = made.y / head.w;
    state = take * (d * made.x - keep * bump) + keep * before;
    float rate = take > 0.0 && take < 1.0 ? d * made.x - before - (1.0 - 2.0 * take) * bump : 0.0;
    slope = (take * made.x + rate * line.x) * g + (keep + rate * line.y) * slope;
    vec4 own_ = part(row, LOOK);
    float gate = painting(at, own, past);
    dense += kind(at, own, past) * (own_.w - dense);
#ifdef TEXTURES
    vec4 paint = part(row, PAINT);
    vec3 plain = own_.rgb;
    if (paint.x > 0.5) {
      worn = true;
      plain = 0.4 + 0.6 * fract(vec3(0.618034, 0.754878, 0.569840) * float(row + 1));
      own_.rgb = textured(row, paint, q);
    }
    even += gate * (plain - even);
#endif
    seen += gate * (own_.rgb - seen);
  }
#ifndef TEXTURES
  even = seen;
#endif
}

void look(ivec2 list, vec3 p) {
  look(list, p, vec3(0.0));
}

ivec2 cell(int at) {
  return ivec2(listed(2 * at), listed(2 * at + 1));
}

// What of the light reaches a point: on a surface, or in a medium where something opaque may begin.
float lit(vec3 p, bool edge) {
  vec3 way = p - lamp, a;
  float r = length(way);
  way /= max(r, 1e-9);
  a = abs(way);
  int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
  vec3 turned_ = axis == 0 ? way : axis == 1 ? way.yzx : way.zxy;
  ivec2 at = ivec2(clamp((turned_.yz / abs(turned_.x) * 0.5 + 0.5) * float(grid.w), 0.0, float(grid.w) - 1.0));
  int face = 2 * axis + (turned_.x > 0.0 ? 0 : 1);
  march(cell(grid.z + (face * grid.w + at.y) * grid.w + at.x), lamp, way, r - (edge ? 0.0 : CLEAR));
  return hit < NEVER ? 0.0 : exp(-EXTINCTION * fog);
}

#ifdef MEDIA
const vec3 NODES = vec3(0.1127016654, 0.5, 0.8872983346), WEIGHTS = vec3(5.0, 8.0, 5.0) / 18.0; // of Gauss
const float EVEN = 2.0; // how much more evenly than the light that the medium takes nodes lie
const float LEAST = 0.04; // of what is seen, that a piece has to have a part of to be cut
const float LONG = 2.0; // world units: longer pieces are cut
const float STEEP = 1.2; // how much more light the last node may get than the first
const float NARROW = 0.8; // cosine: pieces that the light sees under a larger angle are cut
const float CUTS[8] = float[](-14.0, -3.7, -1.0, -0.27, 0.27, 1.0, 3.7, 14.0); // tangents of angles at the light
const int PARTS = 3; // of pieces of which the nodes do not tell enough

vec3 glow, evenGlow; // light that media send towards the eye

// Light from a piece of a ray: from three nodes, and from those of three parts where these do not tell enough.
void scatter(ivec2 list, vec3 way, float begin, float end, float before) {
  vec3 total = vec3(0.0), evenTotal = vec3(0.0);
  float share = 0.0, first = 0.0, last = 0.0, free = 0.0;
  bool woven = false;
  for (int i = zero; i < 3 + 3 * PARTS; i++) {
    int node = i % 3;
    if (i == 3) {
      bool edge = free > 0.5 && free < 2.5;
      if (share <= LEAST || !(edge || woven || last > STEEP * first || end - begin > LONG)) break;
      total = evenTotal = vec3(0.0);
    }
    float size = end - begin, from = begin;
    if (i >= 3) {
      size /= float(PARTS);
      from += size * float(i / 3 - 1);
    }
    float taken = 1.0 - exp(-EXTINCTION / EVEN * size), left = 1.0 - NODES[node] * taken;
    float t = from - log(left) * (EVEN / EXTINCTION);
    float weight = WEIGHTS[node] * EVEN * taken * left * exp(-EXTINCTION * (before + from - begin));
    vec3 p = eye + t * way;
    look(list, p);
    vec3 own = seen, plain = even;
    woven = woven || worn;
    float r = max(length(lamp - p), NEAREST), clear = lit(p, false);
    vec3 light = weight * (AMBIENT_EVEN + power * (clear / (4.0 * r * r)));
    total += own * light;
    evenTotal += plain * light;
    share += weight;
    free += clear > 0.0 ? 1.0 : 0.0;
    last = dot(plain * light, vec3(1.0));
    if (i == 0) first = last;
  }
  glow += total;
  evenGlow += evenTotal;
}

#ifdef COLOURED
const float JUMP = 0.03; // of colours that differ

// Up to where a piece of a ray, from a place on, keeps its colour or changes it slowly.
float lasting(ivec2 list, vec3 way, float from, vec2 piece) {
  float size = (piece.y - piece.x) / 8.0, low = from + 0.02 * size, high = NEVER;
  vec3 first, last;
  look(list, eye + low * way);
  first = even;
  for (int i = zero; i < 16; i++) {
    bool halving = high < NEVER;
    float t = halving ? 0.5 * (low + high) : min(low + size, piece.y - 0.02 * size);
    if (t <= low) return halving ? low : piece.y;
    look(list, eye + t * way);
    if (halving ? dot(abs(even - first), vec3(1.0)) < dot(abs(even - last), vec3(1.0))
      : dot(abs(even - first), vec3(1.0)) <= JUMP) {
      low = t;
      first = halving ? first : even;
    } else {
      high = t;
      last = halving ? last : even;
    }
  }
  return high < NEVER ? low : piece.y;
}
#endif
#endif

// What a ray from the eye sees, premultiplied, and the same with plain colours.
void shade(vec3 way, ivec2 list, float px, out vec4 light, out vec4 plain) {
  vec3 sky = mix(horizon, zenith, clamp(2.0 * way.y, 0.0, 1.0));
  light = transparent ? vec4(0.0) : vec4(sky, 1.0);
  float limit = grounded && eye.y > ground.w && way.y < 0.0 ? (ground.w - eye.y) / way.y : NEVER;
#ifdef MEDIA
  pieceCount = 0;
  seeing = true;
#endif
  march(list, eye, way, limit);
#ifdef MEDIA
  seeing = false;
  float thick = fog;
#endif
  float t = hit;
  bool surface = t < NEVER, edge = soft;
  plain = light;
  if (surface || limit < NEVER) {
    vec3 n = vec3(0.0, 1.0, 0.0), haze = vec3(0.0), colour, other;
    if (surface) {
      float ahead = 0.0, towards = 0.0;
      for (int i = zero; i < 2; i++) {
        look(list, eye + (t + INTO) * way);
        towards = dot(slope, way);
        ahead = clamp(towards < -0.02 ? -state / towards : -INTO, -GAP, GAP);
        if (edge || i == 1 || abs(state) <= 3.0 * INTO) break;
        t += ahead;
      }
      if (!edge) t += INTO + ahead;
      n = slope * ((towards > 0.0 ? -1.0 : 1.0) / max(length(slope), 1e-12));
      colour = seen;
      other = even;
#ifdef TEXTURES
      if (px > 0.0 && worn && !edge) { // the mean of what the pixel's samples see of the plane there
        colour = vec3(0.0);
        vec3 ray = way * t, base = eye + way * (t + INTO);
        float towards_ = dot(n, ray), wide = px * t * dot(way, forward) / dot(forward, forward);
        if (abs(towards_) < 1e-6) towards_ = -1e-6;
        for (int i = zero; i < 4; i++) {
          vec3 off = wide * (right * (float(i & 1) * 0.5 - 0.25) + up * (float(i >> 1) * 0.5 - 0.25));
          float ratio = clamp(dot(n, off) / towards_, -0.5, 0.5);
          look(list, base, (off - ray * ratio) / (1.0 + ratio));
          colour += 0.25 * seen;
        }
      }
#endif
    } else {
      t = limit;
    }
    vec3 p = eye + t * way;
    if (!surface) {
      float kept = exp(-dot(p.xz, p.xz) / FADE);
      colour = other = kept * ground.rgb;
      haze = (1.0 - kept) * horizon;
    }
    vec3 to = lamp - p;
    float r = max(length(to), NEAREST), facing = max(dot(n, to) / r, 0.0) / (r * r);
    vec3 all = vec3(AMBIENT_EVEN + AMBIENT_UP * n.y);
    if (facing > 0.0 && power != vec3(0.0)) all += power * (facing * lit(p + LIFT * n, edge));
    light = vec4(colour * all + haze, 1.0);
    plain = vec4(other * all + haze, 1.0);
  }
#ifdef MEDIA
  if (pieceCount > 0) {
    glow = evenGlow = vec3(0.0);
    float before = 0.0, middle = dot(lamp - eye, way), aside = max(length(lamp - eye - middle * way), NEAREST);
    for (int i = zero; i < pieceCount; i++) {
      vec2 piece = pieces[i];
      float from = piece.x;
      for (int j = zero; j < 9 && from < piece.y; j++) { // by colours
        float to = piece.y;
#ifdef COLOURED
        if (j < 8) to = lasting(list, way, from, piece);
#endif
        vec3 a = lamp - eye - from * way, b = lamp - eye - to * way;
        bool narrow = dot(a, b) > NARROW * length(a) * length(b);
        for (int k = zero; k < 9; k++) { // by the angle at the light, where that is wide
          float low = from, high = to;
          if (!narrow) {
            if (k > 0) low = max(low, middle + CUTS[k - 1] * aside);
            if (k < 8) high = min(high, middle + CUTS[k] * aside);
          }
          if (low < high) scatter(list, way, low, high, before + low - piece.x);
          if (narrow) break;
        }
        from = to;
      }
      before += piece.y - piece.x;
    }
    float clear = exp(-EXTINCTION * thick);
    light = vec4(light.rgb * clear + glow, 1.0 - (1.0 - light.a) * clear);
    plain = vec4(plain.rgb * clear + evenGlow, light.a);
  }
#endif
}

#ifdef POINTS
uniform sampler2D places;
layout(location = 0) out vec4 found;
layout(location = 1) out vec4 more;

void main() {
  met = 0.0;
  look(cell(0), texelFetch(places, ivec2(gl_FragCoord.xy), 0).xyz);
  found = vec4(state, seen);
  more = vec4(dense, 0.0, 0.0, 0.0);
}
#else
layout(location = 0) out vec4 picture;
#ifdef FOUR
uniform sampler2D once, shown;
const float CONTRAST = 0.04; // pixels that differ more from between their neighbours are sampled four times

vec4 near(ivec2 at) {
  return texelFetch(shown, clamp(at, ivec2(0), ivec2(canvas.xy) - 1), 0);
}
#else
layout(location = 1) out vec4 brightness;
#endif

// Premultiplied and sRGB-encoded.
vec4 encoded(vec4 light) {
  vec3 x = clamp(light.rgb / max(light.a, 1e-6), 0.0, 1.0);
  x = mix(1.055 * pow(max(x, vec3(1e-9)), vec3(1.0 / 2.4)) - 0.055, 12.92 * x, vec3(lessThanEqual(x, vec3(0.0031308))));
  return vec4(x * light.a, light.a);
}

void main() {
  met = 0.0;
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  ivec2 list = cell(1 + pixel.y / grid.x * grid.y + pixel.x / grid.x);
  vec4 light = vec4(0.0), one, plain;
#ifdef FOUR
  picture = texelFetch(once, pixel, 0);
  vec4 here = 2.0 * near(pixel);
  vec4 bend = max(abs(near(pixel + ivec2(1, 0)) + near(pixel - ivec2(1, 0)) - here),
    abs(near(pixel + ivec2(0, 1)) + near(pixel - ivec2(0, 1)) - here));
  if (max(max(bend.x, bend.y), max(bend.z, bend.w)) <= CONTRAST) return;
  const int samples = 4;
#else
  const int samples = 1;
#endif
  for (int i = zero; i < samples; i++) {
    vec2 off = samples == 1 ? vec2(0.0) : vec2(i & 1, i >> 1) * 0.5 - 0.25;
    vec2 at = (gl_FragCoord.xy + off - 0.5 * canvas.xy) * canvas.z;
    shade(normalize(forward + at.x * right + at.y * up), list, samples == 1 ? canvas.z : 0.0, one, plain);
    light += one / float(samples);
  }
#ifndef FOUR
  brightness = sqrt(clamp(plain, 0.0, 1.0));
#endif
#ifdef COUNT
#ifdef FOUR
  picture.x += met;
#else
  picture = vec4(met);
#endif
#else
  picture = encoded(light);
#endif
}
#endif
