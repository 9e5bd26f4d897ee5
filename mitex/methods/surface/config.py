"""Settings of the surface texture synthesis, and its presets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from mitex.errors import ConfigError
from mitex.features.layers import LAYERS, LAYERS_19, with_poolings
from mitex.methods.layout import EXEMPLAR_WIDTH
from mitex.methods.words.config import WordsConfig, check_words
from mitex.methods.words.wording import CLIP, EMBEDDED
from mitex.ranges import SCALES
from mitex.training.settings import ScheduledConfig, key

WORDS = (CLIP, EMBEDDED)  # presets for words
SIDES = (16, 2048)  # of the exemplar [px]


@dataclass(frozen=True)
class TexelConfig(ScheduledConfig):
    """What shapes a synthesis from an exemplar."""

    preset: str = "fast"
    steps: int = 60
    resolution: int = key(512, "side of the texture [texels]", 1, 4096)
    scale: float = key(
        1.0, "size of the pattern, beside that at which exemplar_size is the exemplar's side", *SCALES
    )
    exemplar_size: int = key(
        0,
        "side of the exemplar's central square at scale 1 [texels]; it is resized so that a pixel becomes a "
        "texel. 0: half of the resolution, so that more texels make the pattern sharper, not smaller",
        0,
        2048,
    )
    frames: Literal["smooth", "fixed"] = key(
        "smooth", "tangent frames that turn least, or Gram-Schmidt with a fixed vector (the paper)"
    )
    angle: float = key(0.0, "turns the texture counter-clockwise, seen from outside [degrees]", -360, 360)
    correct: bool = key(True, "walk geodesics back that overshoot (figure 3)")
    continued: bool = key(
        True,
        "texels whose centres lie outside their chart show what lies across the seam, instead of values of "
        "their own (the paper)",
    )
    bilinear: bool = key(True, "the first convolution interpolates the texels, instead of the nearest ones")
    weights: Literal["vgg16", "vgg19", "random"] = key(
        "vgg16", "vgg19 is a file of yours (mitex.features.vgg19), random the ablation of figure 5"
    )
    pooling: Literal["average", "max"] = key("average", "pooling of the network")
    loss: Literal["gram", "transport"] = key(
        "gram", "Gram matrices (the paper), or MeshNCA's relaxed optimal transport and moments"
    )
    samples: int = key(2048, "loss=transport: feature vectors a layer and step", 1)
    moment_weight: float = key(0.1, "loss=transport: weight of the moments", 0)
    region: float = key(
        0.5,
        "Gram matrices are compared region by region, each a square of so many times the exemplar's side in "
        "area, which keeps the contrast even; 0: of the whole surface (the paper)",
        0,
        10,
    )
    colours: float = key(
        0.2,
        "loss=gram: weight of the distributions of colours, of texels and of whole stones; the paper: 0",
        0,
    )
    layers: tuple[str, ...] = key((), "compared: VGG's convolutions and poolings; none stands for all")
    content_layer: str = key("relu4_2", "style transfer: the layer whose features stay the content's")
    content_weight: float = key(1000.0, "style transfer: how much that counts", 0)
    scales: int = key(0, "coarser pyramids of texels matched first, each half as fine", 0, 3)
    coarse_share: float = key(0.4, "share of the steps that is spent on the coarser scales together", 0, 0.95)
    triples: int = key(2, "triples of channels compared in a step, for several maps", 1, 16)
    whitened: bool = key(
        True,
        "the optimizer works in the principal components of the exemplar's channels, each measured by its "
        "spread, so that colours move together as they do there; instead of in the channels (the paper)",
    )
    diffusion: float = key(
        0.0,
        "part of each texel replaced in every step by the mean of what its taps read, which wears down what "
        "the first convolution cannot see; it falls with the learning rate; the paper: 0",
        0,
        1,
    )
    start: Literal["patches", "noise"] = key(
        "patches",
        "begin with patches of the exemplar, joined on the surface, or with noise (the paper); style "
        "transfer begins with its content, and words alone with noise",
    )
    patch: float = key(0.5, "start=patches: side of a patch [sides of the exemplar]", 0.02, 1)
    noise: float = key(
        1.0,
        "start=noise: width of uniform noise: from 0 on (the paper), or around the exemplar's mean and in "
        "multiples of its spread, if whitened",
        0,
        10,
    )
    optimizer: Literal["adam", "lbfgs"] = key(
        "adam", "Adam (the paper), or L-BFGS, for one map, one scale and Gram matrices"
    )
    lr: float = key(0.05, "learning rate; of L-BFGS the largest change in a step", 0)
    milestones: tuple[int, ...] = (40, 50)
    decay: float = 0.5
    shared_moment: bool = key(
        True,
        "Adam's second moment is one number for the whole texture, which leaves noise alone that the "
        "features do not see; instead of one for each texel (the paper), which amplifies it",
    )
    checkpoint_every: int = 50
    preview_every: int = 50

    def __post_init__(self) -> None:
        super().__post_init__()
        layers = with_poolings(LAYERS_19 if self.weights == "vgg19" else LAYERS)
        unknown = [layer for layer in self.layers if layer not in layers]
        if unknown:
            raise ConfigError(f"layers holds {', '.join(unknown)}", f"use some of {', '.join(layers)}")
        if self.content_layer not in layers:
            raise ConfigError(f"content_layer is {self.content_layer}", f"use one of {', '.join(layers)}")
        if self.optimizer == "lbfgs" and (self.loss != "gram" or self.scales):
            problem = "lbfgs needs a loss without randomness, the same throughout"
            raise ConfigError(problem, "set loss=gram and scales=0, or optimizer=adam")

    @property
    def compared(self) -> tuple[str, ...]:
        """The layers that are compared, by name."""
        return self.layers or with_poolings(LAYERS_19 if self.weights == "vgg19" else LAYERS)

    def wanted_side(self, factor: float = 1.0) -> int:
        """What `exemplar_side` is computed from [px], also if no exemplar can be so small or large."""
        return round(self.scale * factor * (self.exemplar_size or EXEMPLAR_WIDTH * self.resolution))

    def exemplar_side(self, factor: float = 1.0, layout_ratio: float = 1.0) -> int:
        """Side that the exemplar's central square is resized to [px]; a pixel becomes a texel.

        Args:
            factor: of the pattern's size, beside `scale`.
            layout_ratio: of the mesh's layout, as `mitex.methods.layout.layout_ratio` tells; texels that
                `exemplar_size` asks for stay as many.

        Raises:
            ConfigError: it is not from 16 to 2048.
        """
        side = self.wanted_side(factor)
        least, most = SIDES
        if least <= side <= most:
            return side if self.exemplar_size else max(round(side / layout_ratio), least)
        raise ConfigError(
            f"the exemplar would be {side} texels wide with a scale of {self.scale * factor:g}",
            f"change scale, resolution or exemplar_size so that it is {least} to {most}",
        )


@dataclass(frozen=True)
class SurfaceConfig(WordsConfig, TexelConfig):
    """Everything that shapes a synthesis; every key can be set from a TOML file or with `--set`."""

    text_weight: float = key(
        1.0,
        "weight of the words, beside an exemplar or a content: with 1, pictures that have nothing of the "
        "text cost as much as a surface that has no features",
        0,
    )
    text_directional: bool = key(
        True, "compare the steps from the grey surface; false: pictures and text themselves"
    )
    text_bank: int = key(64, "sets of views, drawn once, of which a step sees one", 1, 65_536)
    text_views: int = key(4, "views in a set", 1, 64)
    text_view: int = key(224, "side of a view [px]", 16, 2048)
    text_distance: float = key(2.0, "distance of the cameras of views of the whole mesh [radii]", 1.01, 100)
    text_width: float = key(
        0.0, "width of what a view shows at scale 1 [radii]; 0: views of the whole mesh", 0, 2
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_words(self, "text_whole_weight", "text_close_weight")
        if self.text is None:  # words alone have no exemplar
            self.exemplar_side()
        elif self.optimizer == "lbfgs":
            raise ConfigError("lbfgs needs a loss without randomness", "set optimizer=adam for words")


DEFAULT = SurfaceConfig()
NOISE = replace(
    DEFAULT,
    preset="noise",
    start="noise",
    steps=200,
    scales=2,
    diffusion=0.03,
    lr=0.2,
    milestones=(150, 180),
)
PRESETS = {
    DEFAULT.preset: DEFAULT,
    NOISE.preset: NOISE,
    "paper": replace(
        NOISE,
        preset="paper",
        steps=500,
        scales=0,
        milestones=(200, 400),
        frames="fixed",
        continued=False,
        exemplar_size=512,
        whitened=False,
        region=0.0,
        colours=0.0,
        diffusion=0.0,
        noise=0.2,
        lr=0.1,
        shared_moment=False,
    ),
    "style": replace(
        NOISE,
        preset="style",
        colours=0.0,
        steps=300,
        scales=0,
        layers=("relu1_1", "relu2_1", "relu3_1", "relu4_1", "relu5_1"),
        # The content's colours may be none of the exemplar's: in its components they would hardly change.
        whitened=False,
        lr=0.1,
        milestones=(180, 250),
    ),
}
PRESETS[CLIP] = replace(
    NOISE,
    preset=CLIP,
    text="red dots on white",
    steps=300,
    colours=0.0,  # words may ask for some that no exemplar has
    milestones=(210, 270),
    coarse_share=0.5,
    diffusion=0.05,
)
PRESETS[EMBEDDED] = replace(
    PRESETS[CLIP],
    preset=EMBEDDED,
    resolution=256,
    text_prompt="{text}",
    text_directional=False,
    text_background=0.5,  # white would count as a colour of the text
    text_bank=512,
    text_views=8,
    text_view=96,
    text_width=0.8,
    text_crops=2,
    text_crop_area=0.6,
    text_tilt=0.0,
    text_whole_weight=0.0,
)
