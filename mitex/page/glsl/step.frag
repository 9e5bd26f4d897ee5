#version 300 es
// One step of the automaton (Pajouheshgar et al. 2024, equations 1 to 3) for the cell of this texel.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
//: CONSTANTS
//: SAMPLERS
uniform usampler2D rows;   // first link, number of links
uniform usampler2D links;  // texel of the neighbour, bits of the direction to it
uniform uint phase;        // hash of step and seed
uniform int count;
uniform float regular;     // what the mean over the neighbours is multiplied by; 0 for their sum
#if GRAFT
uniform sampler2D shares;  // of the second rule
#endif
#if CONDITION
uniform sampler2D condition;
#endif
//: BOUNDS
//: BLOCKS
//: OUTPUTS

uint pcg(uint value) {
  uint state = value * 747796405u + 2891336453u;
  uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
  return (word >> 22u) ^ word;
}

vec4 held(vec4 state, vec4 low, vec4 high) {
  return min(max(state, low), high);
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  //: OWN
#if GRAFT
  float share0 = texelFetch(shares, at, 0).r;
#else
  const float share0 = 0.0;
#endif
  // The cells of a tile of 8 x 4 texels update together or not at all: whole groups of threads are idle in
  // half of the steps, which is what makes a step cost half.
  uint tile = uint((at.y >> 2) * (WIDTH >> 3) + (at.x >> 3));
  if (at.y * WIDTH + at.x >= count || pcg(tile + phase) >= 0x80000000u) {
    //: KEEP
    return;
  }
  uvec2 row = texelFetch(rows, at, 0).xy;
  //: ZERO
  for (uint k = row.x; k < row.x + row.y; k++) {
    uvec4 link = texelFetch(links, ivec2(int(k) & (LIST - 1), int(k) / LIST), 0);
    ivec2 place = ivec2(int(link.x) & (WIDTH - 1), int(link.x) / WIDTH);
    vec3 d = uintBitsToFloat(link.yzw);
    //: NEIGHBOUR
  }
  if (regular > 0.0) {
    float share = regular / max(float(row.y), 1.0);
    //: MEAN
  }
#if CONDITION
  vec4 told = texelFetch(condition, at, 0);
#endif
  //: CHANGES
  //: RULES
  //: NEXT
}
