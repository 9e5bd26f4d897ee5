// Files that are dropped into the page: meshes (OBJ, PLY, GLB), of which positions and faces are read, and vectors
// at the vertices of a mesh (NPY, PLY).

const MOST_VERTICES = 300_000;
const ENOUGH = 8_000; // vertices, as `--subdivide auto` has it
const MOST_LEVELS = 6;

// What is in a file: a mesh, and vectors at its vertices or at those of another one; null for what is not there.
// Errors say what is wrong.
function readFile(bytes, name) {
  const reader = { obj: readObj, ply: readPly, glb: readGlb, npy: readNpy }[name.toLowerCase().split(".").pop()];
  if (!reader) throw new Error(`${name} is no OBJ, PLY, GLB or NPY file`);
  const { positions = [], faces = [], vectors = [] } = given(reader, bytes, name);
  const alone = vectors.length && !faces.length;
  return { mesh: alone ? null : meshOfFile(positions, faces, name), vectors: vectors.length ? vectors : null };
}

// `origin` has the file's number of each vertex, of `fileCount`.
function meshOfFile(given, corners, name) {
  const fileCount = given.length / 3;
  if (corners.some((index) => !(index < fileCount))) throw new Error(`${name} is damaged: a face has no such vertex`);
  const { positions, faces, origin } = welded(given, corners);
  if (!faces.length || !positions.every(Number.isFinite)) throw new Error(`${name} has no faces that can be shown`);
  if (origin.length > MOST_VERTICES) throw new Error(`${name} has more than ${MOST_VERTICES.toLocaleString()} vertices`);
  return Object.assign(new Mesh(positions, faces, name.replace(/\.\w+$/, "")), { origin, fileCount });
}

// Whether there is one for each vertex of a mesh, or of the file that it was in.
const fits = (vectors, mesh) => [mesh.count, mesh.fileCount].includes(vectors.length / 3);

// The same as vectors of the mesh's vertices; errors say what is wrong.
function vectorsOf(mesh, vectors, name) {
  const count = vectors.length / 3;
  if (!fits(vectors, mesh)) {
    const [has, needs] = [count, mesh.count].map((number) => number.toLocaleString());
    throw new Error(`${name} has ${has} vectors, but the mesh has ${needs} vertices`);
  }
  const bad = vectors.findIndex((x) => !Number.isFinite(x));
  if (bad >= 0) throw new Error(`${name} is NaN or infinite at vertex ${Math.floor(bad / 3)}`);
  const rows = Float32Array.from(count === mesh.count ? vectors : Array.from({ length: 3 * mesh.count }, (_, k) =>
    vectors[3 * mesh.origin[Math.floor(k / 3)] + (k % 3)]));
  if (!tangent(mesh, (v) => rowOf(rows, v)).some(Boolean)) {
    throw new Error(`${name} has no vector with a part along the surface`);
  }
  return rows;
}

function given(reader, bytes, name) {
  try {
    return reader(bytes);
  } catch (error) {
    throw new Error(`${name} is damaged, or no such file: ${error.message}`);
  }
}

const autoLevels = (count) => {
  let levels = 0;
  while (count * 4 ** levels < ENOUGH && levels < MOST_LEVELS) levels++;
  return levels;
};

// Vertices at the same place become one, those of no face are left out, and so are faces without three.
function welded(positions, faces) {
  const used = new Uint8Array(positions.length / 3);
  for (const vertex of faces) used[vertex] = 1;
  const [places, origin, numbers] = [new Map(), [], new Uint32Array(used.length)];
  used.forEach((one, vertex) => {
    if (!one) return;
    const key = Array.from(positions.slice(3 * vertex, 3 * vertex + 3), Math.fround).join();
    if (!places.has(key)) places.set(key, origin.push(vertex) - 1);
    numbers[vertex] = places.get(key);
  });
  const triangles = [];
  for (let k = 0; k + 2 < faces.length; k += 3) {
    const corners = [0, 1, 2].map((c) => numbers[faces[k + c]]);
    if (new Set(corners).size === 3) triangles.push(...corners);
  }
  const points = origin.flatMap((vertex) => positions.slice(3 * vertex, 3 * vertex + 3));
  return { positions: Float32Array.from(points), faces: Uint32Array.from(triangles), origin };
}

function fan(polygon, faces) {
  for (let k = 2; k < polygon.length; k++) faces.push(polygon[0], polygon[k - 1], polygon[k]);
}

function readObj(bytes) {
  const [positions, faces] = [[], []];
  for (const line of new TextDecoder().decode(bytes).split("\n")) {
    const [kind, ...words] = line.trim().split(/\s+/);
    if (kind === "v") positions.push(...words.slice(0, 3).map(Number));
    else if (kind === "f") {
      fan(words.map((word) => {
        const index = parseInt(word, 10);
        return index < 0 ? positions.length / 3 + index : index - 1;
      }), faces);
    }
  }
  return { positions, faces };
}

function readGlb(bytes) {
  const words = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (words.getUint32(0, true) !== 0x46546c67) throw new Error("this is no GLB file");
  const length = words.getUint32(12, true);
  const document = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + length)));
  const binary = 28 + length;
  const accessor = (index) => {
    const { bufferView, byteOffset = 0, componentType, count, type } = document.accessors[index];
    const view = document.bufferViews[bufferView];
    const width = type === "VEC3" ? 3 : 1;
    const [size, read] = { 5126: [4, "getFloat32"], 5125: [4, "getUint32"], 5123: [2, "getUint16"], 5121: [1, "getUint8"] }[componentType];
    const stride = view.byteStride ?? size * width;
    const start = binary + (view.byteOffset ?? 0) + byteOffset;
    return Array.from({ length: count * width }, (_, k) =>
      words[read](start + Math.floor(k / width) * stride + (k % width) * size, true));
  };
  const [positions, faces] = [[], []];
  for (const primitive of document.meshes.flatMap((mesh) => mesh.primitives)) {
    if ((primitive.mode ?? 4) !== 4) continue;
    const points = accessor(primitive.attributes.POSITION);
    const first = positions.length / 3;
    const order = primitive.indices === undefined ? points.slice(0, points.length / 3).map((_, k) => k) : accessor(primitive.indices);
    for (const x of points) positions.push(x);
    for (const k of order) faces.push(first + k);
  }
  return { positions, faces };
}
