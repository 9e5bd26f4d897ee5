"""More options whose values, or whose use with others, are refused with code 2 and one `error:` line."""

import pytest
import torch

from tests.cli import bad_files as bad
from tests.cli.refusals import QUICK, apply, check_refused

PAGE = "out/a.html"

# Name -> (words of the command, words of the message)
APPLIES = {
    "width 0": (apply("--exemplar-width 0"), "--exemplar-width 0 is out of range"),
    "great width": (apply("--exemplar-width 101"), "--exemplar-width 101 is out of range"),
    "width nan": (apply("--exemplar-width nan"), "--exemplar-width nan is out of range"),
    "width and scale": (apply("--exemplar-width 0.5 --scale 2"), "--exemplar-width and --scale contradict"),
    "great scale": (apply("--scale 21"), "--scale 21 is out of range"),
    "great turn": (apply("--orientation 361"), "--orientation 361 is out of range"),
    "many steps": (apply("--steps 10001"), "--steps 10001 is out of range"),
    "great speed": (apply("--field up --speed 11"), "--speed 11 is out of range"),
    "looks of a mesh": (apply("--looks lava"), "--looks means nothing for .glb"),
    "resolution of a page": (apply("--resolution 64", out=PAGE), "--resolution means nothing for .html"),
    "colours of a page": (apply("--vertex-colours", out=PAGE), "--vertex-colours means nothing for .html"),
    "dense page": (apply("--keep-dense", out=PAGE), "--keep-dense means nothing for .html"),
    "displaced page": (apply("--displace", out=PAGE), "--displace means nothing for .html"),
    "variants of a page": (apply("--variants 2", out=PAGE), "--variants means nothing for .html"),
}

RENDERS = {
    "fps of a still": ("--out out/a.png --fps 12", "--fps means nothing for .png"),
    "fps 0": ("--out out/a.mp4 --fps 0", "--fps 0 is out of range"),
    "many frames a second": ("--out out/a.mp4 --fps 61", "--fps 61 is out of range"),
    "many frames": ("--out out/a.mp4 --frames 3601", "--frames 3601 is out of range"),
    "displacement": ("--out out/a.png --displacement 0.6", "--displacement 0.6 is out of range"),
    "displacement inwards": ("--out out/a.png --displacement -0.6", "--displacement -0.6 is out of range"),
    "displacement nan": ("--out out/a.png --displacement nan", "--displacement nan is out of range"),
    "dark": ("--out out/a.png --exposure -11", "--exposure -11 is out of range"),
    "many samples": ("--out out/a.png --spp 65537", "--spp 65537 is out of range"),
    "large": ("--out out/a.png --resolution 4097", "--resolution 4097 is out of range"),
    "below what floats": ("--out out/a.png --floating --elevation -86", "--elevation -86 is out of range"),
}

FITS = {
    "nca": f"fit nca --exemplar good.png --out out/run --quiet --device cuda {QUICK}".split(),
    "geometric": ["fit", "geometric", "--reference", "good.obj", "--out", "out/run", "--device", "cuda"],
}


@pytest.mark.parametrize("name", APPLIES)
def test_apply(name, files, capsys):
    words, message = APPLIES[name]
    check_refused(files, words, message, capsys)


@pytest.mark.parametrize("name", RENDERS)
def test_render(name, files, capsys):
    bad.foreign_glb(files / "foreign.glb")
    words, message = RENDERS[name]
    check_refused(files, ["render", "foreign.glb", *words.split()], message, capsys)


@pytest.mark.parametrize("method", FITS)
def test_a_card_that_is_not_there(method, files, monkeypatch, capsys):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    bad.image(files / "good.png")
    check_refused(files, FITS[method], "no CUDA graphics card", capsys)
