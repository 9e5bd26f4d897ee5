"""The training of a network of colours through views of a mesh, as a task (Michel et al. 2022)."""

from __future__ import annotations

import numpy as np
import torch
import torch.nn.functional as F

from mitex.cache import content_key
from mitex.exemplar import Exemplar
from mitex.features import Vgg16, normalise_colours
from mitex.features.coverage import fully_covered
from mitex.features.frozen import Tap
from mitex.losses import channel_transport, moment_distance, relaxed_transport
from mitex.mesh import Mesh
from mitex.methods.baselines.text2mesh.config import Text2MeshConfig, share_open
from mitex.methods.exemplar_pictures import albedo, framed, side_in_view
from mitex.methods.layout import exemplar_texels
from mitex.methods.neural_style.cameras import cameras_of, frame_height
from mitex.methods.neural_style.field import colours, encoded, head, opened, random_waves, trunk
from mitex.runtime import keep_freed_memory, mixed_precision
from mitex.scenes.cameras import Cameras, orbit
from mitex.scenes.shaded import BACKGROUND
from mitex.scenes.stage import Stage
from mitex.texels import Texels
from mitex.training import ParameterTask, Step

CHUNK = 1 << 16  # places at a time
ROWS = 4096  # views are evaluated in a multiple of it, see `mixed_precision`


class Text2MeshTask(ParameterTask):
    """A network whose colours shall make views of a mesh look like an exemplar.

    As MeshNCA compares with it: the target is an image, the loss that of `nca` (MeshNCA, equation 6), and the
    geometry stays. Colours are those of the places that pixels see, where the authors interpolate them
    from the vertices: so they are as fine on coarse meshes. With anchored cameras (the preset `paper`) the
    anchor view is the front, and elevations end at 80 degrees; waves are opened the slowest first.

    Args:
        config: settings.
        exemplar: whose albedo is matched.
        mesh: with the UVs of the texture that the network is baked into.
    """

    def __init__(self, config: Text2MeshConfig, exemplar: Exemplar, mesh: Mesh) -> None:
        keep_freed_memory()
        self.config, self.exemplar, self.mesh = config, exemplar, mesh
        generator = torch.Generator().manual_seed(config.seed)
        self.waves = random_waves(config.frequencies, config.sigma, generator)
        self._layers = trunk(config.frequencies, config.width), head("colours", config.width, 3)
        super().__init__({k: v for part in self._layers for k, v in part.weights(generator).items()})
        self.ball = mesh.normalised()[0]
        assert mesh.uv is not None
        self.texels = Texels.rasterize(self.ball, mesh.uv, config.resolution)
        self.stage = Stage(self.ball)
        self.network = Vgg16(config.pooling)
        picture = albedo(exemplar, self.exemplar_side)
        self.picture = normalise_colours(picture.flatten(0, 1))
        features = self.network.features(picture[None], config.layers)
        self.targets = {layer: values[0].flatten(0, 1) for layer, values in features.items()}

    @property
    def exemplar_side(self) -> int:
        """Of the exemplar, so that a texel of it is as large as one on the mesh at the mean distance [px]."""
        config = self.config
        width = exemplar_texels(config.exemplar_size, config.resolution)
        return side_in_view(width * self.texels.size, config.view, frame_height(config))

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """Relaxed transport and moments of the features of some views, and transport of their colours."""
        weights = opened(self.waves, share_open(self.config, step))
        views, masks = self.views(cameras_of(self.config, generator), weights)
        losses = [self._view_loss(*pair, generator) for pair in zip(views, masks, strict=True)]
        return Step(torch.stack(losses).mean(), {})

    def views(
        self, cameras: Cameras, weights: torch.Tensor | None = None
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Pictures (K, S, S, 3) sRGB on white, and (K, S, S) bool, which pixels show the mesh.

        Args:
            cameras: K of them.
            weights: (M,) of the waves; None: all are open.
        """
        hits = self.stage.hits(cameras)
        corners = torch.from_numpy(self.ball.vertices[self.ball.faces[hits.face.numpy()]])
        points = (hits.barycentric[..., None] * corners).sum(1)
        pixels = torch.full((len(hits.hit), 3), BACKGROUND)
        with mixed_precision():
            seen = self.colours(F.pad(points, (0, 0, 0, -len(points) % ROWS)), weights)
        pixels[hits.hit] = seen[: len(points)].float()
        shape = len(cameras), cameras.height, cameras.width
        return pixels.view(*shape, 3), hits.hit.view(*shape)

    def colours(self, points: torch.Tensor, weights: torch.Tensor | None = None) -> torch.Tensor:
        """(N, 3) sRGB in (0, 1) at places (N, 3) [radii], with weights (M,) of the waves as of `views`."""
        values = encoded(points, self.waves, weights)
        for part in self._layers:
            values = part(self.named, values)
        return colours(values)

    @torch.no_grad()
    def baked(self) -> np.ndarray:
        """(R, R, 3) float32 sRGB: the network's colours at the texels of the mesh, grey elsewhere."""
        places = torch.from_numpy(self.texels.position.astype(np.float32))
        parts = [self.colours(part) for part in places.split(CHUNK)]
        return self.texels.image(torch.cat(parts).numpy(), 0.5)

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """The exemplar as large as it shall look on the mesh, and the mesh from two sides, unlit."""
        config = self.config
        around = orbit(2, distance=config.distance, fov=config.fov, resolution=config.view)
        views = self.views(around)[0].numpy()
        return np.hstack([framed(self.exemplar, self.exemplar_side, config.view), *views])

    def metadata(self) -> dict[str, str]:
        exemplar = {"exemplar": self.exemplar.name, "exemplar_key": self.exemplar.key}
        key = content_key(self.mesh.vertices, self.mesh.faces, self.mesh.uv)
        return {"method": "text2mesh", "mesh": self.mesh.name, "mesh_key": key} | exemplar

    def _view_loss(
        self, picture: torch.Tensor, mask: torch.Tensor, generator: torch.Generator
    ) -> torch.Tensor:
        """Of a picture (S, S, 3) and where it shows the mesh, (S, S) bool."""
        taps, targets = {}, {}
        for layer, theirs in self.targets.items():
            size = self.network.extent(layer, *mask.shape)
            inside = fully_covered(mask[None], size)[0]
            ours, targets[layer] = self._samples(inside.flatten().nonzero()[:, 0], theirs, generator)
            taps[layer] = Tap(self.network.index_of(layer), ours[None])
        values = self.network.read(picture[None], taps)
        colours = normalise_colours(picture[mask])
        total = self._colour_distance(*self._samples(colours, self.picture, generator))
        for layer, theirs in targets.items():
            total = total + self._feature_distance(values[layer][0], theirs)
        return total

    def _samples(
        self, ours: torch.Tensor, theirs: torch.Tensor, generator: torch.Generator
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Random ones of both, as many."""
        count = min(len(ours), len(theirs), self.config.samples)
        a, b = (rows[torch.randperm(len(rows), generator=generator)[:count]] for rows in (ours, theirs))
        return a, b

    def _colour_distance(self, ours: torch.Tensor, theirs: torch.Tensor) -> torch.Tensor:
        """Of colours (n, 3), as many of both, in ImageNet's units; 0 if there are none."""
        if not len(ours):
            return torch.zeros(())
        a, b = ours[None], theirs[None]
        cost = relaxed_transport(a, b, euclidean=True)
        return (cost + channel_transport(a, b) if self.config.colour_histogram else cost).sum()

    def _feature_distance(self, ours: torch.Tensor, theirs: torch.Tensor) -> torch.Tensor:
        """Of features (n, C), as many of both; 0 if they are too few."""
        if len(ours) < 2:
            return torch.zeros(())
        a, b = ours[None], theirs[None]
        return (relaxed_transport(a, b) + self.config.moment_weight * moment_distance(a, b)).sum()
