"""The appearance loss: rendered views against the exemplar's pictures (MeshNCA, equation 6)."""

from __future__ import annotations

import torch

from mitex.features import Vgg16, normalise_colours
from mitex.losses import autocorrelation_distance, channel_transport, moment_distance, relaxed_transport
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.targets import Targets
from mitex.triples import CYCLE

ORDER_LAYER = "relu3_1"  # its maps have a place for every four pixels


class Appearance:
    """Compares views with pictures of the exemplar, at random places of each feature layer.

    A picture is a triple of the exemplar's channels as an RGB image (`mitex.triples`).

    Args:
        config: settings.
        targets: the features of the pictures.
        network: the frozen network that looks at the views, on whose device everything happens.
        ordered: compare autocorrelations too, if the settings want it.
    """

    def __init__(self, config: NcaConfig, targets: Targets, network: Vgg16, ordered: bool = False) -> None:
        self.ordered = ordered and config.order_weight > 0
        self.config, self.targets, self.network = config, targets, network
        self._table = torch.tensor([p.channels for p in targets.pictures], device=network.device)

    def __call__(self, views: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
        """Loss of views (K, H, W, C) of the maps' values; scalar.

        Averaged over views, and over maps where each view shows all of them; summed over layers.
        """
        view, which = self._assignment(len(views), generator)
        columns = self._table[which][:, None, None, :].expand(-1, *views.shape[1:3], -1)
        images = views[view].gather(3, columns)
        return self.config.appearance_weight * self._compare(images, which, generator)

    def _assignment(self, count: int, generator: torch.Generator) -> tuple[torch.Tensor, torch.Tensor]:
        """Which views are compared with which pictures: the indices of both, (N,) each."""
        kinds = [p.kind for p in self.targets.pictures]
        if not self.config.blend:
            return torch.arange(count).repeat_interleave(len(kinds)), torch.arange(len(kinds)).repeat(count)
        cycle = [kind for kind in CYCLE if kind in kinds]
        if count < len(cycle):  # too few views for all kinds: other kinds in every step
            first = int(torch.randint(len(cycle), (), generator=generator))
            cycle = cycle[first:] + cycle[:first]
        which = []
        for k in range(count):
            choices = [i for i, kind in enumerate(kinds) if kind == cycle[k % len(cycle)]]
            which.append(choices[int(torch.randint(len(choices), (), generator=generator))])
        return torch.arange(count), torch.tensor(which)

    def _compare(self, images: torch.Tensor, which: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
        config, (count, height, width) = self.config, images.shape[:3]
        ours, theirs = {}, {}
        for layer in config.layers:
            h, w = self.network.extent(layer, height, width)
            n = min(h * w, self.targets.size(layer), config.samples)
            if self.ordered and layer == ORDER_LAYER:
                n = h * w
            ours[layer] = _places(count, h * w, n, generator).to(images.device)
            theirs[layer] = _places(count, self.targets.size(layer), n, generator).to(images.device)
        total = config.colour_weight * self._colours(images, which, generator)
        low_precision = self.network.dtype == torch.bfloat16
        for layer, a in self.network.samples(images, ours).items():
            b = self.targets.sample(layer, which, theirs[layer])
            total = total + relaxed_transport(a, b, low_precision=low_precision).mean()
            total = total + config.moment_weight * moment_distance(a, b, low_precision).mean()
            if self.ordered and layer == ORDER_LAYER:
                maps = a.view(count, *self.network.extent(layer, height, width), -1)
                order = autocorrelation_distance(maps, self.targets.maps(layer, which))
                total = total + config.order_weight * order.mean()
        return total

    def _colours(self, images: torch.Tensor, which: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
        count, pixels = len(images), images.shape[1] * images.shape[2]
        n = min(pixels, self.targets.size("colour"), self.config.samples)
        ours = _places(count, pixels, n, generator).to(images.device)
        theirs = _places(count, self.targets.size("colour"), n, generator).to(images.device)
        a = normalise_colours(images.flatten(1, 2).gather(1, ours[:, :, None].expand(-1, -1, 3)))
        b = normalise_colours(self.targets.sample("colour", which, theirs))
        cost = relaxed_transport(a, b, euclidean=True).mean()
        return cost + channel_transport(a, b).mean() if self.config.colour_histogram else cost


def _places(count: int, size: int, n: int, generator: torch.Generator) -> torch.Tensor:
    """(count, n) indices below `size`, without repetition within a row; all of them are in order."""
    if n == size:
        return torch.arange(n).expand(count, n)
    return torch.stack([torch.randperm(size, generator=generator)[:n] for _ in range(count)])
