#version 300 es
// The corners of all faces, without attributes: what they are is in textures. `places` are positions in
// decoder units, or texture coordinates where the maps are baked.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
uniform usampler2D corners;
uniform sampler2D place;
uniform mat4 camera;
flat out uint face;
out vec3 barycentric;

void main() {
  int index = gl_VertexID / 3, k = gl_VertexID % 3;
  int slot = int(texelFetch(corners, ivec2(index & (LIST - 1), index / LIST), 0)[k]);
  vec3 position = texelFetch(place, ivec2(slot & (WIDTH - 1), slot / WIDTH), 0).xyz;
  gl_Position = camera * vec4(position, 1.0);
  face = uint(index);
  barycentric = vec3(k == 0, k == 1, k == 2);
}
