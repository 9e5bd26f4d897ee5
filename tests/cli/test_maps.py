"""Maps as files of their own: tiles, folders and variants from the command line."""

import numpy as np
import pytest
from PIL import Image

from mitex.asset import Asset
from mitex.cli import main
from mitex.exemplar import Exemplar
from tests.cli import bad_files as bad
from tests.cli.refusals import apply, check_refused
from tests.export.common import Glb

pytestmark = pytest.mark.usefixtures("own_cache", "quick_settling")
GROWN = "--subdivide 0 --steps 1 --resolution 64"
SURFACE = "--quiet --set exemplar_size=32 steps=2 preview_every=0 scales=0 layers=relu1_1"


def tile(words="--tile 32 --tile-cells 8 --steps 1", model="pebbles", out="out/tile"):
    return f"apply {model} --out {out} {words}".split()


def surface(words):
    return f"fit surface --exemplar lava --tile 64 --out out/run {words}"


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_tile_is_an_exemplar(files, capsys):
    assert main(tile()) == 0 and capsys.readouterr().out == "out/tile\n"
    maps = Exemplar.load(files / "out" / "tile").maps
    assert len(maps) == 5 and maps["albedo"].shape == (32, 32, 3)
    assert names(files / "out" / "tile") == sorted(f"{name}.png" for name in maps)
    quick = "order_weight=0 frequency=4 pool=1 view_count=1 resolution=32 min_steps=1 max_steps=1 steps=1"
    assert (
        main(f"fit nca --exemplar out/tile --out out/run --quiet --set layers=relu1_1 {quick}".split()) == 0
    )
    before = (files / "out/tile/albedo.png").read_bytes()
    assert main(tile("--tile 32 --tile-cells 8 --steps 1 --seed 0")) == 0  # our own files may be replaced
    assert (files / "out/tile/albedo.png").read_bytes() == before
    assert main(tile("--tile 32 --tile-cells 8 --steps 1 --maps-format exr", out="out/exr")) == 0
    assert "height.exr" in names(files / "out" / "exr")


def test_a_tile_of_a_surface_texture(files, capsys):
    bad.image(files / "good.png")
    assert main(f"fit surface --exemplar good.png --tile 32 --out out/run {SURFACE}".split()) == 0
    assert main(["apply", "out/run", "--out", "out/maps/"]) == 0
    assert names(files / "out" / "maps") == ["albedo.png", "mesh.mtl", "mesh.obj"]
    assert Image.open(files / "out/maps/albedo.png").size == (32, 32)
    assert Asset.load(files / "out/maps/mesh.obj").mesh.faces.shape == (2, 3)
    words = f"fit surface --exemplar good.png --tile 32 --out out/run {SURFACE} --resume".split()
    assert main([word.replace("steps=2", "steps=3") for word in words]) == 0
    capsys.readouterr()
    words = ["apply", "out/run", "--mesh", "good.obj", "--out", "out/a.glb"]
    check_refused(files, words, "belongs to mesh", capsys)


def test_a_folder_of_any_asset(files, capsys):
    assert main(apply(GROWN, out="out/maps/")) == 0 and capsys.readouterr().out == "out/maps/\n"
    assert len(names(files / "out" / "maps")) == 7
    assert Asset.load(files / "out/maps/mesh.obj").mesh.vertices.shape == (8, 3)
    assert main(apply("--start-level 0 --end-level 1", model="spikes", out="out/spikes/")) == 0
    assert names(files / "out" / "spikes") == ["albedo.png", "mesh.mtl", "mesh.obj"]


def test_a_folder_of_layers(files):
    assert main(apply(f"{GROWN} --maps-format exr", out="out/maps/")) == 0
    maps = ("albedo", "ambient_occlusion", "height", "normal", "roughness")
    assert names(files / "out" / "maps") == sorted(
        [*(f"{name}.exr" for name in maps), "mesh.mtl", "mesh.obj"]
    )


def test_variants_differ_by_their_seeds(files):
    assert main(apply(f"{GROWN} --steps 9 --seed 5 --variants 2".replace("--steps 1 ", ""))) == 0
    file = Glb(files / "out" / "a.glb")
    variants = file.document["extensions"]["KHR_materials_variants"]["variants"]
    assert [variant["name"] for variant in variants] == ["seed 5", "seed 6"]
    one, two = (
        file.image(material["pbrMetallicRoughness"]["baseColorTexture"])
        for material in file.document["materials"]
    )
    assert np.abs(one.astype(int) - two).max() > 2
    assert main(apply(f"{GROWN} --variants 1", out="out/b.glb")) == 0
    assert "extensions" not in Glb(files / "out" / "b.glb").document


REFUSALS = {
    "no mesh": (tile(""), "--mesh is missing; give --mesh MESH, or --tile N"),
    "one pixel": (tile("--tile 1"), "--tile 1 is out of range"),
    "huge tile": (tile("--tile 100000"), "--tile 100000"),
    "few cells": (tile("--tile 64 --tile-cells 2"), "--tile-cells 2"),
    "many cells": (tile("--tile 64 --tile-cells 5000"), "--tile-cells 5000"),
    "cells without a tile": (apply("--tile-cells 64"), "--tile-cells means nothing without --tile"),
    "tile on a mesh": (apply("--tile 64", out="out/t"), "--tile and --mesh contradict"),
    "turned tile": (tile("--tile 64 --orientation 45"), "--tile and --orientation contradict"),
    "tile of two sizes": (tile("--tile 64 --resolution 64"), "--tile and --resolution contradict"),
    "subdivided tile": (tile("--tile 64 --subdivide 2"), "--tile and --subdivide contradict"),
    "scaled tile": (tile("--tile 64 --scale 2"), "--tile and --scale contradict"),
    "width in a tile": (tile("--tile 64 --exemplar-width 0.5"), "--tile and --exemplar-width contradict"),
    "colours of a tile": (tile("--tile 64 --vertex-colours"), "--tile and --vertex-colours contradict"),
    "dense tile": (tile("--tile 64 --keep-dense"), "--tile and --keep-dense contradict"),
    "displaced tile": (tile("--tile 64 --displace"), "--tile and --displace contradict"),
    "relief of a tile": (tile("--tile 64 --relief 0.1"), "--tile and --relief contradict"),
    "looks of a tile": (tile("--tile 64 --looks lava"), "--tile and --looks contradict"),
    "variants of a tile": (tile("--tile 64 --variants 2"), "--tile and --variants contradict"),
    "tile as a GLB": (tile("--tile 64", out="out/a.glb"), "--tile means nothing for .glb files"),
    "tile as a picture": (tile("--tile 64", out="out/a.png"), "--tile means nothing for .png files"),
    "tile below a file": (tile("--tile 64", out="good.obj/tile"), "is a file"),
    "tile over other maps": (tile("--tile 64", out="photos"), "that Mitex did not write"),
    "folder over other maps": (apply(out="photos"), "that Mitex did not write"),
    "folder over the mesh": (apply(mesh="meshes/mesh.obj", out="meshes/"), "mesh.obj' is an input"),
    "no variants": (apply("--variants 0"), "--variants 0"),
    "many variants": (apply("--variants 1000"), "--variants 1000"),
    "variants in obj": (apply("--variants 2", out="out/a.obj"), "--variants means nothing for .obj"),
    "variants in a folder": (apply("--variants 2", out="out/"), "--variants means nothing for folders"),
    "coloured variants": (
        apply("--variants 2 --vertex-colours"),
        "--variants and --vertex-colours contradict",
    ),
    "last seed too large": (apply("--variants 2 --seed 4294967295"), "--seed 4294967296"),
    "colours in a folder": (
        apply("--vertex-colours", out="out/"),
        "--vertex-colours means nothing for folders",
    ),
    "format of a GLB": (apply("--maps-format exr"), "--maps-format means nothing for .glb"),
    "unknown format": (apply("--maps-format tif", out="out/"), "tif"),
    "surface on both": ("fit surface --exemplar lava --tile 64 --mesh good.obj", "--tile and --mesh"),
    "surface on none": ("fit surface --exemplar lava", "--mesh is missing; give --mesh MESH, or --tile N"),
    "surface of a pixel": ("fit surface --exemplar lava --tile 1", "--tile 1 is out of range"),
    "surface of two sizes": (surface("--resolution 64"), "--tile and --resolution contradict"),
    "surface of words": ("fit surface --text red --tile 64", "--tile and --text contradict"),
    "surface of a content": (surface("--content ao"), "--tile and --content contradict"),
    "turned surface": (surface("--orientation field.npy"), "--tile and --orientation contradict"),
    "surface of sizes": (surface("--scale-map sizes.npy"), "--tile and --scale-map contradict"),
    "surface's own UVs": (surface("--keep-uvs"), "--tile and --keep-uvs contradict"),
    "surface uneven": ("fit surface --exemplar lava --tile 200 --out out/run", "use a multiple of 32"),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_refusals(files, name, capsys):
    bad.image(files / "photos" / "albedo.png")
    bad.text(files / "meshes" / "mesh.obj", bad.CUBE)
    words, message = REFUSALS[name]
    check_refused(files, words.split() if isinstance(words, str) else words, message, capsys)
