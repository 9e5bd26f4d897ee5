// States that are carried along a field, as mitex.methods.nca.motion.advection has it: each cell takes over what
// the smooth interpolation reads upstream of it.

// What each cell's state comes from, in rows of four numbers: `sources`, by texel, the first of its parts and their
// number; `parts` the texel of a cell and the bits of its weight.
function advectionOf(surface, vectors, period) {
  const { mesh, slots } = surface;
  const around = facesAround(mesh);
  const sums = Array.from({ length: mesh.count }, (_, v) => {
    if (around.start[v] === around.start[v + 1]) return new Map([[v, 1]]); // a vertex without a face
    const upstream = plus(mesh.point(v), rowOf(vectors, v), -mesh.edgeLengths[v] / period);
    return interpolated(surface, nearestFrom(mesh, around, v, upstream));
  });
  const rows = new Uint32Array(2 * mesh.count);
  const parts = new Uint32Array(4 * sums.reduce((total, sum) => total + sum.size, 0));
  const weights = new Float32Array(parts.buffer);
  let at = 0;
  sums.forEach((sum, v) => {
    rows.set([at, sum.size], 2 * v);
    for (const [vertex, weight] of sum) {
      parts[4 * at] = slots.slotOf[vertex];
      weights[4 * at + 1] = weight;
      at++;
    }
  });
  return { sources: slots.spread(rows, 2, Uint32Array), parts };
}

// The weights of the vertices, by vertex, with which their values give that of a point.
function interpolated({ mesh, points, gradients }, { face, barycentric }) {
  const { start, index } = mesh.neighbours;
  const corners = [...mesh.faces.subarray(3 * face, 3 * face + 3)];
  const [ofValue, ofSlope] = sideVertex(corners.map((v) => rowOf(points, v)), corners.map((v) => mesh.normal(v)), barycentric);
  const sum = new Map();
  const add = (vertex, weight) => sum.set(vertex, (sum.get(vertex) ?? 0) + weight);
  corners.forEach((v, k) => {
    add(v, ofValue[k] + dot(ofSlope[k], rowOf(gradients.own, v)));
    for (let n = start[v]; n < start[v + 1]; n++) add(index[n], dot(ofSlope[k], gradients.links.subarray(4 * n, 4 * n + 3)));
  });
  return sum;
}

// Nielson's interpolant, as smooth.glsl has it: weights of the corners' values and derivatives.
function sideVertex(corner, normals, barycentric) {
  const [ofValue, ofSlope] = [[0, 0, 0], [[0, 0, 0], [0, 0, 0], [0, 0, 0]]];
  const squares = barycentric.map((b) => b * b);
  const shares = [0, 1, 2].map((k) => squares[(k + 1) % 3] * squares[(k + 2) % 3]);
  const total = shares[0] + shares[1] + shares[2];
  for (let k = 0; k < 3; k++) {
    const [i, j, share] = [(k + 1) % 3, (k + 2) % 3, total > 1e-30 ? shares[k] / total : 1 / 3];
    const along = minus(corner[j], corner[i]);
    const length2 = Math.max(dot(along, along), 1e-30);
    const across = unit(cross(plus(normals[i], normals[j]), along));
    const both = barycentric[i] + barycentric[j];
    const t = both > 0 ? barycentric[j] / both : 0.5;
    const [[h, g], [c]] = [cubics(t), cubics(barycentric[k])];
    const radial = minus(corner[k], plus(corner[i], along, t));
    const ahead = dot(radial, along) / length2;
    const height = Math.sqrt(Math.max(dot(radial, radial) - ahead * ahead * length2, 0));
    const slope = (to, a, b) => { ofSlope[to] = plus(plus(ofSlope[to], along, share * a), across, share * b); };
    ofValue[i] += share * (c[0] * h[0] + c[1] * ahead * g[0]);
    ofValue[j] += share * (c[0] * h[2] + c[1] * ahead * g[2]);
    slope(i, c[0] * h[1] + c[1] * ahead * g[1], c[1] * height * (1 - t));
    slope(j, c[0] * h[3] + c[1] * ahead * g[3], c[1] * height * t);
    ofValue[k] += share * c[2];
    ofSlope[k] = plus(ofSlope[k], radial, share * c[3]);
  }
  return [ofValue, ofSlope];
}

// Hermite's cubics of the value and slope at 0 and at 1, and their derivatives.
function cubics(t) {
  const [t2, t3] = [t * t, t * t * t];
  return [[2 * t3 - 3 * t2 + 1, t3 - 2 * t2 + t, 3 * t2 - 2 * t3, t3 - t2],
    [6 * (t2 - t), 3 * t2 - 4 * t + 1, 6 * (t - t2), 3 * t2 - 2 * t]];
}

// For each vertex its faces: list[start[v]] to list[start[v + 1] - 1].
function facesAround({ faces, count }) {
  const start = new Uint32Array(count + 1);
  for (const v of faces) start[v + 1]++;
  for (let v = 0; v < count; v++) start[v + 1] += start[v];
  const [free, list] = [start.slice(), new Uint32Array(faces.length)];
  faces.forEach((v, k) => { list[free[v]++] = Math.floor(k / 3); });
  return { start, list };
}

// The nearest point of the mesh to one that is not far from a vertex: from face to face while it comes nearer.
function nearestFrom(mesh, { start, list }, vertex, point) {
  let [best, vertices] = [{ apart: Infinity }, [vertex]];
  for (let moved = true; moved;) {
    moved = false;
    for (const v of vertices) {
      for (const face of list.subarray(start[v], start[v + 1])) {
        const one = nearestOn([0, 1, 2].map((k) => mesh.point(mesh.faces[3 * face + k])), point);
        if (one.apart < best.apart) [best, moved] = [{ face, ...one }, true];
      }
    }
    vertices = mesh.faces.subarray(3 * best.face, 3 * best.face + 3);
  }
  return best;
}

// The barycentrics of a triangle's point that is nearest to another one, and how far apart they are.
function nearestOn(corners, point) {
  const [ab, ac, ap] = [corners[1], corners[2], point].map((x) => minus(x, corners[0]));
  const normal = cross(ab, ac);
  const area2 = dot(normal, normal);
  const [b, c] = [dot(cross(ap, ac), normal) / area2, dot(cross(ab, ap), normal) / area2];
  if (b >= 0 && c >= 0 && b + c <= 1) return { barycentric: [1 - b - c, b, c], apart: Math.abs(dot(ap, normal)) / Math.sqrt(area2) };
  const sides = [0, 1, 2].map((k) => {
    const [from, to] = [corners[k], corners[(k + 1) % 3]];
    const along = minus(to, from);
    const t = clamp(dot(minus(point, from), along) / (dot(along, along) || 1), 0, 1);
    const barycentric = [0, 0, 0];
    [barycentric[k], barycentric[(k + 1) % 3]] = [1 - t, t];
    return { barycentric, apart: distance(point, plus(from, along, t)) };
  });
  return sides.reduce((best, side) => (side.apart < best.apart ? side : best));
}
