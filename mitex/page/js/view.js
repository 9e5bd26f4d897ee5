// A mesh in the studio's light, whatever it wears: what pages have in common.

class View {
  constructor(data, graphics, studio = new Studio(graphics)) {
    Object.assign(this, { data, graphics, studio, canvas: graphics.canvas, samples: 1 });
  }

  show(mesh) {
    this.surface?.drop();
    this.surface = new Surface(this.graphics, mesh, this.data.edge, this.turnOn(mesh));
    this.enter();
  }

  // Comes into the studio, which another view may have left.
  enter() {
    this.studio.setSurface(this.surface);
    this.changed = true;
  }

  // The angle by which what it wears is turned on a mesh [rad]; one, or those of the vertices.
  turnOn() {
    return 0;
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

function meshOf({ positions, faces, name, fields = {} }) {
  const vectors = Object.entries(fields).map(([key, rows]) => [key, rowsOf(rows)]);
  const corners = Uint32Array.from(summed(faces, 3, faces.constructor));
  return new Mesh(rowsOf(positions), corners, name, Object.fromEntries(vectors));
}

// Rows of three numbers that are in steps from the lowest ones.
function rowsOf({ low, step, steps }) {
  return Float32Array.from(summed(steps, 3, Uint16Array), (count, k) => low[k % 3] + step[k % 3] * count);
}
