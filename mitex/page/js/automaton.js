// The cells of a surface: their states, and the derivatives that pixels read. How they take steps is for
// FragmentAutomaton and ComputeAutomaton.

class Automaton {
  constructor(graphics, surface, look, blockSize) {
    const shape = new RuleShape(look, blockSize);
    Object.assign(this, { graphics, surface, shape, look, steps: 0 });
    if (shape.vectors > graphics.targets) throw new Error("the rule has too many channels for this device");
    this.states = [this._target()];
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
  }

  // Whether steps are on their way.
  get busy() {
    return false;
  }

  // Sets cells back to the seed.
  clear(vertices) {
    this._clear(Uint32Array.from(vertices, (v) => this.surface.slots.slotOf[v]));
  }

  _clear(slots) {
    const { graphics, shape, surface } = this;
    const { gl } = graphics;
    this.clearing ??= graphics.program(SHADERS["clear.vert"], written(SHADERS["clear.frag"], {
      OUTPUTS: each(shape.vectors, (c) => `layout(location = ${c}) out vec4 seed${c};`),
      ZERO: each(shape.vectors, (c) => `seed${c} = vec4(0.0);`) }));
    const points = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, points);
    gl.bufferData(gl.ARRAY_BUFFER, slots, gl.STREAM_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 0);
    graphics.into(this.states[0]);
    this.clearing.use({ height: surface.height });
    gl.disable(gl.DEPTH_TEST);
    gl.drawArrays(gl.POINTS, 0, slots.length);
    gl.disableVertexAttribArray(0);
    gl.deleteBuffer(points);
    this.fresh = false;
  }

  reset(seed) {
    this.seed = seed;
    this.steps = 0;
    this.write(new Float32Array(this.surface.mesh.count * this.shape.channels));
  }

  // Shares of the look that is grafted on, by cell.
  share(values) {
    this.graphics.refill(this.shares, values);
  }

  // What a moving texture is told: four numbers by cell.
  tell(values) {
    this.graphics.refill(this.condition, values);
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
    this._show(this._planes(values));
  }

  // States as the textures have them, one after the other.
  _planes(values) {
    const { channels, vectors } = this.shape;
    const { slots, mesh, height } = this.surface;
    const planes = new Float32Array(vectors * 4 * WIDTH * height);
    for (let v = 0; v < mesh.count; v++) {
      for (let c = 0; c < channels; c++) {
        planes[4 * ((c >> 2) * WIDTH * height + slots.slotOf[v]) + (c & 3)] = values[v * channels + c];
      }
    }
    return planes;
  }

  _show(planes) {
    const size = planes.length / this.shape.vectors;
    this.states[0].textures.forEach((texture, c) =>
      this.graphics.refill(texture, planes.subarray(c * size, (c + 1) * size)));
    this.fresh = false;
  }

  _target(parts = 1) {
    const { graphics, surface, shape } = this;
    return graphics.target(Array.from({ length: shape.vectors }, () =>
      graphics.texture("RGBA32F", WIDTH, parts * surface.height)));
  }

  drop() {
    [...this.states, this.table].forEach((target) => this.graphics.drop(target));
    this.graphics.gl.deleteTexture(this.shares);
    this.graphics.gl.deleteTexture(this.condition);
  }
}

const textures = (target, name) =>
  Object.fromEntries(target.textures.map((texture, c) => [`${name}${c}`, texture]));
