// A mesh in the studio's light, whatever it wears: what pages have in common.

class View {
  constructor(data, graphics) {
    Object.assign(this, { data, graphics, canvas: graphics.canvas, turn: data.turn ?? 0, samples: 1 });
    this.studio = new Studio(this.graphics);
  }

  show(mesh) {
    this.surface?.drop();
    this.surface = new Surface(this.graphics, mesh, this.data.edge, this.turn);
    this.studio.setSurface(this.surface);
    this.changed = true;
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

  // Which points of the surface the pixels see.
  see() {
    this.studio.resize(this.canvas.width, this.canvas.height, this.samples);
    this.studio.look();
  }

  // A picture on the canvas.
  draw() {
    this.see();
    this.decode(this.studio.maps, this.studio.picture.textures[0]);
    this.studio.render();
    this.changed = false;
  }

  // Bytes of a GLB file with textures of `side` texels.
  glb(side) {
    return glbOf(this, side);
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
