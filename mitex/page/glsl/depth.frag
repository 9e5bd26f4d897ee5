#version 300 es
// For depth alone.
void main() {}
