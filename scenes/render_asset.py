"""Dress a mesh with maps of your own, look at it, and take it to any other program.

    python scenes/render_asset.py            # an embedded vase with turned grooves
    python scenes/render_asset.py my.glb     # an asset that Mitex exported

writes asset.png (path-traced) and, for the vase, vase.glb with its maps baked to textures.
"""

import sys

import numpy as np

from mitex import Asset
from mitex.geometry.vectors import orthonormal
from mitex.mesh import embedded


def grooved() -> Asset:
    """A vase with grooves around it: one colour in the valleys, a glossier one on the ridges."""
    mesh, _ = embedded("vase").normalised()
    phase = 60.0 * mesh.vertices[:, 1:2] + 3.0 * np.sin(4.0 * np.arctan2(*mesh.vertices[:, 0::2].T))[:, None]
    height = 0.5 + 0.5 * np.sin(phase)
    # +u runs around the vase, so +v (the bitangent) runs up; a normal leans away from where the height grows.
    tangents = orthonormal(np.cross([0.0, 1.0, 0.0], mesh.normals), mesh.normals)
    lean = np.concatenate([0 * phase, -0.6 * np.cos(phase), 0 * phase + 1.0], axis=1)
    maps = {
        "albedo": (1 - height) * np.array([0.10, 0.20, 0.28]) + height * np.array([0.85, 0.72, 0.52]),
        "ambient_occlusion": 0.5 + 0.5 * height,
        "height": height,
        "normal": 0.5 + 0.5 * lean / np.linalg.norm(lean, axis=1, keepdims=True),
        "roughness": 0.7 - 0.45 * height,
    }
    return Asset(mesh, maps, tangents, name="vase")


def main(source: str | None = None, **options) -> None:
    if source:
        asset = Asset.load(source)
    else:
        asset = grooved()
        print(asset.baked(resolution=1024).export("vase.glb"))
    print(asset.render("asset.png", **options))


if __name__ == "__main__":
    main(*sys.argv[1:])
