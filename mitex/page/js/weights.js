// Networks in blocks of uniforms: a matrix is cut into pieces of 4 x 4, and products are sums of pieces times
// vectors of four, written out without loops, as software renderers and phones need it.

const upTo4 = (count) => Math.ceil(count / 4);

// (outputs x inputs) weights as pieces[o][i], each 16 numbers by column; `place` says where an input is.
function pieces(weight, outputs, inputs, place = (i) => i) {
  let width = 0;
  for (let i = 0; i < inputs; i++) width = Math.max(width, upTo4(place(i) + 1));
  const rows = Array.from({ length: upTo4(outputs) }, () =>
    Array.from({ length: width }, () => new Float32Array(16)));
  for (let o = 0; o < outputs; o++) {
    for (let i = 0; i < inputs; i++) {
      const at = place(i);
      rows[o >> 2][at >> 2][4 * (at & 3) + (o & 3)] = weight[inputs * o + i];
    }
  }
  return rows;
}

function column(bias, group) {
  const piece = new Float32Array(16);
  for (let k = 0; k < 4; k++) piece[k] = bias[4 * group + k] ?? 0;
  return piece;
}

function joined(parts) {
  const values = new Float32Array(16 * parts.length);
  parts.forEach((part, k) => values.set(part, 16 * k));
  return values;
}

// Declares a block that holds so many pieces, and is called as its array but for a capital.
const blockText = (name, count) => `layout(std140) uniform ${name}Block { mat4 ${name}[${count}]; };\n`;

const each = (count, line) => Array.from({ length: count }, (_, k) => line(k)).join("\n");

// A shader: its template with every `//: NAME` line replaced by a text.
function written(template, texts) {
  return template.replace(/^\s*\/\/: (\w+)$/gm, (_, name) => {
    if (texts[name] === undefined) throw new Error(`nothing is written for ${name}`);
    return texts[name];
  });
}
