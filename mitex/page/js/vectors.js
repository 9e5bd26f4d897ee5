// Vectors of three numbers, and 4 x 4 matrices by column as WebGL takes them.

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const plus = (a, b, scale = 1) => [a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const unit = (a) => scaled(a, 1 / (norm(a) || 1));
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

// The unit vector across a normal that is nearest to another one.
function across(vector, normal) {
  const flat = plus(vector, normal, -dot(vector, normal));
  if (norm(flat) > 1e-9 * norm(vector)) return unit(flat);
  const axis = Math.abs(normal[0]) < 0.6 ? [1, 0, 0] : [0, 1, 0];
  return unit(plus(axis, normal, -dot(axis, normal)));
}

// A vector turned counter-clockwise about a unit axis (Rodrigues).
function rotated(v, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return plus(plus(scaled(v, c), cross(axis, v), s), axis, dot(axis, v) * (1 - c));
}

function times(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[4 * k + row] * b[4 * column + k];
      out[4 * column + row] = sum;
    }
  }
  return out;
}

// From the world to a camera with axes right, up and back.
function viewMatrix(origin, right, up, back) {
  const rows = [right, up, back];
  const out = new Float32Array(16);
  rows.forEach((row, r) => {
    for (let c = 0; c < 3; c++) out[4 * c + r] = row[c];
    out[12 + r] = -dot(row, origin);
  });
  out[15] = 1;
  return out;
}

function perspective(slope, aspect, near, far) {
  const out = new Float32Array(16);
  out[0] = 1 / (slope * aspect);
  out[5] = 1 / slope;
  out[10] = (far + near) / (near - far);
  out[11] = -1;
  out[14] = (2 * far * near) / (near - far);
  return out;
}

function orthographic(half, near, far) {
  const out = new Float32Array(16);
  out[0] = out[5] = 1 / half;
  out[10] = 2 / (near - far);
  out[14] = (far + near) / (near - far);
  out[15] = 1;
  return out;
}
