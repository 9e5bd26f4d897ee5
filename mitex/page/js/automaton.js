// The cells of a surface: their states, the steps that they take, and the derivatives that pixels read.

class Automaton {
  constructor(graphics, surface, look, other = null) {
    const shape = new RuleShape(look, graphics.blockSize);
    Object.assign(this, { graphics, surface, shape, look });
    if (shape.vectors > graphics.targets) throw new Error("the rule has too many channels for this device");
    this.states = [0, 1].map(() => this._target());
    this.table = this._target(4); // the states, then their derivatives along x, y and z
    this.shares = surface.cells("R32F");
    this.condition = surface.cells("RGBA32F");
    const text = { SAMPLERS: each(shape.vectors, (c) => `uniform sampler2D state${c};`),
      OUTPUTS: each(shape.vectors, (c) => `layout(location = ${c}) out vec4 slope${c};`) };
    this.slopesProgram = graphics.program(SHADERS["fill.vert"], written(SHADERS["slopes.frag"], { ...text,
      NOTHING: each(shape.vectors, (c) => `slope${c} = vec4(0.0);`),
      COPY: each(shape.vectors, (c) => `slope${c} = texelFetch(state${c}, at, 0);`),
      OWN: each(shape.vectors, (c) => `slope${c} = own * texelFetch(state${c}, at, 0);`),
      ADD: each(shape.vectors, (c) => `slope${c} += weight * texelFetch(state${c}, other, 0);`) }));
    this.setLooks(look, other);
    this.reset(0);
  }

  // Sets cells back to the seed.
  clear(vertices) {
    const { graphics, shape, surface } = this;
    const { gl } = graphics;
    this.clearing ??= graphics.program(SHADERS["clear.vert"], written(SHADERS["clear.frag"], {
      OUTPUTS: each(shape.vectors, (c) => `layout(location = ${c}) out vec4 seed${c};`),
      ZERO: each(shape.vectors, (c) => `seed${c} = vec4(0.0);`) }));
    const points = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, points);
    gl.bufferData(gl.ARRAY_BUFFER, Uint32Array.from(vertices, (v) => surface.slots.slotOf[v]), gl.STREAM_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 0);
    graphics.into(this.states[0]);
    this.clearing.use({ height: surface.height });
    gl.disable(gl.DEPTH_TEST);
    gl.drawArrays(gl.POINTS, 0, vertices.length);
    gl.disableVertexAttribArray(0);
    gl.deleteBuffer(points);
    this.fresh = false;
  }

  // The look whose rule the cells follow, and another one that may be grafted onto it.
  setLooks(look, other = null) {
    const rules = other ? { rule: look, other } : { rule: look };
    this._dropWeights();
    this.look = look;
    this.uniforms = {};
    for (const [name, one] of Object.entries(rules)) {
      Object.assign(this.uniforms, this.shape.buffers(this.graphics, one, name));
      this.uniforms[`${name}Low`] = four(one.low, this.shape.vectors);
      this.uniforms[`${name}High`] = four(one.high, this.shape.vectors);
      this.uniforms[`${name}Bias`] = four(one.bias2, this.shape.vectors);
    }
    this.programs ??= {};
    const key = Object.keys(rules).length;
    this.programs[key] ??= this.graphics.program(SHADERS["fill.vert"], this.shape.shader(Object.keys(rules)));
    this.program = this.programs[key];
  }

  reset(seed) {
    this.seed = seed;
    this.steps = 0;
    this.write(new Float32Array(this.surface.mesh.count * this.shape.channels));
  }

  step() {
    const { surface, uniforms, condition, shares } = this;
    const [from, to] = this.states;
    this.graphics.fill(to, this.program, {
      ...uniforms, ...textures(from, "state"), rows: surface.rows, links: surface.links, shares, condition,
      phase: phaseOf(this.steps, this.seed), count: surface.mesh.count, regular: this.look.mean ? 6 : 0,
    });
    this.states = [to, from];
    this.steps++;
    this.fresh = false;
  }

  // What pixels read: the states and their derivatives, as of now.
  readable() {
    if (!this.fresh) {
      const { rows, links, slopes, ownSlopes, mesh, height } = this.surface;
      this.graphics.fill(this.table, this.slopesProgram, {
        ...textures(this.states[0], "state"), rows, links, slopes, ownSlopes, height, count: mesh.count,
      });
      this.fresh = true;
    }
    return textures(this.table, "state");
  }

  // States (count x channels), by vertex.
  read() {
    const { channels, vectors } = this.shape;
    const { slots, mesh } = this.surface;
    const parts = Array.from({ length: vectors }, (_, c) => this.graphics.read(this.states[0], c));
    const values = new Float32Array(mesh.count * channels);
    for (let v = 0; v < mesh.count; v++) {
      const at = 4 * slots.slotOf[v];
      for (let c = 0; c < channels; c++) values[v * channels + c] = parts[c >> 2][at + (c & 3)];
    }
    return values;
  }

  write(values) {
    const { channels, vectors } = this.shape;
    const { slots, mesh } = this.surface;
    for (let c = 0; c < vectors; c++) {
      const rows = new Float32Array(4 * mesh.count);
      for (let v = 0; v < mesh.count; v++) {
        for (let k = 0; k < 4 && 4 * c + k < channels; k++) {
          rows[4 * slots.slotOf[v] + k] = values[v * channels + 4 * c + k];
        }
      }
      this.graphics.refill(this.states[0].textures[c], rows);
    }
    this.fresh = false;
  }

  _target(parts = 1) {
    const { graphics, surface, shape } = this;
    return graphics.target(Array.from({ length: shape.vectors }, () =>
      graphics.texture("RGBA32F", WIDTH, parts * surface.height)));
  }

  _dropWeights() {
    for (const value of Object.values(this.uniforms ?? {})) {
      if (value instanceof WebGLBuffer) this.graphics.gl.deleteBuffer(value);
    }
  }

  drop() {
    this._dropWeights();
    [...this.states, this.table].forEach((target) => this.graphics.drop(target));
    this.graphics.gl.deleteTexture(this.shares);
    this.graphics.gl.deleteTexture(this.condition);
  }
}

const textures = (target, name) =>
  Object.fromEntries(target.textures.map((texture, c) => [`${name}${c}`, texture]));

function four(values, vectors) {
  const padded = new Float32Array(4 * vectors);
  padded.set(values);
  return padded;
}
