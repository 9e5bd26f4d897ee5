"""Pictures cut and tilted at random, so that a loss looks at what they show and not at their pixels."""

from __future__ import annotations

from dataclasses import dataclass

import torch
import torch.nn.functional as F

CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))  # x to the right, y down


@dataclass(frozen=True, eq=False)
class Augmentation:
    """N tilted squares of pictures; drawn once, it does the same to any batch.

    Attributes:
        picture: (N,) int64, which one each is of.
        homography: (N, 3, 3) float32, from places in the square to places in the picture, (x, y, 1) both,
            from -1 to 1.
        side: mean side of the squares, as a share of the picture's.
    """

    picture: torch.Tensor
    homography: torch.Tensor
    side: float

    @staticmethod
    def draw(
        generator: torch.Generator, pictures: int, squares: int = 1, area: float = 1.0, tilt: float = 0.5
    ) -> Augmentation:
        """Draws squares.

        Args:
            generator: source of all randomness.
            pictures: K.
            squares: of each picture; N = K times this.
            area: of a square, as a share of the picture's; 1 for the whole picture.
            tilt: how far corners are moved outwards at most, each way [half sides]. Text2Mesh moves them
                inwards and fills with white; so a square goes on with what the picture shows around it.
        """
        count, side = pictures * squares, area**0.5
        centre = (1 - side) * (2 * torch.rand(count, 1, 2, generator=generator, dtype=torch.float64) - 1)
        outwards = 1 + tilt * torch.rand(count, 4, 2, generator=generator, dtype=torch.float64)
        corners = torch.tensor(CORNERS, dtype=torch.float64)
        homography = _homographies(corners, centre + side * outwards * corners)
        which = torch.arange(pictures).repeat_interleave(squares)
        return Augmentation(which, homography.float(), side)

    def __call__(self, pictures: torch.Tensor, size: int, fill: float = 1.0) -> torch.Tensor:
        """The squares.

        Args:
            pictures: (K, H, W, C), H = W; reduced first where a pixel of a square would span several.
            size: of the squares [px].
            fill: what is around a picture; white by default.

        Returns:
            (N, size, size, C), differentiable in the pictures.
        """
        images = pictures.permute(0, 3, 1, 2) - fill
        reduced = round(size / self.side)
        if reduced < images.shape[2]:
            images = F.interpolate(images, (reduced, reduced), mode="bilinear", antialias=True)
        places = _places(self.homography.to(images.device), size)
        squares = F.grid_sample(images[self.picture.to(images.device)], places, align_corners=False)
        return squares.permute(0, 2, 3, 1) + fill


def _places(homography: torch.Tensor, size: int) -> torch.Tensor:
    """Where in the picture each pixel of a square is: (N, size, size, 2)."""
    steps = (torch.arange(size, device=homography.device) + 0.5) * (2 / size) - 1
    y, x = torch.meshgrid(steps, steps, indexing="ij")
    at = torch.stack([x, y, torch.ones_like(x)], 2).reshape(-1, 3) @ homography.transpose(1, 2)
    return (at[..., :2] / at[..., 2:]).view(-1, size, size, 2)


def _homographies(source: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
    """(N, 3, 3) homographies with a 1 at the end that take four points (4, 2) to (N, 4, 2)."""
    x, y = (source.expand_as(target)[..., k] for k in range(2))
    one, zero = torch.ones_like(x), torch.zeros_like(x)
    rows = []
    for k, u in enumerate(target.unbind(2)):
        affine = [x, y, one, zero, zero, zero] if k == 0 else [zero, zero, zero, x, y, one]
        rows.append(torch.stack([*affine, -u * x, -u * y], 2))
    solution = torch.linalg.solve(torch.cat(rows, 1), torch.cat(target.unbind(2), 1))
    return torch.cat([solution, solution.new_ones(len(solution), 1)], 1).view(-1, 3, 3)
