#version 300 es
// What the smooth interpolation reads: the states, and below them their derivatives along x, y and z, which
// are the rows of mitex.mesh.gradients.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
//: SAMPLERS
uniform usampler2D rows, links;
uniform sampler2D slopes;     // weights of the neighbours, by link
uniform sampler2D ownSlopes;  // of the cell itself
uniform int height, count;
//: OUTPUTS

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  int axis = at.y / height - 1;
  at.y %= height;
  if (at.y * WIDTH + at.x >= count) {
    //: NOTHING
    return;
  }
  if (axis < 0) {
    //: COPY
    return;
  }
  float own = texelFetch(ownSlopes, at, 0)[axis];
  //: OWN
  uvec2 row = texelFetch(rows, at, 0).xy;
  for (uint k = row.x; k < row.x + row.y; k++) {
    ivec2 place = ivec2(int(k) & (LIST - 1), int(k) / LIST);
    int link = int(texelFetch(links, place, 0).x);
    ivec2 other = ivec2(link & (WIDTH - 1), link / WIDTH);
    float weight = texelFetch(slopes, place, 0)[axis];
    //: ADD
  }
}
