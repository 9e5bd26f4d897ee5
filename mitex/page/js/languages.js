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
  const [inputs, needed] = [shape.inputNames, ["share0 < 1.0", "share0 > 0.0"]];
  const network = (rule) => shape.network(rule, GLSL, 1, (i) => inputs[i], (c) => `${rule}u${c}`);
  return written(SHADERS["step.frag"], {
    ...shape.perception(GLSL),
    CONSTANTS: `const int VECTORS = ${vectors};\n#define GRAFT ${rules.length - 1}\n`
      + `#define CONDITION ${shape.condition ? 1 : 0}`,
    SAMPLERS: each(vectors, (c) => `uniform sampler2D state${c};`),
    OUTPUTS: each(vectors, (c) => `layout(location = ${c}) out vec4 next${c};`),
    BLOCKS: rules.map((rule) => each(shape.blocks, (b) =>
      blockText(`${rule}${b}`, shape.perBlock * shape.stride))).join(""),
    BOUNDS: rules.map((rule) =>
      `uniform vec4 ${rule}Low[VECTORS], ${rule}High[VECTORS], ${rule}Bias[VECTORS];`).join("\n"),
    KEEP: each(vectors, (c) => `next${c} = ${shape.held(rules, GLSL, c, `s${c}`)};`),
    CHANGES: rules.map((rule) => each(vectors, (c) => `vec4 ${rule}u${c} = ${rule}Bias[${c}];`)).join("\n"),
    RULES: rules.map((rule, r) => `if (${needed[r]}) {\n${network(rule)}\n}`).join("\n"),
    NEXT: each(vectors, (c) => `next${c} = ${shape.held(rules, GLSL, c, `s${c}`, rules.map((rule) => `${rule}u${c}`))};`),
  });
}

const WGSL = {
  zero: "vec4f(0.0)",
  vector: (name, value) => `var ${name} = ${value};`,
  matrix: (name, value) => `let ${name} = ${value};`,
  number: (name, value) => `let ${name} = ${value};`,
  state: (c, place) => `states[${c}u * now.plane + ${place}]`,
  bound: (name, c) => `bounds.${name}[${c}]`,
  loop: (count) => `for (var g = 0u; g < ${count}u; g++)`,
  index: (stride) => `let k = g * ${stride}u;`,
};

// Each thread computes so many cells of a tile.
function computeStep(shape, rules, cellsPerThread) {
  const { vectors } = shape;
  const needed = ["least < 1.0", "most > 0.0"];
  const network = (rule) => shape.network(rule, WGSL, cellsPerThread, (i, m) => `x[${m}][${i}]`, (c, m) => `${rule}u[${m}][${c}]`);
  const next = (value) => each(vectors, (c) => `following[${c}u * now.plane + at] = ${value(c)};`);
  const own = (c) => WGSL.state(c, "at");
  return written(SHADERS["step.wgsl"], {
    ...shape.perception(WGSL),
    CONSTANTS: `const VECTORS = ${vectors}u;\nconst CELLS = ${cellsPerThread}u;\nconst INPUTS = ${shape.inputs};`,
    BOUNDS: `struct Bounds { ${rules.flatMap((rule) => ["Low", "High", "Bias"].map((kind) =>
      `${rule}${kind}: array<vec4f, ${vectors}>`)).join(", ")} }`,
    BINDINGS: bindings(shape, rules).map(([name, space, kind], k) =>
      `@group(0) @binding(${k}) var<${space}> ${name}: ${kind};`).join("\n"),
    SHARE: `return ${rules.length > 1 ? "shares[at]" : "0.0"};`,
    CONDITION: shape.condition ? "let told = condition[at];" : "",
    PERCEIVED: `return array<vec4f, INPUTS>(${shape.inputNames.join(", ")});`,
    KEEP: next((c) => shape.held(rules, WGSL, c, own(c))),
    CHANGES: rules.map((rule) => `var ${rule}u: array<array<vec4f, VECTORS>, CELLS>;`).join("\n"),
    BIAS: rules.map((rule) => `${rule}u[m] = bounds.${rule}Bias;`).join("\n"),
    RULES: rules.map((rule, r) => `if (${needed[r]}) {\n${network(rule)}\n}`).join("\n"),
    NEXT: next((c) => shape.held(rules, WGSL, c, own(c), rules.map((rule) => `${rule}u[m][${c}]`))),
  });
}

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
