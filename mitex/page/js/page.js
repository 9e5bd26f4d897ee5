// A look that grows on a mesh. Everything that can be done with it is a method; the panel and tests call them.

class Page extends View {
  // Steps are taken on `device`, or in WebGL2 if it is null.
  constructor(data, graphics, device = null) {
    super(data, graphics);
    this.device = device;
    Object.assign(this, { looks: data.looks, seed: data.seed, turn: data.turn, speed: data.speed });
    Object.assign(this, { chosen: 0, grafted: null });
    this.setMesh(meshOf(data.meshes[0]), data.meshes[0].levels);
    device?.lost.then(() => this._withoutDevice());
  }

  // Grows it on another one of the page's own meshes.
  chooseMesh(k) {
    this.setMesh(meshOf(this.data.meshes[k]), this.data.meshes[k].levels);
  }

  // Other weights for all looks, as a training has them; the states go on.
  refresh(looks) {
    this.looks = looks;
    this._weights();
  }

  get look() {
    return this.looks[this.chosen];
  }

  // Grows the look on a mesh that is subdivided so many times. It follows the mesh's own fields, if it has any.
  setMesh(base, levels) {
    if (base !== this.base) {
      const led = (own, now, otherwise) => (base.fields[own] ? own : now === own || now === undefined ? otherwise : now);
      this.field = led(MOTION, this.field, this.data.field);
      this.upwards = led(UPWARDS, this.upwards, this.data.upwards);
    }
    Object.assign(this, { base, levels });
    this.show(dense(base, levels));
    this.radius = 0.15 * this.studio.radius * this.surface.scale; // of the brush [mesh units]
    this._grow();
  }

  // Cells on the surface, from the seed.
  _grow() {
    this._settle();
    this.setShare(0);
    this.reset();
  }

  _settle() {
    this.automaton?.drop();
    const { graphics, surface, look, device } = this;
    this.automaton = device ? new ComputeAutomaton(graphics, surface, look, device)
      : new FragmentAutomaton(graphics, surface, look);
    this.decoder ??= new Decoder(graphics, look);
    this._weights();
    this.move(this.field, this.speed);
  }

  // Goes on in WebGL2 with the states that have arrived: browsers may take a device away.
  _withoutDevice() {
    const { steps, seed } = this.automaton;
    const states = this.automaton.read();
    this.device = null;
    this._settle();
    this._shares(this.shares);
    this.automaton.write(states);
    Object.assign(this.automaton, { steps, seed });
  }

  reset(seed = this.seed) {
    this.seed = seed;
    this.automaton.reset(seed);
    this.changed = true;
  }

  // Takes steps; pictures show them when the promise is kept.
  async step(count = 1) {
    await this.automaton.advance(count);
    this.changed = true;
  }

  // Turns the texture on the surface [rad], from +y or from where a field leads its up.
  orient(turn, upwards = this.upwards) {
    Object.assign(this, { turn, upwards });
    this.surface.orient(this.turnOn(this.surface.mesh));
    this._tell();
    this.changed = true;
  }

  turnOn(mesh) {
    return this.upwards ? turnsAlong(mesh, this.upwards, this.turn) : this.turn;
  }

  // Gives the mesh that is shown vectors at its vertices, for the texture's MOTION or what it takes for UPWARDS.
  follow(own, vectors) {
    this.base.fields[own] = vectors;
    this.surface.mesh.fields = dense(this.base, this.levels).fields;
    if (own === MOTION) this.move(own, this.speed);
    else this.orient(this.turn, own);
  }

  // Lets a texture that can move follow a field at some speed; null for none.
  move(field, speed) {
    Object.assign(this, { field, speed, changed: true });
    const { look, surface, followed } = this;
    this.vectors = followed && slowedVectors(surface.mesh, followed, speed, look.fastest ?? Infinity);
    this._tell();
    this.automaton.carry(followed && look.carried ? advectionOf(surface, this.vectors, look.period) : null);
  }

  // The field that moves the texture; null for none. What was trained to be told of one needs one.
  get followed() {
    if (this.look.condition) return this.field ?? FIELDS[0];
    return this.look.carried ? this.field : null;
  }

  _tell() {
    if (!this.look.condition) return;
    const { mesh, slots, turn } = this.surface;
    this.automaton.tell(slots.spread(toldVectors(mesh, this.vectors, turn), 3));
  }

  // Another look on the mesh; one of the same family goes on from the state that is there.
  setLook(chosen) {
    const related = this.looks[chosen].family === this.look.family;
    Object.assign(this, { chosen, grafted: null });
    if (related) {
      this._weights();
      this.move(this.field, this.speed);
    } else {
      this.decoder = null;
      this._grow();
    }
  }

  // Grafts another look of the family onto the one that is there; null for none.
  setGraft(grafted) {
    this.grafted = grafted;
    this._weights();
  }

  // Its share of all cells, in [0, 1].
  setShare(share) {
    this._shares(new Float32Array(this.surface.mesh.count).fill(share));
  }

  // Gives it the cells around a point, softly towards the brush's border.
  graft(point, radius = this.radius) {
    for (const [vertex, apart] of brushed(this.surface.mesh, point, radius)) {
      const share = clamp(2 - (2 * apart) / radius, 0, 1);
      this.shares[vertex] = Math.max(this.shares[vertex], share * share * (3 - 2 * share));
    }
    this._shares(this.shares);
  }

  _shares(shares) {
    this.shares = shares;
    this.automaton.share(this.surface.slots.order(shares));
    this.changed = true;
  }

  _weights() {
    const other = this.grafted === null ? null : this.looks[this.grafted];
    this.automaton.setLooks(this.look, other);
    this.decoder.setLooks(this.look, other);
    this.studio.relief = this.look.relief;
    this.changed = true;
  }

  // Sets the cells around a point of the surface back to the seed.
  erase(point, radius = this.radius) {
    const vertices = brushed(this.surface.mesh, point, radius).map(([vertex]) => vertex);
    this.automaton.clear(vertices);
    this.changed = true;
    return vertices;
  }

  // The maps at the points of a picture of ids.
  decode(target, ids) {
    this.decoder.decode(target, ids, this.automaton, this.studio.occlusion.cells.textures[0], this.studio.mode === GRAFT);
  }
}
