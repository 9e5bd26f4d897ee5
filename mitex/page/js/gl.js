// WebGL2 in few words: programs, textures, targets, blocks of uniforms.

const WIDTH = 256; // of textures with a texel for each cell; a multiple of a tile
const LIST = 1024; // of textures with a texel for each link or face
const FORMATS = {
  RGBA32F: ["RGBA", "FLOAT", Float32Array], RGBA16F: ["RGBA", "HALF_FLOAT", Float32Array],
  R32F: ["RED", "FLOAT", Float32Array], RGBA8: ["RGBA", "UNSIGNED_BYTE", Uint8Array],
  SRGB8_ALPHA8: ["RGBA", "UNSIGNED_BYTE", Uint8Array], R8: ["RED", "UNSIGNED_BYTE", Uint8Array],
  RGBA32UI: ["RGBA_INTEGER", "UNSIGNED_INT", Uint32Array],
  DEPTH_COMPONENT24: ["DEPTH_COMPONENT", "UNSIGNED_INT", Uint32Array],
};

class Graphics {
  constructor(canvas) {
    const options = { antialias: false, alpha: false, preserveDrawingBuffer: false };
    const gl = canvas.getContext("webgl2", options);
    if (!gl) throw new Error("this browser has no WebGL2");
    if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("this device cannot draw into numbers");
    gl.getExtension("OES_texture_float_linear");
    gl.disable(gl.DITHER);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    this.gl = gl;
    this.canvas = canvas;
    this.programs = new Map();
    this.blockSize = gl.getParameter(gl.MAX_UNIFORM_BLOCK_SIZE);
    this.targets = Math.min(gl.getParameter(gl.MAX_DRAW_BUFFERS), gl.getParameter(gl.MAX_COLOR_ATTACHMENTS));
  }

  // Whether a processor draws.
  get software() {
    const names = this.gl.getExtension("WEBGL_debug_renderer_info");
    const name = this.gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : this.gl.RENDERER);
    return /swiftshader|llvmpipe|software|basic render/i.test(name);
  }

  // Programs are kept: meshes come and go, and compiling takes long.
  program(vertex, fragment) {
    const text = vertex + fragment;
    if (!this.programs.has(text)) this.programs.set(text, this._compiled(vertex, fragment));
    return this.programs.get(text);
  }

  _compiled(vertex, fragment) {
    const sizes = `#version 300 es\n#define WIDTH ${WIDTH}\n#define LIST ${LIST}`;
    return new Program(this.gl, ...[vertex, fragment].map((text) => text.replace("#version 300 es", sizes)));
  }

  texture(format, width, height, data = null, filter = "NEAREST") {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const side of ["TEXTURE_WRAP_S", "TEXTURE_WRAP_T"]) {
      gl.texParameteri(gl.TEXTURE_2D, gl[side], gl.CLAMP_TO_EDGE);
    }
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl[filter]);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl[filter]);
    const [layout, kind] = FORMATS[format];
    gl.texImage2D(gl.TEXTURE_2D, 0, gl[format], width, height, 0, gl[layout], gl[kind], data);
    return Object.assign(texture, { width, height, format });
  }

  // Values in rows of a texture with `width` texels, padded with zeros.
  list(format, values, width = LIST) {
    const channels = format.startsWith("RGBA") ? 4 : 1;
    const height = Math.max(Math.ceil(values.length / channels / width), 1);
    const padded = new FORMATS[format][2](width * height * channels);
    padded.set(values);
    return this.texture(format, width, height, padded);
  }

  // An image as a texture with mip maps.
  picture(image) {
    const { gl } = this;
    const texture = this.texture("RGBA8", image.width, image.height, null, "LINEAR");
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, image);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.generateMipmap(gl.TEXTURE_2D);
    return texture;
  }

  refill(texture, values) {
    const { gl } = this;
    const [layout, kind, Kind] = FORMATS[texture.format];
    const padded = new Kind(texture.width * texture.height * (layout.startsWith("RGBA") ? 4 : 1));
    padded.set(values);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, texture.width, texture.height, gl[layout], gl[kind], padded);
  }

  // What can be drawn into: colour textures and, if given, a depth texture.
  target(textures, depth = null) {
    const { gl } = this;
    const buffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
    const places = textures.map((texture, k) => {
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, texture, 0);
      return gl.COLOR_ATTACHMENT0 + k;
    });
    if (depth) gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, depth, 0);
    gl.drawBuffers(places.length ? places : [gl.NONE]);
    if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE) {
      throw new Error("this device cannot draw into such textures");
    }
    const { width, height } = textures[0] ?? depth;
    return { buffer, textures, depth, width, height };
  }

  into(target) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target ? target.buffer : null);
    gl.viewport(0, 0, target ? target.width : this.canvas.width, target ? target.height : this.canvas.height);
  }

  // One triangle over all of a target.
  fill(target, program, values) {
    this.into(target);
    program.use(values);
    this.gl.disable(this.gl.DEPTH_TEST);
    this.gl.drawArrays(this.gl.TRIANGLES, 0, 3);
  }

  read(target, k = 0, x = 0, y = 0, width = target.width, height = target.height) {
    const { gl } = this;
    const [layout, , Kind] = FORMATS[target.textures[k].format];
    const values = new Kind(width * height * 4);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.buffer);
    gl.readBuffer(gl.COLOR_ATTACHMENT0 + k);
    const kind = { [Float32Array.name]: gl.FLOAT, [Uint32Array.name]: gl.UNSIGNED_INT }[Kind.name];
    gl.readPixels(x, y, width, height, layout === "RGBA_INTEGER" ? gl.RGBA_INTEGER : gl.RGBA, kind ?? gl.UNSIGNED_BYTE, values);
    return values;
  }

  block(values) {
    const { gl } = this;
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.UNIFORM_BUFFER, buffer);
    gl.bufferData(gl.UNIFORM_BUFFER, values, gl.STATIC_DRAW);
    return buffer;
  }

  drop(target) {
    if (!target) return;
    this.gl.deleteFramebuffer(target.buffer);
    for (const texture of [...target.textures, target.depth]) this.gl.deleteTexture(texture);
  }
}
