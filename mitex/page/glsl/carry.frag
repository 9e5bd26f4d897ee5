#version 300 es
// States that are carried along a field: what is upstream of each cell, a sum over others.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
//: SAMPLERS
uniform usampler2D sources;  // first part, number of parts
uniform usampler2D parts;    // texel of a cell, bits of its weight
//: OUTPUTS

void main() {
  uvec2 row = texelFetch(sources, ivec2(gl_FragCoord.xy), 0).xy;
  //: ZERO
  for (uint k = row.x; k < row.x + row.y; k++) {
    uvec4 part = texelFetch(parts, ivec2(int(k) & (LIST - 1), int(k) / LIST), 0);
    ivec2 place = ivec2(int(part.x) & (WIDTH - 1), int(part.x) / WIDTH);
    float weight = uintBitsToFloat(part.y);
    //: ADD
  }
}
