"""The example scripts in scenes/ run and make their pictures."""

import ast
import importlib.util
from functools import partialmethod
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from mitex.asset import Asset
from mitex.exemplar import Exemplar
from mitex.images import read_image
from mitex.mesh import Mesh, icosphere
from mitex.methods.nca import NcaTexture

pytestmark = pytest.mark.usefixtures("own_cache")
SCRIPTS = Path(__file__).parents[2] / "scenes"


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"{name}_script", SCRIPTS / f"{name}.py")
    assert spec is not None and spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    return script


def slim_ball() -> Mesh:
    """In place of the vase, which takes seconds to unwrap."""
    ball = icosphere(8)
    return ball.with_vertices(ball.vertices * np.array([0.6, 1.0, 0.6]))


def test_vertex_field_script(mi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    script = load("vertex_field")
    monkeypatch.setattr(script, "ROUND", 96)
    monkeypatch.setattr(script, "ACROSS", 48)
    script.main(str(tmp_path / "ring.png"), spp=1)

    picture = read_image(tmp_path / "ring.png")
    assert picture.shape == (720, 960, 3)
    traced, color, roughness = picture[:360, :480], picture[:360, 480:], picture[360:, :480]
    ring = roughness.max(axis=-1) > 0
    assert 0.3 < ring.mean() < 0.7
    assert not color[~ring].any()  # the floor shows the background
    warm = color[ring][:, 0] > 1.5 * color[ring][:, 2]
    cool = color[ring][:, 2] > 1.5 * color[ring][:, 0]
    assert warm.mean() > 0.2 and cool.mean() > 0.2
    assert 0.2 < traced[~ring].mean() < 0.8  # the lit floor


def test_texel_field_script(mi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    script = load("texel_field")
    monkeypatch.setattr(script, "RESOLUTION", 256)
    monkeypatch.setattr(script, "embedded", lambda _name: slim_ball())
    script.main(str(tmp_path / "vase.png"), spp=4)

    picture = read_image(tmp_path / "vase.png")
    assert picture.shape == (480, 800, 3)
    traced, charts = picture[:, :400], picture[:, 400:]
    vase = charts.max(axis=-1) > 0
    assert 0.1 < vase.mean() < 0.6
    # One colour for each chart and blends only at borders: samples of a pixel mix there, texels never do.
    _, count = np.unique((255 * charts[vase]).round(), axis=0, return_counts=True)
    assert np.sort(count)[-25:].sum() > 0.9 * vase.sum()
    warm = traced[vase][:, 0] > 1.5 * traced[vase][:, 2]
    cool = traced[vase][:, 2] > 1.5 * traced[vase][:, 0]
    assert warm.mean() > 0.15 and cool.mean() > 0.1


def test_motion_script(mi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """About the vertical axis to the right, which is red; up is violet."""
    script = load("motion")
    monkeypatch.setattr(script, "embedded", lambda _name: icosphere(8))
    script.main(str(tmp_path / "motion.png"), side=48)
    picture = read_image(tmp_path / "motion.png")
    about, up = picture[20:28, 20:28].mean((0, 1)), picture[20:28, 68:76].mean((0, 1))
    assert about[0] > about[1] + 0.3 and about[0] > about[2] + 0.3
    assert up[2] > up[0] > up[1] + 0.1


@pytest.mark.slow
def test_decoded_field_script(mi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A ball with heights that differ; most of the time goes into one kernel."""
    script = load("decoded_field")
    monkeypatch.setattr(script, "embedded", lambda _name: icosphere(6))
    script.main(str(tmp_path / "a.png"), steps=20, resolution=48, spp=2)
    picture = read_image(tmp_path / "a.png")
    assert picture.shape == (48, 96, 3)
    height = picture[:, 48:]
    ball = height.max(axis=2) > 0
    assert 0.05 < ball.mean() < 0.9 and np.ptp(height[ball]) > 0.02


@pytest.mark.slow
def test_shell_texture_script(mi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The orange sponge on the left, darker than its surroundings."""
    script = load("shell_texture")
    monkeypatch.setattr(script, "embedded", lambda _name: icosphere(3))
    script.main(str(tmp_path / "a.png"), resolution=24, spp=1)
    sponge = read_image(tmp_path / "a.png")[6:16, 3:14].reshape(-1, 3).mean(0)
    assert sponge[0] > 1.3 * sponge[2]


@pytest.mark.parametrize("path", sorted(SCRIPTS.glob("*.py")), ids=lambda path: path.stem)
def test_scripts_need_no_arguments(path: Path):
    """Their main() has a default for every parameter."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name == "main":
            assert len(node.args.args) == len(node.args.defaults)


@pytest.mark.parametrize(("large", "steps"), [(False, 40), (True, 2)])
def test_surface_synthesis_script(mi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, large, steps):
    script, ball = load("surface_synthesis"), icosphere(6)
    monkeypatch.setattr(script, "embedded", lambda _name: ball)
    small = ["resolution=48", "exemplar_size=48", f"steps={steps}", "milestones=30"]
    script.main(str(tmp_path / "octopus.png"), large, small, resolution=128, spp=4)

    picture = read_image(tmp_path / "octopus.png")
    assert picture.shape == (128, 256, 3)
    for image in (Exemplar.load("scales").maps["albedo"], picture[30:98, 30:98]):  # greenish both
        red, green, _ = image.mean((0, 1))
        assert green > red + 0.1
    asset = Asset.load(tmp_path / "octopus.glb")
    assert len(asset.mesh.faces) == len(ball.faces) and ("roughness" in asset.vertex_maps) == large


def test_text_texture_script(mi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Two balls on white, whose colours come near to the words in a few steps of a coarse training."""
    script = load("text_texture")
    monkeypatch.setattr(script, "embedded", lambda _name: icosphere(6))
    quick = partialmethod(NcaTexture.apply, steps=4, subdivide=0, resolution=64)
    monkeypatch.setattr(NcaTexture, "apply", quick)
    tiny = ["frequency=8", "density=8", "steps=10", "pool=1", "inject_every=1", "lr=0.02", "preview_every=0"]
    script.main(str(tmp_path / "a.png"), "plain red", [*tiny, "min_steps=2", "max_steps=4"], 32, 4)
    picture = read_image(tmp_path / "a.png")
    assert picture.shape[1] > 2 * 32
    middle = picture[picture.shape[0] // 2 - 4 :][:8, 12:20].reshape(-1, 3).mean(0)
    assert middle[0] > middle[1] + 0.05 and middle[0] > middle[2] + 0.05


def test_shape_from_images_script(mi, tmp_path: Path):
    script = load("shape_from_images")
    losses = script.main(str(tmp_path / "shape.png"), steps=4, resolution=24, spp=1, side=32)
    assert read_image(tmp_path / "shape.png").shape == (32, 3 * 32, 3)
    assert losses[-1] < 0.8 * losses[0]


def test_relief_and_colour(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Grey with the light's hue only on the left, in the pebbles' pale colours on the right."""
    pytest.importorskip("pymeshlab")
    quick = partialmethod(NcaTexture.apply, steps=40, subdivide=0, resolution=128)
    monkeypatch.setattr(NcaTexture, "apply", quick)
    monkeypatch.setattr("mitex.methods.geometric.coarse_patches.PLACES", 20)
    script, ball = load("relief_and_colour"), icosphere(8)
    flat = ball.with_vertices(ball.vertices * np.array([1.0, 0.6, 1.0]))
    monkeypatch.setattr(script, "embedded", lambda _name: flat)
    script.main(str(tmp_path / "a.png"), vertices=60, resolution=48, spp=8)
    picture = read_image(tmp_path / "a.png")
    half = picture.shape[1] // 2
    grey, coloured = picture[:, :half], picture[:, -half:]
    middle = np.s_[half // 3 : 2 * half // 3, half // 3 : 2 * half // 3]
    chroma = [float(np.ptp(side[middle], axis=2).mean()) for side in (grey, coloured)]
    assert chroma[0] < 0.015 and chroma[1] > 2 * chroma[0]


@pytest.mark.parametrize(("loss", "steps"), [("transport", 8), ("gram", 8), ("motion", 16)])
def test_lit_texture_script(mi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, loss: str, steps: int):
    """The exemplar, and the vase before and after: what is seen of it has changed, the floor has not."""
    script = load("lit_texture")
    monkeypatch.setattr(script, "embedded", lambda _name: slim_ball())
    losses = script.main(str(tmp_path / "a.png"), loss, steps=steps, side=64, resolution=64, spp=4)
    assert sum(losses[-4:]) < 0.95 * sum(losses[:4])  # of the same views
    picture = read_image(tmp_path / "a.png")
    assert picture.shape == (64, 192, 3)
    before, after = picture[:, 64:128], picture[:, 128:]
    change = np.abs(after - before).mean(2)
    assert change[24:40, 24:40].mean() > 10 * change[-8:, :8].mean()  # the floor in front


def test_lit_texture_script_knows_its_losses(tmp_path: Path):
    with pytest.raises(SystemExit, match="no loss 'gramm'; name one of transport, gram, motion"):
        load("lit_texture").main(str(tmp_path / "a.png"), "gramm")
