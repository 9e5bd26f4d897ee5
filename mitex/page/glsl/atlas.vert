#version 300 es
// The faces of a mesh laid out in a square, two to a cell, each a little larger than it is: what is beyond a
// face shows its border, so that no seam shows.
precision highp float;
precision highp int;
uniform int cells;      // along a side
uniform vec2 legs;      // start and length of a face's legs, in cells
uniform float growth;   // of the faces
flat out uint face;
out vec3 barycentric;

void main() {
  int index = gl_VertexID / 3, k = gl_VertexID % 3;
  vec3 corner = vec3(k == 0, k == 1, k == 2);
  barycentric = 1.0 / 3.0 + (corner - 1.0 / 3.0) * (1.0 + growth);
  vec2 place = legs.x + legs.y * barycentric.yz;
  if (index % 2 == 1) place = 1.0 - place;
  int cell = index / 2;
  vec2 at = (vec2(float(cell % cells), float(cell / cells)) + place) / float(cells);
  gl_Position = vec4(2.0 * at - 1.0, 0.0, 1.0);
  face = uint(index);
}
