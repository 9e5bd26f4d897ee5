// Vector fields that moving textures follow, as mitex.mesh.fields has them: tangent, of mean length 1.

const CONSTANT = { right: [1, 0, 0], left: [-1, 0, 0], up: [0, 1, 0], down: [0, -1, 0] };
const SHEARS = { "shear-up": 1, "shear-down": -1 };
const AXES = { "about-x": [1, 0, 0], "about-y": [0, 1, 0] };
const FIELDS = [...Object.keys(CONSTANT), ...Object.keys(SHEARS), ...Object.keys(AXES)];
const FAINT = 1e-5; // parts along the surface that are shorter are rounding errors

// (count x 3) vectors of a field, by its name or its direction.
function fieldVectors(mesh, field) {
  const way = wayOf(mesh, field);
  const vectors = new Float64Array(3 * mesh.count);
  let sum = 0;
  for (let v = 0; v < mesh.count; v++) {
    const [whole, normal] = [way(mesh.point(v)), unit(mesh.normals.subarray(3 * v, 3 * v + 3))];
    const along = plus(whole, normal, -dot(whole, normal));
    if (norm(along) <= FAINT * norm(whole)) continue;
    vectors.set(along, 3 * v);
    sum += norm(along);
  }
  return vectors.map((x) => (x * mesh.count) / (sum || 1));
}

function wayOf(mesh, field) {
  if (Array.isArray(field)) return () => field;
  if (CONSTANT[field]) return () => CONSTANT[field];
  const { centre, radius } = mesh.sphere();
  if (SHEARS[field]) return (point) => [0, SHEARS[field] * ((point[2] - centre[2]) / radius + 1), 0];
  return (point) => cross(AXES[field], unit(minus(point, centre)));
}

// What cells are told (count x 3): the field at some speed, no faster than they have learned to move, turned
// back by the texture's orientation.
function conditionOf(mesh, field, speed, longest, turn) {
  const vectors = fieldVectors(mesh, field);
  const told = new Float32Array(vectors.length);
  for (let v = 0; v < mesh.count; v++) {
    const vector = scaled(vectors.subarray(3 * v, 3 * v + 3), speed);
    const slowed = scaled(vector, Math.min(1, longest / Math.max(norm(vector), 1e-12)));
    told.set(rotated(slowed, mesh.normals.subarray(3 * v, 3 * v + 3), -turn), 3 * v);
  }
  return told;
}
