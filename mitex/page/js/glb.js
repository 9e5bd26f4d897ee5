// The current state as a GLB file (glTF 2.0): the mesh, and the look as PBR textures.

const [FLOATS, ARRAY] = [5126, 34962];
const [LINEAR, MIPMAPPED, CLAMPED] = [9729, 9987, 33071];

// Bytes of the file; textures are `side` texels wide.
async function glbOf(page, side) {
  const { mesh } = page.surface;
  const images = bakedImages(page, side);
  const files = await Promise.all(images.map((pixels) => png(pixels, side)));
  const attributes = attributesOf(mesh, side);
  const buffer = new Chunks();
  const accessors = attributes.map(({ values, type, width, bounds }) => ({
    bufferView: buffer.add(values, { target: ARRAY }), componentType: FLOATS, type,
    count: values.length / width, ...bounds,
  }));
  const views = files.map((file) => buffer.add(file));
  const document = {
    asset: { version: "2.0", generator: "Mitex" },
    scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0, name: mesh.name }],
    meshes: [{ name: mesh.name, primitives: [{ material: 0,
      attributes: Object.fromEntries(attributes.map(({ name }, k) => [name, k])) }] }],
    materials: [{ name: page.look.name, doubleSided: true,
      pbrMetallicRoughness: { baseColorTexture: { index: 0 }, metallicRoughnessTexture: { index: 1 } },
      occlusionTexture: { index: 1 }, normalTexture: { index: 2 } }],
    textures: views.map((_, k) => ({ source: k, sampler: 0 })),
    samplers: [{ magFilter: LINEAR, minFilter: LINEAR, wrapS: CLAMPED, wrapT: CLAMPED }],
    images: views.map((bufferView) => ({ bufferView, mimeType: "image/png" })),
    accessors, bufferViews: buffer.views, buffers: [{ byteLength: buffer.length }],
  };
  return containerOf(document, buffer);
}

// Values of the corners of all faces, which share none.
function attributesOf(mesh, side) {
  const count = mesh.faces.length;
  const [positions, normals] = [mesh.positions, mesh.normals].map((values) => {
    const rows = new Float32Array(3 * count);
    mesh.faces.forEach((vertex, k) => rows.set(values.subarray(3 * vertex, 3 * vertex + 3), 3 * k));
    return rows;
  });
  const tangents = new Float32Array(4 * count);
  for (let k = 0; k < count; k++) {
    const first = 3 * Math.floor(k / 3);
    const [a, b] = [first, first + 1].map((corner) => positions.subarray(3 * corner, 3 * corner + 3));
    const along = scaled(minus(b, a), (k / 3) & 1 ? -1 : 1);
    const normal = normals.subarray(3 * k, 3 * k + 3);
    tangents.set([...across(along, normal), 1], 4 * k);
  }
  const axis = (act, none) => [0, 1, 2].map((c) => positions.reduce((x, y, k) => (k % 3 === c ? act(x, y) : x), none));
  const bounds = { min: axis(Math.min, Infinity), max: axis(Math.max, -Infinity) };
  return [
    { name: "POSITION", values: positions, width: 3, type: "VEC3", bounds },
    { name: "NORMAL", values: normals, width: 3, type: "VEC3" },
    { name: "TANGENT", values: tangents, width: 4, type: "VEC4" },
    { name: "TEXCOORD_0", values: coordinatesOf(count / 3, layoutOf(count / 3, side)), width: 2, type: "VEC2" },
  ];
}

// Parts of a binary buffer, each from a multiple of four on.
class Chunks {
  constructor() {
    Object.assign(this, { views: [], parts: [], length: 0 });
  }

  add(values, extra = {}) {
    const bytes = new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
    this.parts.push([this.length, bytes]);
    this.views.push({ buffer: 0, byteOffset: this.length, byteLength: bytes.length, ...extra });
    this.length += 4 * Math.ceil(bytes.length / 4);
    return this.views.length - 1;
  }
}

function containerOf(document, buffer) {
  const text = new TextEncoder().encode(JSON.stringify(document));
  const start = 20 + 4 * Math.ceil(text.length / 4);
  const bytes = new Uint8Array(start + 8 + buffer.length);
  const words = new DataView(bytes.buffer);
  [0x46546c67, 2, bytes.length, start - 20, 0x4e4f534a].forEach((word, k) => words.setUint32(4 * k, word, true));
  bytes.fill(0x20, 20, start);
  bytes.set(text, 20);
  words.setUint32(start, buffer.length, true);
  words.setUint32(start + 4, 0x004e4942, true);
  for (const [place, part] of buffer.parts) bytes.set(part, start + 8 + place);
  return bytes;
}
