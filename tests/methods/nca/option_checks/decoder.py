"""Keys that shape what the state becomes: the mean over neighbours, and the decoder."""

import numpy as np
import pytest
import torch

from tests.methods.nca.option_checks.registry import patch_cameras, patch_views, registry

CHECKS, check = registry()


@check("aggregation")
def aggregation(build):
    """At the icosphere's vertices of valence 5 the mean is larger."""
    mean, total = (build(f"aggregation={a}") for a in ("mean", "sum"))
    assert (mean.look.mean, total.look.mean) == (True, False)
    state = torch.rand(1, 642, 16, generator=torch.Generator().manual_seed(0))
    ratio = (mean.surfaces[0].perception(state) / total.surfaces[0].perception(state))[0, :, 0]
    valence = torch.from_numpy(np.diff(mean.surfaces[0].mesh.edges.indptr))
    assert torch.allclose(ratio, 6 / valence, rtol=1e-3)


@check("decoder")
def maps_without_a_decoder_are_channels(build):
    assert [len(build(f"decoder={on}").parameters) for on in ("true", "false")] == [12, 4]
    assert torch.equal(patch_views(build("decoder=false")), torch.full((4, 32, 32, 4), 0.5))


@check("decoder_width", "decoder_depth")
def layers_of_the_decoder(build):
    shapes = [tuple(p.shape) for p in build("decoder_width=7", "decoder_depth=1").parameters[4:]]
    assert shapes == [(7, 24), (7,), (4, 7), (4,)]


@check("coordinates")
def inputs_of_the_decoder(build):
    for words, extra in (("", 0), ("waves", 8), ("polynomials,waves", 10), ("barycentrics,polynomials", 5)):
        assert build(f"coordinates={words}").look.decoder.network.layers[0].in_features == 16 + extra


@check("waves", "wave_frequencies", "wave_amplitude")
def grain(build):
    waves = build("waves=5", "wave_frequencies=0.5,4", "wave_amplitude=0.7").look.decoder.waves
    lengths = waves.vectors.norm(dim=1)
    assert lengths.tolist() == pytest.approx([0.5, 4, 0.5, 4, 0.5]) and waves.amplitude == 0.7


@check("omega")
def bends_of_the_decoder(build):
    """It multiplies what enters a sine; initial weights behind the first layer are divided by it."""
    low, high = (build(f"omega={omega}").look.decoder.network for omega in (2, 30))
    assert torch.allclose(2 * low.layers[1].weight, 30 * high.layers[1].weight)
    assert (low.omega, high.omega) == (2, 30)


@check("interpolation")
def creases_of_the_state(build):
    """Seen close up, slopes of a linear one jump at the edges."""
    state = torch.rand(642, 16, generator=torch.Generator().manual_seed(0)) - 0.5
    jumps = {}
    for kind in ("smooth", "linear"):
        task = build(f"interpolation={kind}", "coordinates=", "resolution=64")
        lines = task.surfaces[0].views(task.look, state, patch_cameras(task, 512))
        bends = lines.diff(n=2, dim=2).abs()
        jumps[kind] = (bends.amax() / bends.mean()).item()
    assert jumps["linear"] > 2 * jumps["smooth"]
