// Pictures of the surface: ids of what pixels see, their maps, and light on them.

const MODES = ["light", "albedo", "normal", "height", "roughness", "ambient_occlusion", "graft"];
const GRAFT = MODES.indexOf("graft");
const KEY = [-2.6, 3.0, 3.2]; // where the key light is, for a camera on +z
const SHADOWS = 1024; // side of the shadow map [px]

class Studio {
  constructor(graphics) {
    this.graphics = graphics;
    const fill = SHADERS["fill.vert"];
    this.ids = graphics.program(SHADERS["ids.vert"], SHADERS["ids.frag"]);
    this.depth = graphics.program(SHADERS["ids.vert"], SHADERS["depth.frag"]);
    this.shading = graphics.program(fill, SHADERS["shade.frag"]);
    this.presenting = graphics.program(fill, SHADERS["present.frag"]);
    this.shadows = graphics.target([], graphics.texture("DEPTH_COMPONENT24", SHADOWS, SHADOWS));
    Object.assign(this, { mode: 0, exposure: 0, relief: 0, paper: [0.72, 0.72, 0.72] });
  }

  // The mesh that pictures show.
  setSurface(surface) {
    if (this.surface) this.occlusion.drop();
    this.surface = surface;
    let [radius, floor] = [0, Infinity];
    for (let k = 0; k < surface.points.length; k += 3) {
      radius = Math.max(radius, norm(surface.points.subarray(k, k + 3)));
      floor = Math.min(floor, surface.points[k + 1]);
    }
    Object.assign(this, { radius: radius || 1, floor });
    this.occlusion = new Occlusion(this.graphics, surface, this.radius, floor);
    this.camera = new Camera(surface.points, this.radius);
  }

  // Pictures of so many pixels, each of `samples` x `samples` samples.
  resize(width, height, samples = 1) {
    this.samples = samples;
    [width, height] = [width * samples, height * samples];
    if (this.picture && this.picture.width === width && this.picture.height === height) return;
    [this.picture, this.maps, this.light].forEach((target) => this.graphics.drop(target));
    const texture = (format) => this.graphics.texture(format, width, height);
    this.picture = this.graphics.target([texture("RGBA32UI")], texture("DEPTH_COMPONENT24"));
    this.maps = this.graphics.target(["RGBA16F", "RGBA16F", "RGBA16F", "RGBA32F"].map(texture));
    this.light = this.graphics.target([texture("RGBA8")]);
  }

  get aspect() {
    return this.picture.width / this.picture.height;
  }

  // Which point of the surface each pixel sees.
  look() {
    drawIds(this.graphics, this.ids, this.picture, this.surface, this.camera.matrix(this.aspect));
  }

  // The point of the surface at a pixel, counted from the lower left: its face and barycentrics; null if there is none.
  pick(x, y) {
    const { samples } = this;
    [x, y] = [Math.floor((x + 0.5) * samples), Math.floor((y + 0.5) * samples)];
    if (x < 0 || y < 0 || x >= this.picture.width || y >= this.picture.height) return null;
    return pointOf(this.graphics.read(this.picture, 0, x, y, 1, 1));
  }

  // Light on the maps, onto the canvas.
  render() {
    const { graphics, surface, camera, radius, floor, occlusion } = this;
    const key = unit(camera.studio(KEY));
    const light = lightMatrix(key, radius);
    drawDepth(graphics, this.shadows, this.depth,
      { corners: surface.corners, place: surface.place, camera: light }, surface.faceCount);
    const [colour, bent, plain, spot] = this.maps.textures;
    const { width, height } = this.maps;
    graphics.fill(this.light, this.shading, {
      ids: this.picture.textures[0], colour, bent, plain, spot, light, key, radius, floor, ...camera.axes(), eye: camera.eye,
      shadows: this.shadows.depth, ground: occlusion.ground.textures[0], extent: occlusion.half,
      slopes: camera.slopes(this.aspect), size: [width, height], mode: this.mode, exposure: this.exposure,
      paper: this.paper, relief: this.relief,
    });
    graphics.fill(null, this.presenting, { picture: this.light.textures[0], samples: this.samples });
  }
}

function drawIds(graphics, program, target, surface, camera, place = surface.place, corners = surface.corners) {
  const { gl } = graphics;
  graphics.into(target);
  gl.enable(gl.DEPTH_TEST);
  gl.clearBufferuiv(gl.COLOR, 0, [0, 0, 0, 0]);
  if (target.depth) gl.clear(gl.DEPTH_BUFFER_BIT);
  program.use({ corners, place, camera });
  gl.drawArrays(gl.TRIANGLES, 0, 3 * surface.faceCount);
}

function pointOf(id) {
  if (!id[0]) return null;
  const [a, b] = new Float32Array(id.buffer, id.byteOffset + 4, 2);
  return { face: id[0] - 1, barycentric: [a, b, 1 - a - b] };
}
