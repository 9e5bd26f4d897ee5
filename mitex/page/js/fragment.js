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

  // Takes steps; the states can be drawn when the promise is kept, which here is at once.
  async advance(count) {
    for (let k = 0; k < count; k++) this._step();
  }

  _step() {
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

  _dropWeights() {
    for (const value of Object.values(this.uniforms ?? {})) {
      if (value instanceof WebGLBuffer) this.graphics.gl.deleteBuffer(value);
    }
  }

  drop() {
    this._dropWeights();
    super.drop();
  }
}
