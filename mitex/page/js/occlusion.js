// How much light of the dome reaches the surface and the floor: the object is looked at from many directions,
// and what is not seen from one is in its shadow. It belongs to the mesh, so that it is computed once.

const DIRECTIONS = 64;
const MAP = 256; // side of a depth map [px]
const FLOOR = 64; // side of the floor's picture [px]

class Occlusion {
  constructor(graphics, surface, radius, floor) {
    Object.assign(this, { graphics, surface, radius, floor });
    this.cells = graphics.target([graphics.texture("RGBA16F", WIDTH, surface.height)]);
    this.ground = graphics.target([graphics.texture("RGBA16F", FLOOR, FLOOR, null, "LINEAR")]);
    this.half = 4 * radius; // of the floor's picture
    const depth = graphics.texture("DEPTH_COMPONENT24", MAP, MAP);
    const map = graphics.target([], depth);
    const drawn = graphics.program(SHADERS["ids.vert"], SHADERS["depth.frag"]);
    const seen = graphics.program(SHADERS["fill.vert"], SHADERS["visible.frag"]);
    for (const target of [this.cells, this.ground]) {
      graphics.into(target);
      graphics.gl.clearBufferfv(graphics.gl.COLOR, 0, [0, 0, 0, 0]);
    }
    const { corners, place, normals, faceCount } = surface;
    for (let k = 0; k < DIRECTIONS; k++) {
      const direction = onSphere(k, DIRECTIONS);
      const light = lightMatrix(direction, radius);
      drawDepth(graphics, map, drawn, { corners, place, camera: light }, faceCount);
      for (const [target, ground] of [[this.cells, 0], [this.ground, 1]]) {
        this._add(target, seen, { depth, place, normals, light, direction, ground, floor, extent: this.half });
      }
    }
    graphics.drop(map);
  }

  _add(target, program, values) {
    const { gl } = this.graphics;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    this.graphics.fill(target, program, { ...values, share: 4 / DIRECTIONS });
    gl.disable(gl.BLEND);
  }

  drop() {
    this.graphics.drop(this.cells);
    this.graphics.drop(this.ground);
  }
}

// Evenly spread over the sphere: Fibonacci's lattice.
function onSphere(k, count) {
  const y = 1 - (2 * k + 1) / count;
  const [r, turn] = [Math.sqrt(1 - y * y), k * Math.PI * (3 - Math.sqrt(5))];
  return [r * Math.cos(turn), y, r * Math.sin(turn)];
}

// From the object's space to the picture of a light far away.
function lightMatrix(direction, radius) {
  const side = Math.abs(direction[1]) > 0.99 ? [1, 0, 0] : [0, 1, 0];
  const right = unit(cross(side, direction));
  const up = cross(direction, right);
  const view = viewMatrix(scaled(direction, 2 * radius), right, up, direction);
  return times(orthographic(1.02 * radius, 0.9 * radius, 3.1 * radius), view);
}

function drawDepth(graphics, target, program, values, faces) {
  const { gl } = graphics;
  graphics.into(target);
  gl.enable(gl.DEPTH_TEST);
  gl.clear(gl.DEPTH_BUFFER_BIT);
  program.use(values);
  gl.drawArrays(gl.TRIANGLES, 0, 3 * faces);
}
