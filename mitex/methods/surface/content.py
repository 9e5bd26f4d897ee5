"""Content textures: what style transfer starts from and keeps (Kovacs et al. 2024, section 4)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import unit
from mitex.images import bilinear, read_image
from mitex.methods.surface.domain import SurfaceDomain
from mitex.paths import expanded

AO = "ao"


def content_picture(content: str | Path) -> np.ndarray | None:
    """The picture (H, W, 3) float32, sRGB in [0, 1], that a content is; None for "ao", which is none.

    Raises:
        ImageError: it cannot be read.
    """
    return None if str(content) == AO else read_image(expanded(content))


def content_colours(picture: np.ndarray | None, domain: SurfaceDomain) -> np.ndarray:
    """The colours (N, 3) float32, sRGB in [0, 1], of texels in a content texture.

    Args:
        picture: (H, W, 3) on the mesh's UVs, sRGB in [0, 1]; None for the mesh's ambient occlusion as grey.
        domain: with the texels.
    """
    mesh, texels = domain.mesh, domain.texels
    if picture is None:
        from mitex.scenes.occlusion import ambient_occlusion

        corners = mesh.normals[mesh.faces[texels.face]].astype(np.float64)
        normals = unit(interpolate(texels.barycentric, corners))
        return np.repeat(ambient_occlusion(mesh, texels.position, normals)[:, None], 3, axis=1)
    uv = interpolate(texels.barycentric, texels.uv[texels.face].astype(np.float64))
    return bilinear(picture, uv).astype(np.float32)
