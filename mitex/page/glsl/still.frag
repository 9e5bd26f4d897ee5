#version 300 es
// The maps at the point of the surface that a pixel shows, from textures or from values at the vertices.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
//: SURFACE
//: CONSTANTS
#if BAKED
uniform sampler2D colours, materials, details, coordinates;  // sRGB; occlusion, roughness, height; object space
uniform float level;  // of the textures' mip maps
uniform bool detailed;
#else
uniform sampler2D colours, materials, details;  // by vertex
uniform bool detailed;
#endif
uniform sampler2D occlusion;
layout(location = 0) out vec4 colour;
layout(location = 1) out vec4 bent;
layout(location = 2) out vec4 plain;
layout(location = 3) out vec4 spot;

vec3 read(sampler2D values) {
#if BAKED
  int index = 3 * (int(texelFetch(ids, ivec2(gl_FragCoord.xy), 0).x) - 1);
  vec2 uv = vec2(0.0);
  for (int k = 0; k < 3; k++) {
    int at = index + k;
    uv += barycentric[k] * texelFetch(coordinates, ivec2(at & (LIST - 1), at / LIST), 0).xy;
  }
  return textureLod(values, vec2(uv.x, 1.0 - uv.y), level).rgb;
#else
  vec3 rows[3];
  for (int k = 0; k < 3; k++) rows[k] = texelFetch(values, slot[k], 0).rgb;
  return mixed(rows);
#endif
}

void main() {
  colour = bent = plain = spot = vec4(0.0);
  if (!locate(ivec2(gl_FragCoord.xy))) return;
  vec3 normal = normalize(mixed(cornerNormal)), material = read(materials);
  float open = dot(barycentric, vec3(texelFetch(occlusion, slot[0], 0).r, texelFetch(occlusion, slot[1], 0).r,
                                     texelFetch(occlusion, slot[2], 0).r));
  colour = vec4(read(colours), material.z);
  bent = vec4(detailed ? normalize(2.0 * read(details) - 1.0) : normal, material.y);
  plain = vec4(normal, material.x);
  spot = vec4(mixed(corner), open);
}
