#version 300 es
// Whether a direction is free at the cell of this texel, or at this place of the floor.
precision highp float;
precision highp int;
uniform highp sampler2D depth, place, normals;
uniform mat4 light;
uniform vec3 direction;
uniform bool ground;
uniform float floor, extent, share;
layout(location = 0) out vec4 free;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 position = texelFetch(place, at, 0).xyz, normal = texelFetch(normals, at, 0).xyz;
  if (ground) {
    vec2 unit = gl_FragCoord.xy / 64.0 * 2.0 - 1.0;
    position = vec3(extent * unit.x, floor, extent * unit.y);
    normal = vec3(0.0, 1.0, 0.0);
  }
  float facing = dot(normal, direction);
  if (facing <= 0.0) {
    free = vec4(0.0);
    return;
  }
  vec4 seen = light * vec4(position, 1.0);
  vec3 inside = seen.xyz * 0.5 + 0.5;
  bool beyond = any(greaterThan(abs(seen.xy), vec2(1.0)));
  float hidden = !beyond && texture(depth, inside.xy).r < min(inside.z - 0.012, 0.9999) ? 1.0 : 0.0;
  free = vec4((1.0 - hidden) * facing * share);
}
