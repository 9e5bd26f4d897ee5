"""What fields with one row for each vertex share: they refuse meshes with other numbers of vertices."""

from __future__ import annotations

from mitex.errors import ConfigError
from mitex.runtime.jit import dr, mi
from mitex.textures.field import FieldMethods, Located
from mitex.textures.scene_objects import holds, is_rendered, loaded_meshes


class VertexRows(FieldMethods):
    """Members of the plugin class of a field whose `data` has one row for each vertex."""

    def check_shape(self, shape: mi.Shape) -> None:
        """Raises a ConfigError if a mesh has another number of vertices than the data has rows.

        Other shapes have no vertices, and show `offset`.
        """
        rows = self.data.shape[0]
        if not isinstance(shape, mi.Mesh) or shape.vertex_count() == rows:
            return
        name = f"mesh '{shape.id()}'" if shape.id() else "mesh"
        raise ConfigError(
            f"{self.plugin}: 'data' has {rows} rows, but the {name} has {shape.vertex_count()} vertices",
            "give one row for each vertex, in the order of the mesh in the scene: `mitex.scenes.mesh_shape` "
            "keeps that of a `mitex.Mesh`, Mitsuba's loaders may split and merge vertices",
        )

    def _lookup(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool) -> Located:
        """`locate`, after a check of the meshes that show the field, and of those looked up, if known."""
        for mesh in loaded_meshes():
            try:
                self.check_shape(mesh)
            except ConfigError:
                if (holds(mesh, self) and is_rendered(mesh)) or _on(mesh, si, active):
                    raise
        return self.locate(si, active)


def _on(shape: mi.Shape, si: mi.SurfaceInteraction3f, active: mi.Bool | bool) -> bool:
    if dr.flag(dr.JitFlag.SymbolicScope):  # a kernel is traced: the points are not known
        return False
    return bool(dr.any(mi.Bool(active) & (si.shape == mi.ShapePtr(shape))))
