#version 300 es
// The maps of the pixels in the light of `mitex render`'s studio: a key light from the upper left and a dome,
// metallic-roughness with F0 = 0.04 (GGX, Smith, Schlick), sRGB without a film curve.
precision highp float;
precision highp int;
uniform highp usampler2D ids;
uniform highp sampler2D colour, bent, plain, spot, shadows, ground;
uniform mat4 light;
uniform vec3 eye, key, right, up, back, paper;
uniform vec2 slopes, size;
uniform float radius, floor, extent, exposure, relief;
uniform int mode;
layout(location = 0) out vec4 shown;

const vec3 GROUND = vec3(0.22, 0.21, 0.20), SKY = vec3(1.05, 1.11, 1.18);
const vec3 KEY = vec3(2.865, 2.722, 2.507);  // irradiance of the key light
const float SPREAD = 0.2;                     // its angular radius [rad]
const float SOFTEST = 0.1;                    // half width of its softest shadow, in its picture
const vec3 BOUNCE = vec3(0.55, 0.545, 0.54);  // radiance of the floor
const float PI = 3.14159265359, TURN = 6.28318530718;

vec3 dome(float y) {
  return mix(mix(GROUND, BOUNCE, smoothstep(0.1, -0.2, y)), SKY, clamp((y + 0.4) / 1.4, 0.0, 1.0));
}

// Irradiance / pi of the dome on a plane with this normal: a fit of the integral.
vec3 domeDiffuse(float y) {
  vec3 free = mix(GROUND, SKY, 0.3275 + 0.3734 * y + 0.061 * y * y);
  return free + (BOUNCE - GROUND) * 0.5 * (1.0 - y);
}

// A place of `count` on a disk of radius 1. They turn from pixel to pixel (Jimenez 2014), so that there is grain in
// place of bands.
vec2 onDisk(int k, int count) {
  float first = TURN * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
  float turn = first + float(k) * 2.39996;
  return sqrt((float(k) + 0.5) / float(count)) * vec2(cos(turn), sin(turn));
}

// How much of the key light arrives: the farther what is in the way, the softer its shadow. What is in the way is
// looked for as far around as the softest shadow reaches; else shadows would end at an edge.
float lit(vec3 position, vec3 normal) {
  vec4 seen = light * vec4(position + normal * 0.012 * radius, 1.0);
  vec3 at = seen.xyz * 0.5 + 0.5;
  if (any(greaterThan(abs(seen.xy), vec2(1.0 + 2.0 * SOFTEST)))) return 1.0;
  float sum = 0.0, blockers = 0.0, depths = 0.0, limit = min(at.z - 0.004, 0.9999);
  for (int k = 0; k < 16; k++) {
    float depth = texture(shadows, at.xy + SOFTEST * onDisk(k, 16)).r;
    if (depth < limit) {
      blockers += 1.0;
      depths += depth;
    }
  }
  if (blockers == 0.0) return 1.0;
  float softness = clamp(SPREAD * 1.1 * (min(at.z, 2.0) - depths / blockers), 0.002, SOFTEST);
  for (int k = 0; k < 32; k++) {
    sum += texture(shadows, at.xy + softness * onDisk(k, 32)).r < limit ? 0.0 : 1.0;
  }
  return sum / 32.0;
}

vec3 toLinear(vec3 srgb) {
  return mix(srgb / 12.92, pow((srgb + 0.055) / 1.055, vec3(2.4)), step(0.04045, srgb));
}

vec3 toScreen(vec3 linear) {
  linear = clamp(linear, 0.0, 1.0);
  return mix(linear * 12.92, 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, linear));
}

// Bends a normal where the height changes, for looks that have no normal map.
vec3 embossed(ivec2 at, vec3 normal, vec3 position) {
  ivec2 last = ivec2(size) - 1;
  vec4 x = texelFetch(spot, min(at + ivec2(1, 0), last), 0), y = texelFetch(spot, min(at + ivec2(0, 1), last), 0);
  if (x.w == 0.0 || y.w == 0.0) return normal;
  float here = texelFetch(colour, at, 0).a;
  vec3 dx = x.xyz - position, dy = y.xyz - position, r1 = cross(dy, normal), r2 = cross(normal, dx);
  float det = dot(dx, r1);
  if (abs(det) < 1e-12) return normal;
  float hx = texelFetch(colour, min(at + ivec2(1, 0), last), 0).a - here;
  float hy = texelFetch(colour, min(at + ivec2(0, 1), last), 0).a - here;
  return normalize(normal - relief * (hx * r1 + hy * r2) / det);
}

// A normal that does not point away from the eye, as those of details and of coarse meshes do at outlines.
vec3 towards(vec3 view, vec3 normal) {
  return normalize(normal + view * max(0.05 - dot(normal, view), 0.0));
}

vec3 surface(ivec2 at, vec4 here) {
  vec4 c = texelFetch(colour, at, 0), b = texelFetch(bent, at, 0), p = texelFetch(plain, at, 0);
  vec3 view = normalize(eye - here.xyz), flat_ = p.xyz, n = b.xyz;
  if (texelFetch(ids, at, 0).w == 1u && dot(flat_, view) < 0.0) {  // seen from behind
    flat_ = -flat_;
    n = -n;
  }
  flat_ = towards(view, flat_);
  if (relief > 0.0) n = embossed(at, n, here.xyz);
  n = towards(view, n);
  float roughness = max(b.w, 0.05), alpha = roughness * roughness, open = here.w;
  vec3 base = toLinear(c.rgb) * p.w;
  float facing = clamp(dot(n, view), 0.02, 1.0);
  float sun = clamp(dot(n, key), 0.0, 1.0);
  float arriving = sun > 0.0 ? lit(here.xyz, flat_) * smoothstep(-0.1, 0.1, dot(flat_, key)) : 0.0;
  vec3 halfway = normalize(key + view);
  float fresnel = 0.04 + 0.96 * pow(1.0 - clamp(dot(view, halfway), 0.0, 1.0), 5.0);
  float wide = min(alpha + 0.5 * SPREAD, 1.0);
  float c2 = clamp(dot(n, halfway), 0.0, 1.0), w2 = wide * wide, d = c2 * c2 * (w2 - 1.0) + 1.0;
  float highlight = w2 / (PI * d * d) * (alpha / wide) * (alpha / wide);
  float smith = 0.5 / max(mix(2.0 * sun * facing, sun + facing, alpha), 1e-4);
  vec3 direct = KEY * sun * arriving * (base / PI + fresnel * highlight * smith);
  // The dome: diffuse, and a fit of what a rough surface mirrors of it (Karis 2014).
  vec3 mirrored = reflect(-view, n);
  vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
  float a004 = min(r.x * r.x, exp2(-9.28 * facing)) * r.x + r.y;
  float strength = 0.04 * (-1.04 * a004 + r.z) + 1.04 * a004 + r.w;
  vec3 ambient = open * (base * domeDiffuse(n.y) + strength * mix(dome(mirrored.y), domeDiffuse(mirrored.y), roughness));
  return direct + ambient;
}

// What of the dome reaches the floor: softer away from the object, where its shadows of single directions would show.
float groundLight(vec2 at, float apart) {
  float sum = 0.0;
  for (int k = 0; k < 12; k++) sum += texture(ground, at + (0.01 + 0.12 * apart) * onDisk(k, 12)).r;
  return sum / 12.0;
}

// Paper, with the shadow of the object where it is the floor.
vec3 backdrop(vec3 way) {
  float down = (floor - eye.y) / min(way.y, -1e-4);
  if (way.y >= 0.0 || down <= 0.0) return paper;
  vec3 place = eye + down * way;
  vec2 at = place.xz / extent * 0.5 + 0.5;
  float apart = length(place.xz) / extent;
  float open = apart < 1.0 ? mix(groundLight(at, apart), 1.0, smoothstep(0.5, 1.0, apart)) : 1.0;
  float shade = (0.54 * lit(place, vec3(0.0, 1.0, 0.0)) + 0.80 * min(open, 1.0)) / 1.34;
  return paper * mix(shade, 1.0, smoothstep(2.0, 6.0, length(place.xz) / radius));
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 here = texelFetch(spot, at, 0);
  vec2 unit = (gl_FragCoord.xy / size * 2.0 - 1.0) * slopes;
  bool hit = any(notEqual(texelFetch(plain, at, 0).xyz, vec3(0.0)));
  vec4 c = texelFetch(colour, at, 0);
  vec3 light = hit ? surface(at, here) : backdrop(normalize(unit.x * right + unit.y * up - back));
  vec3 value = toScreen(light * exp2(exposure));
  if (hit && mode == 1) value = c.rgb;
  if (hit && mode == 2) value = texelFetch(bent, at, 0).xyz * 0.5 + 0.5;
  if (hit && mode == 3) value = vec3(c.a);
  if (hit && mode == 4) value = vec3(texelFetch(bent, at, 0).w);
  if (hit && mode == 5) value = vec3(texelFetch(plain, at, 0).w);
  if (hit && mode == 6) value = mix(vec3(0.16, 0.20, 0.25), vec3(0.95, 0.72, 0.35), c.r);
  shown = vec4(value, 1.0);
}
