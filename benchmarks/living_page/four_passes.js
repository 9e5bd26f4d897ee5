// The automaton in the way of MeshNCA's own web page (Pajouheshgar et al. 2024), as a reference for speed: four
// passes a step with everything in between in textures of 32-bit floats. A fragment computes four channels of a
// cell; weights are read from textures; directions follow from positions. Half of the rows of (shuffled) cells
// take part in a step. Written from a description of that page, for the rule of `page`.

const { graphics, surface, look } = page;
const { mesh, slots } = surface;
const VECTORS = 4, HARMONICS = 4, PERCEIVED = VECTORS * (HARMONICS + 1), HIDDEN = look.hidden / 4;
const across = Math.ceil(Math.sqrt(mesh.count) / 2) * 2;
const rows = 2 * Math.ceil(mesh.count / across / 2);

// Vectors of cells are tiles in one texture.
const grid = (vectors) => Math.ceil(Math.sqrt(vectors));
const tiled = (vectors, height) => graphics.target([graphics.texture(
  "RGBA32F", grid(vectors) * across, Math.ceil(vectors / grid(vectors)) * height)]);
const table = (values, width) => graphics.list("RGBA32F", values, width);

const COMMON = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
const int ACROSS = ${across}, ROWS = ${rows}, COUNT = ${mesh.count};
uniform int offset;
out vec4 value;
vec4 from(sampler2D tiles, int wide, int high, int vector, ivec2 at) {
  return texelFetch(tiles, ivec2(vector % wide, vector / wide) * ivec2(ACROSS, high) + at, 0);
}`;
const VERTEX = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;

// Where a fragment is: its vector and cell, in targets of half of the rows.
const place = (vectors, high) => `ivec2 pixel = ivec2(gl_FragCoord.xy), tile = pixel / ivec2(ACROSS, ${high});
  ivec2 at = pixel % ivec2(ACROSS, ${high});
  int vector = tile.y * ${grid(vectors)} + tile.x;
  if (vector >= ${vectors}) discard;`;

const PERCEIVE = `${COMMON}
uniform sampler2D states, neighbours, positions;
uniform int most;
void main() {
  ${place(PERCEIVED, rows / 2)}
  ivec2 cell = ivec2(at.x, (at.y + offset) % ROWS);
  int kind = vector / ${VECTORS}, c = vector % ${VECTORS}, index = cell.y * ACROSS + cell.x;
  if (index >= COUNT) discard;
  vec4 own = from(states, ${grid(VECTORS)}, ROWS, c, cell);
  if (kind == ${HARMONICS}) { value = own; return; }
  vec3 here = texelFetch(positions, cell, 0).xyz;
  value = vec4(0.0);
  float found = 0.0;
  for (int k = 0; k < most; k++) {
    vec4 four = texelFetch(neighbours, ivec2(cell.x, cell.y * most + k), 0);
    for (int j = 0; j < 4; j++) {
      if (four[j] < 0.0) continue;
      ivec2 other = ivec2(int(four[j]) % ACROSS, int(four[j]) / ACROSS);
      vec3 d = normalize(texelFetch(positions, other, 0).xyz - here);
      float weight = kind == 0 ? 1.0 : kind == 1 ? d.y : kind == 2 ? d.z : d.x;
      value += weight * (from(states, ${grid(VECTORS)}, ROWS, c, other) - own);
      found += 1.0;
    }
  }
  value *= 6.0 / max(found, 1.0);
}`;

const dense = (inputs, outputs, active) => `${COMMON}
uniform sampler2D inputs, weights;
void main() {
  ${place(outputs, rows / 2)}
  value = texelFetch(weights, ivec2(${4 * inputs}, vector), 0);
  for (int i = 0; i < ${inputs}; i++) {
    mat4 piece = mat4(texelFetch(weights, ivec2(4 * i, vector), 0), texelFetch(weights, ivec2(4 * i + 1, vector), 0),
                      texelFetch(weights, ivec2(4 * i + 2, vector), 0), texelFetch(weights, ivec2(4 * i + 3, vector), 0));
    value += piece * from(inputs, ${grid(inputs)}, ROWS / 2, i, at);
  }
  ${active ? "value = max(value, 0.0);" : ""}
}`;

const UPDATE = `${COMMON}
uniform sampler2D states, changes;
uniform vec4 low[${VECTORS}], high[${VECTORS}];
void main() {
  ${place(VECTORS, rows)}
  value = from(states, ${grid(VECTORS)}, ROWS, vector, at);
  int row = (at.y - offset + ROWS) % ROWS;
  if (row < ROWS / 2) value += from(changes, ${grid(VECTORS)}, ROWS / 2, vector, ivec2(at.x, row));
  value = clamp(value, low[vector], high[vector]);
}`;

// A layer's matrix in pieces of 4 x 4 by column, and its bias, a row for each four outputs.
function layer(weight, bias, outputs, inputs) {
  const values = new Float32Array((outputs / 4) * (inputs + 1) * 4);
  for (let o = 0; o < outputs; o++) {
    const row = (o >> 2) * (inputs + 1) * 4;
    for (let i = 0; i < inputs; i++) values[row + 4 * i + (o & 3)] = weight[inputs * o + i];
    values[row + 4 * inputs + (o & 3)] = bias[o];
  }
  return table(values, inputs + 1);
}

const positions = new Float32Array(4 * across * rows);
const { start, index } = mesh.neighbours;
let most = 0;
for (let v = 0; v < mesh.count; v++) most = Math.max(most, Math.ceil((start[v + 1] - start[v]) / 4));
const neighbours = new Float32Array(4 * across * rows * most).fill(-1);
for (let v = 0; v < mesh.count; v++) {
  const slot = slots.slotOf[v], [x, y] = [slot % across, Math.floor(slot / across)];
  positions.set(mesh.point(v), 4 * slot);
  for (let k = 0; k < start[v + 1] - start[v]; k++) {
    neighbours[4 * ((y * most + (k >> 2)) * across + x) + (k & 3)] = slots.slotOf[index[start[v] + k]];
  }
}

const programs = {
  perceive: graphics.program(VERTEX, PERCEIVE), first: graphics.program(VERTEX, dense(PERCEIVED, HIDDEN, true)),
  second: graphics.program(VERTEX, dense(HIDDEN, VECTORS, false)), update: graphics.program(VERTEX, UPDATE),
};
const inputs = {
  positions: table(positions, across), neighbours: table(neighbours, across), most,
  low: look.low, high: look.high,
};
const weights = [layer(look.weight1, look.bias1, look.hidden, 16 * (HARMONICS + 1)),
  layer(look.weight2, look.bias2, 16, look.hidden)];
let states = [tiled(VECTORS, rows), tiled(VECTORS, rows)];
const [perception, hidden, changes] = [PERCEIVED, HIDDEN, VECTORS].map((vectors) => tiled(vectors, rows / 2));

const tileOf = (slot, c) => 4 * ((Math.floor(c / 2) * rows + Math.floor(slot / across)) * 2 * across
  + (c % 2) * across + (slot % across));

return {
  step(offset) {
    const [old] = states;
    graphics.fill(perception, programs.perceive, { ...inputs, states: old.textures[0], offset });
    graphics.fill(hidden, programs.first, { inputs: perception.textures[0], weights: weights[0] });
    graphics.fill(changes, programs.second, { inputs: hidden.textures[0], weights: weights[1] });
    graphics.fill(states[1], programs.update, { ...inputs, states: old.textures[0], changes: changes.textures[0], offset });
    states = states.toReversed();
  },
  rows,
  // Whether a vertex takes part in the step with this offset.
  active: (vertex, offset) => (Math.floor(slots.slotOf[vertex] / across) - offset + rows) % rows < rows / 2,
  write(values) {
    const texels = new Float32Array(4 * 4 * across * rows);
    for (let v = 0; v < mesh.count; v++) {
      for (let c = 0; c < 16; c++) texels[tileOf(slots.slotOf[v], c >> 2) + (c & 3)] = values[16 * v + c];
    }
    graphics.refill(states[0].textures[0], texels);
  },
  read() {
    const texels = graphics.read(states[0]), values = new Float32Array(16 * mesh.count);
    for (let v = 0; v < mesh.count; v++) {
      for (let c = 0; c < 16; c++) values[16 * v + c] = texels[tileOf(slots.slotOf[v], c >> 2) + (c & 3)];
    }
    return values;
  },
  wait: () => graphics.read(states[0], 0, 0, 0, 1, 1),
};
