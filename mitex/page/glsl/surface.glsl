// A point of the surface, as the other shaders read it from the picture of ids.
uniform usampler2D ids, corners;
uniform sampler2D place, normals;
uniform float turn;    // of the texture about the normals [rad]
uniform bool follows;  // whether cells have turns of their own, which are in
uniform sampler2D rights;

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

// The unit vector across a unit normal that is nearest to another vector.
vec3 across(vec3 n, vec3 vector) {
  vec3 flat_ = vector - n * dot(n, vector);
  float length2 = dot(flat_, flat_);
  if (length2 < 1e-12) {
    vec3 axis = vec3(1.0, 0.0, 0.0);
    flat_ = axis - n * dot(axis, n);
    length2 = dot(flat_, flat_);
  }
  return flat_ * inversesqrt(length2);
}

// Where the exemplar's right points: y x normal, turned about the normal, or what it is at the cells around
// (mitex.methods.nca.orientation).
vec3 rightwards(vec3 n) {
  if (follows) {
    vec3 around[3];
    for (int k = 0; k < 3; k++) around[k] = texelFetch(rights, slot[k], 0).xyz;
    return across(n, mixed(around));
  }
  vec3 right = across(n, vec3(n.z, 0.0, -n.x));
  return right * cos(turn) + cross(n, right) * sin(turn);
}
