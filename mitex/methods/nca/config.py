"""Settings of the MeshNCA trainings, and their presets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from mitex.errors import ConfigError
from mitex.features.layers import check_layers
from mitex.methods.nca.decoder.shape import COORDINATES, DecoderShape
from mitex.methods.nca.ranges import MOST_STEPS
from mitex.methods.words.config import PromptConfig, check_words
from mitex.training.settings import DeviceConfig, ScheduledConfig, key

LEAST_SIDE = 32  # of pictures in which Lucas and Kanade's method can measure [px]
SURFACES = ("even", "uneven", "flat")
# Keys that shape the decoder -> attributes of its shape.
DECODER_KEYS = {
    "interpolation": "interpolation",
    "coordinates": "coordinates",
    "waves": "waves",
    "wave_frequencies": "frequencies",
    "wave_amplitude": "amplitude",
    "decoder_width": "width",
    "decoder_depth": "depth",
    "omega": "omega",
}


@dataclass(frozen=True)
class NcaConfig(PromptConfig, DeviceConfig, ScheduledConfig):
    """Everything that shapes a training; every key can be set from a TOML file or with `--set`."""

    preset: str = "patch"
    steps: int = key(900, "training steps", 0)
    channels: int = key(16, "channels of a cell's state", 12, 256)
    hidden: int = key(128, "width of the hidden layer", 1, 4096)
    degree: int = key(1, "highest degree of the spherical harmonics of the perception", 0, 2)
    gain: float = key(0.1, "gain of the initial weights of the last layer (the authors: 1.2)", 0)
    frequency: int = key(
        32, "frequency f of the icosphere that is trained on, which has 10 f^2 + 2 vertices", 1, 4096
    )
    surfaces: tuple[str, ...] = key(
        ("even", "flat", "uneven", "flat"),
        "surfaces that states grow on in turns: even (icosphere), uneven (scattered sphere), flat (square)",
    )
    pool: int = key(64, "states kept between steps", 1, 4096)
    aggregation: Literal["mean", "sum"] = key(
        "mean",
        "how a cell sums up what it perceives of its neighbours: six times the mean, or the sum (the paper)",
    )
    inject_every: int = key(16, "steps after which the drawn state is replaced by the seed", 1, 4096)
    min_steps: int = key(24, "fewest automaton steps in a training step", 1, 4096)
    max_steps: int = key(48, "most automaton steps in a training step", 1, 4096)
    views: Literal["patch", "full"] = key(
        "patch", "orthographic close-ups, or perspective views of the whole sphere (the paper)"
    )
    view_count: int = key(4, "views in a step, of each zoom", 1, 4096)
    resolution: int = key(128, "side of a view [px]", 16, 2048)
    zooms: int = key(4, "sizes at which views are compared, each half of the next", 1, 6)
    distance: float = key(2.5, "distance of the camera of a full view [normalised mesh units]", 1.01, 100)
    fov: float = key(60.0, "field of view of a full view [degrees]", 1, 170)
    density: float = key(32.0, "vertices along the exemplar's width in a patch: the size on a mesh", 4, 4096)
    exemplar_size: int = key(1024, "side that a larger exemplar is resized to [px]", 16, 2048)
    target_size: int = key(0, "side that it is enlarged to for the features [px]; 0: its own", 0, 2048)
    blend: bool = key(
        True, "a view shows one picture of several maps, mixed, so that they are learned in register"
    )
    layers: tuple[str, ...] = key(
        ("relu1_1", "relu2_1", "relu3_1", "relu4_1", "relu5_1"), "VGG-16's that are compared"
    )
    pooling: Literal["average", "max"] = key("max", "pooling of VGG-16")
    samples: int = key(1024, "feature vectors compared in each layer and view, at most", 1, 4096)
    colour_weight: float = key(1.0, "weight of the comparison of colours, beside the layers", 0)
    colour_histogram: bool = key(True, "compare the histograms of the channels too")
    moment_weight: float = key(0.1, "weight of the moment terms, beside the transport terms", 0)
    order_weight: float = key(
        10.0, "weight of the autocorrelation of the coarsest views, for regular patterns", 0
    )
    relief_weight: float = key(
        1.0, "weight of normals that follow from the height as far as the exemplar's do; on flat surfaces", 0
    )
    appearance_weight: float = key(2.0, "weight of the appearance loss", 0)
    overflow_weight: float = key(100.0, "weight of the overflow loss", 0)
    decoder: bool = key(
        True, "decode the maps from the states; false: they are channels of the state (the paper)"
    )
    interpolation: Literal["smooth", "linear"] = key(
        "smooth", "interpolation of the states between the vertices"
    )
    coordinates: tuple[str, ...] = key(
        ("waves",), "local coordinates, of waves, barycentrics, polynomials; or none"
    )
    waves: int = key(12, "number of waves of the solid noise", 1, 256)
    wave_frequencies: tuple[float, ...] = key(
        (1.7, 2.3, 3.1), "frequencies of the waves that the decoder is told [cycles per edge]", 0
    )
    wave_amplitude: float = key(0.3, "amplitude of these waves", 0)
    decoder_width: int = key(32, "width of the decoder's hidden layers", 1, 1024)
    decoder_depth: int = key(3, "number of the decoder's hidden layers", 1, 16)
    omega: float = key(10.0, "factor in the decoder's sines", 0)
    milestones: tuple[int, ...] = (500, 750)
    decay: float = 0.3
    normalise_gradients: bool = key(True, "divide each parameter tensor's gradient by its norm")
    motion: str | None = key(None, "vector field that the texture moves along, by name or direction")
    motion_encoding: bool = key(True, "whether cells know the field at their place (MPE)")
    motion_advection: bool = key(True, "whether each step carries the states along the field")
    motion_estimator: Literal["advection", "flow", "lucas-kanade"] = key(
        "advection", "what tells how it moves: the states themselves, or pictures of the albedo"
    )
    motion_gamma: float = key(1.5, "weight of the direction in the motion loss of pictures", 0)
    motion_weight: float = key(2.0, "weight of the motion loss (lambda)", 0)
    motion_period: float = key(12.0, "automaton steps in which a vector of length 1 is one edge (T)", 1)
    motion_steps: int = key(12, "automaton steps between the states that are compared", 1, 4096)
    motion_start: int = key(0, "training step from which on motion counts", 0)
    motion_turns: bool = key(True, "another rotation of the field in each step")
    motion_speeds: tuple[float, ...] = key((0.0, 2.0), "least and most factor of the field in a step", 0)
    text: str | None = key(None, "what the texture is made of, in words, instead of an exemplar")
    text_object: str | None = key(None, "what has the texture; by default a sphere, or the mesh's name")
    text_parent: str | None = key(None, "model that training starts from if no other is given")
    text_directional: bool = key(
        True, "compare the steps from the grey surface; false: pictures and text themselves"
    )
    text_growth_steps: int = key(200, "automaton steps after which it is taken for grown", 1, MOST_STEPS)
    text_bank: int = key(64, "sets of views, drawn once, of which a step sees one", 1, 65_536)
    text_distances: tuple[float, ...] = key((2.5,), "distances of the cameras, one for each set", 1.01, 100)
    text_crops: int = key(2, "close-ups that are cut out of a view", 1, 64)
    text_relief_weight: float = key(
        1.0, "weight of the distance of close-ups without colours from the text", 0
    )
    text_relief: float = key(2.5, "largest displacement of the surface [edges]", 0, 100)
    text_roughness: float = key(0.01, "roughness of the relief that costs nothing (xi)", 0)
    text_smooth_weight: float = key(1.0, "weight of the relief's roughness beyond that", 0)
    text_range_weight: float = key(10.0, "weight of values outside of what maps can hold", 0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.max_steps < self.min_steps:
            raise ConfigError(
                f"max_steps = {self.max_steps} is out of range", f"choose {self.min_steps} or more"
            )
        check_layers(self.layers)
        unknown = [name for name in self.surfaces if name not in SURFACES]
        if unknown or not self.surfaces:
            raise ConfigError(
                f"surfaces holds {unknown or 'nothing'}", f"use one or more of {', '.join(SURFACES)}"
            )
        if self.views == "full" and "flat" in self.surfaces:
            raise ConfigError("full views need spheres, and surfaces holds 'flat'", "use even or uneven")
        if self.order_weight and ("relu3_1" not in self.layers or self.views == "full"):
            raise ConfigError("order_weight needs patches and the layer relu3_1", "set it to 0, or these")
        unknown = [name for name in self.coordinates if name not in COORDINATES]
        if unknown:
            raise ConfigError(f"coordinates holds {unknown}", f"use some of {', '.join(COORDINATES)}")
        self._check_motion()
        check_words(self, "text_whole_weight", "text_close_weight", "text_relief_weight")
        if not self.text_distances:
            raise ConfigError("text_distances holds nothing", "give one or more [normalised mesh units]")
        if not self.wave_frequencies:
            raise ConfigError("wave_frequencies holds nothing", "give one or more [cycles per edge]")

    def _check_motion(self) -> None:
        speeds = self.motion_speeds
        if len(speeds) != 2 or speeds[0] > speeds[1] or not speeds[1]:
            raise ConfigError(f"motion_speeds holds {speeds}", "give the least, and the most above 0")
        if not self.motion:
            return
        if self.motion_start and self.motion_start >= self.steps:
            raise ConfigError(
                f"motion_start = {self.motion_start} comes after the last of {self.steps} steps",
                "choose less, or more steps",
            )
        if self.motion_estimator == "lucas-kanade" and self.resolution < LEAST_SIDE:
            raise ConfigError(
                f"lucas-kanade cannot measure in pictures of resolution = {self.resolution}",
                f"choose {LEAST_SIDE} or more, or motion_estimator=advection",
            )

    @property
    def schedule(self) -> dict[str, Any]:
        """Options of `train` for the learning rate and the gradients."""
        return super().schedule | {"normalise_gradients": self.normalise_gradients}

    @property
    def decoder_shape(self) -> DecoderShape:
        """What the decoder is built from."""
        return DecoderShape(**{part: getattr(self, key) for key, part in DECODER_KEYS.items()})


DEFAULT = NcaConfig()
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "paper": replace(
        DEFAULT,
        preset="paper",
        steps=4000,
        gain=1.2,
        frequency=64,
        pool=256,
        min_steps=15,
        max_steps=24,
        views="full",
        view_count=6,
        resolution=320,
        zooms=1,
        density=98.0,
        exemplar_size=128,
        target_size=224,
        layers=(
            *("relu1_1", "relu1_2", "relu2_1", "relu2_2", "relu3_1", "relu3_2", "relu3_3"),
            *("relu4_3", "relu5_3"),
        ),
        pooling="average",
        aggregation="sum",
        overflow_weight=1e4,
        surfaces=("even",),
        order_weight=0.0,
        relief_weight=0.0,
        decoder=False,
        interpolation="linear",
        blend=False,
        colour_histogram=False,
        motion_advection=False,
        milestones=(1000, 2000),
    ),
}
PRESETS["motion"] = replace(
    DEFAULT,
    preset="motion",
    steps=600,
    pool=24,
    view_count=4,
    lr=5e-4,
    milestones=(300, 480),
    motion="right",
    motion_estimator="lucas-kanade",
    motion_weight=0.15,
    motion_period=6.0,
)
PRESETS["motion-paper"] = replace(
    PRESETS["paper"],
    preset="motion-paper",
    channels=32,
    min_steps=32,
    max_steps=64,
    resolution=128,
    distance=2.0,
    motion="right",
    motion_estimator="flow",
    motion_weight=0.67,
    motion_period=24.0,
    motion_steps=64,
    motion_turns=False,
    motion_speeds=(1.0, 1.0),
)
PRESETS["text"] = replace(
    DEFAULT,
    preset="text",
    text="red dots on white",
    steps=1000,
    views="full",
    surfaces=("even", "uneven"),
    order_weight=0.0,
    resolution=224,
    pool=32,
    text_parent="knit",
    motion_weight=0.05,  # with more, one colour everywhere costs less than what the words say
    text_roughness=0.15,  # a soft relief of a few edges' width; at 0.01, as published, there is none
    text_distances=(2.0, 2.5),
    milestones=(600, 850),
)
PRESETS["text-words"] = replace(
    PRESETS["text"],
    preset="text-words",
    steps=900,
    surfaces=("even",),
    frequency=24,
    min_steps=12,
    max_steps=24,
    views="patch",
    view_count=6,
    resolution=64,
    density=24.0,
    coordinates=(),
    milestones=(540, 765),
    text_parent=None,
    text_prompt="{text}",
    text_directional=False,
    text_growth_steps=80,
    text_tilt=0.0,
    text_close_weight=0.0,
    text_relief_weight=0.0,
)
PRESETS["text-paper"] = replace(
    PRESETS["paper"],
    preset="text-paper",
    text="red dots on white",
    pool=64,
    inject_every=32,
    view_count=8,
    resolution=224,
    motion_estimator="flow",
    motion_gamma=0.15,
    motion_weight=0.67,
    motion_period=10.0,
    motion_turns=False,
    motion_speeds=(1.0, 1.0),
    text_bank=256,
    text_relief=5.0,
    text_distances=(2.0, 3.0, 4.0),
    text_crops=4,
)
