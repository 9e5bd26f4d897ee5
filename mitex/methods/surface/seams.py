"""Whether a texture knows where its charts end."""

from __future__ import annotations

import numpy as np

from mitex.methods.surface.texture import SurfaceTexture


def seam_ratio(texture: SurfaceTexture, seed: int = 0) -> float:
    """How much more a texture changes across the seams of its layout than elsewhere.

    From every texel a geodesic goes as far as a texel is wide, in a random direction, to a neighbour: mean
    absolute difference of the neighbours that lie in another chart, over that of the others. 1 where seams
    cannot be seen. Texels whose centres lie outside their chart do not count.

    Args:
        texture: to judge, all its maps together.
        seed: of the directions.

    Returns:
        The ratio; NaN if there is no seam, or if nothing changes.
    """
    texels = texture.domain.texels
    start = np.flatnonzero(texels.inside)
    face, barycentric = texels.face[start], texels.barycentric[start]
    right, up = (axis[start] for axis in texture.domain.tangent_frames)
    angle = np.random.default_rng(seed).uniform(0, 2 * np.pi, (len(start), 1))
    direction = np.cos(angle) * right + np.sin(angle) * up
    end = texture.domain.tracer.trace(face, barycentric, direction, texels.size)
    index, weight = texels.bilinear(end.face, end.barycentric)
    neighbour = np.take_along_axis(index, weight.argmax(1)[:, None], 1)[:, 0]
    change = np.abs(texture.values[start] - texture.values[neighbour]).mean(1)
    counts = end.arrived & (neighbour != start) & texels.inside[neighbour]
    crossed = texels.chart[face] != texels.chart[texels.face[neighbour]]
    across, within = change[crossed & counts], change[~crossed & counts]
    return float(across.mean() / within.mean()) if len(across) and within.any() else float("nan")
