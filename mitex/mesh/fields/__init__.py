"""Vector fields on meshes: which way, and how fast, something moves along the surface.

`vector_field(mesh, source)` makes one. The source is one of these:

| source | vector at (x, y, z) |
| --- | --- |
| `right`, `left` | (1, 0, 0), (-1, 0, 0) |
| `up`, `down` | (0, 1, 0), (0, -1, 0) |
| `shear-up`, `shear-down` | (0, z + 1, 0), (0, -z - 1, 0): faster towards +z |
| `about-x` | (0, -z, y) / r: turns about the x axis, right-handed |
| `about-y` | (z, 0, -x) / r: turns about the y axis, right-handed |
| `1,0,0` | that direction everywhere |
| a `.npy` file | row i of (V, 3) numbers for vertex i |
| a `.ply` file | the vertex properties `vx vy vz`, `fx fy fz` or `u v w` of its V vertices |
| a `.json` file | {"strokes": [[[x, y, z], ...], ...]}, drawn on the surface: see `stroke_vectors` |
| an array | (V, 3) |

The names stand for the fields of table 8 of the MeshNCA paper. Their x, y, z are those of the mesh with its
vertex mean at the origin and its farthest vertex at distance 1 (`Mesh.normalised`); r is the distance from
the origin.
At the command line, a direction that begins with a minus needs an equals sign: `--field=-1,0,0`.
"""

from mitex.mesh.fields.field import vector_field
from mitex.mesh.fields.named import NAMES
from mitex.mesh.fields.strokes import stroke_vectors

__all__ = ["NAMES", "stroke_vectors", "vector_field"]
