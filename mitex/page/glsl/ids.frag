#version 300 es
// Which point of the surface a pixel shows: the face, counted from 1, the bits of two barycentrics, and whether it is
// seen from behind.
precision highp float;
precision highp int;
flat in uint face;
in vec3 barycentric;
layout(location = 0) out uvec4 id;

void main() {
  vec3 inside = max(barycentric, 0.0);
  inside /= inside.x + inside.y + inside.z;
  id = uvec4(face + 1u, floatBitsToUint(inside.xy), gl_FrontFacing ? 0u : 1u);
}
