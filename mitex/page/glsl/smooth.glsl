// Nielson's side-vertex interpolant (1979), as mitex.textures.interpolation has it: weights of the corners'
// values and derivatives.
vec3 ofValue;
vec3 ofSlope[3];

void addSide(int k, float share) {
  int i = (k + 1) % 3, j = (k + 2) % 3;
  vec3 p = corner[i], along = corner[j] - p;
  float length2 = max(dot(along, along), 1e-30);
  vec3 across = cross(cornerNormal[i] + cornerNormal[j], along);
  across *= inversesqrt(max(dot(across, across), 1e-30));
  float both = barycentric[i] + barycentric[j];
  float t = both > 0.0 ? barycentric[j] / max(both, 1e-30) : 0.5, t2 = t * t, t3 = t2 * t;
  // On the side: Hermite's cubic between its ends, and its derivative.
  vec4 h = vec4(2.0 * t3 - 3.0 * t2 + 1.0, t3 - 2.0 * t2 + t, 3.0 * t2 - 2.0 * t3, t3 - t2);
  vec4 g = vec4(6.0 * (t2 - t), 3.0 * t2 - 4.0 * t + 1.0, 6.0 * (t - t2), 3.0 * t2 - 2.0 * t);
  vec3 radial = corner[k] - p - t * along;
  float ahead = dot(radial, along) / length2;
  float height = sqrt(max(dot(radial, radial) - ahead * ahead * length2, 0.0));
  float b = barycentric[k], b2 = b * b, b3 = b2 * b;
  vec4 c = share * vec4(2.0 * b3 - 3.0 * b2 + 1.0, b3 - 2.0 * b2 + b, 3.0 * b2 - 2.0 * b3, b3 - b2);
  ofValue[i] += c.x * h.x + c.y * ahead * g.x;
  ofValue[j] += c.x * h.z + c.y * ahead * g.z;
  ofSlope[i] += (c.x * h.y + c.y * ahead * g.y) * along + c.y * height * (1.0 - t) * across;
  ofSlope[j] += (c.x * h.w + c.y * ahead * g.w) * along + c.y * height * t * across;
  ofValue[k] += c.z;
  ofSlope[k] += c.w * radial;
}

void weigh() {
  vec3 squares = barycentric * barycentric;
  vec3 shares = squares.yzx * squares.zxy;
  float total = shares.x + shares.y + shares.z;
  shares = total > 1e-30 ? shares / total : vec3(1.0 / 3.0);
  ofValue = vec3(0.0);
  for (int k = 0; k < 3; k++) ofSlope[k] = vec3(0.0);
  for (int k = 0; k < 3; k++) addSide(k, shares[k]);
}
