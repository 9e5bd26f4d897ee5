// NumPy's .npy files of numbers.

const NUMPY = {
  f4: [4, "getFloat32"], f8: [8, "getFloat64"], i1: [1, "getInt8"], i2: [2, "getInt16"], i4: [4, "getInt32"],
  i8: [8, "getBigInt64"], u1: [1, "getUint8"], u2: [2, "getUint16"], u4: [4, "getUint32"], u8: [8, "getBigUint64"],
};

// The rows of an array (N, 3) as vectors, one after the other.
function readNpy(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (view.getUint32(0) !== 0x934e554d) throw new Error("this is no NumPy array");
  const [start, length] = bytes[6] === 1 ? [10, view.getUint16(8, true)] : [12, view.getUint32(8, true)];
  const header = new TextDecoder("latin1").decode(bytes.subarray(start, start + length));
  const [, order, kind] = /'descr':\s*'([<>|=])(\w+)'/.exec(header) ?? [];
  const shape = (/'shape':\s*\(([^)]*)\)/.exec(header)?.[1] ?? "").split(",").filter((n) => n.trim()).map(Number);
  if (!NUMPY[kind]) throw new Error("it does not hold numbers");
  if (shape.length !== 2 || shape[1] !== 3) throw new Error(`its shape is (${shape.join(", ")}), not (N, 3)`);
  const [size, read] = NUMPY[kind];
  const columns = /'fortran_order':\s*True/.test(header);
  const place = (k) => (columns ? (k % 3) * shape[0] + Math.floor(k / 3) : k);
  return { vectors: Array.from({ length: 3 * shape[0] }, (_, k) =>
    Number(view[read](start + length + size * place(k), order !== ">"))) };
}
