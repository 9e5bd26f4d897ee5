"""`OrbitRenderer`: one Mitsuba scene per asset; the object turns, the camera and the lights stay."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mitex.asset import DEFAULT_ALBEDO, DEFAULT_ROUGHNESS, Asset
from mitex.colour import srgb_to_linear
from mitex.errors import ConfigError
from mitex.geometry.tangents import HardSplit, split_at_hard_edges, split_at_seams
from mitex.geometry.triangles import twice_area
from mitex.geometry.vectors import unit
from mitex.mesh import Mesh
from mitex.mesh.mesh import Similarity
from mitex.progress import announce
from mitex.render.framing import FOV, View, fit_view, hull, rotation
from mitex.render.studio import GREY, backdrop, lights
from mitex.runtime import raise_causes

if TYPE_CHECKING:
    from mitex.runtime.jit import mi
from mitex.ranges import DISPLACEMENTS, PIXELS, SAMPLES, elevations
from mitex.runtime.upload import upload

MIN_ROUGHNESS = 0.05
MAX_DEPTH = 4
SAMPLES_PER_PASS = 2**24  # pixels times samples traced at once: an interrupt is heard between passes
VIEW_MARGIN = 0.1  # least cosine between a shading normal and the view, see `_facing`


class OrbitRenderer:
    """Path-traced pictures of one asset from all around.

    Base colour and roughness come from the textures of a baked asset through `texel_field`, else from the
    vertex maps through `vertex_field`; relief from the normal map, of vertices as shading normals. The object
    is normalised to radius 1 and turns about +y in front of a fixed camera, so light always comes from the
    upper left.

    Args:
        asset: what to render.
        resolution: side of the square picture [px], 16 to 4096.
        displacement: b in the offset b h^2 along the vertex normals, h the height map [object radii],
            -0.5 to 0.5. The MeshNCA demo offers -0.1 to 0.1. As there, shading normals stay those of the
            undisplaced surface, since the normal map holds the same relief already; without a normal map
            they are taken from the displaced surface, which is smooth at hard edges too.
        ao: whether ambient occlusion darkens the base colour.
        floating: show the object before plain white instead of standing on a grey sweep.
        like: the mesh that is normalised to radius 1, and stands on the backdrop; the asset moves with it, so
            that several assets can be compared. The asset's own mesh if None.

    Raises:
        ConfigError: an option out of range, or displacement without a height map.
    """

    def __init__(
        self,
        asset: Asset,
        *,
        resolution: int = 512,
        displacement: float = 0.0,
        ao: bool = True,
        floating: bool = False,
        like: Mesh | None = None,
    ):
        from mitex.plugins import init
        from mitex.scenes.shapes import mesh_shape

        init(needs="ad_rgb")
        check_resolution(resolution)
        least, most = DISPLACEMENTS
        if not least <= displacement <= most:
            raise ConfigError(f"displacement {displacement:g} is out of range", f"use {least} to {most}")
        if displacement and "height" not in asset.vertex_maps:
            raise ConfigError("displacement needs a height map", "leave it out or use a model with height")
        self.resolution = resolution
        self._floating, self._ao = floating, ao
        _, similarity = (like or asset.mesh).normalised()
        if asset.atlas is None:  # a vertex for each normal, and for each UV
            split = split_at_hard_edges(asset.mesh)
        else:
            split = split_at_seams(asset.mesh, asset.atlas.uv)
        self._positions, self._normals, self._detail = _surface(asset, split, similarity, displacement)
        framed = self._positions if like is None else similarity.apply(like.vertices)
        self._hull, self._floor = hull(framed), float(framed[:, 1].min())
        material = {"type": "twosided", "bsdf": _bsdf(asset, split, ao)}
        self._scene, self._params = self._build(mesh_shape(asset.mesh, material, smooth=True, split=split))

    def fit_view(self, azimuths: float | Sequence[float] = 0.0, elevation: float = 18.0) -> View:
        """The camera from which the object, at any of the azimuths [degrees], fills the picture.

        Raises:
            ConfigError: the elevation [degrees] is beyond +-85 degrees, or below the floor of the backdrop.
        """
        check_elevation(elevation, self._floating)
        angles = np.radians(np.atleast_1d(np.asarray(azimuths, np.float64)))
        points = np.concatenate([self._hull @ rotation(a).T for a in angles])
        return fit_view(points, math.radians(elevation))

    def render(self, azimuth: float, view: View, spp: int = 64, seed: int = 0) -> np.ndarray:
        """One picture.

        Args:
            azimuth: from where the object is seen [degrees]: 0 is its +z side, 90 its +x side.
            view: the camera, from `fit_view`.
            spp: samples per pixel, 1 to 65536.
            seed: of the noise.

        Returns:
            (H, W, 3) float32 linear radiance; paper white is near 1.

        Raises:
            ConfigError: spp out of range.
        """
        self._turn(azimuth, view)
        return accumulated(self._scene, self.resolution, spp, seed)

    def show(self, asset: Asset) -> None:
        """Changes the look to that of another asset of the same mesh, with the same maps, of the same sizes;
        a new renderer for each would leak memory.
        """
        from mitex.runtime.jit import mi

        assert asset.texture_maps is not None
        albedo, roughness = _material(asset.texture_maps, self._ao)
        values = {"base_color.data": albedo, "roughness.data": roughness}
        if "normal" in asset.texture_maps:
            values["normalmap.data"] = _unmirrored(asset)
        for key in self._params.keys():  # noqa: SIM118
            for name, array in values.items():
                if key.startswith("object.") and key.endswith(name):
                    self._params[key] = upload(mi.TensorXf, np.ascontiguousarray(array, np.float32))
        self._params.update()

    def _build(self, shape: mi.Mesh) -> tuple[mi.Scene, mi.SceneParameters]:
        from mitex.runtime.jit import mi

        scene = {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": MAX_DEPTH, "rr_depth": 99, "hide_emitters": True},
            "sensor": sensor(self.resolution),
            "object": shape,
            **lights(),
        }
        if not self._floating:
            scene["backdrop"] = paper_sweep(self._floor)
        loaded = mi.load_dict(scene)
        return loaded, mi.traverse(loaded)

    def _turn(self, azimuth: float, view: View) -> None:
        """Updates the scene's parameters; a new `load_dict` per picture would leak memory."""
        from mitex.runtime.jit import mi

        turn = rotation(math.radians(azimuth)).T
        positions, normals, detail = (a @ turn for a in (self._positions, self._normals, self._detail))
        shading = _facing(detail, normals, unit(view.origin - positions))
        # Both together: a change of positions alone makes Mitsuba recompute the normals.
        self._params["object.vertex_positions"] = upload(mi.Float, positions.astype(np.float32).ravel())
        self._params["object.vertex_normals"] = upload(mi.Float, shading.astype(np.float32).ravel())
        self._params["sensor.to_world"] = mi.Transform4f().look_at(
            origin=view.origin.tolist(), target=view.target.tolist(), up=[0.0, 1.0, 0.0]
        )
        self._params.update()


def check_resolution(resolution: int) -> None:
    """Raises a ConfigError if a picture's side [px] is out of range."""
    least, most = PIXELS
    if not least <= resolution <= most:
        raise ConfigError(f"a picture of {resolution} pixels is not possible", f"use {least} to {most}")


def check_samples(spp: int) -> None:
    """Raises a ConfigError if the samples per pixel are out of range."""
    least, most = SAMPLES
    if not least <= spp <= most:
        raise ConfigError(f"{spp} samples per pixel are not possible", f"use {least} to {most}")


def check_elevation(elevation: float, floating: bool) -> None:
    """Raises a ConfigError if a camera at this elevation [degrees] would look from below the floor."""
    lowest, highest = elevations(floating)
    if not lowest <= elevation <= highest:
        raise ConfigError(
            f"camera elevation {elevation:.0f} degrees is out of range",
            f"use {lowest:g} to {highest:g}" + ("" if floating else ", or `floating=True`"),
        )


def accumulated(scene: mi.Scene, resolution: int, spp: int, seed: int) -> np.ndarray:
    """(N, N, 3) linear radiance of a scene with a film of `sensor`, over white where it is transparent.

    Raises:
        ConfigError: the samples per pixel are out of range.
    """
    from mitex.runtime.jit import mi

    check_samples(spp)
    level = mi.log_level()
    mi.set_log_level(mi.LogLevel.Error)  # the sampler warns each time it rounds its count up
    per_pass = max(1, min(spp, SAMPLES_PER_PASS // resolution**2))
    passes = math.ceil(spp / per_pass)
    total = np.zeros((resolution, resolution, 4), np.float64)
    try:
        for k in range(passes):
            announce("rendering", k, passes if passes > 1 else 0)
            with raise_causes():
                picture = mi.render(scene, spp=math.ceil(spp / passes), seed=mi.UInt32(seed * 4096 + k))
            total += np.array(picture)
    finally:
        mi.set_log_level(level)
    colour, alpha = total[..., :3] / passes, total[..., 3:] / passes
    return (colour + (1.0 - alpha.clip(0.0, 1.0))).astype(np.float32)


def _surface(
    asset: Asset, split: HardSplit, similarity: Similarity, displacement: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions in the scene, normals and detail normals of the split vertices, (N, 3) float64 each."""
    mesh, normals = asset.mesh.with_vertices(similarity.apply(asset.mesh.vertices)), split.normals
    textured = asset.texture_maps is not None  # relief is the material's then
    detail = normals if textured else asset.detail_normals(split)
    if displacement:
        offset = displacement * asset.vertex_maps["height"] ** 2
        mesh = mesh.with_vertices(mesh.vertices + offset * mesh.normals)
        normals = mesh.normals[split.source]
        if "normal" not in (asset.texture_maps or asset.vertex_maps):
            detail = normals
    positions = mesh.vertices[split.source]
    return positions.astype(np.float64), normals.astype(np.float64), detail.astype(np.float64)


def _bsdf(asset: Asset, split: HardSplit, ao: bool) -> dict[str, object]:
    """The material, from textures if the asset has them, else from the maps of the split vertices."""
    from mitex.plugins import init
    from mitex.runtime.jit import mi

    init(needs="ad_rgb")
    maps, kind = {k: v[split.source] for k, v in asset.vertex_maps.items()}, "vertex_field"
    if asset.texture_maps is not None:
        maps, kind = asset.texture_maps, "texel_field"

    def texture(values: np.ndarray) -> dict[str, object]:
        return {"type": kind, "data": upload(mi.TensorXf, np.asarray(values, np.float32)), "raw": True}

    albedo, roughness = _material(maps, ao)
    bsdf = {
        "type": "principled",
        "base_color": texture(albedo),
        "roughness": texture(roughness),
        "specular": 0.5,
    }
    if asset.texture_maps is None or "normal" not in asset.texture_maps:
        return bsdf
    return {"type": "normalmap", "normalmap": texture(_unmirrored(asset)), "bsdf": bsdf}


def _material(maps: Mapping[str, np.ndarray], ao: bool) -> tuple[np.ndarray, np.ndarray]:
    """Linear base colour (..., 3) and roughness (..., 1)."""
    shape = next(iter(maps.values())).shape[:-1]
    albedo = np.full((*shape, 3), DEFAULT_ALBEDO, np.float32)
    if "albedo" in maps:
        albedo = srgb_to_linear(maps["albedo"])
    if ao and "ambient_occlusion" in maps:
        albedo = albedo * maps["ambient_occlusion"]
    roughness = maps.get("roughness", np.full((*shape, 1), DEFAULT_ROUGHNESS, np.float32))
    return albedo, np.maximum(roughness, MIN_ROUGHNESS)


def _unmirrored(asset: Asset) -> np.ndarray:
    """The normal map as Mitsuba means it: its bitangent is normal x tangent in mirrored charts too."""
    assert asset.atlas is not None and asset.texture_maps is not None
    normals = asset.texture_maps["normal"].copy()
    mirrored = (twice_area(asset.atlas.uv) < 0)[asset.atlas.face] & (asset.atlas.face >= 0)
    normals[mirrored, 1] = 1.0 - normals[mirrored, 1]
    return normals


def _facing(detail: np.ndarray, normals: np.ndarray, to_camera: np.ndarray) -> np.ndarray:
    """Bends shading normals that turn away from the camera although their surface faces it.

    A BSDF is black there, which would draw dark crescents around every bump near the silhouette.
    """
    side = np.sign((normals * to_camera).sum(axis=1, keepdims=True))
    cosine = side * (detail * to_camera).sum(axis=1, keepdims=True)
    return unit(detail + np.maximum(VIEW_MARGIN - cosine, 0.0) * side * to_camera)


def paper_sweep(floor: float) -> mi.Mesh:
    """The backdrop at height `floor` as a Mitsuba shape."""
    from mitex.scenes.shapes import mesh_shape

    paper = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [GREY] * 3}}
    return mesh_shape(backdrop(floor), {"type": "twosided", "bsdf": paper})


def sensor(resolution: int) -> dict[str, object]:
    """A scene's entry for the camera of all pictures: square, with a portrait lens."""
    from mitex.runtime.jit import mi

    return {
        "type": "perspective",
        "fov": math.degrees(FOV),
        "near_clip": 0.01,
        "to_world": mi.ScalarTransform4f().look_at(origin=[0, 0, 6], target=[0, 0, 0], up=[0, 1, 0]),
        # Stratified in all dimensions: at 64 samples a third less noise than independent ones.
        "sampler": {"type": "multijitter"},
        "film": {
            "type": "hdrfilm",
            "width": resolution,
            "height": resolution,
            "pixel_format": "rgba",
            "component_format": "float32",
            "rfilter": {"type": "gaussian"},
        },
    }
