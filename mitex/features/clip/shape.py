"""The sizes of a CLIP model, from the JSON files of its folder."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mitex.errors import WeightsError

ACTIVATIONS = ("quick_gelu", "gelu")
MEAN_RGB = (0.48145466, 0.4578275, 0.40821073)  # of OpenAI's models, in [0, 1]
DEVIATION_RGB = (0.26862954, 0.26130258, 0.27577711)


@dataclass(frozen=True)
class TowerShape:
    """A transformer.

    Attributes:
        width: of its vectors.
        layers, heads: number of them.
        inner: width of the hidden layers between.
        activation: "quick_gelu", x sigmoid(1.702 x), or "gelu".
        epsilon: of the layer norms.
    """

    width: int
    layers: int
    heads: int
    inner: int
    activation: str = "quick_gelu"
    epsilon: float = 1e-5


@dataclass(frozen=True)
class ClipShape:
    """A CLIP model.

    Attributes:
        image, text: the towers.
        embedding: D, width of the space that both end in.
        resolution: width and height of the images [px].
        patch: side of the squares that an image is cut into [px].
        vocabulary: number of different tokens.
        length: most tokens of a text.
        end: the token that a text ends with.
        mean, deviation: of the images that it was trained on, sRGB in [0, 1].
    """

    image: TowerShape
    text: TowerShape
    embedding: int
    resolution: int
    patch: int
    vocabulary: int
    length: int
    end: int
    mean: tuple[float, ...] = MEAN_RGB
    deviation: tuple[float, ...] = DEVIATION_RGB

    @staticmethod
    def read(folder: Path) -> ClipShape:
        """From config.json, whose missing keys are those of ViT-B/32, and preprocessor_config.json if there.

        Raises:
            WeightsError: a file is not JSON, not of a CLIP model, or has impossible values.
        """
        file = folder / "config.json"
        try:
            config = _json(file)
            if config.get("model_type") != "clip":
                raise ValueError(f"its model_type is {config.get('model_type')!r}, not 'clip'")
            preparation = folder / "preprocessor_config.json"
            images = _json(preparation) if preparation.is_file() else {}
            shape = _shape(config, images)
        except (ValueError, TypeError, AttributeError) as e:
            raise WeightsError(
                f"{file} does not describe a CLIP model that Mitex can run ({e})",
                "name the folder of one as Hugging Face stores it",
            ) from e
        return shape


def _json(file: Path) -> dict[str, Any]:
    try:
        content = json.loads(file.read_text("utf-8"))
    except OSError as e:
        raise ValueError(f"{file.name}: {e.strerror}") from e
    except (ValueError, RecursionError) as e:
        raise ValueError(f"{file.name} is not JSON") from e
    if not isinstance(content, dict):
        raise ValueError(f"{file.name} is no table")
    return content


def _shape(config: Mapping[str, Any], images: Mapping[str, Any]) -> ClipShape:
    text, image = config.get("text_config") or {}, config.get("vision_config") or {}
    resolution, patch = _count(image, "image_size", 224), _count(image, "patch_size", 32)
    if resolution % patch:
        raise ValueError(f"image_size = {resolution} is no multiple of patch_size = {patch}")
    vocabulary, end = _count(text, "vocab_size", 49408), text.get("eos_token_id", 49407)
    # Configs from before 2023 say 2, which is not true: their tokenizers end texts with the last token.
    end = vocabulary - 1 if end == 2 else end
    return ClipShape(
        image=_tower(image, 768, 12, 3072),
        text=_tower(text, 512, 8, 2048),
        embedding=_count(config, "projection_dim", 512),
        resolution=resolution,
        patch=patch,
        vocabulary=vocabulary,
        length=_count(text, "max_position_embeddings", 77),
        end=end,
        mean=_colour(images, "image_mean", MEAN_RGB),
        deviation=_colour(images, "image_std", DEVIATION_RGB),
    )


def _tower(config: Mapping[str, Any], width: int, heads: int, inner: int) -> TowerShape:
    shape = TowerShape(
        width=_count(config, "hidden_size", width),
        layers=_count(config, "num_hidden_layers", 12),
        heads=_count(config, "num_attention_heads", heads),
        inner=_count(config, "intermediate_size", inner),
        activation=config.get("hidden_act", "quick_gelu"),
        epsilon=float(config.get("layer_norm_eps", 1e-5)),
    )
    if shape.width % shape.heads:
        raise ValueError(f"hidden_size = {shape.width} cannot be split into {shape.heads} heads")
    if shape.activation not in ACTIVATIONS:
        raise ValueError(f"hidden_act = {shape.activation!r} is none of {', '.join(ACTIVATIONS)}")
    return shape


def _count(config: Mapping[str, Any], key: str, default: int) -> int:
    value = config.get(key, default)
    if not isinstance(value, int) or isinstance(value, bool) or not 0 < value < 1 << 20:
        raise ValueError(f"{key} = {value!r}")
    return value


def _colour(config: Mapping[str, Any], key: str, default: tuple[float, ...]) -> tuple[float, ...]:
    values = tuple(float(value) for value in config.get(key, default))
    if len(values) != 3 or not all(0 < value < 10 for value in values):
        raise ValueError(f"{key} = {values}")
    return values
