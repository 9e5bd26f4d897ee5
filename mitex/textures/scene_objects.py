"""Which meshes show a texture.

A Mitsuba texture is not told what it is put on, and while a kernel is traced no lookup knows its shape. But
Dr.Jit lists all shapes, and those that show a texture hold it.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cache
from typing import Any

from mitex.runtime.jit import dr, mi


def loaded_meshes() -> list[mi.Mesh]:
    """All meshes of the current variant, of whichever scene."""
    meshes: list[mi.Mesh] = []

    def visit(shape: mi.Mesh | None, nothing: mi.Float) -> mi.Float:
        # All shapes come as meshes, and None where one was freed.
        if shape is not None and shape.is_mesh():
            meshes.append(shape)
        return nothing

    dr.dispatch(dr.zeros(mi.MeshPtr), visit, mi.Float(0))
    return meshes


def is_rendered(shape: mi.Shape) -> bool:
    """Whether a shape belongs to the scene that is rendered, or to none that the callers know of.

    A kernel is traced for the materials of all scenes, also of one that was given up but is still in memory.
    The scene that is rendered is in the innermost function that has any.
    """
    frame = inspect.currentframe()
    while frame is not None:
        scenes = [value for value in frame.f_locals.values() if isinstance(value, mi.Scene)]
        if scenes:
            return any(holds(scene, shape) for scene in scenes)
        frame = frame.f_back
    return True


def holds(thing: mi.Object, part: Any) -> bool:
    """Whether an object of a scene has the object `part` somewhere inside."""
    return any(value.ptr == part.ptr or holds(value, part) for value in nested(thing).values())


def nested(thing: mi.Object) -> dict[str, mi.Object]:
    """The objects that an object of a scene holds, by parameter name."""
    callback = _collector(mi.variant())()
    thing.traverse(callback)
    return callback.objects


@cache
def _collector(_variant: str) -> Callable[[], Any]:
    """The class of callbacks that keep objects: one for each variant, not for each call."""

    class Collector(mi.TraversalCallback):
        def __init__(self) -> None:
            super().__init__()
            self.objects: dict[str, mi.Object] = {}

        def put(self, key: str, value: object, *_flags: object) -> None:
            if isinstance(value, mi.Object):
                self.objects[key] = value

    return Collector
