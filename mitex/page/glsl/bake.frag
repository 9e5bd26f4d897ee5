#version 300 es
// Decoded maps as images of a material (glTF): colour; occlusion, roughness and metallic; normals in the frame
// of each face.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
//: SURFACE
uniform sampler2D colour, bent, plain;
uniform int image;
layout(location = 0) out vec4 value;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  value = vec4(0.5, 0.5, 1.0, 1.0);
  if (!locate(at)) return;
  if (image == 0) value.rgb = texelFetch(colour, at, 0).rgb;
  if (image == 1) value.rgb = vec3(texelFetch(plain, at, 0).w, texelFetch(bent, at, 0).w, 0.0);
  if (image < 2) return;
  vec3 along = normalize(corner[1] - corner[0]) * (texelFetch(ids, at, 0).x % 2u == 1u ? 1.0 : -1.0);
  vec3 tangents[3];
  for (int k = 0; k < 3; k++) {
    tangents[k] = normalize(along - cornerNormal[k] * dot(along, cornerNormal[k]));
  }
  vec3 n = normalize(mixed(cornerNormal)), t = normalize(mixed(tangents)), b = cross(n, t);
  vec3 detail = texelFetch(bent, at, 0).xyz;
  value.rgb = 0.5 + 0.5 * normalize(vec3(dot(detail, t), dot(detail, b), dot(detail, n)));
}
