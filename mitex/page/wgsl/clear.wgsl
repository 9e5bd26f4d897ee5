// The seed, for the cells in a list: a state of zeros.
@group(0) @binding(0) var<storage, read_write> states: array<vec4f>;
@group(0) @binding(1) var<storage, read> slots: array<u32>;
//: CONSTANTS

@compute @workgroup_size(32)
fn main(@builtin(global_invocation_id) id: vec3u) {
  if (id.x >= arrayLength(&slots)) {
    return;
  }
  let plane = arrayLength(&states) / VECTORS;
  for (var c = 0u; c < VECTORS; c++) {
    states[c * plane + slots[id.x]] = vec4f(0.0);
  }
}
