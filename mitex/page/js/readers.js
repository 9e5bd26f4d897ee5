// Meshes that are dropped into the page: OBJ, PLY and GLB, of which positions and faces are read.

const MOST_VERTICES = 300_000;
const ENOUGH = 8_000; // vertices, as `--subdivide auto` has it
const MOST_LEVELS = 6;

// A mesh from a file's bytes; errors say what is wrong.
function readMesh(bytes, name) {
  const suffix = name.toLowerCase().split(".").pop();
  const reader = { obj: readObj, ply: readPly, glb: readGlb }[suffix];
  if (!reader) throw new Error(`${name} is no OBJ, PLY or GLB file`);
  const { positions, faces } = welded(given(reader, bytes, name));
  const count = positions.length / 3;
  if (!faces.length || !positions.every(Number.isFinite)) throw new Error(`${name} has no faces that can be shown`);
  if (count > MOST_VERTICES) throw new Error(`${name} has more than ${MOST_VERTICES.toLocaleString()} vertices`);
  if (faces.some((index) => !(index < count))) throw new Error(`${name} is damaged: a face has no such vertex`);
  return new Mesh(positions, faces, name.replace(/\.\w+$/, ""));
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
function welded({ positions, faces }) {
  const places = new Map();
  const [kept, numbers] = [[], new Map()];
  const numberOf = (vertex) => {
    if (numbers.has(vertex)) return numbers.get(vertex);
    const point = positions.slice(3 * vertex, 3 * vertex + 3);
    const key = Array.from(point, Math.fround).join();
    if (!places.has(key)) {
      places.set(key, places.size);
      kept.push(...point);
    }
    numbers.set(vertex, places.get(key));
    return places.get(key);
  };
  const triangles = [];
  for (let k = 0; k + 2 < faces.length; k += 3) {
    const corners = [faces[k], faces[k + 1], faces[k + 2]].map(numberOf);
    if (new Set(corners).size === 3) triangles.push(...corners);
  }
  return { positions: Float32Array.from(kept), faces: Uint32Array.from(triangles) };
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
