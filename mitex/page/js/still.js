// An asset that does not grow: its maps are textures, or values at the vertices.

class StillPage extends View {
  static async of(data, graphics, studio) {
    const page = new StillPage(data, graphics, studio);
    await page._read();
    return page;
  }

  constructor(data, graphics, studio) {
    super(data, graphics, studio);
    this.show(meshOf(data.mesh));
    this.baked = Boolean(data.uv);
    const program = written(SHADERS["still.frag"], { SURFACE: SHADERS["surface.glsl"],
      CONSTANTS: `#define BAKED ${Number(this.baked)}` });
    this.program = this.graphics.program(SHADERS["fill.vert"], program);
  }

  get look() {
    return { name: this.data.look, maps: this.data.maps };
  }

  async _read() {
    const { graphics, surface, data } = this;
    const names = ["colours", "materials", "details"];
    if (this.baked) {
      const images = await Promise.all(names.map((name) => data.images[name] && pictureOf(data.images[name])));
      images.forEach((image, k) => { this[names[k]] = image ? graphics.picture(image) : null; });
      const uv = new Float32Array(2 * data.uv.length);
      data.uv.forEach((value, k) => { uv[4 * (k >> 1) + (k & 1)] = value / 65535; });
      this.coordinates = graphics.list("RGBA32F", uv);
      this.texels = images[0].width / Math.sqrt(areaOf(surface.points, surface.mesh.faces));
    } else {
      for (const name of names) {
        const values = data.rows[name];
        this[name] = values ? surface.cells("RGBA32F", surface.slots.spread(values.map((x) => x), 3, Float32Array)
          .map((x) => x / 255)) : null;
      }
    }
  }

  decode(target, ids) {
    const { surface, studio, colours, materials, details, coordinates } = this;
    const pixels = studio.maps ? studio.maps.height : target.height;
    const size = (2 * studio.camera.slopes(1)[1] * studio.camera.distance) / pixels; // of a pixel
    this.graphics.fill(target, this.program, {
      colours, materials, details: details ?? colours, detailed: Boolean(details), coordinates, ids,
      level: Math.max(Math.log2(size * (this.texels ?? 1)) - 0.5, 0), occlusion: studio.occlusion.cells.textures[0],
      corners: surface.corners, place: surface.place, normals: surface.normals, ...surface.orientation,
    });
  }
}

const pictureOf = (bytes) => createImageBitmap(new Blob([bytes], { type: "image/webp" }),
  { colorSpaceConversion: "none", premultiplyAlpha: "none" });

function areaOf(points, faces) {
  let area = 0;
  for (let f = 0; f < faces.length; f += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => points.subarray(3 * faces[f + k], 3 * faces[f + k] + 3));
    area += norm(cross(minus(b, a), minus(c, a))) / 2;
  }
  return area || 1;
}
