"""Folders of CLIP models with random weights and a tokenizer of a few words."""

import json
from pathlib import Path
from typing import Any

import torch

MERGES = ("r e", "re d</w>", "d o", "do t", "dot s</w>", "o n</w>")
START, END = "<|startoftext|>", "<|endoftext|>"
SHAPES: dict[str, dict[str, Any]] = {
    "quick": {"projection_dim": 24, "image_size": 32, "patch_size": 16, "hidden_act": "quick_gelu"},
    "exact": {"projection_dim": 16, "image_size": 48, "patch_size": 8, "hidden_act": "gelu", "layers": 3},
    "wide": {"projection_dim": 32, "image_size": 64, "patch_size": 32, "hidden_size": 96, "heads": 6},
}


def vocabulary() -> dict[str, int]:
    """Every byte, at the end of a word or not, the merged pairs, and the two special tokens."""
    from tokenizers.pre_tokenizers import ByteLevel

    letters = sorted(ByteLevel.alphabet())
    words = [*letters, *(letter + "</w>" for letter in letters), *("".join(m.split()) for m in MERGES)]
    return {token: index for index, token in enumerate([*words, START, END])}


def config(projection_dim: int, image_size: int, patch_size: int, **options: Any) -> dict[str, Any]:
    """What config.json says."""
    width, heads = options.get("hidden_size", 64), options.get("heads", 4)
    tower = {
        "hidden_size": width,
        "num_attention_heads": heads,
        "intermediate_size": 3 * width,
        "num_hidden_layers": options.get("layers", 2),
        "hidden_act": options.get("hidden_act", "quick_gelu"),
    }
    ids = vocabulary()
    text = {"vocab_size": len(ids), "max_position_embeddings": 77, "bos_token_id": ids[START]}
    return {
        "model_type": "clip",
        "projection_dim": projection_dim,
        "text_config": tower | text | {"eos_token_id": options.get("end", ids[END])},
        "vision_config": tower | {"image_size": image_size, "patch_size": patch_size},
    }


def write_folder(folder: Path, shape: str = "quick", **options: Any) -> Path:
    """A folder with random weights that are far from those at the start of a training."""
    from safetensors.torch import save_file

    from mitex.features.clip.shape import ClipShape
    from mitex.features.clip.towers import Towers

    folder.mkdir(parents=True, exist_ok=True)
    (folder / "config.json").write_text(json.dumps(config(**(SHAPES[shape] | options))))
    (folder / "vocab.json").write_text(json.dumps(vocabulary()))
    (folder / "merges.txt").write_text("\n".join(["#version: 0.2", *MERGES]))
    generator = torch.Generator().manual_seed(0)
    towers = Towers(ClipShape.read(folder))
    tensors = {}
    for name, value in towers.state_dict().items():
        scale = 1.0 if value.ndim == 1 else value.shape[-1] ** -0.5
        around = 1.0 if "norm" in name and name.endswith("weight") else 0.0
        tensors[name] = around + 0.3 * scale * torch.randn(value.shape, generator=generator)
        if value.ndim > 1:
            tensors[name] *= 3
    save_file(tensors, folder / "model.safetensors")
    return folder
