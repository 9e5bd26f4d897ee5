"""The two transformers of CLIP; modules are named as in Hugging Face's files, which load as they are."""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import nn

from mitex.features.clip.shape import ClipShape, TowerShape


class Linear(nn.Linear):
    """A linear layer that computes in the type of its weights, and gives its result in that."""

    def forward(self, input: torch.Tensor) -> torch.Tensor:
        return super().forward(input.to(self.weight.dtype))


class Attention(nn.Module):
    """Self-attention of several heads."""

    def __init__(self, shape: TowerShape) -> None:
        super().__init__()
        self.heads = shape.heads
        self.q_proj, self.k_proj, self.v_proj, self.out_proj = (
            Linear(shape.width, shape.width) for _ in range(4)
        )

    def forward(self, x: torch.Tensor, causal: bool) -> torch.Tensor:
        q, k, v = (
            project(x).unflatten(2, (self.heads, -1)).transpose(1, 2)
            for project in (self.q_proj, self.k_proj, self.v_proj)
        )
        mixed = F.scaled_dot_product_attention(q, k, v, is_causal=causal)
        return self.out_proj(mixed.transpose(1, 2).flatten(2))


class Perceptron(nn.Module):
    """Two layers that work on each vector alone."""

    def __init__(self, shape: TowerShape) -> None:
        super().__init__()
        self.quick = shape.activation == "quick_gelu"
        self.fc1, self.fc2 = Linear(shape.width, shape.inner), Linear(shape.inner, shape.width)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        x = self.fc1(x)
        return self.fc2(x * torch.sigmoid(1.702 * x) if self.quick else F.gelu(x))


class Layer(nn.Module):
    """Attention, then perceptron, each added to what it reads; sums and norms stay in float32."""

    def __init__(self, shape: TowerShape) -> None:
        super().__init__()
        self.self_attn, self.mlp = Attention(shape), Perceptron(shape)
        self.layer_norm1, self.layer_norm2 = (nn.LayerNorm(shape.width, shape.epsilon) for _ in range(2))

    def forward(self, x: torch.Tensor, causal: bool) -> torch.Tensor:
        x = x + self.self_attn(self.layer_norm1(x), causal)
        return x + self.mlp(self.layer_norm2(x))


class Encoder(nn.Module):
    """All layers of a tower."""

    def __init__(self, shape: TowerShape) -> None:
        super().__init__()
        self.layers = nn.ModuleList(Layer(shape) for _ in range(shape.layers))

    def forward(self, x: torch.Tensor, causal: bool = False) -> torch.Tensor:
        for layer in self.layers:
            x = layer(x, causal)
        return x


class ImageEmbeddings(nn.Module):
    """Patches as vectors, each with its place, after one vector that stands for the image."""

    def __init__(self, shape: ClipShape) -> None:
        super().__init__()
        width, places = shape.image.width, (shape.resolution // shape.patch) ** 2 + 1
        self.class_embedding = nn.Parameter(torch.zeros(width))
        self.patch_embedding = nn.Conv2d(3, width, shape.patch, shape.patch, bias=False)
        self.position_embedding = _table(places, width)

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        patches = self.patch_embedding(images).flatten(2).transpose(1, 2)
        first = self.class_embedding.expand(len(images), 1, -1)
        return torch.cat([first, patches], 1) + self.position_embedding.weight


class ImageTower(nn.Module):
    """A vision transformer (Dosovitskiy et al. 2021)."""

    def __init__(self, shape: ClipShape) -> None:
        super().__init__()
        width, epsilon = shape.image.width, shape.image.epsilon
        self.embeddings = ImageEmbeddings(shape)
        self.pre_layrnorm = nn.LayerNorm(width, epsilon)  # spelt so in all files
        self.encoder = Encoder(shape.image)
        self.post_layernorm = nn.LayerNorm(width, epsilon)

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        """(K, width) of normalised images (K, 3, R, R)."""
        x = self.encoder(self.pre_layrnorm(self.embeddings(images)))
        return self.post_layernorm(x[:, 0])


class TextEmbeddings(nn.Module):
    """Tokens as vectors, each with its place."""

    def __init__(self, shape: ClipShape) -> None:
        super().__init__()
        self.token_embedding = _table(shape.vocabulary, shape.text.width)
        self.position_embedding = _table(shape.length, shape.text.width)

    def forward(self, tokens: torch.Tensor) -> torch.Tensor:
        return self.token_embedding(tokens) + self.position_embedding.weight[: tokens.shape[1]]


class TextTower(nn.Module):
    """A transformer in which every token sees those before it."""

    def __init__(self, shape: ClipShape) -> None:
        super().__init__()
        self.embeddings = TextEmbeddings(shape)
        self.encoder = Encoder(shape.text)
        self.final_layer_norm = nn.LayerNorm(shape.text.width, shape.text.epsilon)

    def forward(self, tokens: torch.Tensor, last: torch.Tensor) -> torch.Tensor:
        """(N, width) of tokens (N, L) at the places `last` (N,) where the texts end."""
        x = self.final_layer_norm(self.encoder(self.embeddings(tokens), causal=True))
        return x[torch.arange(len(x), device=x.device), last]


class Towers(nn.Module):
    """Both towers and their projections into the common space."""

    def __init__(self, shape: ClipShape) -> None:
        super().__init__()
        self.vision_model, self.text_model = ImageTower(shape), TextTower(shape)
        self.visual_projection = nn.Linear(shape.image.width, shape.embedding, bias=False)
        self.text_projection = nn.Linear(shape.text.width, shape.embedding, bias=False)


def _table(count: int, width: int) -> nn.Embedding:
    """Empty vectors, one a number: to draw them on the device "meta" takes a second of imports."""
    return nn.Embedding.from_pretrained(torch.empty(count, width), freeze=False)
