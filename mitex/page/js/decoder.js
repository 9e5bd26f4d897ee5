// The decoder as a shader: from the states around a pixel to the values of its maps.

const MISSING = { albedo: "vec3(0.906)", height: "0.5", roughness: "0.5", ambient_occlusion: "1.0" };
const NAMES = { albedo: "vec3 albedo", height: "float relief", roughness: "float roughness", ambient_occlusion: "float occluded" };
const COLOURS = 64; // at most, in a palette

// What the shaders of two looks must have in common to be grafted.
class DecoderShape {
  constructor(look) {
    const { decoder } = look;
    this.channels = look.channels;
    this.vectors = upTo4(look.channels);
    this.decoder = decoder;
    this.smooth = Boolean(decoder.layers) && decoder.interpolation === "smooth";
    this.maps = look.maps;
    this.waves = decoder.layers && decoder.coordinates.includes("waves") ? decoder.waves.length / 4 : 0;
    if (!decoder.layers) return;
    const place = (i) => (i < look.channels ? i : 4 * this.vectors + i - look.channels);
    this.layers = decoder.layers.map(({ outputs, inputs }, k) => ({
      groups: upTo4(outputs), width: k === 0 ? this.vectors + upTo4(inputs - look.channels) : upTo4(inputs),
      place: k === 0 ? place : (i) => i,
    }));
    this.size = this.layers.reduce((sum, { groups, width }) => sum + groups * (width + 1), 0);
  }

  buffers(graphics, look, name) {
    if (!this.layers) return {};
    if (64 * this.size > graphics.blockSize) throw new Error("the decoder is too wide for this device");
    const last = this.layers.length - 1;
    const parts = this.layers.flatMap(({ place }, k) => {
      const { weight, bias, outputs, inputs } = look.decoder.layers[k];
      const omega = k < last ? look.decoder.omega : 1; // the sines' factor is in the weights
      const rows = pieces(weight.map((x) => omega * x), outputs, inputs, place);
      return rows.flatMap((row, o) => [...row, column(bias.map((x) => omega * x), o)]);
    });
    return { [`${name}Block`]: graphics.block(joined(parts)) };
  }

  shader(names) {
    const n = this.vectors;
    return written(SHADERS["decode.frag"], {
      SURFACE: SHADERS["surface.glsl"],
      SAMPLERS: each(n, (c) => `uniform sampler2D state${c};`),
      CONSTANTS: `#define GRAFT ${names.length > 1 ? 1 : 0}\n#define COLOURS ${COLOURS}`,
      BLOCKS: (this.layers ? names.map((name) => blockText(name, this.size)).join("") : "")
        + (this.waves ? `uniform vec4 waves[${this.waves}];\nuniform float amplitude;` : ""),
      COORDINATES: SHADERS["coordinates.glsl"],
      INTERPOLATION: this.smooth ? SHADERS["smooth.glsl"] : "",
      STATES: this._states(),
      NETWORK: this.layers ? this._network(names) : this._readout(),
      MAPS: this._maps(),
    });
  }

  _states() {
    const read = (c, part) => `texelFetch(state${c}, slot[k]${part ? ` + ivec2(0, ${part} * height)` : ""}, 0)`;
    const slopes = (c) => [1, 2, 3].map((part) => ` + ofSlope[k][${part - 1}] * ${read(c, part)}`).join("");
    const share = (c) => (this.smooth ? `ofValue[k] * ${read(c, 0)}${slopes(c)}` : `barycentric[k] * ${read(c, 0)}`);
    return `${this.smooth ? "weigh();" : ""}
      ${each(this.vectors, (c) => `vec4 s${c} = vec4(0.0);`)}
      for (int k = 0; k < 3; k++) { ${each(this.vectors, (c) => `s${c} += ${share(c)};`)} }`;
  }

  // The vectors of four numbers that the network reads beside the states.
  _coordinates() {
    const numbers = this.decoder.coordinates.flatMap((name) => ({
      waves: Array.from({ length: this.waves }, (_, k) => `along[${k}]`),
      barycentrics: [0, 1, 2].map((k) => `sortedBarycentrics()[${k}]`),
      polynomials: [0, 1].map((k) => `symmetricPolynomials()[${k}]`),
    }[name]));
    while (numbers.length % 4) numbers.push("0.0");
    return Array.from({ length: numbers.length / 4 }, (_, k) => `vec4(${numbers.slice(4 * k, 4 * k + 4).join(", ")})`);
  }

  // A layer is a loop: written out, its shader takes more than twice as long to compile on a processor.
  _network(names) {
    const count = this.waves;
    const lines = count ? ["scaleWaves(position);", `float along[${count}];`,
      `for (int k = 0; k < ${count}; k++) along[k] = amplitude * wave(waves[k]);`] : [];
    let inputs = Array.from({ length: this.vectors }, (_, c) => `s${c}`);
    this._coordinates().forEach((vector, k) => {
      lines.push(`vec4 e${k} = ${vector};`);
      inputs.push(`e${k}`);
    });
    let first = 0;
    this.layers.forEach(({ groups, width }, layer) => {
      const product = (name) => `${name}[k + ${width}][0] + ` + inputs.map((x, i) => `${name}[k + ${i}] * ${x}`).join(" + ");
      const sum = names.length > 1 ? `mix(${names.map(product).join(", ")}, share0)` : product(names[0]);
      const value = layer < this.layers.length - 1 ? `sin(${sum})` : `${sum} + 0.5`;
      lines.push(`vec4 y${layer}[${groups}];`, `for (int o = 0; o < ${groups}; o++) {`,
        `int k = ${first} + o * ${width + 1};`, `y${layer}[o] = ${value};`, "}");
      first += groups * (width + 1);
      inputs = Array.from({ length: groups }, (_, o) => `y${layer}[${o}]`);
    });
    this.outputs = inputs;
    return lines.join("\n");
  }

  _readout() {
    const channels = this.decoder.channels;
    const vectors = Array.from({ length: upTo4(channels.length) }, (_, k) => [0, 1, 2, 3].map((c) => {
      const channel = channels[4 * k + c];
      return channel === undefined ? "0.0" : `s${channel >> 2}[${channel & 3}]`;
    }));
    this.outputs = vectors.map((_, k) => `r${k}`);
    return vectors.map((parts, k) => `vec4 r${k} = vec4(${parts.join(", ")}) + 0.5;`).join("\n");
  }

  _maps() {
    const value = (k) => `clamp(${this.outputs[k >> 2]}[${k & 3}], 0.0, 1.0)`;
    const vector = (columns) => `vec3(${columns.map(value).join(", ")})`;
    const { maps } = this;
    const lines = Object.entries(NAMES).map(([name, variable]) => {
      const columns = maps[name];
      const text = !columns ? MISSING[name] : columns.length > 1 ? vector(columns) : value(columns[0]);
      return `${variable} = ${text};`;
    });
    lines.push(`vec3 detailed = ${maps.normal ? `2.0 * ${vector(maps.normal)} - 1.0` : "vec3(0.0, 0.0, 1.0)"};`);
    return lines.join("\n");
  }
}

// The maps that a pixel shows: pictures of ids become pictures of values.
class Decoder {
  constructor(graphics, look, other = null) {
    Object.assign(this, { graphics, shape: new DecoderShape(look) });
    this.setLooks(look, other);
  }

  setLooks(look, other = null) {
    const names = other ? ["decoder", "grafted"] : ["decoder"];
    const looks = other ? [look, other] : [look];
    for (const value of Object.values(this.buffers ?? {})) this.graphics.gl.deleteBuffer(value);
    this.buffers = Object.assign({}, ...looks.map((one, k) => this.shape.buffers(this.graphics, one, names[k])));
    this.program = this.graphics.program(SHADERS["fill.vert"], this.shape.shader(names));
    this.uniforms = {
      waves: look.decoder.waves, amplitude: look.decoder.amplitude,
      palette: colours(look), otherPalette: colours(other ?? look),
      limits: [look, other ?? look].map((one) => (one.palette ? one.palette.limit : -1)),
    };
  }

  // Into four textures, see decode.frag.
  decode(target, ids, automaton, occlusion, shown) {
    const { surface } = automaton;
    const states = this.shape.smooth ? automaton.readable() : textures(automaton.states[0], "state");
    this.graphics.fill(target, this.program, {
      ...this.buffers, ...this.uniforms, ...states, ids, occlusion, shares: automaton.shares,
      corners: surface.corners, place: surface.place, normals: surface.normals, ...surface.orientation,
      height: surface.height, shareShown: shown,
    });
  }
}

function colours(look) {
  const values = new Float32Array(4 * COLOURS);
  const palette = look.palette ? look.palette.colours : [[0, 0, 0]];
  for (let k = 0; k < COLOURS; k++) values.set(palette[Math.min(k, palette.length - 1)], 4 * k);
  return values;
}
