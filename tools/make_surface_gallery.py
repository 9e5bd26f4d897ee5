"""Synthesizes surface textures on meshes and renders them, the exemplar beside them.

usage: python tools/make_surface_gallery.py EXEMPLARS MESHES RUNS SHEET MESH=EXEMPLAR[,SETTING=VALUE ...] ...
           [SETTING=VALUE ...]

EXEMPLARS and MESHES are folders; names of embedded ones work too, and the exemplar `letters` is drawn. MESH^N
is MESH with all faces split in four N times, MESH~N a remeshed copy with N faces (MESH~N^M: then split),
and `scene`, `torus` and `nut` are made up. RUNS is where the run folders go: finished ones are used again,
begun ones go on. The sheet is docs/gallery/SHEET.jpg, a row for each exemplar: itself, and the mesh from two
sides, or one side of each of its meshes or variants, in the order that they are given; the ratio across seams
is printed, and the contrast of the texels.
Settings change the synthesis, of one MESH=EXEMPLAR or of all (`resolution=512`, `triples=1`, ...);
`maps=albedo` leaves out other maps, `content=ao` transfers the style, `scale_map=LOW:HIGH` lets the pattern's
size grow evenly from the mesh's lowest point to its highest.
"""

from __future__ import annotations

import re
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
from machine_part import flanged_nut
from PIL import Image, ImageDraw, ImageFont

from mitex.evaluation.contrast import Contrast, contrast
from mitex.evaluation.seams import seam_ratio
from mitex.exemplar import Exemplar
from mitex.exemplar import names as exemplar_names
from mitex.images import write_image
from mitex.mesh import Mesh, embedded_names, grid, remesh, subdivide_midpoint, torus
from mitex.mesh.topology import welded
from mitex.methods import surface
from mitex.render import sheet, still, tone
from mitex.training.locate import NAME, has_checkpoint

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
SIDES = {"scene": (25, 65)}  # azimuths [degrees]
OTHER_SIDES = (20, 200)
CELL, SMALL = 272, 200  # sides of pictures [px], in rows of three and longer ones
INPUTS = {"content", "scale_map"}
KEYS = {field.name for field in fields(surface.SurfaceConfig)} | {"maps"} | INPUTS


def letters(size: int = 256) -> Exemplar:
    """Letters that look different in a mirror, upright, on paper."""
    image = Image.new("RGB", (size, size), (236, 226, 204))
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(size // 5)
    for k in range(25):
        row, column = divmod(k, 5)
        ink = ((30, 40, 70), (150, 40, 30), (40, 90, 60))[k % 3]
        draw.text(((column + 0.18) * size / 5, (row - 0.05) * size / 5), "RFGPE"[(k + row) % 5], ink, font)
    return Exemplar({"albedo": np.asarray(image, np.float32) / 255}, "letters")


def scene(meshes: Path) -> Mesh:
    """A floor and two walls with furniture, scanned badly: a bumpy open surface with holes."""
    rng = np.random.default_rng(0)
    square = grid(70, 70)
    x, y = square.vertices[:, 0], square.vertices[:, 1]
    sheets = [(x, -1 + 0 * x, -y), (x, y, -1 + 0 * x), (-1 + 0 * x, y, -x)]
    parts = [(np.stack(s, 1), square.faces) for s in sheets]
    for name, scale, at in (("chair", 0.55, (0.3, -0.45, 0.2)), ("mug", 0.25, (-0.5, -0.78, 0.45))):
        thing = Mesh.load(meshes / f"{name}.obj").normalised()[0]
        parts.append((scale * thing.vertices + at, thing.faces))
    vertices = np.concatenate([v for v, _ in parts])
    starts = np.cumsum([0, *(len(v) for v, _ in parts)])
    faces = np.concatenate([f + start for (_, f), start in zip(parts, starts, strict=False)])
    vertices = vertices + rng.normal(0, 0.002, vertices.shape)[welded(vertices)]
    centres = vertices[faces].mean(1)
    holes = centres[rng.integers(len(centres), size=14)]
    outside = (np.linalg.norm(centres[:, None] - holes, axis=2) > rng.uniform(0.04, 0.12, 14)).all(1)
    return Mesh(vertices.astype(np.float32), faces[outside], name="scene")


def find_mesh(name: str, meshes: Path) -> Mesh:
    """A mesh by the name that the command line gives it."""
    if name == "scene":
        return scene(meshes)
    base = re.split(r"[~^]", name)[0]
    if base in ("torus", "nut"):
        mesh = torus() if base == "torus" else flanged_nut()
    else:
        mesh = Mesh.load(base if base in embedded_names() else meshes / f"{base}.obj")
    if coarse := re.search(r"~(\d+)", name):
        mesh = remesh(mesh, int(coarse[1]) // 2)
    if split := re.search(r"\^(\d+)", name):
        mesh = subdivide_midpoint(mesh, int(split[1]))
    return replace(mesh, name=name)


def find_exemplar(name: str, exemplars: Path, maps: str | None) -> Exemplar:
    """An exemplar by the name that the command line gives it."""
    if name == "letters":
        return letters()
    exemplar = Exemplar.load(name if name in exemplar_names() else exemplars / name)
    if maps is None:
        return exemplar
    return Exemplar({key: exemplar.maps[key] for key in maps.split(",")}, exemplar.name)


def texture(exemplar: Exemplar, mesh: Mesh, run: Path, settings: dict[str, str]) -> surface.SurfaceTexture:
    """The texture in a run folder, synthesized if it is not there yet."""
    if (run / NAME).is_file():
        return surface.SurfaceTexture.load(run)
    overrides = {key: value for key, value in settings.items() if key not in INPUTS}
    content, ends, scale_map = settings.get("content"), settings.get("scale_map"), None
    if ends is not None:
        height = mesh.vertices[:, 1]
        scale_map = np.interp(height, (height.min(), height.max()), [float(end) for end in ends.split(":")])
    resume = has_checkpoint(run)
    return surface.fit(
        exemplar, mesh, run, set=overrides, content=content, scale_map=scale_map, resume=resume
    )


def contrasts(result: surface.SurfaceTexture) -> Contrast:
    """Of the texels that lie on the mesh."""
    albedo = result.apply().maps["albedo"]
    mask = np.zeros(albedo.shape[:2], bool)
    np.put(mask, result.domain.texels.index, True)
    return contrast(albedo, mask)


def pictures(result: surface.SurfaceTexture, count: int, side: int) -> list[np.ndarray]:
    """The mesh from `count` of its sides, each picture with `side` pixels in rows and columns."""
    asset, sides = result.apply(), SIDES.get(result.mesh.name, OTHER_SIDES)[:count]
    return [tone(still(asset, resolution=side, spp=64, azimuth=a)) for a in sides]


def main() -> None:
    exemplars, meshes, runs, name = Path(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3]), sys.argv[4]
    shared = dict(word.split("=") for word in sys.argv[5:] if word.split("=")[0] in KEYS)
    rows = [word.split(",") for word in sys.argv[5:] if word.split("=")[0] not in KEYS]
    pairs = [pair.split("=") for pair, *_ in rows]
    several = len({exemplar for _, exemplar in pairs}) < len(pairs)  # results of an exemplar: one side each
    variants = several and len({mesh for mesh, _ in pairs}) == 1
    one = len({exemplar for _, exemplar in pairs}) == 1
    columns = 3 if one or not several else 1 + len({mesh for mesh, _ in pairs})
    side = CELL if columns == 3 else SMALL
    cells, labels, last = [], [], None
    for (mesh_name, exemplar_name), (_, *own) in zip(pairs, rows, strict=True):
        settings = shared | dict(setting.split("=") for setting in own)
        maps = settings.pop("maps", None)
        mesh, exemplar = find_mesh(mesh_name, meshes), find_exemplar(exemplar_name, exemplars, maps)
        run = runs / "-".join([name, mesh_name, exemplar_name, *(word.replace("=", "") for word in own)])
        result = texture(exemplar, mesh, run, settings)
        seams = seam_ratio(result.apply(), result.domain.texels.size)
        print(f"{run.name}: {result.about['seconds']} s, seams {seams:.3f}", flush=True)
        print(f"  contrast {contrasts(result)}", flush=True)
        if exemplar_name != last:
            cells.append(exemplar.resized(side).maps["albedo"])
            labels.append(f"exemplar {exemplar.name}")
        cells += pictures(result, 1 if several else 2, side)
        common = [f"{key}={value}" for key, value in shared.items() if key not in {*INPUTS, "maps"}]
        words = own or common or ["default"] if variants else [mesh.name, *own[:1]]
        labels += [" ".join(words), *["the other side"] * (not several)]
        last = exemplar_name
    write_image(GALLERY / f"{name}.jpg", sheet(cells, columns=columns, labels=labels, cell=side))


if __name__ == "__main__":
    main()
