"""Content textures: what style transfer starts from and keeps (Kovacs et al. 2024, section 4)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import unit
from mitex.images import bilinear, read_image
from mitex.methods.surface.domain import SurfaceDomain

AO = "ao"


def content_colours(content: str | Path, domain: SurfaceDomain) -> np.ndarray:
    """The colours (N, 3) float32, sRGB in [0, 1], of texels in a content texture.

    Args:
        content: an image on the mesh's UVs, or "ao" for the mesh's ambient occlusion as grey.
        domain: with the texels.

    Raises:
        ImageError: the image cannot be read.
    """
    mesh, texels = domain.mesh, domain.texels
    if str(content) == AO:
        from mitex.scenes.occlusion import ambient_occlusion

        corners = mesh.normals[mesh.faces[texels.face]].astype(np.float64)
        normals = unit(interpolate(texels.barycentric, corners))
        return np.repeat(ambient_occlusion(mesh, texels.position, normals)[:, None], 3, axis=1)
    uv = interpolate(texels.barycentric, texels.uv[texels.face].astype(np.float64))
    return bilinear(read_image(Path(content)), uv).astype(np.float32)
