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

  // One step, in one of the languages.
  shader(rules, language, ...extra) {
    const n = this.vectors;
    const z = (k, c) => `z${k}_${c}`;
    const kinds = Array.from({ length: this.harmonics }, (_, k) => k);
    const all = (line) => kinds.map((k) => each(n, (c) => line(k, c))).join("\n");
    const { vector, number, state, next, zero, bound } = language;
    const held = (c, change) => this._held(rules, c, change, bound);
    return written(SHADERS[language.template], {
      ...language.declarations(this, rules, ...extra),
      OWN: each(n, (c) => vector(`s${c}`, state(c, "at"))),
      KEEP: each(n, (c) => next(c, held(c, ""))),
      ZERO: all((k, c) => vector(z(k, c), zero)),
      NEIGHBOUR: `${each(n, (c) => vector(`o${c}`, `${state(c, "place")} - s${c}`))}\n`
        + `${kinds.map((k) => number(`w${k}`, HARMONICS[k])).join("\n")}\n`
        + all((k, c) => `${z(k, c)} += w${k} * o${c};`),
      MEAN: all((k, c) => `${z(k, c)} *= share;`),
      CHANGES: rules.map((rule) => each(n, (c) => vector(`${rule}u${c}`, bound(`${rule}Bias`, c)))).join("\n"),
      RULES: rules.map((rule, r) => this._network(rule, ["share0 < 1.0", "share0 > 0.0"][r], language)).join("\n"),
      NEXT: each(n, (c) => next(c, held(c,
        rules.length > 1 ? ` + mix(ruleu${c}, otheru${c}, share0)` : ` + ruleu${c}`))),
    });
  }

  // A state and its change, within the bounds of the training.
  _held(rules, c, change, bound) {
    const mixed = (kind) => (rules.length > 1
      ? `mix(${rules.map((rule) => bound(`${rule}${kind}`, c)).join(", ")}, share0)` : bound(`rule${kind}`, c));
    return `held(s${c}${change}, ${mixed("Low")}, ${mixed("High")})`;
  }

  _network(rule, needed, { vector, zero, loop, index }) {
    const inputs = Array.from({ length: this.harmonics * this.vectors }, (_, i) =>
      `z${Math.floor(i / this.vectors)}_${i % this.vectors}`);
    for (let c = 0; c < this.vectors; c++) inputs.push(`s${c}`);
    if (this.condition) inputs.push("told");
    const block = (b) => `${loop(this.perBlock)} {
      ${index(this.stride)}
      ${vector("h", `${rule}${b}[k + ${this.stride - 1}][0]`)}
      ${inputs.map((x, i) => `h += ${rule}${b}[k + ${i}] * ${x};`).join("\n")}
      h = max(h, ${zero});
      ${each(this.vectors, (c) => `${rule}u${c} += ${rule}${b}[k + ${this.inputs + c}] * h;`)}
    }`;
    return `if (${needed}) {\n${each(this.blocks, block)}\n}`;
  }
}

function four(values, vectors) {
  const padded = new Float32Array(4 * vectors);
  padded.set(values);
  return padded;
}
