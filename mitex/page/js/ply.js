// PLY files, of text or binary: positions, faces and, if the vertices have such properties, vectors.

const VECTORS = [["vx", "vy", "vz"], ["fx", "fy", "fz"], ["u", "v", "w"]];

const NUMBERS = {
  char: [1, "getInt8"], int8: [1, "getInt8"], uchar: [1, "getUint8"], uint8: [1, "getUint8"],
  short: [2, "getInt16"], int16: [2, "getInt16"], ushort: [2, "getUint16"], uint16: [2, "getUint16"],
  int: [4, "getInt32"], int32: [4, "getInt32"], uint: [4, "getUint32"], uint32: [4, "getUint32"],
  float: [4, "getFloat32"], float32: [4, "getFloat32"], double: [8, "getFloat64"], float64: [8, "getFloat64"],
};

function readPly(bytes) {
  const text = new TextDecoder("latin1").decode(bytes.subarray(0, 65536));
  const end = /end_header\r?\n/.exec(text);
  if (!text.startsWith("ply") || !end) throw new Error("this is no PLY file");
  const { format, elements } = headerOf(text.slice(0, end.index));
  const body = bytes.subarray(end.index + end[0].length);
  const next = format === "ascii" ? wordsOf(body) : valuesOf(body, format === "binary_little_endian");
  const [positions, faces, vectors] = [[], [], []];
  for (const { name, count, properties } of elements) {
    const columns = (names) => names.map((one) => properties.findIndex((property) => property.name === one));
    const places = columns(["x", "y", "z"]);
    const ways = VECTORS.map(columns).find((group) => !group.includes(-1)) ?? [];
    for (let k = 0; k < count; k++) {
      const values = properties.map(({ kind, length }) =>
        length ? Array.from({ length: next(length) }, () => next(kind)) : next(kind));
      if (name === "vertex") {
        positions.push(...places.map((place) => values[place]));
        vectors.push(...ways.map((way) => values[way]));
      } else if (name === "face") fan(values.find(Array.isArray) ?? [], faces);
    }
  }
  return { positions, faces, vectors };
}

function headerOf(text) {
  const [elements, header] = [[], { format: "ascii" }];
  for (const line of text.split("\n")) {
    const words = line.trim().split(/\s+/);
    if (words[0] === "format") header.format = words[1];
    else if (words[0] === "element") elements.push({ name: words[1], count: Number(words[2]), properties: [] });
    else if (words[0] === "property") {
      const list = words[1] === "list";
      elements.at(-1).properties.push({ name: words.at(-1), kind: words[list ? 3 : 1], length: list && words[2] });
    }
  }
  return { ...header, elements };
}

function wordsOf(body) {
  const words = new TextDecoder().decode(body).split(/\s+/).filter(Boolean);
  let at = 0;
  return () => Number(words[at++]);
}

function valuesOf(body, little) {
  const view = new DataView(body.buffer, body.byteOffset, body.byteLength);
  let at = 0;
  return (kind) => {
    const [size, read] = NUMBERS[kind];
    const value = view[read](at, little);
    at += size;
    return value;
  };
}
