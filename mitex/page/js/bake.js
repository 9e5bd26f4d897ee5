// The current look as textures: every face has a place of its own in a square, two to a cell.

const PADDING = 1; // around a face [texels]

// Where the faces are in a texture of `side` texels: cells along a side, legs, and growth of the padding.
function layoutOf(faceCount, side) {
  const cells = Math.max(Math.ceil(Math.sqrt(faceCount / 2)), 1);
  const padding = PADDING / (side / cells);
  const length = 1 - padding * (2 + Math.SQRT2);
  return { cells, legs: [padding, length], growth: padding / (length * (1 - Math.SQRT1_2)) };
}

// (3 faceCount x 2) texture coordinates of the corners, v downwards as in glTF.
function coordinatesOf(faceCount, { cells, legs: [start, length] }) {
  const uv = new Float32Array(6 * faceCount);
  for (let face = 0; face < faceCount; face++) {
    const cell = Math.floor(face / 2);
    [[0, 0], [1, 0], [0, 1]].forEach(([x, y], k) => {
      const place = [start + length * x, start + length * y].map((c) => (face % 2 ? 1 - c : c));
      uv[6 * face + 2 * k] = ((cell % cells) + place[0]) / cells;
      uv[6 * face + 2 * k + 1] = 1 - (Math.floor(cell / cells) + place[1]) / cells;
    });
  }
  return uv;
}

// Images of `side` texels: colour, occlusion-roughness-metallic, normal; RGBA bytes, row 0 below.
function bakedImages(page, side) {
  const { graphics, surface } = page;
  const { gl } = graphics;
  const texture = (format) => graphics.texture(format, side, side);
  const ids = graphics.target([texture("RGBA32UI")]);
  const maps = graphics.target(["RGBA16F", "RGBA16F", "RGBA16F", "RGBA32F"].map(texture));
  const out = graphics.target([texture("RGBA8")]);
  const laid = graphics.program(SHADERS["atlas.vert"], SHADERS["ids.frag"]);
  const baking = graphics.program(SHADERS["fill.vert"],
    written(SHADERS["bake.frag"], { SURFACE: SHADERS["surface.glsl"] }));
  graphics.into(ids);
  gl.disable(gl.DEPTH_TEST);
  gl.clearBufferuiv(gl.COLOR, 0, [0, 0, 0, 0]);
  laid.use(layoutOf(surface.faceCount, side));
  gl.drawArrays(gl.TRIANGLES, 0, 3 * surface.faceCount);
  page.decode(maps, ids.textures[0]);
  const [colour, bent, plain] = maps.textures;
  const images = [0, 1, 2].map((image) => {
    graphics.fill(out, baking, { image, colour, bent, plain, ids: ids.textures[0], corners: surface.corners,
      place: surface.place, normals: surface.normals, ...surface.orientation });
    return graphics.read(out);
  });
  [ids, maps, out].forEach((target) => graphics.drop(target));
  return images;
}

// As a PNG file.
async function png(pixels, side) {
  const canvas = element("canvas", { width: side, height: side });
  const rows = new Uint8ClampedArray(pixels.length);
  for (let row = 0; row < side; row++) {
    rows.set(pixels.subarray(4 * side * row, 4 * side * (row + 1)), 4 * side * (side - 1 - row));
  }
  canvas.getContext("2d").putImageData(new ImageData(rows, side, side), 0, 0);
  const blob = await new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
  return new Uint8Array(await blob.arrayBuffer());
}
