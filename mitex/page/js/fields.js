// Vector fields that textures follow, as mitex.mesh.fields has them: tangent, of mean length 1.

const CONSTANT = { right: [1, 0, 0], left: [-1, 0, 0], up: [0, 1, 0], down: [0, -1, 0] };
const SHEARS = { "shear-up": 1, "shear-down": -1 };
const AXES = { "about-x": [1, 0, 0], "about-y": [0, 1, 0] };
const FIELDS = [...Object.keys(CONSTANT), ...Object.keys(SHEARS), ...Object.keys(AXES)];
const [MOTION, UPWARDS] = ["motion", "upwards"]; // fields of one mesh alone, for its texture's motion and up
const FAINT = 1e-5; // parts along the surface that are shorter are rounding errors

// (count x 3) vectors of a field: a name, a direction, or one of the mesh's own.
function fieldVectors(mesh, field) {
  const own = mesh.fields[field];
  return tangent(mesh, own ? (v) => rowOf(own, v) : named(mesh, field));
}

// The parts along the surface of vectors by vertex, of mean length 1; zeros if there is none.
function tangent(mesh, vectorOf) {
  const vectors = new Float64Array(3 * mesh.count);
  let sum = 0;
  for (let v = 0; v < mesh.count; v++) {
    const [whole, normal] = [vectorOf(v), unit(mesh.normal(v))];
    const along = plus(whole, normal, -dot(whole, normal));
    if (norm(along) <= FAINT * norm(whole)) continue;
    vectors.set(along, 3 * v);
    sum += norm(along);
  }
  return vectors.map((x) => (x * mesh.count) / (sum || 1));
}

function named(mesh, field) {
  if (Array.isArray(field)) return () => field;
  if (CONSTANT[field]) return () => CONSTANT[field];
  const { centre, radius } = mesh.sphere();
  if (SHEARS[field]) return (v) => [0, SHEARS[field] * ((mesh.point(v)[2] - centre[2]) / radius + 1), 0];
  return (v) => cross(AXES[field], unit(minus(mesh.point(v), centre)));
}

// (count x 3) vectors of a field at some speed, none longer than a texture can follow.
function slowedVectors(mesh, field, speed, longest) {
  const vectors = fieldVectors(mesh, field);
  for (let v = 0; v < mesh.count; v++) {
    const vector = scaled(rowOf(vectors, v), speed);
    vectors.set(scaled(vector, Math.min(1, longest / Math.max(norm(vector), 1e-12))), 3 * v);
  }
  return vectors;
}

// What cells are told of these vectors: turned back by the texture's orientation.
function toldVectors(mesh, vectors, turn) {
  const told = new Float32Array(vectors.length);
  for (let v = 0; v < mesh.count; v++) told.set(rotated(rowOf(vectors, v), mesh.normal(v), -turnAt(turn, v)), 3 * v);
  return told;
}

// A texture's turn about the normal of a vertex; `turn` is one angle, or those of the vertices [rad].
const turnAt = (turn, vertex) => (typeof turn === "number" ? turn : turn[vertex]);

// Where the exemplar's right points on a surface with this normal, before it is turned.
const rightwards = (normal) => across([normal[2], 0, -normal[0]], normal);

// The turns (count) of a texture whose up follows a field, and is turned from there by an angle
// (mitex.methods.nca.orientation).
function turnsAlong(mesh, field, angle) {
  const vectors = fieldVectors(mesh, field);
  return Float64Array.from({ length: mesh.count }, (_, v) => {
    const [normal, vector] = [unit(mesh.normal(v)), rowOf(vectors, v)];
    const right = rightwards(normal);
    return Math.atan2(-dot(vector, right), dot(vector, cross(normal, right))) + angle;
  });
}
