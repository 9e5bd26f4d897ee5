// A mesh on the graphics card: what cells and pixels read of it, by slot.

class Surface {
  constructor(graphics, mesh, edge, turn) {
    const slots = new Slots(mesh.count);
    Object.assign(this, { graphics, mesh, slots, turn });
    this.height = 4 * Math.max(Math.ceil(mesh.count / WIDTH / 4), 1);
    const { centre } = mesh.sphere();
    this.centre = centre;
    this.scale = mesh.meanEdge / edge; // from decoder units to those of the mesh
    this.points = this._points();
    this.place = this._cells("RGBA32F", slots.spread(this._places(), 4));
    this.normals = this._cells("RGBA32F", slots.spread(mesh.normals, 3));
    this.rights = this._cells("RGBA32F", this._rights(turn));
    this.faceCount = mesh.faces.length / 3;
    this.corners = graphics.list("RGBA32UI", this._corners());
    this.rowValues = this._rows();
    this.linkValues = this._links(turn);
    this.rows = this._cells("RGBA32UI", this.rowValues);
    this.links = graphics.list("RGBA32UI", this.linkValues);
    this.gradients = gradients(this.points, mesh);
    this.slopes = graphics.list("RGBA32F", this.gradients.links);
    this.ownSlopes = this._cells("RGBA32F", slots.spread(this.gradients.own, 3));
  }

  // Turns the texture about the normals by this angle [rad], one or those of the vertices.
  orient(turn) {
    this.turn = turn;
    this.linkValues = this._links(turn);
    this.graphics.refill(this.links, this.linkValues);
    this.graphics.refill(this.rights, this._rights(turn));
  }

  // A texture with a texel for each cell.
  cells(format, values = []) {
    return this._cells(format, values);
  }

  _cells(format, values) {
    const texture = this.graphics.list(format, values, WIDTH);
    if (texture.height === this.height) return texture;
    this.graphics.gl.deleteTexture(texture);
    const { 2: Kind } = FORMATS[format];
    const padded = new Kind(WIDTH * this.height * (format.startsWith("RGBA") ? 4 : 1));
    padded.set(values);
    return this.graphics.list(format, padded, WIDTH);
  }

  // What shaders read of the texture's orientation.
  get orientation() {
    const follows = typeof this.turn !== "number";
    return { follows, rights: this.rights, turn: follows ? 0 : this.turn };
  }

  // Where the exemplar's right points, if cells have turns of their own.
  _rights(turn) {
    const rows = new Float32Array(3 * this.mesh.count);
    for (let v = 0; typeof turn !== "number" && v < this.mesh.count; v++) {
      const normal = unit(this.mesh.normal(v));
      rows.set(rotated(rightwards(normal), normal, turn[v]), 3 * v);
    }
    return this.slots.spread(rows, 3);
  }

  // Positions in decoder units.
  _points() {
    return Float32Array.from(this.mesh.positions, (x, k) => (x - this.centre[k % 3]) / this.scale);
  }

  _places() {
    const places = new Float32Array(4 * this.mesh.count);
    for (let v = 0; v < this.mesh.count; v++) {
      places.set(this.points.subarray(3 * v, 3 * v + 3), 4 * v);
      places[4 * v + 3] = this.mesh.edgeLengths[v] / this.scale;
    }
    return places;
  }

  _corners() {
    const { faces } = this.mesh;
    const corners = new Uint32Array((4 * faces.length) / 3);
    for (let k = 0; k < faces.length; k++) corners[4 * Math.floor(k / 3) + (k % 3)] = this.slots.slotOf[faces[k]];
    return corners;
  }

  _rows() {
    const { start } = this.mesh.neighbours;
    const rows = new Uint32Array(2 * this.mesh.count);
    for (let v = 0; v < this.mesh.count; v++) rows.set([start[v], start[v + 1] - start[v]], 2 * v);
    return this.slots.spread(rows, 2, Uint32Array);
  }

  // The neighbours' texels and the directions to them, which are turned back by the texture's orientation.
  _links(turn) {
    const { mesh, slots } = this;
    const { start, index } = mesh.neighbours;
    const links = new Uint32Array(4 * index.length);
    const directions = new Float32Array(links.buffer);
    for (let v = 0; v < mesh.count; v++) {
      const [normal, angle] = [mesh.normal(v), turnAt(turn, v)];
      for (let k = start[v]; k < start[v + 1]; k++) {
        let way = unit(minus(mesh.point(index[k]), mesh.point(v)));
        if (angle) way = rotated(way, normal, -angle);
        links[4 * k] = slots.slotOf[index[k]];
        directions.set(way, 4 * k + 1);
      }
    }
    return links;
  }

  drop() {
    for (const name of ["place", "normals", "corners", "rights", "rows", "links", "slopes", "ownSlopes"]) {
      this.graphics.gl.deleteTexture(this[name]);
    }
  }
}

// The weights with which values at the vertices give their derivatives, see mitex.mesh.gradients: by link
// (four numbers each) and of the vertices themselves (three).
function gradients(points, mesh) {
  const { start, index } = mesh.neighbours;
  const { links, own, total } = {
    links: new Float32Array(4 * index.length), own: new Float32Array(3 * mesh.count), total: new Float64Array(mesh.count),
  };
  const point = (v) => points.subarray(3 * v, 3 * v + 3);
  const triangles = [];
  let largest = 0;
  for (let f = 0; f < mesh.faces.length; f += 3) {
    const corners = mesh.faces.subarray(f, f + 3);
    const [a, b, c] = [...corners].map(point);
    const normal = cross(minus(b, a), minus(c, a));
    triangles.push([corners, normal, norm(normal)]);
    largest = Math.max(largest, norm(normal));
  }
  const used = triangles.filter(([, , area2]) => area2 > 1e-12 * largest);
  for (const [corners, , area2] of used) for (const v of corners) total[v] += area2;
  for (const [corners, normal, area2] of used) {
    for (let k = 0; k < 3; k++) {
      const side = minus(point(corners[(k + 2) % 3]), point(corners[(k + 1) % 3]));
      const hat = cross(scaled(normal, 1 / area2), side);
      for (const v of corners) {
        const [values, at] = v === corners[k] ? [own, 3 * v] : [links, 4 * find(index, start, v, corners[k])];
        for (let c = 0; c < 3; c++) values[at + c] += hat[c] / total[v];
      }
    }
  }
  return { links, own };
}

function find(index, start, vertex, neighbour) {
  let [low, high] = [start[vertex], start[vertex + 1]];
  while (low < high - 1) {
    const middle = (low + high) >> 1;
    if (index[middle] <= neighbour) low = middle;
    else high = middle;
  }
  return low;
}
