"""A small real synthesis, its texture, and what is refused."""

from dataclasses import replace
from functools import partial
from importlib import import_module

import numpy as np
import pytest
import torch

from mitex.asset import Asset
from mitex.atlas import usable_uv
from mitex.errors import CheckpointError, ConfigError, MeshError
from mitex.exemplar import Exemplar
from mitex.features.layers import LAYERS, with_poolings
from mitex.geometry.vectors import unit
from mitex.mesh import Mesh, icosphere, torus
from mitex.mesh.fields import vector_field
from mitex.methods import surface
from mitex.methods.layout import with_layout
from mitex.methods.registry import method_of
from mitex.methods.surface import METHOD
from mitex.methods.surface.config import PRESETS
from mitex.methods.surface.texture import SurfaceTexture
from mitex.runtime import threads
from mitex.texels import charts
from mitex.training import resolve
from mitex.training.locate import NAME
from tests.methods.surface.small import SHALLOW, SMALL
from tests.training.contract import assert_same_checkpoint

pytestmark = pytest.mark.usefixtures("own_cache", "known_exemplars")


@pytest.fixture(scope="module")
def run(mesh, exemplar, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run") / "run"
    return folder, surface.fit(exemplar, mesh, folder, set=SMALL)


def losses(folder):
    import json

    return [json.loads(line)["loss"] for line in (folder / "metrics.jsonl").read_text().splitlines()]


def test_the_loss_falls_and_the_colours_come_near(exemplar, tmp_path):
    colours = Exemplar({"albedo": exemplar.maps["albedo"]})
    texture = surface.fit(colours, torus(32, 16), tmp_path / "run", set=[*SMALL, "steps=60"])
    loss = losses(tmp_path / "run")
    assert loss[-1] < 0.15 * loss[0]
    pixels = exemplar.maps["albedo"].reshape(-1, 3)
    assert np.abs(texture.values.mean(0) - pixels.mean(0)).max() < 0.06
    assert np.abs(texture.values.std(0) - pixels.std(0)).max() < 0.08


def test_all_maps_are_synthesized(run, exemplar):
    _, texture = run
    asset = texture.apply()
    assert isinstance(asset, Asset) and asset.texture_maps is not None
    assert set(asset.texture_maps) == set(asset.vertex_maps) == set(exemplar.maps)
    assert asset.texture_maps["albedo"].shape == (48, 48, 3)


def test_textures_agree_with_vertex_maps(run, mesh):
    """Both are read from the same texels."""
    asset = run[1].apply(mesh)
    assert asset.atlas is not None and asset.texture_maps is not None
    row = (1 - asset.atlas.uv[..., 1]) * 48 - 0.5
    column = asset.atlas.uv[..., 0] * 48 - 0.5
    nearest = asset.texture_maps["albedo"][
        np.rint(row).astype(int).clip(0, 47), np.rint(column).astype(int).clip(0, 47)
    ]
    at_corners = asset.vertex_maps["albedo"][asset.mesh.faces]
    assert np.corrcoef(nearest.ravel(), at_corners.ravel())[0, 1] > 0.5


def test_files_round_trip(run, mesh):
    folder, texture = run
    again = SurfaceTexture.load(folder)
    assert method_of(folder) == method_of(folder / NAME) == METHOD
    assert np.abs(again.values - texture.values).max() < 1e-3 and again.maps == texture.maps
    assert np.array_equal(again.mesh.faces, mesh.faces) and again.about["steps"] == 12
    with pytest.raises(ConfigError, match="belongs to mesh 'icosphere6', not to 'icosphere5'; synthesize"):
        again.apply(icosphere(5))


@pytest.mark.parametrize("name", ["config.toml", "nothing", "metrics.jsonl"])
def test_what_is_no_texture_is_refused(run, name):
    with pytest.raises(CheckpointError, match="surface texture|there is no model"):
        SurfaceTexture.load(run[0] / name)


def test_resuming_changes_nothing(mesh, exemplar, tmp_path, monkeypatch):
    """Nor are patches laid again, which the checkpoint would overwrite."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        settings = [*SHALLOW, "start=patches"]
        whole = surface.fit(exemplar, mesh, tmp_path / "whole", set=settings)
        part = [*settings, "steps=6"]
        surface.fit(exemplar, mesh, tmp_path / "part", set=part)
        assert method_of(tmp_path / "part") == METHOD
        monkeypatch.delattr("mitex.methods.surface.task.joined_patches")
        rest = surface.fit(exemplar, mesh, tmp_path / "part", set=["steps=12"], resume=True)
    finally:
        torch.set_num_threads(threads)
    assert np.array_equal(whole.values, rest.values)
    assert_same_checkpoint(tmp_path / "whole", tmp_path / "part")


def test_resuming_on_another_mesh_is_refused(run, exemplar):
    with pytest.raises(CheckpointError, match="mesh"):
        surface.fit(exemplar, icosphere(7), run[0], set=["steps=14"], resume=True)


def test_resuming_with_another_exemplar_of_the_same_name_is_refused(run, mesh, exemplar):
    other = Exemplar({**exemplar.maps, "albedo": 1 - exemplar.maps["albedo"]}, exemplar.name)
    with pytest.raises(CheckpointError, match=f"the exemplar '{exemplar.name}' is not the one"):
        surface.fit(other, mesh, run[0], set=["steps=14"], resume=True)


def test_optimizers_and_spaces(mesh, exemplar, tmp_path):
    """After the same steps principal components are nearer than channels, and L-BFGS than Adam."""
    colours, last = Exemplar({"albedo": exemplar.maps["albedo"]}), {}
    for setting in ("whitened=false noise=0.2 lr=0.1", "optimizer=adam", "optimizer=lbfgs lr=1"):
        overrides = [*SMALL, "start=patches", "steps=25", *setting.split()]
        surface.fit(colours, mesh, tmp_path / setting, set=overrides)
        last[setting] = losses(tmp_path / setting)[-1]
    channels, adam, lbfgs = last.values()
    assert adam < 0.7 * channels and lbfgs < 0.85 * adam


def test_transport_gives_the_exemplars_colours(mesh, exemplar, tmp_path):
    colours = Exemplar({"albedo": exemplar.maps["albedo"]})
    overrides = [*SMALL, "steps=30", "loss=transport", "layers=relu1_1,relu2_1,relu3_1"]
    texture = surface.fit(colours, mesh, tmp_path / "run", preset="noise", set=overrides)
    loss = losses(tmp_path / "run")
    assert np.mean(loss[-5:]) < 0.5 * loss[0]
    assert np.abs(texture.values.mean(0) - exemplar.maps["albedo"].mean((0, 1))).max() < 0.06


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["optimizer=lbfgs", "loss=transport"], "without randomness"),
        (["optimizer=lbfgs"], "one map"),
        (["optimizer=lbfgs", "scales=1"], "scales=0"),
        (["optimizer=sgd"], "'adam', 'lbfgs'"),
        (["loss=l2"], "'gram', 'transport'"),
        (["layers=relu3_4"], "relu3_4"),
        (["weights=vgg19", "layers=relu3_5"], "relu3_5"),
    ],
)
def test_settings_that_do_not_go_together(mesh, exemplar, tmp_path, settings, message):
    with pytest.raises(ConfigError, match=message):
        small = [word for word in SMALL if word != "scales=0" or "scales=1" not in settings]
        surface.fit(exemplar, mesh, tmp_path / "run", set=[*small, *settings])
    assert not (tmp_path / "run").exists()


def test_vgg19_compares_its_own_layers():
    config = resolve(PRESETS, None, None, ["weights=vgg19"])
    assert len(config.compared) == 21 and "relu5_4" in config.compared
    assert resolve(PRESETS, None, None, []).compared == with_poolings(LAYERS)


def test_an_unknown_content_layer_is_named_as_such():
    with pytest.raises(ConfigError, match="content_layer is relu9_1"):
        resolve(PRESETS, None, None, ["content_layer=relu9_1"])


def test_more_than_the_memory_is_refused_with_the_estimate(mesh, monkeypatch):
    room = import_module("mitex.methods.surface.fitting")
    config = resolve(PRESETS, None, None, ["resolution=2000"])
    half = replace(
        mesh, uv=np.tile(np.array([[0, 0], [1, 0], [0, 1]], np.float32), (1, 1, 1)), faces=mesh.faces[:1]
    )
    monkeypatch.setattr(room, "available_memory", lambda: 2_000_000 * room.BYTES_PER_TEXEL + 1)
    room.check_memory(half, config)
    monkeypatch.setattr(room, "available_memory", lambda: 500_000 * room.BYTES_PER_TEXEL)
    with pytest.raises(
        ConfigError,
        match=r"2000\^2 needs about 7.2 GB of memory, and 1.8 GB are free; set resolution to 1000",
    ):
        room.check_memory(half, config)
    monkeypatch.setattr(room, "available_memory", lambda: 2_000_000 * room.BYTES_PER_TEXEL + 1)
    room.check_memory(half, config, steps=np.ones(3))
    with pytest.raises(ConfigError, match="needs about 4[0-9]"):  # its pattern hardly pools
        room.check_memory(half, config, steps=np.full(3, 0.25))
    monkeypatch.setattr(room, "available_memory", lambda: None)
    room.check_memory(half, config)


class TestOrientation:
    def test_a_field_turns_the_frames_and_stays_with_the_texture(self, mesh, exemplar, tmp_path):
        down = np.tile(np.array([0.0, -1.0, 0.0], np.float32), (len(mesh.vertices), 1))
        np.save(tmp_path / "down.npy", down)
        settings = [*SHALLOW, "steps=2"]
        surface.fit(exemplar, mesh, tmp_path / "run", set=settings, orientation=tmp_path / "down.npy")
        texture = SurfaceTexture.load(tmp_path / "run")
        tangents = texture.apply().tangents
        assert texture.domain.orientation is not None and tangents is not None
        assert np.array_equal(texture.domain.orientation, vector_field(mesh, down))
        around = np.abs(mesh.normals[:, 1]) < 0.5
        right = np.cross([0.0, -1.0, 0.0], mesh.normals[around])  # of up, with the outward normal
        assert ((unit(right) * tangents[around, :3]).sum(axis=1) > 0.99).all()

    def test_a_name_is_the_field_of_that_name(self, mesh, exemplar):
        fit = partial(surface.fit, exemplar, mesh, set=[*SHALLOW, "steps=1"])
        orientation = fit(orientation="about-x").domain.orientation
        assert orientation is not None and np.array_equal(orientation, vector_field(mesh, "about-x"))

    def test_resuming_with_another_field_is_refused(self, mesh, exemplar, tmp_path):
        fit = partial(surface.fit, exemplar, mesh, tmp_path / "run", set=[*SHALLOW, "steps=2"])
        fit()
        with pytest.raises(CheckpointError, match="orientation"):
            fit(orientation=mesh.vertices, resume=True)


def test_a_fit_computes_its_domain_once(mesh, exemplar, tmp_path, monkeypatch):
    """Synthesis, previews and texture work on one domain, for which each piece is computed once."""
    room, calls = import_module("mitex.methods.surface.domain"), []
    for name in ("vertex_directions", "build", "GeodesicTracer"):
        original = getattr(room, name)
        count = lambda *args, f=original, name=name: (calls.append(name), f(*args))[1]  # noqa: E731
        monkeypatch.setattr(room, name, count)
    rasterize = room.Texels.rasterize
    monkeypatch.setattr(
        room.Texels, "rasterize", staticmethod(lambda *args: (calls.append("texels"), rasterize(*args))[1])
    )
    monkeypatch.setattr("mitex.methods.surface.task.VIEW", 16)
    overrides = [*SHALLOW, "resolution=47", "steps=2", "preview_every=2"]
    surface.fit(exemplar, mesh, tmp_path / "run", set=overrides).apply()
    assert sorted(calls) == ["GeodesicTracer", "build", "texels", "vertex_directions"]


def test_noise_start_and_range(mesh, exemplar, tmp_path):
    texture = surface.fit(exemplar, mesh, tmp_path / "run", set=[*SHALLOW, "steps=1", "lr=0"])
    maps = [exemplar.maps[name] for name in texture.maps]
    assert np.abs(texture.values.mean(0) - np.concatenate([m.mean((0, 1)) for m in maps])).max() < 0.05
    spread = np.concatenate([m.std((0, 1)) for m in maps])
    # Uniform noise of width 1 deviates by 0.289; a channel that hardly varies gets a little of the floor.
    assert np.abs(texture.values.std(0) - 0.289 * spread).max() < 0.02
    overrides = [*SHALLOW, "steps=1", "lr=0", "whitened=false", "noise=0.2"]
    texture = surface.fit(exemplar, mesh, tmp_path / "paper", set=overrides)
    assert texture.values.min() >= 0 and texture.values.max() <= 0.2
    assert abs(texture.values.mean() - 0.1) < 0.005


def test_diffusion_wears_down_what_is_finer_than_the_taps(mesh, exemplar, tmp_path):
    """Without a gradient noise fades and the mean stays."""
    textures = {}
    for amount in ("0", "0.1"):
        overrides = [*SHALLOW, "lr=0", f"diffusion={amount}"]
        textures[amount] = surface.fit(exemplar, mesh, tmp_path / amount, set=overrides).values
    assert np.abs(textures["0.1"].mean(0) - textures["0"].mean(0)).max() < 0.01
    assert (textures["0.1"].std(0) < 0.6 * textures["0"].std(0)).all()


class TestLayouts:
    CONFIG = resolve(PRESETS, None, None, ["resolution=64"])

    def test_own_uvs_are_kept_on_request(self, mesh):
        laid = with_layout(mesh, self.CONFIG.resolution)
        assert laid.uv is not None and usable_uv(laid, laid.uv)
        assert with_layout(laid, self.CONFIG.resolution, True) is laid
        assert len(np.unique(charts(laid, laid.uv))) >= 2

    def test_missing_uvs(self, mesh):
        with pytest.raises(ConfigError, match="no UVs to keep"):
            with_layout(mesh, self.CONFIG.resolution, True)

    def test_a_mesh_whose_areas_vanish_is_not_unwrapped(self, monkeypatch):
        monkeypatch.delattr("mitex.methods.layout.unwrap")
        tiny = icosphere(2).with_vertices(icosphere(2).vertices * 1e-30)
        with pytest.raises(MeshError, match="no face of icosphere2 has an area; scale it up"):
            with_layout(tiny, self.CONFIG.resolution)

    @pytest.mark.parametrize("damage", ["overlap", "outside", "nan"])
    def test_unusable_uvs(self, mesh, damage):
        uv = np.array(with_layout(mesh, self.CONFIG.resolution).uv)
        uv[: len(uv) // 2] = uv[len(uv) // 2 :] if damage == "overlap" else uv[: len(uv) // 2]
        if damage == "outside":
            uv = 2 * uv
        if damage == "nan":
            uv[0, 0] = 1e30
        with pytest.raises(ConfigError, match="overlap"):
            with_layout(replace(mesh, uv=uv), self.CONFIG.resolution, True)


def test_one_triangle_is_enough(exemplar, tmp_path):
    mesh = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]), name="one")
    texture = surface.fit(exemplar, mesh, tmp_path / "run", set=[*SMALL, "steps=2"])
    assert np.isfinite(texture.values).all()


def test_size_does_not_matter(mesh, exemplar):
    """Scaled by a power of two, which changes no digits, the texture is the same but for rounding."""
    threads(1)
    one, small, large = (
        surface.fit(exemplar, mesh.with_vertices(mesh.vertices * 2.0**power), set=[*SMALL, "steps=3"])
        for power in (0, -20, 20)
    )
    for other in (small, large):
        size = np.ptp(other.domain.mesh.vertices)
        assert np.array_equal(one.domain.uv, other.domain.uv), size
        assert np.abs(one.values - other.values).max() < 1e-2, size
