// A triangle mesh, and what follows from its positions and faces. Numbers are those of Mitex's own Mesh.

// `fields` are vectors at the vertices, by name.

class Mesh {
  constructor(positions, faces, name = "mesh", fields = {}) {
    Object.assign(this, { positions, faces, name, fields });
    this.count = positions.length / 3;
    this.neighbours = neighboursOf(faces, this.count);
    this.crosses = this._crosses();
    this.normals = this._normals();
    this.edgeLengths = this._edgeLengths();
  }

  point(vertex) {
    return rowOf(this.positions, vertex);
  }

  normal(vertex) {
    return rowOf(this.normals, vertex);
  }

  // The mean of the vertices, and the largest distance of one from it.
  sphere() {
    const centre = [0, 0, 0];
    for (let k = 0; k < this.positions.length; k++) centre[k % 3] += this.positions[k] / this.count;
    let radius = 0;
    for (let v = 0; v < this.count; v++) radius = Math.max(radius, distance(this.point(v), centre));
    return { centre, radius: radius || 1 };
  }

  _crosses() {
    const crosses = new Float64Array(this.faces.length);
    for (let f = 0; f < this.faces.length; f += 3) {
      const [a, b, c] = [0, 1, 2].map((k) => this.point(this.faces[f + k]));
      crosses.set(cross(minus(b, a), minus(c, a)), f);
    }
    return crosses;
  }

  _normals() {
    const sums = new Float64Array(3 * this.count);
    for (let k = 0; k < this.faces.length; k++) {
      const face = 3 * Math.floor(k / 3);
      for (let c = 0; c < 3; c++) sums[3 * this.faces[k] + c] += this.crosses[face + c];
    }
    const normals = new Float32Array(sums.length);
    for (let v = 0; v < this.count; v++) {
      const sum = sums.subarray(3 * v, 3 * v + 3);
      normals.set(norm(sum) > 0 ? unit(sum) : [0, 0, 1], 3 * v);
    }
    return normals;
  }

  // The mean length at each vertex; of all edges where there are none.
  _edgeLengths() {
    const { start, index } = this.neighbours;
    const lengths = new Float64Array(this.count);
    let all = 0;
    for (let v = 0; v < this.count; v++) {
      let sum = 0;
      for (let k = start[v]; k < start[v + 1]; k++) sum += distance(this.point(index[k]), this.point(v));
      all += sum;
      lengths[v] = sum / Math.max(start[v + 1] - start[v], 1);
    }
    this.meanEdge = index.length ? all / index.length : 1;
    return lengths.map((length) => length || this.meanEdge);
  }
}

const rowOf = (rows, k) => rows.subarray(3 * k, 3 * k + 3);

// For each vertex the others that it has an edge with, ascending: index[start[v]] to index[start[v + 1] - 1].
function neighboursOf(faces, count) {
  const keys = new Float64Array(2 * faces.length);
  sides(faces, (a, b, k) => { keys[2 * k] = a * count + b; keys[2 * k + 1] = b * count + a; });
  const edges = distinct(keys.sort(), (key) => Math.floor(key / count) !== key % count);
  const start = new Uint32Array(count + 1);
  const index = new Uint32Array(edges.length);
  edges.forEach((key, k) => { start[Math.floor(key / count) + 1]++; index[k] = key % count; });
  for (let v = 0; v < count; v++) start[v + 1] += start[v];
  return { start, index };
}

// Every triangle becomes four, in the order of mitex.mesh.subdivide: the old vertices, then one for each edge.
function subdivided(mesh) {
  const { faces, count } = mesh;
  const keyOf = (a, b) => Math.min(a, b) * count + Math.max(a, b);
  const keys = new Float64Array(faces.length);
  sides(faces, (a, b, k) => { keys[k] = keyOf(a, b); });
  const edges = distinct(keys.sort(), () => true);
  const middle = new Map();
  edges.forEach((key, k) => middle.set(key, count + k));
  const halved = (values) => {
    const rows = new Float32Array(3 * (count + edges.length));
    rows.set(values);
    edges.forEach((key, k) => {
      const [a, b] = [rowOf(values, Math.floor(key / count)), rowOf(values, key % count)];
      for (let c = 0; c < 3; c++) rows[3 * (count + k) + c] = 0.5 * (a[c] + b[c]);
    });
    return rows;
  };
  const children = new Uint32Array(4 * faces.length);
  for (let f = 0; f < faces.length; f += 3) {
    const [a, b, c] = faces.subarray(f, f + 3);
    const [ab, bc, ca] = [middle.get(keyOf(a, b)), middle.get(keyOf(b, c)), middle.get(keyOf(c, a))];
    children.set([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], 4 * f);
  }
  const fields = Object.entries(mesh.fields).map(([name, vectors]) => [name, halved(vectors)]);
  return new Mesh(halved(mesh.positions), children, mesh.name, Object.fromEntries(fields));
}

// The mesh with about as many vertices as a texture was trained on, and how often it was subdivided for it.
function dense(mesh, levels) {
  let fine = mesh;
  for (let k = 0; k < levels; k++) fine = subdivided(fine);
  return fine;
}

function sides(faces, visit) {
  for (let k = 0; k < faces.length; k++) visit(faces[k], faces[k % 3 === 2 ? k - 2 : k + 1], k);
}

function distinct(sorted, keep) {
  return sorted.filter((key, k) => (k === 0 || key !== sorted[k - 1]) && keep(key));
}
