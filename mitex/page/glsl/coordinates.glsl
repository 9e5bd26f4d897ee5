// Local coordinates of the decoder, see mitex.methods.nca.decoder.coordinates.
const float TURN = 6.28318530718;

// The waves of the two powers of two around the length of the edges, and the weights that they have.
vec3 coarse, fine;
vec2 octaves;

void scaleWaves(vec3 position) {
  float octave = log2(edge), below = floor(octave), share = octave - below;
  coarse = position * exp2(-below);
  fine = position * exp2(-below - 1.0);
  octaves = sqrt(vec2(1.0 - share, share));
}

float wave(vec4 way) {
  vec2 cycles = fract(vec2(dot(coarse, way.xyz), dot(fine, way.xyz)) + way.w);
  return dot(octaves, cos(TURN * cycles));
}

vec3 sortedBarycentrics() {
  vec3 b = barycentric;
  float low = min(b.x, b.y), high = max(b.x, b.y);
  float most = max(high, b.z), least = min(low, b.z), middle = max(low, min(high, b.z));
  float first = most <= 0.5 ? 9.0 * (most - 1.0 / 3.0) * (most - 1.0 / 3.0) : 1.0 - 3.0 * (1.0 - most) * (1.0 - most);
  float second = middle <= 1.0 / 3.0 ? 6.0 * middle * middle : 1.0 - 12.0 * (0.5 - middle) * (0.5 - middle);
  float third = 1.0 - 9.0 * (1.0 / 3.0 - least) * (1.0 / 3.0 - least);
  return 2.0 * vec3(first, second, third) - 1.0;
}

vec2 symmetricPolynomials() {
  vec3 b = barycentric;
  return vec2(6.0 * (b.x * b.y + b.y * b.z + b.z * b.x) - 1.0, 54.0 * b.x * b.y * b.z - 1.0);
}
