"""The losses as loops over single vectors, in float64 and under autograd."""

import torch


def cosine_distance(x: torch.Tensor, y: torch.Tensor) -> torch.Tensor:
    return 1 - (x @ y) / (x.norm() * y.norm())


def pair_cost(x: torch.Tensor, y: torch.Tensor, euclidean: bool) -> torch.Tensor:
    """D(x, y) of equation 4, with the authors' clamp."""
    cost = cosine_distance(x, y)
    if euclidean:
        cost = cost + (x - y).square().sum().clamp(1e-5, 1e5) / len(x)
    return cost


def transport(a: torch.Tensor, b: torch.Tensor, euclidean: bool = False) -> torch.Tensor:
    """Equation 4 for two sets (n, C) and (m, C)."""
    rows = [[pair_cost(x, y, euclidean) for y in b] for x in a]
    forth = sum(min(row, key=_value) for row in rows) / len(a)
    back = sum(min((row[j] for row in rows), key=_value) for j in range(len(b))) / len(b)
    return torch.as_tensor(forth if forth > back else back)


def covariance(a: torch.Tensor) -> torch.Tensor:
    """Unbiased, (C, C), of vectors (n, C)."""
    count, channels = a.shape
    mean = [sum(a[i, c] for i in range(count)) / count for c in range(channels)]
    rows = []
    for c in range(channels):
        for d in range(channels):
            rows.append(sum((a[i, c] - mean[c]) * (a[i, d] - mean[d]) for i in range(count)) / (count - 1))
    return torch.stack(rows).view(channels, channels)


def moments(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """Equation 5 for two sets (n, C) and (m, C)."""
    means = (a.mean(0) - b.mean(0)).abs().mean()
    return means + (covariance(a) - covariance(b)).abs().mean()


def _value(x: torch.Tensor) -> float:
    return x.detach().item()
