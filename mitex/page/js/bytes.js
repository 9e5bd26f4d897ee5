// Arrays in the page's data: deflated, then in base64.

const KINDS = {
  float32: Float32Array, float64: Float64Array,
  uint8: Uint8Array, uint16: Uint16Array, uint32: Uint32Array, int32: Int32Array,
};

async function piped(bytes, stream) {
  const piping = new Blob([bytes]).stream().pipeThrough(stream);
  return new Uint8Array(await new Response(piping).arrayBuffer());
}

function fromBase64(text) {
  const characters = atob(text);
  const bytes = new Uint8Array(characters.length);
  for (let k = 0; k < bytes.length; k++) bytes[k] = characters.charCodeAt(k);
  return bytes;
}

// A copy of a value in which every {kind, bytes} is a typed array.
async function unpacked(value) {
  if (value === null || typeof value !== "object") return value;
  if (typeof value.bytes === "string") {
    const bytes = await piped(fromBase64(value.bytes), new DecompressionStream("deflate-raw"));
    return new KINDS[value.kind](bytes.buffer);
  }
  const parts = await Promise.all(Object.values(value).map(unpacked));
  if (Array.isArray(value)) return parts;
  return Object.fromEntries(Object.keys(value).map((key, k) => [key, parts[k]]));
}

// Undoes differences between neighbours along columns, which deflate well.
function summed(differences, width, Kind) {
  const values = new Kind(differences);
  for (let k = width; k < values.length; k++) values[k] += values[k - width];
  return values;
}
