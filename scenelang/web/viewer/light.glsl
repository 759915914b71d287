
// What rays from the eye see under the light.

const float INTO = 3e-5; // behind a surface where its material is asked for

#ifdef MEDIA
const vec3 NODES = vec3(0.1127016654, 0.5, 0.8872983346), WEIGHTS = vec3(5.0, 8.0, 5.0) / 18.0; // of Gauss
const float EVEN = 2.0; // how much more evenly than the light that the medium takes nodes lie
const float LEAST = 0.04; // of what is seen, that a piece has to have a part of to be cut
const float LONG = 2.0; // world units: longer pieces are cut
const float STEEP = 1.2; // how much more light the last node may get than the first
const float NARROW = 0.8; // cosine: pieces that the light sees under a larger angle are cut
// tangents of angles at the light
const float CUTS[8] = float[](-14.0, -3.7, -1.0, -0.27, 0.27, 1.0, 3.7, 14.0);
const int PARTS = 3; // of pieces of which the nodes do not tell enough

vec3 glow, evenGlow; // light that media send towards the eye

// Light from a piece of a ray: from three nodes, or those of its parts where these do not tell enough.
void scatter(ivec2 list, vec3 way, float begin, float end, float before, float sigma) {
  vec3 total = vec3(0.0), evenTotal = vec3(0.0);
  float share = 0.0, first = 0.0, last = 0.0;
  int once = 0;
  bool woven = false, edge = false;
  for (int i = zero; i < 3 + 3 * PARTS; i++) {
    int node = i % 3;
    if (i == 3) {
      if (share <= LEAST || !(edge || woven || last > STEEP * first || end - begin > LONG)) break;
      total = evenTotal = vec3(0.0);
    }
    float size = end - begin, from = begin;
    if (i >= 3) {
      size /= float(PARTS);
      from += size * float(i / 3 - 1);
    }
    float taken = 1.0 - exp(-sigma / EVEN * size), left = 1.0 - NODES[node] * taken;
    float t = from - log(left) * (EVEN / sigma);
    float weight = WEIGHTS[node] * EVEN * taken * left * exp(-before - sigma * (from - begin));
    vec3 p = EYE + t * way;
    look(list, p);
    vec3 own = seen, plain = even;
    woven = woven || worn;
    vec3 shone = SHINE, light = HAZE(p);
    int reached = 0; // by which lamps
    EACH_LAMP {
      float clear;
      light += sent(p, clear);
      reached += clear > 0.0 ? 1 << lamp : 0;
    }
    total += weight * (own * light + shone);
    evenTotal += weight * (plain * light + shone);
    share += weight;
    last = weight * dot(plain * light + shone, vec3(1.0));
    if (i == 0) first = last, once = reached;
    else if (i < 3 && reached != once) edge = true;
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
  look(list, EYE + low * way);
  first = even + SHINE;
  for (int i = zero; i < 16; i++) {
    bool halving = high < NEVER;
    float t = halving ? 0.5 * (low + high) : min(low + size, piece.y - 0.02 * size);
    if (t <= low) return halving ? low : piece.y;
    look(list, EYE + t * way);
    vec3 here = even + SHINE;
    if (halving ? dot(abs(here - first), vec3(1.0)) < dot(abs(here - last), vec3(1.0))
      : dot(abs(here - first), vec3(1.0)) <= JUMP) {
      low = t;
      first = halving ? first : here;
    } else {
      high = t;
      last = halving ? last : here;
    }
  }
  return high < NEVER ? low : piece.y;
}
#endif
#endif

// What a ray from the eye sees, premultiplied, and the same with plain colours.
void shade(vec3 way, ivec2 list, float px, out vec4 light, out vec4 plain) {
  vec3 sky = mix(stage.horizon, stage.zenith, clamp(2.0 * way.y, 0.0, 1.0));
  light = stage.transparent ? vec4(0.0) : vec4(sky, 1.0);
  float limit = stage.ground.on && EYE.y > stage.ground.y && way.y < 0.0 ? (stage.ground.y - EYE.y) / way.y : NEVER;
#ifdef MEDIA
  pieceCount = 0;
  seeing = true;
#endif
  march(list, EYE, way, limit);
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
        vec3 was = slope, wore = seen, plainly = even, shone = SHINE;
        float off = state;
        look(list, EYE + (t + INTO) * way);
        if (i == 1 && dot(slope, slope) < 0.01) { // past an edge, where nothing is
          slope = was, seen = wore, even = plainly, state = off;
#ifdef GLOWS
          shine = shone;
#endif
          t -= ahead;
        }
        towards = dot(slope, way);
        ahead = clamp(towards < -0.02 ? -state / towards : state > 3.0 * INTO ? GAP : -INTO, -GAP, GAP);
        if (edge || i == 1 || abs(state) <= 3.0 * INTO) break;
        t += ahead;
      }
      if (!edge) t += INTO + ahead;
      n = slope * ((towards > 0.0 ? -1.0 : 1.0) / max(length(slope), 1e-12));
      colour = seen;
      other = even;
      haze = SHINE;
#ifdef TEXTURES
      if (px > 0.0 && worn && !edge) { // the mean of what the pixel's samples see of the plane there
        colour = vec3(0.0);
        vec3 ray = way * t, base = EYE + way * (t + INTO);
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
    vec3 p = EYE + t * way;
    if (!surface) {
      float kept = exp(-dot(p.xz, p.xz) / (stage.ground.fade * stage.ground.fade));
      colour = other = kept * stage.ground.rgb;
      haze = (1.0 - kept) * stage.horizon;
    }
#ifdef SKY
    vec3 all = surface ? arriving(p, n) : arrivingDown(p);
#else
    vec3 all = vec3(AMBIENT_EVEN + AMBIENT_UP * n.y);
#endif
    EACH_LAMP all += sent(p, n, edge);
    light = vec4(colour * all + haze, 1.0);
    plain = vec4(other * all + haze, 1.0);
  }
#ifdef MEDIA
  if (pieceCount > 0) {
    glow = evenGlow = vec3(0.0);
    float before = 0.0;
    for (int i = zero; i < pieceCount; i++) {
      vec2 piece = pieces[i];
      float from = piece.x, sigma = SIGMA(i);
      for (int j = zero; j < 9 && from < piece.y; j++) { // by colours
        float to = piece.y;
#ifdef COLOURED
        if (j < 8) to = lasting(list, way, from, piece);
#endif
        float low = from;
        for (int k = zero; k <= 8 * LAMPS && low < to; k++) { // by the angles at lamps, where these are wide
          float high = to;
          EACH_LAMP {
            vec3 off = LAMP - EYE, a = off - from * way, b = off - to * way;
            float middle = dot(off, way), aside = max(length(off - middle * way), NEAREST);
            if (dot(a, b) <= NARROW * length(a) * length(b)) {
              for (int c = zero; c < 8; c++) {
                float cut = middle + CUTS[c] * aside;
                if (cut > low) high = min(high, cut);
              }
            }
          }
          scatter(list, way, low, high, before + sigma * (low - piece.x), sigma);
          low = high;
        }
        from = to;
      }
      before += sigma * (piece.y - piece.x);
    }
    float clear = exp(-thick);
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
  more = vec4(min(dense, 1.0), 0.0, 0.0, 0.0);
}
#else
layout(location = 0) out vec4 picture;
#ifdef FOUR
uniform sampler2D once, shown;
uniform int along; // samples along a side of a pixel
const float CONTRAST = 0.04; // pixels that differ more from between their neighbours are sampled so often

vec4 near(ivec2 at) {
  return texelFetch(shown, clamp(at, ivec2(0), ivec2(canvas.xy) - 1), 0);
}
#else
layout(location = 1) out vec4 brightness;
#endif

// Premultiplied and sRGB-encoded.
vec4 encoded(vec4 light) {
  vec3 x = clamp(stage.camera.exposure * light.rgb / max(light.a, 1e-6), 0.0, 1.0);
  vec3 curved = 1.055 * pow(max(x, vec3(1e-9)), vec3(1.0 / 2.4)) - 0.055;
  x = mix(curved, 12.92 * x, vec3(lessThanEqual(x, vec3(0.0031308))));
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
  bool even_ = max(max(bend.x, bend.y), max(bend.z, bend.w)) <= CONTRAST;
  if (even_ && min(canvas.x, canvas.y) > 1.0) return; // a line of pixels shows too little of what changes
  const bool whole = false; // whether a sample stands for all of its pixel
#else
  const int along = 1;
  const bool whole = true;
#endif
  int samples = along * along;
  for (int i = zero; i < samples; i++) {
    sampleAt = i;
    vec2 off = (vec2(i % along, i / along) + 0.5) / float(along) - 0.5;
    vec2 at = (gl_FragCoord.xy + off - 0.5 * canvas.xy) * canvas.z;
    shade(normalize(forward + at.x * right + at.y * up), list, whole ? canvas.z : 0.0, one, plain);
    light += one / float(samples);
  }
#ifndef FOUR
  brightness = sqrt(clamp(vec4(stage.camera.exposure * plain.rgb, plain.a), 0.0, 1.0));
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
