
// The stage, what lamps send, and what comes from everywhere.

const float CLEAR = 2e-4; // before a surface where rays from the light end

uniform Stage stage; // as scenelang/compiler/spaces.py has it; `on` of a part that is there
uniform vec3 forward, right, up; // the camera's; forward over the tangent of half the angle of view
uniform vec3 canvas; // width, height, world units of a pixel at the focus
uniform ivec4 grid; // pixels along a side, cells in a row; first of the light's, these along a side of a cube

int sampleAt; // which one of a pixel

#define EYE stage.camera.eye
#if LAMPS > 1
int lamp; // the one that is asked for
#define EACH_LAMP for (lamp = zero; lamp < LAMPS; lamp++)
#else
const int lamp = 0;
#define EACH_LAMP
#endif
#define LAMP stage.lights[lamp].position
#define POWER (stage.lights[lamp].power * stage.lights[lamp].rgb)

// The cell of directions from the lamp.
ivec2 lampCell(vec3 way) {
  vec3 a = abs(way);
  int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
  vec3 turned_ = axis == 0 ? way : axis == 1 ? way.yzx : way.zxy;
  float side = float(grid.w);
  ivec2 at = ivec2(clamp((turned_.yz / abs(turned_.x) * 0.5 + 0.5) * side, 0.0, side - 1.0));
  int face = 2 * axis + (turned_.x > 0.0 ? 0 : 1);
  return cell(grid.z + ((6 * lamp + face) * grid.w + at.y) * grid.w + at.x);
}

// What of the lamp's light reaches a point: on a surface, or in a medium where something opaque may begin.
float lit(vec3 p, bool edge) {
  vec3 way = p - LAMP;
  float r = length(way);
  way /= max(r, 1e-9);
  march(lampCell(way), LAMP, way, r - (edge ? 0.0 : CLEAR));
  return hit < NEVER ? 0.0 : exp(-fog);
}

#ifdef SKY
uniform sampler3D around; // moments of light at nodes, in blocks three beside each other: scenelang/web/volume.py
uniform vec4 lattice; // the first node, and how far nodes lie apart
uniform vec3 nodes_; // their numbers
uniform sampler2D floor_; // what the ground receives
uniform vec4 plane; // its middle, scale and spread
const float FREE = 1e-3; // what a node counts that lies in a solid or behind the surface

vec4 moment(ivec3 at, int k) {
  return texelFetch(around, at + ivec3(k % 3, k / 3, 0) * ivec3(nodes_.zyx), 0);
}

// What surfaces receive.
vec3 arriving(vec3 p, vec3 n) {
  vec3 at = clamp((p - lattice.xyz) / lattice.w, vec3(0.0), nodes_ - 1.001), cell_ = floor(at), light = vec3(0.0);
  float all = 0.0;
  for (int i = zero; i < 8; i++) {
    vec3 off = vec3(i & 1, i >> 1 & 1, i >> 2), part_ = mix(1.0 - (at - cell_), at - cell_, off);
    ivec3 node = ivec3((cell_ + off).zyx);
    vec4 first = moment(node, 0);
    float ahead = dot(cell_ + off - at, n);
    float weight = (part_.x * part_.y * part_.z + 1e-4) * max(FREE, first.a * clamp(1.0 + 2.0 * ahead, 0.0, 1.0));
    vec3 mean = first.rgb, x = moment(node, 7).rgb, y = moment(node, 8).rgb;
    vec3 once = n.x * moment(node, 1).rgb + n.y * moment(node, 2).rgb + n.z * moment(node, 3).rgb;
    vec3 mixed = n.x * n.y * moment(node, 4).rgb + n.y * n.z * moment(node, 5).rgb + n.z * n.x * moment(node, 6).rgb;
    vec3 twice = n.x * n.x * x + n.y * n.y * y + n.z * n.z * (mean - x - y) + 2.0 * mixed;
    light += weight * max(0.375 * mean + 2.0 * once + 1.875 * twice, 0.0);
    all += weight;
  }
  return light / all;
}

vec3 arrivingDown(vec3 p) {
  vec2 off = (p.xz - plane.xy) / plane.z;
  float side = float(textureSize(floor_, 0).x);
  vec2 at = clamp(asinh(off) / plane.w * 0.5 + 0.5, 0.0, 1.0) * (side - 1.0) + 0.5;
  return texture(floor_, at.yx / side).rgb;
}

#ifdef MEDIA
// What a medium receives.
vec3 haze(vec3 p) {
  vec3 at = clamp((p - lattice.xyz) / lattice.w + 0.5, vec3(0.5), nodes_ - 0.5) + vec3(0.0, 3.0 * nodes_.y, 0.0);
  return texture(around, at.zyx / vec3(textureSize(around, 0))).rgb;
}
#define HAZE(p) haze(p)
#endif
#else
#define HAZE(p) vec3(AMBIENT_EVEN)
#endif

#ifdef SOFT
#define RADIUS_ stage.lights[lamp].radius
const float GOLDEN = 2.399963; // radians
const int SAMPLES = 16, FIRST = 6, BEAMS = 4; // of a lamp, of these which may tell, and for media

// The light that surfaces receive of a lamp of power 1 that nothing hides, by the cosine at which they see its middle (Snyder 1996).
float form(float cos_, float far, float radius) {
  float h = max(far / radius, 1.0), x = sqrt(h * h - 1.0), sin_ = sqrt(max(1.0 - cos_ * cos_, 1e-12));
  if (far <= radius || cos_ * h <= -1.0) return 0.0;
  if (cos_ * h >= 1.0) return cos_ / (far * far);
  float y = clamp(-x * cos_ / sin_, -1.0, 1.0), edge = sin_ * sqrt(1.0 - y * y), slope_ = edge / max(x, 1e-6);
  float low = (cos_ * acos(y) - x * edge) / (h * h) + acos(1.0 / sqrt(1.0 + slope_ * slope_));
  return max(low, 0.0) / (3.1415927 * radius * radius);
}

// The part of that which arrives at a point, on a surface with a normal or in a medium with none.
float shared(vec3 p, vec3 n, bool edge, int count) {
  vec3 to = LAMP - p;
  float far = length(to), radius = RADIUS_, sin_ = radius / far, deep = 1.0 - sqrt(max(1.0 - sin_ * sin_, 0.0));
  if (far <= radius) return 0.0;
  to /= far;
  vec3 u = normalize(cross(to, abs(to.y) < 0.9 ? vec3(0, 1, 0) : vec3(1, 0, 0))), v = cross(to, u);
  ivec2 list = lampCell(-to);
  float turn = 6.2831853 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))) + 0.618 * float(sampleAt));
  float open_ = 0.0, all = 0.0, least = 1.0, most = 0.0;
  for (int i = zero; i < count; i++) {
    int k = count - 1 - i;
    float cos_ = 1.0 - deep * (float(k) + 0.5) / float(count), angle = GOLDEN * float(k) + turn;
    float aside = sqrt(1.0 - cos_ * cos_);
    vec3 way = cos_ * to + aside * (cos(angle) * u + sin(angle) * v);
    float weight = dot(n, n) > 0.5 ? max(dot(n, way), 0.0) : 1.0;
    if (weight <= 0.0) continue;
    float t = far * cos_ - sqrt(max(radius * radius - far * far * aside * aside, 0.0));
    march(list, p + t * way, -way, t - (edge ? 0.0 : CLEAR));
    float clear = hit < NEVER ? 0.0 : exp(-fog);
    open_ += weight * clear;
    all += weight;
    least = min(least, clear);
    most = max(most, clear);
    if (i + 1 == FIRST && most - least < 0.02) break;
  }
  return open_ / max(all, 1e-9);
}
#endif

// A lamp's light on a surface at p, and in a medium.
vec3 sent(vec3 p, vec3 n, bool edge) {
  vec3 to = LAMP - p;
  float r = max(length(to), NEAREST), facing = dot(n, to) / r;
  if (POWER == vec3(0.0)) return POWER;
#ifdef SOFT
  if (RADIUS_ > 0.0) {
    float whole = form(facing, r, RADIUS_);
    return whole > 0.0 ? POWER * (whole * shared(p + LIFT * n, n, edge, SAMPLES)) : vec3(0.0);
  }
#endif
  return facing > 0.0 ? POWER * (facing / (r * r) * lit(p + LIFT * n, edge)) : vec3(0.0);
}

#ifdef MEDIA
vec3 sent(vec3 p, out float clear) {
  float r = max(length(LAMP - p), NEAREST);
#ifdef SOFT
  if (RADIUS_ > 0.0) {
    float rim = sqrt(max(1.0 - RADIUS_ * RADIUS_ / (r * r), 0.0));
    clear = shared(p, vec3(0.0), false, BEAMS);
    return POWER * (clear / (2.0 * r * r * (1.0 + rim)));
  }
#endif
  clear = lit(p, false);
  return POWER * (clear / (4.0 * r * r));
}
#endif
