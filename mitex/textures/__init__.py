"""The textures of Mitex as Mitsuba plugins; `import mitex.plugins` registers them.

| type | class | rows of `data` |
| --- | --- | --- |
| `vertex_field` | `VertexField` | one for each vertex, interpolated over the triangles |
| `texel_field` | `TexelField` | one for each texel of a UV layout, filtered within charts |
| `decoded_field` | `DecodedField` | a state for each vertex, decoded by a small network |
| `shell_field` | `ShellField` | none: a radiance field, an object that `shell_field(...)` makes |

The docstrings of the classes are the reference: each parameter of the scene's dictionary with its type and
meaning, its default where it may be left out, and whether `mi.traverse` lists it (exposed) and images have
derivatives to it (differentiable).
"""

from mitex.textures.decoded_field import DecodedField
from mitex.textures.shell_field import ShellField
from mitex.textures.texel_field import TexelField
from mitex.textures.vertex_field import VertexField

__all__ = ["DecodedField", "ShellField", "TexelField", "VertexField"]
