// The cell rule as a shader: perception of the neighbours and both layers of the network in one pass.

const HARMONICS = [
  "1.0", "d.y", "d.z", "d.x",
  "d.x * d.y", "d.y * d.z", "3.0 * d.z * d.z - 1.0", "d.x * d.z", "d.x * d.x - d.y * d.y",
];
const COUNTS = { 0: 1, 1: 4, 2: 9 }; // highest degree -> harmonics

// What the shaders of two looks must have in common to be grafted.
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

  // The buffers of a look's weights, by block; `name` is that of the rule in the shader.
  buffers(graphics, look, name) {
    const inputs = (this.harmonics + 1) * this.channels + this.condition;
    const place = (i) => {
      const block = Math.min(Math.floor(i / this.channels), this.harmonics + 1);
      return 4 * this.vectors * block + (i - block * this.channels);
    };
    const first = pieces(look.weight1, look.hidden, inputs, place);
    const second = pieces(look.weight2, look.channels, look.hidden);
    const parts = first.flatMap((row, g) => [...row, ...second.map((out) => out[g]), column(look.bias1, g)]);
    return Object.fromEntries(Array.from({ length: this.blocks }, (_, b) => {
      const block = parts.slice(b * this.perBlock * this.stride, (b + 1) * this.perBlock * this.stride);
      while (block.length < this.perBlock * this.stride) block.push(new Float32Array(16));
      return [`${name}${b}Block`, graphics.block(joined(block))];
    }));
  }

  shader(rules) {
    const n = this.vectors;
    const z = (k, c) => `z${k}_${c}`;
    const kinds = Array.from({ length: this.harmonics }, (_, k) => k);
    const all = (line) => kinds.map((k) => each(n, (c) => line(k, c))).join("\n");
    return written(SHADERS["step.frag"], {
      SAMPLERS: each(n, (c) => `uniform sampler2D state${c};`),
      CONSTANTS: `const int VECTORS = ${n};\n#define GRAFT ${rules.length > 1 ? 1 : 0}\n`
        + `#define CONDITION ${this.condition ? 1 : 0}`,
      OUTPUTS: each(n, (c) => `layout(location = ${c}) out vec4 next${c};`),
      BLOCKS: rules.map((rule) => each(this.blocks, (b) =>
        blockText(`${rule}${b}`, this.perBlock * this.stride))).join(""),
      OWN: each(n, (c) => `vec4 s${c} = texelFetch(state${c}, at, 0);`),
      KEEP: each(n, (c) => `next${c} = ${this._held(rules, c, "")};`),
      ZERO: all((k, c) => `vec4 ${z(k, c)} = vec4(0.0);`),
      NEIGHBOUR: each(n, (c) => `vec4 o${c} = texelFetch(state${c}, other, 0) - s${c};`) + "\n"
        + kinds.map((k) => `float w${k} = ${HARMONICS[k]};`).join("\n") + "\n"
        + all((k, c) => `${z(k, c)} += w${k} * o${c};`),
      MEAN: all((k, c) => `${z(k, c)} *= share;`),
      CHANGES: rules.map((rule) => each(n, (c) => `vec4 ${rule}u${c} = ${rule}Bias[${c}];`)).join("\n"),
      RULES: rules.map((rule, r) => this._network(rule, ["share0 < 1.0", "share0 > 0.0"][r])).join("\n"),
      NEXT: each(n, (c) => `next${c} = ${this._held(rules, c,
        rules.length > 1 ? ` + mix(ruleu${c}, otheru${c}, share0)` : ` + ruleu${c}`)};`),
      BOUNDS: rules.map((rule) =>
        `uniform vec4 ${rule}Low[VECTORS], ${rule}High[VECTORS], ${rule}Bias[VECTORS];`).join("\n"),
    });
  }

  // A state and its change, within the bounds of the training.
  _held(rules, c, change) {
    const bound = (name) => (rules.length > 1 ? `mix(rule${name}[${c}], other${name}[${c}], share0)` : `rule${name}[${c}]`);
    return `held(s${c}${change}, ${bound("Low")}, ${bound("High")})`;
  }

  _network(rule, needed) {
    const inputs = Array.from({ length: this.harmonics * this.vectors }, (_, i) =>
      `z${Math.floor(i / this.vectors)}_${i % this.vectors}`);
    for (let c = 0; c < this.vectors; c++) inputs.push(`s${c}`);
    if (this.condition) inputs.push("told");
    const loop = (b) => `for (int g = 0; g < ${this.perBlock}; g++) {
      int k = g * ${this.stride};
      vec4 h = ${rule}${b}[k + ${this.stride - 1}][0];
      ${inputs.map((x, i) => `h += ${rule}${b}[k + ${i}] * ${x};`).join("\n")}
      h = max(h, 0.0);
      ${each(this.vectors, (c) => `${rule}u${c} += ${rule}${b}[k + ${this.inputs + c}] * h;`)}
    }`;
    return `if (${needed}) {\n${each(this.blocks, loop)}\n}`;
  }
}
