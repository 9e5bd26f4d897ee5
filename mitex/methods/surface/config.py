"""Settings of the surface texture synthesis, and its presets."""

from __future__ import annotations

from dataclasses import dataclass

from mitex.errors import ConfigError
from mitex.features.vgg import LAYERS
from mitex.features.vgg19 import LAYERS_19
from mitex.methods.surface.network import layers_of
from mitex.training import check_ranges

FRAMES = ("smooth", "fixed")
WEIGHTS = ("vgg16", "vgg19", "random")
LOSSES = ("gram", "transport")
OPTIMIZERS = ("adam", "lbfgs")


@dataclass(frozen=True)
class SurfaceConfig:
    """Everything that shapes a synthesis; every key can be set from a TOML file or `--set`.

    Attributes:
        steps, seed, preset: as in every method.
        resolution: side of the texture [texels].
        exemplar_size: the exemplar's central square is resized to it [px]; a pixel becomes a texel.
        frames: "fixed" (the paper: Gram-Schmidt with a fixed vector) or "smooth" (least turning).
        angle: turns the texture about the normals, counter-clockwise from outside [degrees].
        correct: walk geodesics back that overshoot (figure 3).
        continued: texels whose centres lie outside their chart show what lies across the seam; False: they
            have values of their own (the paper).
        bilinear: the first convolution interpolates the texels; False: it reads the nearest ones.
        weights: "vgg16"; "vgg19", which the user provides (see `mitex.features.vgg19`); or "random" ones (the
            ablation of figure 5).
        pooling: "average" or "max".
        loss: "gram" (the paper), or "transport": MeshNCA's relaxed optimal transport and moments, of
        samples: feature vectors a layer and step,
        moment_weight: the moments counting as much.
        region: Gram matrices are compared region by region of the surface, each a square of so many times the
            exemplar's side in area, which keeps the contrast even; 0: of the whole surface (the paper).
        layers: that are compared; VGG's convolutions and poolings. None stands for all.
        content_layer, content_weight: whose features shall stay those of the content texture, where one is
            given (style transfer), and how much that counts.
        scales: how many coarser pyramids of texels are matched first, each half as fine.
        coarse_share: of the steps, spent on the coarser scales together.
        pictures: views of the maps compared in a step, when the exemplar has several maps.
        whitened: the optimizer works in the principal components of the exemplar's channels, each measured by
            its spread, so that colours move together as they do there; False: in the channels (the paper).
        diffusion: part of each texel that is replaced in every step by the mean of what its taps read, which
            wears down what the first convolution, as it interpolates, cannot see. 0 in the paper.
        noise: width of the uniform noise that the texture starts with: from 0 on (the paper), or around the
            exemplar's mean and in multiples of the spread, if `whitened`.
        optimizer: "adam" (the paper), or "lbfgs" for one map, one scale and the Gram loss.
        lr, milestones, decay: its learning rate, for "lbfgs" the largest change in a step, and the schedule.
        shared_moment: Adam's second moment is one number for the whole texture, which leaves noise alone that
            the features do not see; False gives each texel its own (the paper), which amplifies it.
        checkpoint_every, preview_every: in steps.
    """

    steps: int
    preset: str
    seed: int = 0
    resolution: int = 512
    exemplar_size: int = 256
    frames: str = "smooth"
    angle: float = 0.0
    correct: bool = True
    continued: bool = True
    bilinear: bool = True
    weights: str = "vgg16"
    pooling: str = "average"
    loss: str = "gram"
    samples: int = 2048
    moment_weight: float = 0.1
    region: float = 0.5
    layers: tuple[str, ...] = ()
    content_layer: str = "relu4_2"
    content_weight: float = 1000.0
    scales: int = 0
    coarse_share: float = 0.4
    pictures: int = 2
    whitened: bool = True
    diffusion: float = 0.03
    noise: float = 1.0
    optimizer: str = "adam"
    lr: float = 0.2
    milestones: tuple[int, ...] = (200, 400)
    decay: float = 0.5
    shared_moment: bool = True
    checkpoint_every: int = 50
    preview_every: int = 50

    def __post_init__(self) -> None:
        check_ranges(
            self,
            steps=(1, None),
            seed=(0, 2**63 - 1),
            resolution=(1, 4096),
            exemplar_size=(32, 2048),
            angle=(-360, 360),
            content_weight=(0, None),
            scales=(0, 3),
            coarse_share=(0, 0.95),
            pictures=(1, 16),
            diffusion=(0, 1),
            noise=(0, 10),
            samples=(1, None),
            region=(0, 10),
            moment_weight=(0, None),
            lr=(0, None),
            decay=(0, None),
            checkpoint_every=(1, None),
            preview_every=(0, None),
        )
        choices = {
            "frames": FRAMES,
            "weights": WEIGHTS,
            "loss": LOSSES,
            "optimizer": OPTIMIZERS,
            "pooling": ("average", "max"),
        }
        for key, allowed in choices.items():
            if getattr(self, key) not in allowed:
                raise ConfigError(f"{key} = '{getattr(self, key)}' is unknown", f"use {' or '.join(allowed)}")
        known = layers_of(LAYERS_19 if self.weights == "vgg19" else LAYERS)
        unknown = [layer for layer in (*self.layers, self.content_layer) if layer not in known]
        if unknown:
            raise ConfigError(f"layers holds {', '.join(unknown)}", f"use some of {', '.join(known)}")
        if self.optimizer == "lbfgs" and (self.loss != "gram" or self.scales):
            problem = "lbfgs needs a loss without randomness, the same throughout"
            raise ConfigError(problem, "set loss=gram and scales=0, or optimizer=adam")

    @property
    def compared(self) -> tuple[str, ...]:
        """The layers that are compared, by name."""
        return self.layers or layers_of(LAYERS_19 if self.weights == "vgg19" else LAYERS)


PRESETS = {
    "fast": SurfaceConfig(steps=200, preset="fast", scales=2, milestones=(150, 180)),
    "paper": SurfaceConfig(
        steps=500,
        preset="paper",
        frames="fixed",
        continued=False,
        exemplar_size=512,
        whitened=False,
        region=0.0,
        diffusion=0.0,
        noise=0.2,
        lr=0.1,
        shared_moment=False,
    ),
    "style": SurfaceConfig(
        steps=300,
        preset="style",
        layers=("relu1_1", "relu2_1", "relu3_1", "relu4_1", "relu5_1"),
        # The content's colours may be none of the exemplar's: in its components they would hardly change.
        whitened=False,
        lr=0.1,
        milestones=(180, 250),
    ),
}
