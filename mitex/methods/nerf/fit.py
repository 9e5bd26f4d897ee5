"""Capturing a texture: from photos to a model file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mitex.mesh import Mesh
from mitex.methods.nerf import files
from mitex.methods.nerf.base.base_shape import face_frames
from mitex.methods.nerf.base.coarse import find_base
from mitex.methods.nerf.capture.capture import Capture, load_capture
from mitex.methods.nerf.config import PRESETS
from mitex.methods.nerf.field.projection import Projection
from mitex.methods.nerf.texture import NerfTexture
from mitex.methods.nerf.training.radiance import learn
from mitex.methods.nerf.training.task import TextureTask
from mitex.runtime import init, keep_freed_memory
from mitex.training import run


def fit(
    capture: Capture | str | Path,
    out: str | Path,
    *,
    base_mesh: Mesh | str | Path | None = None,
    preset: str | None = None,
    config: Path | None = None,
    overrides: Sequence[str] = (),
    resume: bool = False,
    quiet: bool = False,
) -> NerfTexture:
    """Learns a surface with its meso-structure from photos; writes a run folder with the model in it.

    Every eighth view is held out; previews show the first of these. The base shape is found first and mean in
    the user's cache folder.

    Args:
        capture: photos with masks and cameras, or the folder that `load_capture` takes.
        out: run folder; must be new or empty, or hold a run to `resume`.
        base_mesh: the shape without its texture, in the capture's world; None finds it.
        preset: "fast" (default) or "paper".
        config: TOML file with any of `NerfConfig`'s keys.
        overrides: `key=value`, for any key.
        resume: go on from the run's checkpoint, with its config as far as no other is given.
        quiet: show no progress.

    Returns:
        The texture, also saved as `texture.safetensors` in `out`.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Interrupted: a checkpoint has been saved.
    """
    out = Path(out).expanduser()
    settings = run.settings(PRESETS, out, preset, config, overrides, resume)
    photos = capture if isinstance(capture, Capture) else load_capture(capture)
    given = Mesh.load(base_mesh) if isinstance(base_mesh, str | Path) else base_mesh
    if given is not None:
        given = given.with_vertices(photos.similarity.apply(given.vertices))
    init()
    keep_freed_memory()
    training, held_out = photos.split()
    base = find_base(training, settings, given, quiet)
    frames = face_frames(base.mesh)
    projection = Projection(
        base.mesh, neighbours=settings.neighbours, repulsion=settings.repulsion, reach=base.thickness
    )
    task = TextureTask(settings, training, (held_out, 0), projection, frames, base.thickness)
    result = learn(task, settings, out, resume=resume, quiet=quiet)
    about = result.about(photos.name, settings.preset)
    about |= {key: getattr(settings, key) for key in files.SETTINGS}
    about |= {"centre": photos.similarity.center.tolist(), "scale": float(photos.similarity.scale)}
    mean = task.mean
    model = files.Model(
        base,
        frames,
        [mean["tables/f"], mean["tables/phase"]],
        [value for name, value in mean.items() if name.startswith("weights/")],
        mean["light"],
        task.occupancy.occupied,
        about,
    )
    texture = NerfTexture(model)
    texture.save(out / files.NAME)
    return texture
