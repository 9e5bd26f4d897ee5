"""The field of one training step, and states that are carried along it."""

import math

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from mitex.mesh import icosphere, scattered_sphere
from mitex.mesh.fields import vector_field
from mitex.methods.nca.motion.tangent_field import TangentField, random_field, random_rotation, turned_field
from mitex.methods.nca.surfaces import TrainingMesh, TrainingPlane
from tests.methods.nca.tiny import config, texture


@pytest.fixture(scope="module")
def look():
    return texture().look


@pytest.mark.parametrize("azimuth", [0.0, 0.5 * math.pi])
def test_a_square_carries_waves_along(look, azimuth):
    """By any vector in its plane, also over its sides; better than the gradient would by far."""
    plane = TrainingPlane.of(32, look, azimuth)
    places = plane.lattice.mesh.vertices[: plane.lattice.count] @ plane.axes.T
    way = np.array([1.7, -0.9])

    def waves(shift):
        x, y = (2 * math.pi / 32) * (places - shift).T
        return torch.from_numpy(np.stack([np.sin(3 * x), np.cos(2 * x - 3 * y)], 1)).float()

    field = np.tile(2 * way @ plane.axes, (len(places), 1))
    carried = TangentField(plane, field).advection(0.5)(waves(0 * way))
    assert (carried - waves(way)).abs().max() < 0.01
    assert (waves(0 * way) - waves(way)).abs().max() > 0.5


@pytest.mark.parametrize("mesh", [icosphere(16), scattered_sphere(2562)], ids=["even", "uneven"])
def test_a_sphere_carries_a_pattern_about_an_axis(look, mesh):
    """A turn by the angle that the field says, in edges."""
    sphere = TrainingMesh.of(mesh, look)
    angle = 1.5 * sphere.edge
    points = mesh.vertices.astype(np.float64)

    def pattern(turn):
        x, y, z = Rotation.from_rotvec([0, turn, 0]).inv().apply(points).T
        return torch.from_numpy(np.stack([np.sin(5 * x), z * y, x * x], 1)).float()

    field = np.cross([0.0, 1.5, 0.0], points)  # [edges] at the equator
    carried = TangentField(sphere, field).advection(1.0)(pattern(0.0))
    error = (carried - pattern(angle)).abs().max()
    assert error < 0.1 * (pattern(0.0) - pattern(angle)).abs().max()


def test_turned_fields_are_those_of_the_turned_mesh():
    """The field of +x turned to another direction is that of the other direction."""
    mesh, rotation = icosphere(4), random_rotation(torch.Generator().manual_seed(3))
    assert np.allclose(rotation @ rotation.T, np.eye(3)) and np.linalg.det(rotation) == pytest.approx(1)
    direction = ",".join(f"{number:.9f}" for number in rotation @ [1, 0, 0])
    turned = turned_field(mesh, "right", rotation)
    assert np.allclose(turned, vector_field(mesh, direction), atol=1e-4)
    assert np.abs((turned * mesh.normals).sum(1)).max() < 1e-4


@pytest.mark.parametrize("kind", ["plane", "sphere"])
def test_each_step_draws_a_direction_and_a_speed(look, kind):
    surface = TrainingPlane.of(8, look) if kind == "plane" else TrainingMesh.of(icosphere(3), look)
    settings, generator = config("motion=up", "motion_speeds=0.5,2"), torch.Generator().manual_seed(0)
    fields = [random_field(settings, surface, generator).vectors for _ in range(40)]
    speeds = [np.linalg.norm(field, axis=1).mean() for field in fields]
    assert 0.5 <= min(speeds) < 0.7 and 1.7 < max(speeds) <= 2 + 1e-6
    pull = np.array([field.mean(axis=0) for field in fields])
    assert (pull.min(axis=0) < -0.3).sum() >= 2 and (pull.max(axis=0) > 0.3).sum() >= 2
    field = random_field(settings, surface, generator)
    assert field.condition.shape == (surface.perception.vertices, 3)
    assert np.allclose(field.condition.numpy(), field.vectors)


def test_without_turns_a_sphere_has_the_very_field(look):
    sphere = TrainingMesh.of(icosphere(3), look)
    settings = config("motion=about-y", "motion_turns=false", "motion_speeds=2,2")
    field = random_field(settings, sphere, torch.Generator())
    assert np.allclose(field.vectors, 2 * vector_field(sphere.mesh, "about-y"))


@pytest.mark.parametrize("kind", ["plane", "sphere"])
def test_places_upstream_show_what_is_carried_here(look, kind):
    """A smooth state there is the transported state here; points are where there is area."""
    surface = TrainingPlane.of(32, look) if kind == "plane" else TrainingMesh.of(icosphere(16), look)
    field = random_field(config("motion=up"), surface, torch.Generator().manual_seed(1))
    mesh = surface.lattice.mesh if isinstance(surface, TrainingPlane) else surface.mesh
    places = mesh.vertices[: len(field.vectors)].astype(np.float64)
    scale = 2 * math.pi / 32 if kind == "plane" else 3.0
    state = torch.from_numpy(np.sin(scale * places).round(9)).float()
    points, before = field.random_places(4000, 0.5, torch.Generator().manual_seed(0))
    carried = field.table(field.advection(0.5)(state))
    here, there = surface.surface.read(carried, points), surface.surface.read(field.table(state), before)
    still = surface.surface.read(field.table(state), points)
    assert (here - there).abs().mean() < 0.05 * (here - still).abs().mean()
    middle = np.einsum(
        "pk,pkd->pd", points.barycentric.numpy(), mesh.vertices[mesh.faces[points.face.numpy()]]
    )
    extent = np.ptp(mesh.vertices, axis=0).max()
    assert np.abs(middle.mean(axis=0) - mesh.vertices.mean(axis=0)).max() < 0.03 * extent
    assert len(np.unique(points.face)) > 0.3 * len(mesh.faces)
