// A point of the surface, as the other shaders read it from the picture of ids.
uniform usampler2D ids, corners;
uniform sampler2D place, normals;
uniform float turn;  // of the texture about the normals [rad]

ivec2 slot[3];
vec3 barycentric, corner[3], cornerNormal[3];
float edge;  // length of the edges around [decoder units]

bool locate(ivec2 pixel) {
  uvec4 id = texelFetch(ids, pixel, 0);
  if (id.x == 0u) return false;
  barycentric.xy = uintBitsToFloat(id.yz);
  barycentric.z = 1.0 - barycentric.x - barycentric.y;
  int index = int(id.x) - 1;
  uvec4 vertices = texelFetch(corners, ivec2(index & (LIST - 1), index / LIST), 0);
  edge = 0.0;
  for (int k = 0; k < 3; k++) {
    slot[k] = ivec2(int(vertices[k]) & (WIDTH - 1), int(vertices[k]) / WIDTH);
    vec4 texel = texelFetch(place, slot[k], 0);
    corner[k] = texel.xyz;
    edge += barycentric[k] * texel.w;
    cornerNormal[k] = texelFetch(normals, slot[k], 0).xyz;
  }
  return true;
}

vec3 mixed(vec3 values[3]) {
  return barycentric.x * values[0] + barycentric.y * values[1] + barycentric.z * values[2];
}

// Where the exemplar's right points: y x normal, turned about the normal (mitex.methods.nca.orientation).
vec3 rightwards(vec3 n) {
  vec3 right = vec3(n.z, 0.0, -n.x);
  float length2 = dot(right, right);
  if (length2 < 1e-12) {
    vec3 axis = vec3(1.0, 0.0, 0.0);
    right = axis - n * dot(axis, n);
    length2 = dot(right, right);
  }
  right *= inversesqrt(length2);
  return right * cos(turn) + cross(n, right) * sin(turn);
}
