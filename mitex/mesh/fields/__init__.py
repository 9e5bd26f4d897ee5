"""Vector fields on meshes: which way, and how fast, something runs along the surface.

`vector_field(mesh, source)` makes one, of mean length 1. At the point (x, y, z), sources with a name say

- `right` (1, 0, 0), and `left` (-1, 0, 0);
- `up` (0, 1, 0), and `down` (0, -1, 0);
- `shear-up` (0, z + 1, 0), and `shear-down` (0, -z - 1, 0): faster towards +z;
- `about-x` (0, -z, y) / r: turns about the x axis, right-handed;
- `about-y` (z, 0, -x) / r: turns about the y axis, right-handed.

These are the fields of table 8 of the MeshNCA paper. Their x, y, z are those of the mesh with its vertex mean
at the origin and its farthest vertex at distance 1 (`Mesh.normalised`); r is the distance from the origin.

Other sources are in the space of the mesh as it is given:

- a direction, such as `1,0,0`. At the command line, one that begins with a minus needs an equals sign:
  `--field=-1,0,0`;
- a .npy file of (V, 3) numbers: row i is the vector of vertex i;
- a .ply file with V vertices that have the properties `vx vy vz`, `fx fy fz` or `u v w`;
- a .json file of strokes drawn on the surface, `{"strokes": [[[x, y, z], ...], ...]}`, which the field
  follows as `stroke_vectors` says;
- an array (V, 3).
"""

from mitex.mesh.fields.carried import carried_field
from mitex.mesh.fields.field import vector_field
from mitex.mesh.fields.files import read_vectors
from mitex.mesh.fields.named import NAMES
from mitex.mesh.fields.strokes import stroke_vectors

__all__ = ["NAMES", "carried_field", "read_vectors", "stroke_vectors", "vector_field"]
