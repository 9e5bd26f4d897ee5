// The cell rule as a shader: perception of the neighbours and both layers of the network in one pass.

const HARMONICS = [
  "1.0", "d.y", "d.z", "d.x",
  "d.x * d.y", "d.y * d.z", "3.0 * d.z * d.z - 1.0", "d.x * d.z", "d.x * d.x - d.y * d.y",
];
const COUNTS = { 0: 1, 1: 4, 2: 9 }; // highest degree -> harmonics

// What the shaders of two looks must have in common to be grafted; weights are in blocks of so many bytes.
class RuleShape {
  constructor(look, blockSize) {
    this.channels = look.channels;
    this.vectors = upTo4(look.channels);
    this.harmonics = COUNTS[look.degree];
    this.condition = look.condition;
    this.inputs = (this.harmonics + 1) * this.vectors + upTo4(look.condition);
    this.groups = upTo4(look.hidden);
    this.stride = this.inputs + this.vectors + 1;
    this.perBlock = Math.min(Math.floor(blockSize / 64 / this.stride), this.groups);
    this.blocks = Math.ceil(this.groups / this.perBlock);
    if (!this.perBlock) throw new Error("the rule is too wide for this device");
  }

  // A look's weights, by block.
  weights(look) {
    const inputs = (this.harmonics + 1) * this.channels + this.condition;
    const place = (i) => {
      const block = Math.min(Math.floor(i / this.channels), this.harmonics + 1);
      return 4 * this.vectors * block + (i - block * this.channels);
    };
    const first = pieces(look.weight1, look.hidden, inputs, place);
    const second = pieces(look.weight2, look.channels, look.hidden);
    const parts = first.flatMap((row, g) => [...row, ...second.map((out) => out[g]), column(look.bias1, g)]);
    return Array.from({ length: this.blocks }, (_, b) => {
      const block = parts.slice(b * this.perBlock * this.stride, (b + 1) * this.perBlock * this.stride);
      while (block.length < this.perBlock * this.stride) block.push(new Float32Array(16));
      return joined(block);
    });
  }

  // The bounds of a look's states and the bias of their changes, by name; `rule` is that of the rule in the shader.
  bounds(look, rule) {
    const { vectors } = this;
    return { [`${rule}Low`]: four(look.low, vectors), [`${rule}High`]: four(look.high, vectors),
      [`${rule}Bias`]: four(look.bias2, vectors) };
  }

  // What one cell perceives of its neighbours, in one of the languages: texts for its template.
  perception({ vector, number, state, zero }) {
    const { vectors: n } = this;
    const kinds = Array.from({ length: this.harmonics }, (_, k) => k);
    const all = (line) => kinds.map((k) => each(n, (c) => line(`z${k}_${c}`, k, c))).join("\n");
    return {
      OWN: each(n, (c) => vector(`s${c}`, state(c, "at"))),
      ZERO: all((z) => vector(z, zero)),
      NEIGHBOUR: `${each(n, (c) => vector(`o${c}`, `${state(c, "place")} - s${c}`))}\n`
        + `${kinds.map((k) => number(`w${k}`, HARMONICS[k])).join("\n")}\n`
        + all((z, k, c) => `${z} += w${k} * o${c};`),
      MEAN: all((z) => `${z} *= share;`),
    };
  }

  // The names of the vectors that the network reads.
  get inputNames() {
    const perceived = Array.from({ length: this.harmonics * this.vectors }, (_, i) =>
      `z${Math.floor(i / this.vectors)}_${i % this.vectors}`);
    const own = Array.from({ length: this.vectors }, (_, c) => `s${c}`);
    return [...perceived, ...own, ...(this.condition ? ["told"] : [])];
  }

  // The network of a rule, on so many cells at a time: what is read of its weights serves all of them. `input` and
  // `change` name what it reads and adds to.
  network(rule, { vector, matrix, zero, loop, index }, cellCount, input, change) {
    const { stride } = this;
    const cells = Array.from({ length: cellCount }, (_, m) => m);
    const on = (line) => cells.map(line).join(" ");
    const product = (b, k, line) => `{ ${matrix("w", `${rule}${b}[k + ${k}]`)} ${on(line)} }`;
    return each(this.blocks, (b) => `${loop(this.perBlock)} {
      ${index(stride)}
      ${on((m) => vector(`h${m}`, `${rule}${b}[k + ${stride - 1}][0]`))}
      ${each(this.inputs, (i) => product(b, i, (m) => `h${m} += w * ${input(i, m)};`))}
      ${on((m) => `h${m} = max(h${m}, ${zero});`)}
      ${each(this.vectors, (c) => product(b, this.inputs + c, (m) => `${change(c, m)} += w * h${m};`))}
    }`);
  }

  // A cell's next state: its own one and the changes by the rules, if there are any, within the bounds of the training.
  held(rules, { bound }, c, own, changes = []) {
    const mixed = (values) => (rules.length > 1 ? `mix(${values.join(", ")}, share0)` : values[0]);
    const bounds = ["Low", "High"].map((kind) => mixed(rules.map((rule) => bound(`${rule}${kind}`, c))));
    return `held(${own}${changes.length ? ` + ${mixed(changes)}` : ""}, ${bounds.join(", ")})`;
  }
}

function four(values, vectors) {
  const padded = new Float32Array(4 * vectors);
  padded.set(values);
  return padded;
}
