#version 300 es
// The seed: a state of zeros.
precision highp float;
//: OUTPUTS

void main() {
  //: ZERO
}
