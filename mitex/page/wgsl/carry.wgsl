// States that are carried along a field, as carry.frag has it.
@group(0) @binding(0) var<storage, read> sources: array<vec4u>;
@group(0) @binding(1) var<storage, read> parts: array<vec4u>;
@group(0) @binding(2) var<storage, read> states: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> following: array<vec4f>;
//: CONSTANTS

@compute @workgroup_size(32)
fn main(@builtin(global_invocation_id) id: vec3u) {
  let plane = arrayLength(&states) / VECTORS;
  let row = sources[id.x].xy;
  var sums: array<vec4f, VECTORS>;
  for (var k = row.x; k < row.x + row.y; k++) {
    let weight = bitcast<f32>(parts[k].y);
    for (var c = 0u; c < VECTORS; c++) {
      sums[c] += weight * states[c * plane + parts[k].x];
    }
  }
  for (var c = 0u; c < VECTORS; c++) {
    following[c * plane + id.x] = sums[c];
  }
}
