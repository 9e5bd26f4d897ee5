"""Synthesizing a texture on a mesh: from exemplar and mesh to texture file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from mitex.atlas import unwrap, usable_uv
from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.mesh import Mesh
from mitex.methods.surface.cache import cached_levels, content_key
from mitex.methods.surface.config import PRESETS, SurfaceConfig
from mitex.methods.surface.content import AO, content_colours
from mitex.methods.surface.exponential import GeodesicTracer
from mitex.methods.surface.frames import tangent_frames
from mitex.methods.surface.levels import POOLS, Levels
from mitex.methods.surface.taps import Surroundings, build
from mitex.methods.surface.task import SurfaceTask
from mitex.methods.surface.texels import Texels
from mitex.methods.surface.texture import NAME, SurfaceTexture
from mitex.training import resolve, run, train

PADDING = 2  # texels between charts: bilinear taps of one never see the other


def fit(
    exemplar: Exemplar | str | Path,
    mesh: Mesh | str | Path,
    out: str | Path,
    *,
    preset: str | None = None,
    config: Path | None = None,
    overrides: Sequence[str] = (),
    keep_uvs: bool = False,
    content: str | Path | None = None,
    resume: bool = False,
    quiet: bool = False,
) -> SurfaceTexture:
    """Synthesizes the look of an exemplar on a mesh; writes a run folder with the texture in it.

    Args:
        exemplar: maps, or what `Exemplar.load` takes.
        mesh: or what `Mesh.load` takes.
        out: run folder; must be new or empty, or hold a run to `resume`.
        preset: "fast" (default), "paper", or "style" (default with `content`).
        config: TOML file with any of `SurfaceConfig`'s keys.
        overrides: `key=value`, for any key.
        keep_uvs: use the mesh's own UVs.
        content: style transfer: a texture on the mesh's own UVs (an image file), which are kept then, or "ao"
            for the mesh's ambient occlusion.
        resume: go on from the run's checkpoint, with its config as far as no other is given.
        quiet: show no progress.

    Returns:
        The texture, also saved as `texture.safetensors` in `out`.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Interrupted: a checkpoint has been saved.
    """
    out = Path(out).expanduser()
    config = run.checked_config(out, resume, config)
    if content is not None and config is None:
        preset = preset or "style"
    settings = resolve(PRESETS, preset, config, overrides)
    shown = exemplar if isinstance(exemplar, Exemplar) else Exemplar.load(exemplar)
    image = content is not None and str(content) != AO
    surface = with_layout(mesh if isinstance(mesh, Mesh) else Mesh.load(mesh), settings, keep_uvs or image)
    assert surface.uv is not None
    texels = Texels.rasterize(surface, surface.uv, settings.resolution)
    identity = f"{surface.name} {content_key(surface.vertices, surface.faces, surface.uv)}"
    start = None if content is None else content_colours(content, surface, texels)
    task = SurfaceTask(settings, shown, texels, find_levels(surface, texels, settings), identity, start)
    result = train(
        task,
        settings,
        out,
        lr=settings.lr,
        milestones=settings.milestones,
        decay=settings.decay,
        shared_moment=settings.shared_moment,
        checkpoint_every=settings.checkpoint_every,
        preview_every=settings.preview_every,
        resume=resume,
        quiet=quiet,
    )
    about = {
        "name": shown.name,
        "preset": settings.preset,
        "resolution": settings.resolution,
        "frames": settings.frames,
        "angle": settings.angle,
        "steps": result.steps,
        "seconds": round(result.seconds, 1),
    }
    if math.isfinite(result.loss):
        about["loss"] = result.loss
    texture = SurfaceTexture(surface, task.in_texel_order(), tuple(task.layout), about)
    texture.save(out / NAME)
    return texture


def with_layout(mesh: Mesh, config: SurfaceConfig, keep_uvs: bool) -> Mesh:
    """The mesh with the UVs that its texels shall have.

    Raises:
        ConfigError: its own are wanted but missing, out of range or overlapping.
    """
    if not keep_uvs:
        return replace(mesh, uv=unwrap(mesh, config.resolution, PADDING))
    if mesh.uv is None:
        raise ConfigError(f"mesh '{mesh.name}' has no UVs to keep", "leave out --keep-uvs")
    if not usable_uv(mesh, mesh.uv):
        raise ConfigError(
            f"the UVs of mesh '{mesh.name}' overlap, leave [0, 1] or are incomplete",
            "leave out --keep-uvs to have it unwrapped",
        )
    return mesh


def find_levels(mesh: Mesh, texels: Texels, config: SurfaceConfig) -> Levels:
    """The levels of a surface, from the cache if it has been seen before."""
    assert mesh.uv is not None
    angle = math.radians(config.angle)
    count = POOLS + config.scales
    options = (config.resolution, config.frames, angle, config.correct, count)

    def find() -> Levels:
        right, up = tangent_frames(mesh, texels.face, texels.barycentric, config.frames, angle)
        return build(Surroundings(texels, GeodesicTracer(mesh), right, up, config.correct), count)

    return cached_levels(content_key(mesh.vertices, mesh.faces, mesh.uv, *options), find)
