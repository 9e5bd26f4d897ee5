// One step of the automaton, as step.frag has it. A group of threads is a tile of cells, which update together
// or not at all.
const WIDTH = 256u;
//: CONSTANTS
// States are vectors of four channels, those of all cells one after the other: `plane` of each.
struct Step { phase: u32, plane: u32, regular: f32 }
@group(1) @binding(0) var<uniform> now: Step;
//: BOUNDS
//: BINDINGS

fn pcg(value: u32) -> u32 {
  let state = value * 747796405u + 2891336453u;
  let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
  return (word >> 22u) ^ word;
}

fn held(state: vec4f, low: vec4f, high: vec4f) -> vec4f {
  return min(max(state, low), high);
}

// Where a cell of a tile of 8 x 4 is.
fn placed(tile: u32, cell: u32) -> u32 {
  let across = WIDTH >> 3u; // tiles in a row
  return ((tile / across) * 4u + (cell >> 3u)) * WIDTH + (tile % across) * 8u + (cell & 7u);
}

// What the network reads of a cell: sums over its neighbours, its state, what it is told.
fn perceived(at: u32) -> array<vec4f, INPUTS> {
  //: OWN
  let row = rows[at].xy;
  //: ZERO
  for (var k = row.x; k < row.x + row.y; k++) {
    let link = links[k];
    let place = link.x;
    let d = bitcast<vec3f>(link.yzw);
    //: NEIGHBOUR
  }
  if (now.regular > 0.0) {
    let share = now.regular / max(f32(row.y), 1.0);
    //: MEAN
  }
  //: CONDITION
  //: PERCEIVED
}

// The share of the second rule.
fn shareOf(at: u32) -> f32 {
  //: SHARE
}

@compute @workgroup_size(32u / CELLS)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
  let tile = group.x;
  let first = thread * CELLS;
  if (pcg(tile + now.phase) >= 0x80000000u) {
    for (var m = 0u; m < CELLS; m++) {
      let at = placed(tile, first + m);
      let share0 = shareOf(at);
      //: KEEP
    }
    return;
  }
  var x: array<array<vec4f, INPUTS>, CELLS>;
  //: CHANGES
  var least = 1.0;
  var most = 0.0;
  for (var m = 0u; m < CELLS; m++) {
    let at = placed(tile, first + m);
    x[m] = perceived(at);
    least = min(least, shareOf(at));
    most = max(most, shareOf(at));
    //: BIAS
  }
  //: RULES
  for (var m = 0u; m < CELLS; m++) {
    let at = placed(tile, first + m);
    let share0 = shareOf(at);
    //: NEXT
  }
}
