// Which vertices a brush covers: those within a ball around a point that paths along the edges lead to, so
// that it never goes through the object.

const DETOUR = 1.15; // paths along edges are longer than straight ones

// The vertices within `radius` of a point on a face, and how far each is: [vertex, distance] pairs.
function brushed(mesh, { face, barycentric }, radius) {
  const corners = [...mesh.faces.subarray(3 * face, 3 * face + 3)];
  const centre = pointAt(mesh, { face, barycentric });
  const paths = new Map(); // vertex -> length of the shortest path so far
  const queue = new Heap();
  const reach = (vertex, length) => {
    const straight = distance(mesh.point(vertex), centre);
    if (straight > radius || length > DETOUR * radius || length >= (paths.get(vertex) ?? Infinity)) return;
    paths.set(vertex, length);
    queue.push(length, vertex);
  };
  for (const vertex of corners) reach(vertex, distance(mesh.point(vertex), centre));
  // A brush smaller than the mesh's edges still covers a vertex.
  if (!paths.size) paths.set(corners[barycentric.indexOf(Math.max(...barycentric))], 0);
  const { start, index } = mesh.neighbours;
  while (queue.size) {
    const [length, vertex] = queue.pop();
    if (length > paths.get(vertex)) continue;
    for (let k = start[vertex]; k < start[vertex + 1]; k++) {
      reach(index[k], length + distance(mesh.point(vertex), mesh.point(index[k])));
    }
  }
  return [...paths.keys()].map((vertex) => [vertex, distance(mesh.point(vertex), centre)]);
}

function pointAt(mesh, { face, barycentric }) {
  let point = [0, 0, 0];
  for (let k = 0; k < 3; k++) point = plus(point, mesh.point(mesh.faces[3 * face + k]), barycentric[k]);
  return point;
}

// A queue whose smallest key comes first.
class Heap {
  constructor() {
    this.items = [];
  }

  get size() {
    return this.items.length;
  }

  push(key, value) {
    const { items } = this;
    let at = items.push([key, value]) - 1;
    while (at && items[(at - 1) >> 1][0] > key) {
      items[at] = items[(at - 1) >> 1];
      at = (at - 1) >> 1;
    }
    items[at] = [key, value];
  }

  pop() {
    const { items } = this;
    const [first, last] = [items[0], items.pop()];
    let at = 0;
    while (items.length) {
      let child = 2 * at + 1;
      if (child + 1 < items.length && items[child + 1][0] < items[child][0]) child++;
      if (child >= items.length || items[child][0] >= last[0]) break;
      items[at] = items[child];
      at = child;
    }
    if (items.length) items[at] = last;
    return first;
  }
}
