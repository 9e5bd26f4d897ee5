// Steps by a fragment shader, in every browser with WebGL2.

class FragmentAutomaton extends Automaton {
  constructor(graphics, surface, look) {
    super(graphics, surface, look, graphics.blockSize);
    this.states.push(this._target());
    this.setLooks(look);
    this.reset(0);
  }

  // The look whose rule the cells follow, and another one that may be grafted onto it.
  setLooks(look, other = null) {
    const rules = other ? { rule: look, other } : { rule: look };
    this._dropWeights();
    this.look = look;
    this.uniforms = {};
    for (const [rule, one] of Object.entries(rules)) {
      this.shape.weights(one).forEach((values, b) => {
        this.uniforms[`${rule}${b}Block`] = this.graphics.block(values);
      });
      Object.assign(this.uniforms, this.shape.bounds(one, rule));
    }
    this.program = this.graphics.program(SHADERS["fill.vert"], fragmentStep(this.shape, Object.keys(rules)));
  }

  // What carries the states after each step, of `advectionOf`; null for nothing.
  carry(advection) {
    const { graphics, shape, surface } = this;
    this._letGo();
    if (!advection) return;
    this.carrying = { sources: surface.cells("RGBA32UI", advection.sources), parts: graphics.list("RGBA32UI", advection.parts) };
    this.carryProgram = graphics.program(SHADERS["fill.vert"], written(SHADERS["carry.frag"], {
      SAMPLERS: each(shape.vectors, (c) => `uniform sampler2D state${c};`),
      OUTPUTS: each(shape.vectors, (c) => `layout(location = ${c}) out vec4 next${c};`),
      ZERO: each(shape.vectors, (c) => `next${c} = vec4(0.0);`),
      ADD: each(shape.vectors, (c) => `next${c} += weight * texelFetch(state${c}, place, 0);`) }));
  }

  // Takes steps; the states can be drawn when the promise is kept, which here is at once.
  async advance(count) {
    for (let k = 0; k < count; k++) this._step();
  }

  _step() {
    const { surface, uniforms, condition, shares } = this;
    this._pass(this.program, {
      ...uniforms, rows: surface.rows, links: surface.links, shares, condition,
      phase: phaseOf(this.steps, this.seed), count: surface.mesh.count, regular: this.look.mean ? 6 : 0,
    });
    if (this.carrying) this._pass(this.carryProgram, this.carrying);
    this.steps++;
    this.fresh = false;
  }

  // New states of all cells from the present ones.
  _pass(program, values) {
    const [from, to] = this.states;
    this.graphics.fill(to, program, { ...values, ...textures(from, "state") });
    this.states = [to, from];
  }

  _letGo() {
    Object.values(this.carrying ?? {}).forEach((texture) => this.graphics.gl.deleteTexture(texture));
    this.carrying = null;
  }

  _dropWeights() {
    for (const value of Object.values(this.uniforms ?? {})) {
      if (value instanceof WebGLBuffer) this.graphics.gl.deleteBuffer(value);
    }
  }

  drop() {
    this._dropWeights();
    this._letGo();
    super.drop();
  }
}
