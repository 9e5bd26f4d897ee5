"""What a decoder reads, and what it makes of it; surfaces that give states and places."""

import numpy as np
import pytest
import torch

from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.nca.decoder.coordinates import sorted_barycentrics, symmetric_polynomials
from mitex.methods.nca.decoder.decoder import Decoder, Readout
from mitex.methods.nca.decoder.shape import COORDINATES, WIDTHS, DecoderShape
from mitex.methods.nca.decoder.surface import EDGE, Points, Surface, decoder_units
from tests.methods.nca.brute_force import patchwork


def _points(mesh: Mesh, seed=0, each=4) -> Points:
    rng = np.random.default_rng(seed)
    face = np.repeat(np.arange(len(mesh.faces), dtype=np.int32), each)
    weights = rng.dirichlet(np.ones(3), len(face)).astype(np.float32)
    return Points(torch.from_numpy(face), torch.from_numpy(weights))


def _state(mesh: Mesh, channels=16):
    return torch.rand(len(mesh.vertices), channels, generator=torch.Generator().manual_seed(3)) - 0.5


def _decoder(shape: DecoderShape, channels=16, outputs=4) -> Decoder:
    decoder = Decoder(channels, outputs, shape)
    decoder.network.initialise(torch.Generator().manual_seed(0))
    return decoder


@pytest.mark.parametrize("interpolation", ["smooth", "linear"])
@pytest.mark.parametrize(
    "coordinates", [(), ("waves",), ("polynomials", "waves"), ("barycentrics", "polynomials")]
)
def test_a_decoder_reads_the_state_and_its_coordinates_in_order(interpolation, coordinates):
    mesh = icosphere(2)
    shape = DecoderShape(interpolation, coordinates, waves=5, width=10, depth=2)
    decoder, surface, points = _decoder(shape), Surface(mesh, interpolation), _points(mesh)
    table = surface.table(_state(mesh))
    parts = {
        "waves": decoder.waves(*surface.place(points)),
        "polynomials": symmetric_polynomials(points.barycentric),
        "barycentrics": sorted_barycentrics(points.barycentric),
    }
    inputs = torch.cat([surface.read(table, points), *(parts[name] for name in coordinates)], 1)
    assert inputs.shape[1] == 16 + shape.extra == decoder.network.layers[0].in_features
    assert torch.allclose(decoder(surface, table, points), decoder.network(inputs) + 0.5, atol=1e-6)


def test_widths_of_the_coordinates():
    assert set(WIDTHS) | {"waves"} == set(COORDINATES)
    assert DecoderShape(coordinates=()).extra == 0
    assert DecoderShape(coordinates=("waves", "polynomials", "barycentrics"), waves=3).extra == 8


def test_a_readout_is_the_linearly_interpolated_state():
    mesh = icosphere(2)
    surface, points, state = Surface(mesh, "linear"), _points(mesh), _state(mesh)
    corners = state[torch.from_numpy(mesh.faces.astype(np.int64))[points.face.long()]]
    expected = (points.barycentric[:, :, None] * corners).sum(1)[:, [3, 1, 9]] + 0.5
    assert torch.allclose(Readout([3, 1, 9])(surface, surface.table(state), points), expected, atol=1e-6)


@pytest.mark.parametrize("interpolation", ["smooth", "linear"])
def test_gradients_reach_state_and_weights(interpolation):
    """Of the state against finite differences, through the table of slopes."""
    mesh = icosphere(1)
    decoder, surface = _decoder(DecoderShape(interpolation, width=8, depth=1, omega=2.0)), None
    surface, points = Surface(mesh, interpolation), _points(mesh)
    state = _state(mesh).requires_grad_()
    decoder(surface, surface.table(state), points).square().sum().backward()
    assert all(p.grad is not None and p.grad.any() for p in decoder.parameters())
    assert state.grad is not None
    assert (state.grad.abs().amax(1) > 0).all()
    values = []
    for change in (1e-2, -1e-2):
        moved = state.detach().clone()
        moved[5, 2] += change
        values.append(decoder(surface, surface.table(moved), points).square().sum().item())
    assert state.grad[5, 2].item() == pytest.approx((values[0] - values[1]) / 2e-2, rel=0.02, abs=1e-2)


def test_decoded_values_are_continuous_across_edges():
    """To 1e-4 of the values, with all coordinates together; both faces read the same of what they share."""
    mesh = icosphere(2)
    shape = DecoderShape(coordinates=COORDINATES, width=12)
    decoder, surface = _decoder(shape), Surface(mesh)
    table = surface.table(_state(mesh))
    sides = {}
    for face, corners in enumerate(mesh.faces.tolist()):
        for k in range(3):
            i, j = corners[k], corners[(k + 1) % 3]
            sides.setdefault((min(i, j), max(i, j)), []).append((face, k if i < j else (k + 1) % 3, k))
    values = []
    for side in (0, 1):
        barycentric = torch.zeros(len(sides), 3)
        for row, pair in enumerate(sides.values()):
            _, first, k = pair[side]
            second = (k + 1) % 3 if first == k else k
            barycentric[row, first], barycentric[row, second] = 0.3, 0.7
        face = torch.tensor([pair[side][0] for pair in sides.values()], dtype=torch.int32)
        values.append(decoder(surface, table, Points(face, barycentric)))
    assert (values[0] - values[1]).abs().max() < 1e-4
    assert values[0].std(0).min() > 0.01


def test_places_and_edges_of_a_surface():
    """In units in which the mean edge is that of the training; lengths are the means over the edges at a
    vertex, interpolated.
    """
    mesh = patchwork().with_vertices(50 * patchwork().vertices + 300)
    surface, points = Surface(mesh, "linear"), _points(mesh)
    graph, lengths = mesh.edges, np.zeros(len(mesh.vertices))
    small = mesh.vertices.astype(float) - mesh.vertices.astype(float).mean(0)
    small *= EDGE / np.linalg.norm(small[graph.indices] - small[graph.rows], axis=1).mean()
    for v in range(len(mesh.vertices)):
        ring = graph.indices[graph.indptr[v] : graph.indptr[v + 1]]
        lengths[v] = np.linalg.norm(small[ring] - small[v], axis=1).mean() if len(ring) else 0
    corners, weights = mesh.faces[points.face.numpy()], points.barycentric.numpy()
    position, edge = surface.place(points)
    assert np.allclose(position, np.einsum("pk,pkd->pd", weights, small[corners]), atol=1e-5)
    assert np.allclose(edge, (weights * lengths[corners]).sum(1), atol=1e-5)


def test_units_are_those_of_the_default_training():
    """On its sphere they change next to nothing."""
    sphere = icosphere(32)
    assert decoder_units(sphere).scale == pytest.approx(1, abs=2e-4)
    assert np.abs(decoder_units(sphere).centre).max() < 1e-6


def test_a_mesh_at_one_point_has_units():
    mesh = Mesh(np.full((3, 3), 2.0), np.array([[0, 1, 2]]))
    assert decoder_units(mesh).scale == 1
    surface = Surface(mesh)
    assert surface.read(surface.table(_state(mesh)), _points(mesh)).isfinite().all()


def test_a_vertex_without_edges_has_the_mean_length():
    """And a length that is above 0, of which there is a logarithm."""
    mesh = grid(3, 3)
    lonely = Mesh(np.concatenate([mesh.vertices, [[0, 0, 1.0]]]), mesh.faces)
    assert (Surface(lonely, "linear")._corners[:, 3] > 0).all()


@pytest.mark.parametrize("coordinates", [("waves",), ("polynomials",)])
def test_no_points_show_nothing(coordinates):
    mesh = icosphere(1)
    decoder, surface = _decoder(DecoderShape(coordinates=coordinates)), Surface(mesh)
    empty = Points(torch.empty(0, dtype=torch.int32), torch.empty(0, 3))
    assert decoder(surface, surface.table(_state(mesh)), empty).shape == (0, 4)


def test_points_at_a_vertex_of_coinciding_points_are_finite():
    """A vertex all of whose edges have no length."""
    points = np.array([[0, 0, 0], [0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    mesh = Mesh(points, np.array([[0, 1, 2], [3, 4, 5]]))
    decoder, surface = _decoder(DecoderShape()), Surface(mesh)
    assert decoder(surface, surface.table(_state(mesh)), _points(mesh)).isfinite().all()
