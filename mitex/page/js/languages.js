// What the cell rule is written with in the two languages of graphics cards: fragment shaders (WebGL2) and
// compute shaders (WebGPU).

const GLSL = {
  template: "step.frag",
  zero: "vec4(0.0)",
  vector: (name, value) => `vec4 ${name} = ${value};`,
  number: (name, value) => `float ${name} = ${value};`,
  state: (c, place) => `texelFetch(state${c}, ${place}, 0)`,
  next: (c, value) => `next${c} = ${value};`,
  bound: (name, c) => `${name}[${c}]`,
  loop: (count) => `for (int g = 0; g < ${count}; g++)`,
  index: (stride) => `int k = g * ${stride};`,
  declarations: (shape, rules) => ({
    CONSTANTS: `const int VECTORS = ${shape.vectors};\n#define GRAFT ${rules.length - 1}\n`
      + `#define CONDITION ${shape.condition ? 1 : 0}`,
    SAMPLERS: each(shape.vectors, (c) => `uniform sampler2D state${c};`),
    OUTPUTS: each(shape.vectors, (c) => `layout(location = ${c}) out vec4 next${c};`),
    BLOCKS: rules.map((rule) => each(shape.blocks, (b) =>
      blockText(`${rule}${b}`, shape.perBlock * shape.stride))).join(""),
    BOUNDS: rules.map((rule) =>
      `uniform vec4 ${rule}Low[VECTORS], ${rule}High[VECTORS], ${rule}Bias[VECTORS];`).join("\n"),
  }),
};

const WGSL = {
  template: "step.wgsl",
  zero: "vec4f(0.0)",
  vector: (name, value) => `var ${name} = ${value};`,
  number: (name, value) => `let ${name} = ${value};`,
  state: (c, place) => `states[${c}u * PLANE + ${place}]`,
  next: (c, value) => `following[${c}u * PLANE + at] = ${value};`,
  bound: (name, c) => `bounds.${name}[${c}]`,
  loop: (count) => `for (var g = 0u; g < ${count}u; g++)`,
  index: (stride) => `let k = g * ${stride}u;`,
  declarations: (shape, rules, plane) => ({
    CONSTANTS: planes(shape, plane),
    BOUNDS: `struct Bounds { ${rules.flatMap((rule) => ["Low", "High", "Bias"].map((kind) =>
      `${rule}${kind}: array<vec4f, ${shape.vectors}>`)).join(", ")} }`,
    BINDINGS: bindings(shape, rules).map(([name, space, kind], k) =>
      `@group(0) @binding(${k}) var<${space}> ${name}: ${kind};`).join("\n"),
    SHARE: rules.length > 1 ? "let share0 = shares[at];" : "let share0 = 0.0;",
    CONDITION: shape.condition ? "let told = condition[at];" : "",
  }),
};

// Where the vectors of the states are in WebGPU's buffers: one after the other, each with `plane` cells.
const planes = (shape, plane) => `const VECTORS = ${shape.vectors}u;\nconst PLANE = ${plane}u;`;

// What a compute shader reads and writes: names, spaces and kinds.
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
