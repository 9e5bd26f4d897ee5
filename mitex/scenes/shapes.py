"""A `Mesh` as a shape of Mitsuba scenes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mitex.geometry.tangents import HardSplit, Split
from mitex.mesh import Mesh
from mitex.plugins import init
from mitex.runtime.jit import mi
from mitex.runtime.upload import upload


def mesh_shape(
    mesh: Mesh,
    bsdf: mi.BSDF | Mapping[str, Any] | None = None,
    smooth: bool = False,
    split: HardSplit | None = None,
) -> mi.Mesh:
    """A Mitsuba mesh with the vertices of `mesh` in their order, or with those of a split.

    Mitsuba keeps one normal and one UV for each vertex, a `Mesh` has them for each corner of a face. With
    UVs, split the vertices first::

        split = mitex.geometry.tangents.split_at_seams(mesh, mesh.uv)
        shape = mesh_shape(mesh, bsdf, split=split)

    Values at the vertices of `mesh` are then `values[split.source]` at those of the shape, which is the order
    of rows that a `vertex_field` needs. Without a split it is the order of `mesh`, and the shape has no UVs.

    Args:
        mesh: the mesh.
        bsdf: a Mitsuba BSDF or its dictionary, or None for the default one.
        smooth: shade with vertex normals: those of the split, or without one those that Mitsuba finds. If
            vertices are moved later, Mitsuba finds new ones.
        split: of `mesh`, by `split_at_seams`, or `split_at_hard_edges` for normals without UVs.
    """
    init()
    props = mi.Properties()
    if bsdf is not None:
        props["bsdf"] = mi.load_dict(dict(bsdf)) if isinstance(bsdf, Mapping) else bsdf
    vertices, faces = mesh.vertices, mesh.faces
    if split is not None:
        vertices, faces = vertices[split.source], split.faces
    shape = mi.Mesh(
        mesh.name,
        len(vertices),
        len(faces),
        has_vertex_normals=smooth,
        has_vertex_texcoords=isinstance(split, Split),
        props=props,
    )
    params = mi.traverse(shape)
    params["vertex_positions"] = upload(mi.Float, vertices.ravel())
    params["faces"] = upload(mi.UInt32, faces.astype(np.uint32).ravel())
    if isinstance(split, Split):
        params["vertex_texcoords"] = upload(mi.Float, split.uv.ravel())
    params.update()
    if smooth and split is not None:  # last: with new positions, Mitsuba finds its own
        params["vertex_normals"] = upload(mi.Float, split.normals.ravel())
        params.update()
    return shape
