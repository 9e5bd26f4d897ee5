#version 300 es
// A point on the texel of a cell.
precision highp float;
precision highp int;
uniform float height;
layout(location = 0) in uint slot;

void main() {
  vec2 texel = vec2(float(slot % uint(WIDTH)), float(slot / uint(WIDTH))) + 0.5;
  gl_Position = vec4(texel / vec2(float(WIDTH), height) * 2.0 - 1.0, 0.0, 1.0);
  gl_PointSize = 1.0;
}
