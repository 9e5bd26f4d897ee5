#version 300 es
// The maps at the point of the surface that a pixel shows, decoded from the states of the cells around it.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
//: SURFACE
//: SAMPLERS
uniform int height;  // of the states in their textures
uniform sampler2D occlusion;
//: CONSTANTS
//: BLOCKS
#if GRAFT
uniform sampler2D shares;
uniform bool shareShown;  // in place of the colours
#endif
uniform vec4 palette[COLOURS];       // colours
uniform vec4 otherPalette[COLOURS];  // of the look that is grafted on
uniform vec2 limits;                 // distances from the palettes; below 0 for none
layout(location = 0) out vec4 colour;  // albedo (sRGB), height
layout(location = 1) out vec4 bent;    // normal with its detail, roughness
layout(location = 2) out vec4 plain;   // normal of the mesh, occlusion in the map
layout(location = 3) out vec4 spot;    // position [decoder units], light that reaches it of all directions
//: COORDINATES
//: INTERPOLATION

// Colours that the exemplar does not have are moved to its nearest one, as far as it takes.
vec3 within(vec3 albedo, vec4 colours[COLOURS], float limit) {
  if (limit < 0.0) return albedo;
  vec3 nearest = colours[0].rgb;
  float least = 1e9;
  for (int k = 0; k < COLOURS; k++) {
    vec3 offset = albedo - colours[k].rgb;
    float apart = dot(offset, offset);
    if (apart < least) {
      least = apart;
      nearest = colours[k].rgb;
    }
  }
  vec3 offset = albedo - nearest;
  return nearest + offset * min(limit / max(length(offset), limit), 1.0);
}

void main() {
  colour = bent = plain = spot = vec4(0.0);
  if (!locate(ivec2(gl_FragCoord.xy))) return;
  vec3 position = mixed(corner), normal = normalize(mixed(cornerNormal));
#if GRAFT
  float share0 = clamp(dot(barycentric, vec3(texelFetch(shares, slot[0], 0).r, texelFetch(shares, slot[1], 0).r,
                                              texelFetch(shares, slot[2], 0).r)), 0.0, 1.0);
#else
  const float share0 = 0.0;
#endif
  //: STATES
  //: NETWORK
  //: MAPS
#if GRAFT
  albedo = mix(within(albedo, palette, limits.x), within(albedo, otherPalette, limits.y), share0);
  if (shareShown) albedo = vec3(share0);
#else
  albedo = within(albedo, palette, limits.x);
#endif
  vec3 right = rightwards(normal);
  vec3 detail = detailed.x * right + detailed.y * cross(normal, right) + detailed.z * normal;
  float open = dot(barycentric, vec3(texelFetch(occlusion, slot[0], 0).r, texelFetch(occlusion, slot[1], 0).r,
                                     texelFetch(occlusion, slot[2], 0).r));
  colour = vec4(albedo, relief);
  bent = vec4(normalize(detail), roughness);
  plain = vec4(normal, occluded);
  spot = vec4(position, open);
}
