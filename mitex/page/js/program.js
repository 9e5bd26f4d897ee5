// A shader program whose uniforms are set by name, from a number, a list, a texture or a buffer.

class Program {
  constructor(gl, vertex, fragment) {
    this.gl = gl;
    this.program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = gl.getAttachedShaders(this.program).map((shader) => gl.getShaderInfoLog(shader));
      throw new Error(`a shader failed: ${logs.join(" ")} ${gl.getProgramInfoLog(this.program)}`);
    }
    this.uniforms = this._uniforms();
    this.blocks = this._blocks();
  }

  _uniforms() {
    const { gl, program } = this;
    const uniforms = new Map();
    let unit = 0;
    for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
      const { name, type } = gl.getActiveUniform(program, k);
      const location = gl.getUniformLocation(program, name);
      if (location === null) continue; // a member of a block
      const sampler = [gl.SAMPLER_2D, gl.UNSIGNED_INT_SAMPLER_2D, gl.SAMPLER_2D_SHADOW].includes(type);
      uniforms.set(name.replace("[0]", ""), { location, type, unit: sampler ? unit++ : null });
    }
    return uniforms;
  }

  _blocks() {
    const { gl, program } = this;
    const blocks = new Map();
    for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORM_BLOCKS); k++) {
      gl.uniformBlockBinding(program, k, k);
      blocks.set(gl.getActiveUniformBlockName(program, k), k);
    }
    return blocks;
  }

  use(values) {
    const { gl } = this;
    gl.useProgram(this.program);
    for (const [name, binding] of this.blocks) gl.bindBufferBase(gl.UNIFORM_BUFFER, binding, values[name]);
    for (const [name, uniform] of this.uniforms) this._set(name, uniform, values[name]);
  }

  _set(name, { location, type, unit }, value) {
    const { gl } = this;
    if (value === undefined) throw new Error(`nothing is given for ${name}`);
    if (unit !== null) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, value);
      gl.uniform1i(location, unit);
    } else if (type === gl.FLOAT) gl.uniform1f(location, value);
    else if (type === gl.INT || type === gl.BOOL) gl.uniform1i(location, value);
    else if (type === gl.UNSIGNED_INT) gl.uniform1ui(location, value);
    else if (type === gl.FLOAT_VEC2) gl.uniform2fv(location, value);
    else if (type === gl.FLOAT_VEC3) gl.uniform3fv(location, value);
    else if (type === gl.FLOAT_VEC4) gl.uniform4fv(location, value);
    else if (type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(location, false, value);
    else throw new Error(`${name} is of a kind that is not known here`);
  }
}
