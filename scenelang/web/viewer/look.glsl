
// What is at a point: distance, kind, colours, gradient. Colours are linear.

#ifdef TEXTURES
uniform sampler2D pictures;
uniform usampler3D colours;
#endif

bool worn; // whether there is a texture

#ifdef TEXTURES
vec3 hued(vec3 rgb, float turns) {
  float value = max(rgb.r, max(rgb.g, rgb.b)), least = min(rgb.r, min(rgb.g, rgb.b)), chroma = value - least;
  float sixth = 1.0 / max(chroma, 1e-12);
  float hue = value == rgb.r ? (rgb.g - rgb.b) * sixth
    : value == rgb.g ? (rgb.b - rgb.r) * sixth + 2.0 : (rgb.r - rgb.g) * sixth + 4.0;
  hue = fract(hue / 6.0 + turns) * 6.0;
  vec3 shares = vec3(abs(hue - 3.0) - 1.0, 2.0 - abs(hue - 2.0), 2.0 - abs(hue - 4.0));
  return least + chroma * clamp(shares, 0.0, 1.0);
}

vec3 texel(ivec2 at) {
  return texelFetch(pictures, at, 0).rgb;
}

vec3 texel(ivec3 at) {
  return vec3(texelFetch(colours, at, 0).rgb) / 65535.0;
}

// The colour of a gradient between stops at (u, v).
vec3 graded(vec2 spot, int row, int count, bool straight) {
  float s = straight ? 0.5 * spot.x + 0.5 : length(spot);
  vec4 before = part(row, 0);
  vec3 rgb = before.yzw;
  for (int i = 1; i < count; i++) {
    vec4 next = part(row, i);
    float over = next.x - before.x;
    rgb = mix(rgb, next.yzw, over > HARD ? clamp((s - before.x) / over, 0.0, 1.0) : step(next.x, s));
    before = next;
  }
  return rgb;
}

// The colour that a row's texture or gradient has at a point of the leaf.
vec3 textured(int row, vec4 paint, vec3 q) {
  vec4 u = part(row, PLACE), v = part(row, PLACE + 1), size = part(row, GRID);
  vec3 rgb;
  vec2 spot = vec2(dot(u.xyz, vec3(q.xy, 1.0)), dot(v.xyz, vec3(q.xy, 1.0)));
#ifdef TILTS
  spot += q.z * part(row, TILT).xy;
#endif
  if (paint.x > 2.5) {
    rgb = graded(spot, int(paint.y), int(v.w), paint.x < 3.5);
  } else if (paint.x < 1.5) {
    vec2 sides = size.zw, place = fract(spot) * sides - 0.5;
    vec2 cell = floor(place), share = place - cell;
    ivec2 a = ivec2(mod(cell, sides)), b = ivec2(mod(cell + 1.0, sides)), top = ivec2(0, int(u.w));
    rgb = mix(mix(texel(a + top), texel(ivec2(b.x, a.y) + top), share.x),
      mix(texel(ivec2(a.x, b.y) + top), texel(b + top), share.x), share.y);
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
    vec4 op = part(int(paint.y), int(v.w) + i);
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
  begin(true);
  for (int i = list.y - 1; i >= zero; i--) {
    int row = listed(list.x + i);
    vec4 head = part(row, HEAD);
    vec3 q = mapped(row, 0, p), g;
    int flags = int(head.x);
    bool outside = dot(q, q) > part(row, LOW).w;
#ifdef OTHERS
    if (outside && (flags & CLIPS) > 0) { // nothing is left of what came before
      touched = worn = false;
      begin(true);
    }
#endif
#ifdef DEPTH
    if ((flags & HOLDS) == 0)
#endif
    if (outside) continue;
#ifdef OTHERS
    if ((flags & DRAWS) == 0 && !touched) continue;
#endif
    touched = true;
#ifdef DEPTH
    enter(row);
    if (outside) {
      if ((flags & KIND) > SMOOTH) clear(true);
      continue;
    }
#endif
    mat3 way = linear(row, 0);
    q += way * off;
#ifdef TURNS
    q = turned(part(row, MORE), q, way);
#endif
    float d = leaf(row, head, q, g) * head.z;
    vec4 own = part(row, LOOK);
    vec3 plain = own.rgb;
#ifdef TEXTURES
    vec4 paint = part(row, PAINT);
    if (paint.x > 0.5) {
      worn = true;
      plain = 0.4 + 0.6 * fract(vec3(0.618034, 0.754878, 0.569840) * float(row + 1));
      own.rgb = textured(row, paint, q);
    }
#endif
    vec3 sent = vec3(0.0);
#ifdef GLOWS
    sent = part(row, GLOW).rgb;
#endif
    join(flags & KIND, head.w, d, own.w, g * way * head.z, own.rgb, plain, sent);
  }
#ifdef DEPTH
  leave(ALL);
#endif
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
