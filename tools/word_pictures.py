"""Small pictures of patterns, flat or on balls, and what there is to say about them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from torch.nn.functional import normalize
from word_patterns import KINDS
from word_places import Drawn, Place, smooth_noise

from mitex.colour import linear_to_srgb, srgb_to_linear

COLOURS = {
    "red": "d62020", "orange": "f08418", "yellow": "f5dc28", "green": "2fa53c", "cyan": "28c4c8",
    "blue": "2850d8", "purple": "8a35b8", "pink": "f590b8", "brown": "84502a", "beige": "e2cfa4",
    "black": "101010", "grey": "828282", "white": "f8f8f8",
    "dark red": "7c1016", "dark green": "14521f", "dark blue": "16206e", "dark purple": "481860",
    "dark brown": "472a14", "dark grey": "444444", "dark cyan": "126a70",
    "light green": "96de8c", "light blue": "92c4f2", "light purple": "c49ae6", "light brown": "b98a5a",
    "light grey": "bdbdbd",
}  # fmt: skip
COLOURFUL = "colourful"  # a figure of which each element has another colour
SCALES = {"small": (8.0, 10.5), "medium": (4.6, 6.0), "large": (2.3, 3.3)}  # elements across a picture
MATERIALS = {"": 0.4, "matte": 0.1, "shiny": 0.15, "metallic": 0.12, "rough": 0.11, "relief": 0.12}
DIRECTIONS = {"": None, "vertical": 0.0, "horizontal": 0.25, "diagonal": 0.125}  # turns
HELD_OUT = 10  # one in so many combinations of a pattern and two colours is not trained on
CHUNK = 64
RGB = {name: np.array([int(code[i : i + 2], 16) for i in (0, 2, 4)]) / 255 for name, code in COLOURS.items()}


@dataclass(frozen=True)
class Subject:
    """What a picture shows."""

    kind: str
    figure: str
    ground: str
    scale: str = "medium"
    material: str = ""
    direction: str = ""
    ball: bool = False

    @property
    def held_out(self) -> bool:
        """Whether the combination of its pattern and its colours is kept from the training."""
        if self.figure == self.ground or (self.figure, self.ground) in KINDS[self.kind].usual:
            return False
        pair = [self.figure, self.ground]
        letters = " ".join([self.kind, *(sorted(pair) if KINDS[self.kind].equal else pair)])
        return sum(ord(letter) * (place + 7) for place, letter in enumerate(letters)) % HELD_OUT == 0


def draw_subject(rng: np.random.Generator) -> Subject:
    """Any subject, held out or not."""
    name = str(rng.choice(list(KINDS)))
    kind = KINDS[name]
    material = str(rng.choice(list(MATERIALS), p=list(MATERIALS.values())))
    figure, ground = draw_colours(rng, name, material)
    return Subject(
        name,
        figure,
        ground,
        scale="medium" if name == "plain" else str(rng.choice(list(SCALES))),
        material="rough" if name == "plain" and material == "relief" else material,
        direction=str(rng.choice(list(DIRECTIONS))) if kind.directed and rng.random() < 0.7 else "",
        ball=bool(rng.random() < 0.45),
    )


def draw_colours(rng: np.random.Generator, name: str, material: str) -> tuple[str, str]:
    """Colours of figure and ground that can be told apart, or the same one."""
    kind = KINDS[name]
    figure, ground = (str(c) for c in rng.choice(list(COLOURS), 2))
    if name == "plain" or (material == "relief" and rng.random() < 0.5):
        return figure, figure
    if kind.usual and rng.random() < 0.4:
        return kind.usual[rng.integers(len(kind.usual))]
    if kind.elements and rng.random() < 0.08:
        return COLOURFUL, ground
    if np.abs(RGB[figure] - RGB[ground]).sum() < 0.8:
        return draw_colours(rng, name, material)
    return figure, ground


def render(subjects: list[Subject], side: int, seed: int) -> np.ndarray:
    """Pictures of subjects, (N, side, side, 3) uint8 sRGB; the same for the same seed."""
    generator = torch.Generator().manual_seed(seed)
    pictures = np.empty((len(subjects), side, side, 3), np.uint8)
    for name in KINDS:
        places = [i for i, subject in enumerate(subjects) if subject.kind == name]
        for start in range(0, len(places), CHUNK):
            chunk = places[start : start + CHUNK]
            picture = Studio([subjects[i] for i in chunk], side, generator).picture()
            pictures[chunk] = (picture.clamp(0, 1) * 255).round().byte().numpy()
    return pictures


class Studio:
    """A batch of subjects of one pattern, lit and seen from the front.

    The picture spans [-1, 1] in x and y; y is down, and z towards the eye.
    """

    def __init__(self, subjects: list[Subject], side: int, generator: torch.Generator) -> None:
        self.subjects, self.side, self.generator = subjects, side, generator
        axis = (torch.arange(side) + 0.5) / side * 2 - 1
        self.x, self.y = (w.expand(len(subjects), -1, -1) for w in torch.meshgrid(axis, axis, indexing="xy"))

    def picture(self) -> torch.Tensor:
        """(B, side, side, 3) sRGB."""
        point, normal, u, v, inside, radius = self._surface()
        place = self._place(u, v, radius)
        drawn = KINDS[self.subjects[0].kind].draw(place)
        albedo = srgb_to_linear(self._albedo(place, drawn))
        shaded = self._lit(albedo, point, self._bumped(normal, drawn, place))
        return torch.lerp(self._background(), linear_to_srgb(shaded.clamp(0, 1)), inside[..., None])

    def _surface(self) -> tuple[torch.Tensor, ...]:
        """Points and normals (B, H, W, 3), places on the surface (B, H, W), what it covers, its size."""
        ball = self._flags("ball", True)
        radius = torch.where(ball, self._uniform(0.68, 0.95), 1.0)
        slim = torch.where(ball, self._uniform(0.75, 1.0) ** self._normal().sign(), 1.0)
        shift = torch.where(ball, 1.0, 0.0) * (1 - radius)
        x = (self.x - shift * self._uniform(-1, 1)) / (radius * slim.clamp(max=1))
        y = (self.y - shift * self._uniform(-1, 1)) * slim.clamp(min=1) / radius
        rim = torch.hypot(x, y)
        inside = torch.where(ball, ((1 - rim) * radius * self.side / 2 + 0.5).clamp(0, 1), 1.0)
        rim = rim.clamp(1e-4, 0.999)
        z = torch.where(ball, (1 - rim**2).sqrt(), 0.0)
        arc = torch.where(ball, torch.asin(rim) / rim, 1.0)
        flat = torch.stack([0 * x, 0 * y, torch.ones_like(x)], -1)
        bent = normalize(torch.stack([x.clamp(-1, 1), y.clamp(-1, 1), z.clamp(min=0.02)], -1), dim=-1)
        normal = torch.where(ball[..., None], bent, flat)
        return torch.stack([self.x, self.y, z], -1), normal, x * arc, y * arc, inside, radius

    def _place(self, u: torch.Tensor, v: torch.Tensor, radius: torch.Tensor) -> Place:
        low, high = torch.tensor([SCALES[s.scale] for s in self.subjects])[:, :, None, None].unbind(1)
        frequency = torch.lerp(low, high, self._uniform(0, 1)) / 2
        turns = self._turns() * 2 * math.pi
        cos, sin = frequency * torch.cos(turns), frequency * torch.sin(turns)
        middle_u, middle_v = self._uniform(-20, 20), self._uniform(-20, 20)
        pixel = 2 / self.side * frequency / radius
        return Place(
            cos * u + sin * v + middle_u, cos * v - sin * u + middle_v, 1.2 * pixel, self._uniform(0, 1)
        )

    def _turns(self) -> torch.Tensor:
        """As the subjects' directions say; else nearly upright, or any way."""
        said = [DIRECTIONS[s.direction] for s in self.subjects]
        any_way = torch.rand(len(said), generator=self.generator) < 0.3
        any_way |= torch.tensor([KINDS[self.subjects[0].kind].directed] * len(said))
        loose = torch.where(any_way[:, None, None], self._uniform(0, 1), 0.02 * self._normal())
        told = torch.tensor([0.0 if turn is None else turn for turn in said])[:, None, None]
        told = told * self._normal().sign() + 0.015 * self._normal()
        return torch.where(torch.tensor([turn is None for turn in said])[:, None, None], loose, told)

    def _albedo(self, place: Place, drawn: Drawn) -> torch.Tensor:
        figure = self._colours("figure")
        hue = (drawn.element * 5.3).remainder(1.0)[..., None] + torch.tensor([0.0, 1 / 3, 2 / 3])
        rainbow = 0.55 + 0.45 * torch.cos(2 * math.pi * hue)
        colourful = self._flags("figure", COLOURFUL)[..., None]
        figure = torch.where(colourful, rainbow, figure)
        albedo = torch.lerp(self._colours("ground"), figure, drawn.figure[..., None])
        variety = self._uniform(0, 0.25) * (drawn.element - 0.5) * drawn.figure
        grain = self._uniform(0, 0.1) * (smooth_noise(place.u * 6, place.v * 6, place.seed) - 0.5)
        return (albedo * (1 + (variety + grain)[..., None])).clamp(0, 1)

    def _colours(self, which: str) -> torch.Tensor:
        """(B, 1, 1, 3) sRGB, each a little beside its name."""
        named = [RGB.get(getattr(s, which), np.ones(3)) for s in self.subjects]
        colours = torch.tensor(np.stack(named), dtype=torch.float32)[:, None, None]
        shift = torch.randn(len(named), 1, 1, 3, generator=self.generator) * 0.025
        return (colours + shift).clamp(0.0, 1.0)

    def _bumped(self, normal: torch.Tensor, drawn: Drawn, place: Place) -> torch.Tensor:
        """Normals that lean away from what is high."""
        rough, relief = self._flags("material", "rough"), self._flags("material", "relief")
        none = self._flags("material", "")
        depth = torch.where(relief, self._uniform(0.5, 1.0), self._uniform(0, 0.2) * none)
        size = self._uniform(9, 14)
        grain = torch.where(rough, self._uniform(0.5, 0.9), 0.0) * smooth_noise(
            self.x * size, self.y * size, place.seed
        )
        unit = 0.2 / place.pixel
        dx = torch.gradient(drawn.height, dim=2)[0] * depth * unit + torch.gradient(grain, dim=2)[0] * 4
        dy = torch.gradient(drawn.height, dim=1)[0] * depth * unit + torch.gradient(grain, dim=1)[0] * 4
        return normalize(normal - torch.stack([dx, dy, torch.zeros_like(dx)], -1), dim=-1)

    def _lit(self, albedo: torch.Tensor, point: torch.Tensor, normal: torch.Tensor) -> torch.Tensor:
        """Lambert's law and Blinn and Phong's highlights; metals mirror a bright half of the sky."""
        offset = torch.randn(len(albedo), 1, 1, 2, generator=self.generator) * 1.2
        lamp = torch.cat([offset, torch.full_like(offset[..., :1], 2.4)], -1)
        light, eye = normalize(lamp - point, dim=-1), normalize(torch.tensor([0.0, 0.0, 3.0]) - point, dim=-1)
        half = (normal * normalize(light + eye, dim=-1)).sum(-1).clamp(0, 1)
        diffuse = (normal * light).sum(-1).clamp(0, 1)
        ambient = self._uniform(0.25, 0.6)
        shade = ambient + (1.15 - ambient) * diffuse
        shiny, metal = self._flags("material", "shiny"), self._flags("material", "metallic")
        bare = self._flags("material", "") & (self._uniform(0, 1) < 0.5)
        mirrored = 2 * (normal * eye).sum(-1) * normal[..., 1] - eye[..., 1]
        sky = torch.sigmoid((-mirrored + self._uniform(-0.2, 0.2)) * 9)
        shade = torch.where(metal, 0.25 + 0.4 * diffuse + 0.55 * sky, shade)
        shade = torch.where(bare, 1.0, shade)[..., None]
        gloss = half ** self._uniform(25, 70) * self._uniform(0.6, 1.0)
        white = torch.where(shiny, gloss, 0.0)[..., None]
        tinted = torch.where(metal, 1.6 * half**20, 0.0)[..., None] * (albedo * 0.8 + 0.2)
        return albedo * shade + white + tinted

    def _background(self) -> torch.Tensor:
        count = len(self.subjects)
        grey = torch.tensor([1.0, 1.0, 0.0, 0.5])[torch.randint(4, (count,), generator=self.generator)]
        colour = torch.rand(count, 3, generator=self.generator)
        coloured = torch.rand(count, 1, generator=self.generator) < 0.15
        return torch.where(coloured, colour, grey[:, None])[:, None, None]

    def _flags(self, name: str, value: object) -> torch.Tensor:
        return torch.tensor([getattr(s, name) == value for s in self.subjects])[:, None, None]

    def _uniform(self, low: float, high: float) -> torch.Tensor:
        return low + (high - low) * torch.rand(len(self.subjects), 1, 1, generator=self.generator)

    def _normal(self) -> torch.Tensor:
        return torch.randn(len(self.subjects), 1, 1, generator=self.generator)
