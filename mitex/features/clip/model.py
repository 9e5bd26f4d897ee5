"""A CLIP model that is read from a folder and looks at pictures and texts."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path

import torch
import torch.nn.functional as F

from mitex.errors import ImageError, WeightsError
from mitex.features.clip.shape import ClipShape
from mitex.features.clip.tokenizer import Tokenizer
from mitex.features.clip.towers import ImageTower, Linear, Towers
from mitex.runtime import uses_bfloat16

AGREEMENT = 0.999  # cosine of gradients from which on bfloat16 is as good as float32


class Clip:
    """A `TextImageModel` of any folder that holds a CLIP model as Hugging Face stores it.

    It needs config.json, model.safetensors, and tokenizer.json or vocab.json with merges.txt; mean and
    deviation of the colours come from preprocessor_config.json if that is there.

    Args:
        folder: where the files are.
        precision: of the products that images go through: "bfloat16", "float32", or "auto", bfloat16 where
            the processor multiplies it natively and these weights allow it: the gradient of a cosine must
            have a cosine of over 0.999 with that of float32. Texts always get float32.
        device: where the weights live.

    Raises:
        WeightsError: a file is missing, damaged, or does not fit the others.
        ConfigError: an unknown precision.
        MissingPackage: the package tokenizers is not installed.
    """

    def __init__(self, folder: Path, precision: str = "auto", device: torch.device | str = "cpu") -> None:
        in_bfloat16 = uses_bfloat16(precision, str(device))
        self._shape, self._device = ClipShape.read(folder), device
        self._name = _name(folder)
        self._tokenizer = Tokenizer(folder, self._shape)
        self._towers = _loaded(folder, self._shape).to(device)
        if in_bfloat16:
            exact, fast = self._towers.vision_model, _in_bfloat16(self._towers.vision_model)
            if precision == "bfloat16" or _agree(exact, fast, self.resolution):
                self._towers.vision_model = fast
        self._mean, self._deviation = (
            torch.tensor(values, device=device) for values in (self._shape.mean, self._shape.deviation)
        )

    @property
    def name(self) -> str:
        """That of its folder; of one in Hugging Face's cache, the model's."""
        return self._name

    @property
    def resolution(self) -> int:
        """Width and height of the pictures that it sees [px]."""
        return self._shape.resolution

    def encode_images(self, images: torch.Tensor) -> torch.Tensor:
        """Encodes pictures, differentiable in them.

        Args:
            images: (K, R, R, 3) sRGB in [0, 1], R the `resolution`.

        Returns:
            (K, D) embeddings, not normalised.

        Raises:
            ImageError: images of another shape.
        """
        side = self.resolution
        if images.ndim != 4 or images.shape[1:] != (side, side, 3):
            raise ImageError(f"images of shape {tuple(images.shape)}", f"give (K, {side}, {side}, 3)")
        normalised = ((images - self._mean) / self._deviation).permute(0, 3, 1, 2)
        return self._towers.visual_projection(self._towers.vision_model(normalised))

    @torch.no_grad()
    def encode_texts(self, texts: Sequence[str]) -> torch.Tensor:
        """Encodes texts.

        Returns:
            (N, D) embeddings, not normalised.

        Raises:
            ConfigError: a text that is empty or has more tokens than the model reads.
        """
        if not texts:
            return torch.zeros(0, self._shape.embedding, device=self._device)
        tokens, last = (part.to(self._device) for part in self._tokenizer(texts))
        return self._towers.text_projection(self._towers.text_model(tokens, last))


def _in_bfloat16(tower: ImageTower) -> ImageTower:
    """A copy whose products are in bfloat16."""
    fast = deepcopy(tower)
    for layer in fast.modules():
        if isinstance(layer, Linear):
            layer.to(torch.bfloat16)
    return fast


def _agree(exact: ImageTower, fast: ImageTower, resolution: int) -> bool:
    """Whether a picture of soft blots has the same gradient in both, but for a small angle."""
    device, generator = exact.post_layernorm.weight.device, torch.Generator().manual_seed(0)
    blots = F.interpolate(
        torch.randn(1, 3, 8, 8, generator=generator), (resolution, resolution), mode="bicubic"
    )
    aim = torch.randn(exact.post_layernorm.weight.shape, generator=generator).to(device)
    gradients = []
    for tower in (exact, fast):
        picture = blots.to(device).requires_grad_()
        (gradient,) = torch.autograd.grad(F.cosine_similarity(tower(picture)[0], aim, dim=0), picture)
        gradients.append(gradient.flatten())
    return F.cosine_similarity(*gradients, dim=0).item() > AGREEMENT


def _loaded(folder: Path, shape: ClipShape) -> Towers:
    """The towers with the weights of model.safetensors, float32 and frozen."""
    from safetensors import SafetensorError
    from safetensors.torch import load_file

    path = folder / "model.safetensors"
    try:
        tensors = {name: tensor.float() for name, tensor in load_file(path).items()}
    except (SafetensorError, OSError, ValueError) as e:
        raise WeightsError(f"{path} cannot be read ({e})", "download it again") from e
    with torch.device("meta"):  # no memory is filled before it gets the weights
        towers = Towers(shape)
    expected = towers.state_dict()
    wrong = [n for n, t in expected.items() if n not in tensors or tensors[n].shape != t.shape]
    if wrong:
        raise WeightsError(
            f"{path} does not fit its config.json: {wrong[0]} is missing or of another shape",
            "download both again, from one model",
        )
    towers.load_state_dict({name: tensors[name] for name in expected}, assign=True)
    if not all(torch.isfinite(tensor).all() for tensor in towers.state_dict().values()):
        raise WeightsError(f"the weights in {path} are not finite", "download it again")
    return towers.requires_grad_(False).eval()


def _name(folder: Path) -> str:
    """ORGANISATION/NAME of a snapshot in Hugging Face's cache, else the folder's own name."""
    cached = folder.parents[1].name if len(folder.parents) > 1 else ""
    return cached[8:].replace("--", "/") if cached.startswith("models--") else folder.resolve().name
