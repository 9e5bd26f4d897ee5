"""A small real fit, and what is done with its result."""

from __future__ import annotations

import json
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from mitex.asset import Asset
from mitex.errors import CheckpointError, ConfigError, MeshError, OutputError
from mitex.evaluation.metrics import psnr
from mitex.mesh import Mesh, icosphere
from mitex.methods.nerf import PRESETS, NerfTexture, files, fit
from mitex.methods.nerf.base.base_shape import face_frames
from mitex.methods.nerf.capture.pixels import Pixels
from mitex.methods.nerf.field.projection import Projection
from mitex.methods.nerf.field.rendering import render_batch
from mitex.methods.nerf.field.shell import ShellCoords
from mitex.methods.nerf.field.tensors import rows
from mitex.methods.nerf.training import radiance
from mitex.methods.nerf.training.light_estimate import estimated_light
from mitex.methods.nerf.training.task import BURIED, POSE, TextureTask
from mitex.runtime import init, threads
from mitex.runtime.jit import dr, mi
from mitex.training import Step, checkpoint
from mitex.training.config import resolve
from mitex.training.locate import NAME
from tests.methods.nerf.tiny import SETTINGS, tiny_capture
from tests.training.contract import FAULTS, assert_loss_is_pure, assert_third_step_leaves_no_trace

init()


def test_the_loss_falls_and_the_run_folder_is_whole(run):
    lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    colour = [line["colour"] for line in lines]
    assert len(lines) == 160 and np.mean(colour[-20:]) < 0.5 * np.mean(colour[:20])
    assert {"normals", "clusters", "interior", "samples"} <= lines[-1].keys()
    assert (run / NAME).is_file() and len(list((run / "previews").glob("*.png"))) == 1


def test_a_held_out_view_looks_like_its_photo(texture):
    _, held_out = tiny_capture().split()
    batch, shape = Pixels(held_out).image(0, 48)
    photo = (batch.colours * batch.alpha + 1 - batch.alpha).numpy()
    image = render_batch(texture.shell, batch)
    quality = psnr(image.reshape(*shape, 3), photo.reshape(*shape, 3))
    assert quality > 17
    assert quality > 3 + psnr(np.ones_like(photo).reshape(*shape, 3), photo.reshape(*shape, 3))


def test_the_shell_is_as_thick_as_the_bumps(texture):
    assert 0.05 < texture.model.base.thickness < 0.25


def test_the_file_goes_round(texture, tmp_path):
    again = NerfTexture.load(texture.save(tmp_path / "copy.safetensors"))
    points = 0.56 * icosphere(4).vertices
    np.testing.assert_array_equal(again.features(points), texture.features(points))
    np.testing.assert_array_equal(again.model.occupied, texture.model.occupied)
    assert again.model.about == texture.model.about


@pytest.mark.parametrize("missing", ["frames", "weights/3", "tables/f"])
def test_damaged_files_are_refused(texture, tmp_path, missing, monkeypatch):
    original = files.model_file.save

    def save(path, tensors, *rest, **more):
        return original(path, {k: v for k, v in tensors.items() if k != missing}, *rest, **more)

    monkeypatch.setattr(files.model_file, "save", save)
    path = texture.save(tmp_path / "damaged.safetensors")
    with pytest.raises(CheckpointError, match="not a nerf texture"):
        NerfTexture.load(path)


def test_a_used_folder_is_refused(run, base):
    with pytest.raises(OutputError):
        fit(tiny_capture(), run, base_mesh=base, set=SETTINGS)


def test_maps_repeat_patches_of_the_base_shape(texture, maps):
    """Away from seams, features and frames are those of the patch that the texel is from."""
    assert maps.features.shape == (256, 256, 24) and maps.frame.shape == (256, 256)
    turned = np.einsum("kij,klj->kil", maps.frames, maps.frames)
    np.testing.assert_allclose(turned, np.broadcast_to(np.eye(3), turned.shape), atol=1e-4)
    spread = texture.features(texture.model.base.mesh.vertices)
    low, high = spread.min(0) - 1e-3, spread.max(0) + 1e-3
    assert ((maps.features >= low) & (maps.features <= high)).mean() > 0.95


def test_the_same_seed_gives_the_same_texture(texture, maps):
    again = texture.synthesize(256, seed=1, patches=60, tileable=True)
    np.testing.assert_array_equal(again.features, maps.features)
    other = texture.synthesize(256, seed=2, patches=60, tileable=True)
    assert np.abs(other.features - maps.features).mean() > 0.1 * maps.features.std()


def test_a_texture_on_another_mesh_is_near_its_surface(texture, maps):
    applied = texture.apply(icosphere(12), maps, lift=0.0)
    radius = np.linspace(0.3, 1.0, 400)
    points = np.stack([np.zeros(400), radius, np.zeros(400)], 1).astype(np.float32)
    density = applied.density(points)
    surface = 1 / 1.2
    far = np.abs(radius - surface) > applied.thickness * 1.02
    assert (density[far] == 0).all() and density.max() > 1
    np.testing.assert_allclose(applied.similarity.scale, 1.2, rtol=1e-2)
    assert applied.thickness == pytest.approx(texture.model.base.thickness)


def test_scale_and_density_do_what_they_say(texture, maps):
    mesh = icosphere(12)
    plain, dense = texture.apply(mesh, maps), texture.apply(mesh, maps, density=3.0)
    points = (0.84 * mesh.vertices[:200]).astype(np.float32)
    np.testing.assert_allclose(dense.density(points), 3 * plain.density(points), rtol=1e-4)
    large = texture.apply(mesh, maps, scale=2.0)
    assert large.thickness == pytest.approx(2 * plain.thickness)


def test_a_picture_and_a_mesh_come_out(texture, maps, tmp_path):
    applied = texture.apply(icosphere(12), maps, density=20.0, lift=0.0)
    picture = applied.render(tmp_path / "ball.png", resolution=48, spp=1)
    assert picture.stat().st_size > 1000
    asset = applied.extract(cells=96)
    distance = np.linalg.norm(asset.mesh.vertices, axis=1)
    reach = (applied.thickness + 2 / 96) * applied.similarity.scale  # a cell more
    assert np.abs(distance - 1).max() < reach
    again = Asset.load(asset.export(tmp_path / "ball.glb")).mesh
    expected = asset.mesh.vertices[asset.mesh.faces]
    np.testing.assert_allclose(again.vertices[again.faces], expected, atol=1e-5)


def test_bad_requests_are_refused(texture, maps):
    mesh = icosphere(4)
    flat = Mesh(mesh.vertices * 0 + 1, mesh.faces)
    with pytest.raises(ConfigError):
        texture.apply(mesh, maps, scale=0.0)
    with pytest.raises(ConfigError):
        texture.apply(mesh, maps, density=-1.0)
    with pytest.raises(MeshError):
        texture.apply(flat, maps)
    with pytest.raises(ConfigError):
        texture.apply(mesh, maps).extract(cells=50)


@pytest.fixture(scope="module")
def small_base() -> Mesh:
    """Of few faces, for tests of single steps."""
    ball = icosphere(12)
    return Mesh(0.55 * ball.vertices, ball.faces, name="ball")


CONFIG = replace(PRESETS["fast"], rays=512, table=12, coarsest=8, finest=16, occupancy=32, ray_steps=128)


def small_task(base: Mesh, **more) -> TextureTask:
    capture = tiny_capture()
    return TextureTask(
        replace(CONFIG, **more), capture, (capture, 0), Projection(base, reach=0.12), face_frames(base), 0.12
    )


def run_step(task: TextureTask, step: int, generator: torch.Generator | None = None) -> Step:
    """The loss of a step after what comes before it."""
    generator = generator or torch.Generator().manual_seed(0)
    task.begin(step, generator)
    return task.loss(step, generator)


def refresh_each_step(monkeypatch) -> None:
    """So that `begin` changes something in every step."""
    monkeypatch.setattr(radiance, "REFRESH", 1)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_skipped_step_leaves_every_byte(small_base, fault, monkeypatch):
    refresh_each_step(monkeypatch)
    threads(1)
    assert_third_step_leaves_no_trace(lambda: small_task(small_base), CONFIG, fault)


def test_a_refresh_that_finds_no_number_is_taken_back(small_base, monkeypatch):
    refresh_each_step(monkeypatch)
    threads(1)

    @contextmanager
    def spoiled(task, fault):
        with patch.object(task, "density", lambda points: np.full(len(points), np.nan, np.float32)):
            yield

    assert_third_step_leaves_no_trace(lambda: small_task(small_base), CONFIG, "density", spoiled)


@pytest.mark.parametrize("step", [0, 1])
def test_the_loss_changes_nothing(small_base, step):
    threads(1)
    assert_loss_is_pure(small_task(small_base), step)


def test_a_run_does_not_go_on_on_another_base_shape(small_base):
    """Checkpoints tell it, so that the loop refuses them."""
    moved = small_base.with_vertices(1.001 * small_base.vertices)
    tasks = [small_task(mesh) for mesh in (small_base, small_base.with_vertices(small_base.vertices), moved)]
    first, same, other = [task.metadata()["base_key"] for task in tasks]
    assert first == same != other


def test_fine_normals_start_near_those_of_the_faces(base):
    """Else the light stays even, and its shades become part of k_d."""
    task = small_task(base)
    latents, decoder, _ = task.model(task.named, packed=True)
    points = (base.vertices[base.faces].mean(1) * 1.02).astype(np.float32)
    coords = ShellCoords.of(task.projection(points))
    normal = decoder(*latents(coords), coords.distance).normal(*latents.frame(coords))
    cosine = (rows(normal) * base.face_normals[np.array(coords.face)]).sum(1)
    assert cosine.min() > np.cos(np.radians(3.0))


def test_the_light_is_that_of_the_photos_unless_it_is_learned(small_base):
    for learned in (False, True):
        task = small_task(small_base, learn_light=learned)
        estimate = estimated_light(small_base, task.pixels.capture)
        np.testing.assert_allclose(task.named["light"].detach(), estimate, rtol=1e-5, atol=1e-6)
        loss = run_step(task, 0).value
        loss.backward()
        gradient = task.named["light"].grad
        assert (gradient is not None and gradient.abs().max() > 0) == learned


def test_refined_cameras_get_the_gradient_of_the_loss(small_base):
    task = small_task(small_base, refine_cameras=True)
    capture = task.pixels.capture
    loss = run_step(task, 0).value
    loss.backward()
    gradient = task.named["poses"].grad
    assert gradient is not None and gradient.shape == (len(capture), 6)
    assert gradient.isfinite().all() and (gradient.abs().sum(1) > 0).float().mean() > 0.9


@pytest.mark.slow
def test_refined_cameras_make_up_for_wrong_ones(base, tmp_path, own_cache):
    """Poses that are a degree off cost accuracy; refined ones win most of it back."""
    capture, rng = tiny_capture(), np.random.default_rng(0)
    turns = Rotation.from_rotvec(np.radians(1.0) * rng.normal(size=(len(capture), 3)) / np.sqrt(3))
    poses = capture.poses.copy()
    poses[:, :, :3] = turns.as_matrix() @ poses[:, :, :3]
    wrong = replace(capture, poses=poses.astype(np.float32))
    more = [s for s in SETTINGS if not s.startswith(("steps", "lr_steps", "preview"))]
    more += ["steps=400", "lr_steps=400", "preview_every=0"]
    errors = {}
    for name, photos, refined in (("right", capture, 0), ("wrong", wrong, 0), ("refined", wrong, 1)):
        settings = [*more, f"refine_cameras={'true' if refined else 'false'}"]
        fit(photos, tmp_path / name, base_mesh=base, set=settings)
        lines = (tmp_path / name / "metrics.jsonl").read_text().splitlines()[-50:]
        errors[name] = np.mean([json.loads(line)["colour"] for line in lines])
    assert errors["refined"] < 0.5 * (errors["right"] + errors["wrong"]), errors


@pytest.fixture(scope="module")
def projection(base: Mesh) -> Projection:
    """One for all tasks after the fit: it keeps what it has looked up."""
    return Projection(base, reach=0.12)


def trained_task(run, projection: Projection, capture, setting: str) -> TextureTask:
    """After the small fit, with a setting of its own and the same or other photos."""
    settings = resolve(PRESETS, "fast", overrides=[*SETTINGS, setting])
    task = TextureTask(settings, capture, (capture, 0), projection, face_frames(projection.mesh), 0.12)
    state = checkpoint.load(run).task
    with torch.no_grad():
        for name, value in task.named.items():
            value.copy_(state.get(f"parameters/{name}", value))
    return task


def test_the_inside_learns_from_the_surface_and_not_the_surface_from_it(run, projection):
    gradients = []
    for weight in (0.0, 1.0):
        task = trained_task(run, projection, tiny_capture(), f"interior_weight={weight}")
        result = run_step(task, task.config.steps)
        assert result.metrics.get("interior", 0.0) > 0 or not weight
        gradients.append(torch.autograd.grad(result.value, [task.named["tables/f"], task.named["weights/4"]]))
    (features, reflection), (features_too, reflection_too) = gradients
    scale = float(features.abs().max())
    np.testing.assert_allclose(features, features_too, rtol=1e-3, atol=1e-4 * scale)
    assert (reflection - reflection_too).abs().max() > 0.01 * reflection.abs().max()


def test_an_inside_that_looks_as_the_surface_costs_nothing(run, projection):
    task = trained_task(run, projection, tiny_capture(), "interior_weight=1.0")
    with torch.no_grad():
        task.named["weights/4"].zero_()  # the last of the reflection's: all is grey
    assert run_step(task, task.config.steps).metrics["interior"] == 0
    assert "interior" not in run_step(task, 0).metrics


def test_buried_is_what_has_matter_above_and_beside_it(run, projection):
    """In matter that ends at the base shape and at x = 0.1: near either of them a photo may see it."""
    task = trained_task(run, projection, tiny_capture(), "interior_weight=1.0")
    reach = BURIED * task.thickness
    x, distance = [0, 0, 0, 0.1 - 0.9 * reach, 0.1 - 1.5 * reach], [0.5, -0.9, -1.1, -1.1, -1.1]
    up = mi.Vector3f(0, 0, mi.Float([1] * 5))
    here = ShellCoords(
        mi.Point3f(mi.Float(x), 0, 0), reach * mi.Float(distance), mi.UInt32(0), mi.Point2f(0), up
    )

    def exponent(f, distance):
        return dr.select((f[0] < 0.1) & (distance < 0), 12.0, -12.0)

    latents: Any = SimpleNamespace(features=lambda coords: [coords.foot.x])
    decoder: Any = SimpleNamespace(exponent=exponent)
    buried = np.array(task._buried(latents, decoder, here))
    np.testing.assert_allclose(buried, [0, 0, 1, 0, 1], atol=1e-3)


def test_wrong_cameras_find_back(run, projection):
    """In a field that is right, cameras turned by half a degree turn back, or move so that it is the same."""
    capture, rng = tiny_capture(), np.random.default_rng(0)
    training, _ = capture.split()
    turns = np.radians(0.5) * rng.normal(size=(len(training), 3))
    poses = training.poses.copy()
    poses[:, :, :3] = Rotation.from_rotvec(turns).as_matrix() @ poses[:, :, :3]
    wrong = replace(training, poses=poses.astype(np.float32))
    task = trained_task(run, projection, wrong, "refine_cameras=true")
    generator, optimizer = torch.Generator().manual_seed(0), torch.optim.Adam([task.named["poses"]], lr=0.03)
    for step in range(60):
        loss = run_step(task, step, generator).value
        (task.named["poses"].grad,) = torch.autograd.grad(loss, [task.named["poses"]])
        optimizer.step()
    corrections = POSE * task.named["poses"].detach().numpy()
    centres = training.poses[:, :, 3]

    def miss(turn, shift):
        """How far rays to the middle of the object are off there."""
        off = np.cross(turn, -centres) + shift
        axis = centres / np.linalg.norm(centres, axis=1, keepdims=True)
        return np.linalg.norm(off - axis * (off * axis).sum(1, keepdims=True), axis=1).mean()

    assert miss(turns + corrections[:, :3], corrections[:, 3:]) < 0.4 * miss(turns, 0)
