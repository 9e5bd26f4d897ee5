// The page: one mesh, a look that grows on it, and pictures of both. Everything that can be done with it is a
// method here; the panel and tests call them.

class Page {
  constructor(data, canvas) {
    this.graphics = new Graphics(canvas);
    Object.assign(this, { data, canvas, looks: data.looks, seed: data.seed, turn: data.turn, samples: 1 });
    Object.assign(this, { field: data.field, speed: data.speed });
    this.studio = new Studio(this.graphics);
    this.chosen = 0;
    this.setMesh(meshOf(data.mesh), data.mesh.levels);
  }

  get look() {
    return this.looks[this.chosen];
  }

  // Grows the look on a mesh that is subdivided so many times.
  setMesh(base, levels) {
    Object.assign(this, { base, levels });
    this.automaton?.drop();
    this.surface?.drop();
    this.surface = new Surface(this.graphics, dense(base, levels), this.data.edge, this.turn);
    this.studio.setSurface(this.surface);
    this.studio.relief = this.look.relief;
    this.automaton = new Automaton(this.graphics, this.surface, this.look);
    this.decoder ??= new Decoder(this.graphics, this.look);
    this.move(this.field, this.speed);
    this.radius = 0.15 * this.studio.radius * this.surface.scale; // of the brush [mesh units]
    this.reset();
  }

  reset(seed = this.seed) {
    this.seed = seed;
    this.automaton.reset(seed);
    this.changed = true;
  }

  step(count = 1) {
    for (let k = 0; k < count; k++) this.automaton.step();
    this.changed = true;
  }

  // Turns the texture on the surface [rad].
  orient(turn) {
    this.turn = turn;
    this.surface.orient(turn);
    this.move(this.field, this.speed);
  }

  // Lets a moving texture follow a field at some speed.
  move(field, speed) {
    Object.assign(this, { field, speed, changed: true });
    if (!this.look.condition) return;
    const { mesh, slots } = this.surface;
    const told = conditionOf(mesh, field, speed, this.look.fastest ?? Infinity, this.turn);
    this.graphics.refill(this.automaton.condition, slots.spread(told, 3));
  }

  // What the picture shows: one of MODES.
  setMode(name) {
    this.studio.mode = MODES.indexOf(name);
    this.changed = true;
  }

  // The point of the surface at a place of the picture [pixels from its upper left corner].
  pick(x, y) {
    this.see();
    return this.studio.pick(Math.floor(x), this.canvas.height - 1 - Math.floor(y));
  }

  // Sets the cells around a point of the surface back to the seed.
  erase(point, radius = this.radius) {
    const vertices = brushed(this.surface.mesh, point, radius).map(([vertex]) => vertex);
    this.automaton.clear(vertices);
    this.changed = true;
    return vertices;
  }

  // Which points of the surface the pixels see.
  see() {
    this.studio.resize(this.canvas.width, this.canvas.height, this.samples);
    this.studio.look();
  }

  // A picture on the canvas.
  draw() {
    this.see();
    this.decoder.decode(this.studio.maps, this.studio.picture.textures[0], this.automaton,
      this.studio.occlusion.cells.textures[0]);
    this.studio.render();
    this.changed = false;
  }

  // The picture as pixels, row 0 below.
  pixels() {
    this.draw();
    const { gl } = this.graphics;
    const { width, height } = this.canvas;
    const values = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, values);
    return values;
  }
}

function meshOf({ low, step, positions, faces, name }) {
  const quanta = summed(positions, 3, Uint16Array);
  const places = Float32Array.from(quanta, (value, k) => low[k % 3] + step[k % 3] * value);
  return new Mesh(places, Uint32Array.from(summed(faces, 3, faces.constructor)), name);
}
