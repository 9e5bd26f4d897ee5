// A step of the automaton in the two languages of graphics cards: as a fragment shader (WebGL2), which computes
// one cell at a time, and as a compute shader (WebGPU).

const GLSL = {
  zero: "vec4(0.0)",
  vector: (name, value) => `vec4 ${name} = ${value};`,
  matrix: (name, value) => `mat4 ${name} = ${value};`,
  number: (name, value) => `float ${name} = ${value};`,
  state: (c, place) => `texelFetch(state${c}, ${place}, 0)`,
  bound: (name, c) => `${name}[${c}]`,
  loop: (count) => `for (int g = 0; g < ${count}; g++)`,
  index: (stride) => `int k = g * ${stride};`,
};

function fragmentStep(shape, rules) {
  const { vectors } = shape;
  const inputs = shape.inputNames;
  return written(SHADERS["step.frag"], {
    ...shape.perception(GLSL), ...shape.changes(rules, GLSL, [""], (i) => inputs[i]),
    CONSTANTS: `const int VECTORS = ${vectors};\n#define GRAFT ${rules.length - 1}\n`
      + `#define CONDITION ${shape.condition ? 1 : 0}`,
    SAMPLERS: each(vectors, (c) => `uniform sampler2D state${c};`),
    OUTPUTS: each(vectors, (c) => `layout(location = ${c}) out vec4 next${c};`),
    BLOCKS: rules.map((rule) => each(shape.blocks, (b) =>
      blockText(`${rule}${b}`, shape.perBlock * shape.stride))).join(""),
    BOUNDS: rules.map((rule) =>
      `uniform vec4 ${rule}Low[VECTORS], ${rule}High[VECTORS], ${rule}Bias[VECTORS];`).join("\n"),
    KEEP: each(vectors, (c) => `next${c} = ${shape.held(rules, GLSL, c, `s${c}`, "", false)};`),
    NEXT: each(vectors, (c) => `next${c} = ${shape.held(rules, GLSL, c, `s${c}`)};`),
  });
}

const WGSL = {
  zero: "vec4f(0.0)",
  vector: (name, value) => `var ${name} = ${value};`,
  matrix: (name, value) => `let ${name} = ${value};`,
  number: (name, value) => `let ${name} = ${value};`,
  state: (c, place) => `states[${c}u * PLANE + ${place}]`,
  bound: (name, c) => `bounds.${name}[${c}]`,
  loop: (count) => `for (var g = 0u; g < ${count}u; g++)`,
  index: (stride) => `let k = g * ${stride}u;`,
};

// Each thread computes so many cells of a tile.
function computeStep(shape, rules, plane, cellsPerThread) {
  const cells = Array.from({ length: cellsPerThread }, (_, m) => `_${m}`);
  const own = (c, m) => `x${m}[${shape.harmonics * shape.vectors + c}]`;
  const lines = (line) => cells.map((m, k) => line(m, k)).join("\n");
  const next = (value) => lines((m) => each(shape.vectors, (c) =>
    `following[${c}u * PLANE + at${m}] = ${value(c, m)};`));
  return written(SHADERS["step.wgsl"], {
    ...shape.perception(WGSL), ...shape.changes(rules, WGSL, cells, (i, m) => `x${m}[${i}]`),
    CONSTANTS: `${planes(shape, plane)}\nconst CELLS = ${cellsPerThread}u;\nconst INPUTS = ${shape.inputs};`,
    BOUNDS: `struct Bounds { ${rules.flatMap((rule) => ["Low", "High", "Bias"].map((kind) =>
      `${rule}${kind}: array<vec4f, ${shape.vectors}>`)).join(", ")} }`,
    BINDINGS: bindings(shape, rules).map(([name, space, kind], k) =>
      `@group(0) @binding(${k}) var<${space}> ${name}: ${kind};`).join("\n"),
    CONDITION: shape.condition ? "let told = condition[at];" : "",
    PERCEIVED: `return array<vec4f, INPUTS>(${shape.inputNames.join(", ")});`,
    PLACES: lines((m, k) => `let at${m} = placed(tile, thread * CELLS + ${k}u);`),
    SHARES: lines((m) => `let share0${m} = ${rules.length > 1 ? `shares[at${m}]` : "0.0"};`),
    KEEP: next((c, m) => shape.held(rules, WGSL, c, WGSL.state(c, `at${m}`), m, false)),
    CELLS: lines((m) => `var x${m} = perceived(at${m});`),
    NEXT: next((c, m) => shape.held(rules, WGSL, c, own(c, m), m)),
  });
}

// Where the vectors of the states are in WebGPU's buffers: one after the other, each with `plane` cells.
const planes = (shape, plane) => `const VECTORS = ${shape.vectors}u;\nconst PLANE = ${plane}u;`;

// What the compute shader reads and writes: names, spaces and kinds.
function bindings(shape, rules) {
  const read = (name, kind) => [name, "storage, read", `array<${kind}>`];
  return [
    read("rows", "vec4u"), read("links", "vec4u"), read("states", "vec4f"),
    ["following", "storage, read_write", "array<vec4f>"], ["bounds", "uniform", "Bounds"],
    ...rules.map((rule) => read(`${rule}0`, "mat4x4f")),
    ...(rules.length > 1 ? [read("shares", "f32")] : []),
    ...(shape.condition ? [read("condition", "vec4f")] : []),
  ];
}
