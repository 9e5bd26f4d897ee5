// Random numbers that are the same on every machine: the integer hash PCG (Jarzynski and Olano 2020).

function pcg(value) {
  const state = (Math.imul(value, 747796405) + 2891336453) >>> 0;
  const word = Math.imul((state >>> ((state >>> 28) + 4)) ^ state, 277803737) >>> 0;
  return ((word >>> 22) ^ word) >>> 0;
}

// What the hashes of all tiles in a step begin with.
function phaseOf(step, seed) {
  return pcg((step + pcg(seed)) >>> 0);
}

// The places of cells in textures, shuffled: a tile of texels takes a step together, and its cells shall be
// anywhere on the surface.
class Slots {
  constructor(count) {
    const keys = new Float64Array(count); // hash and number in one, as a typed array sorts fastest
    for (let k = 0; k < count; k++) keys[k] = pcg(k) * 2 ** 21 + k;
    keys.sort();
    this.count = count;
    this.vertexAt = Uint32Array.from(keys, (key) => key % 2 ** 21);
    this.slotOf = new Uint32Array(count);
    this.vertexAt.forEach((vertex, slot) => { this.slotOf[vertex] = slot; });
  }

  // Numbers by vertex in the order of the cells.
  order(values) {
    return Float32Array.from(this.vertexAt, (vertex) => values[vertex]);
  }

  // Rows of values by vertex (count x width) as rows of a texture with four channels.
  spread(values, width, Kind = Float32Array) {
    const rows = new Kind(4 * this.count);
    for (let vertex = 0; vertex < this.count; vertex++) {
      const to = 4 * this.slotOf[vertex];
      for (let c = 0; c < width; c++) rows[to + c] = values[width * vertex + c];
    }
    return rows;
  }
}
