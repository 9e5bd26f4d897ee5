#version 300 es
// The mean of the samples of each pixel, in linear light.
precision highp float;
precision highp int;
uniform highp sampler2D picture;
uniform int samples;  // along a side of a pixel
layout(location = 0) out vec4 shown;

void main() {
  ivec2 first = ivec2(gl_FragCoord.xy) * samples;
  vec3 sum = vec3(0.0);
  for (int k = 0; k < samples * samples; k++) {
    vec3 value = texelFetch(picture, first + ivec2(k % samples, k / samples), 0).rgb;
    sum += value * value;
  }
  shown = vec4(sqrt(sum / float(samples * samples)), 1.0);
}
