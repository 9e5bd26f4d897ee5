"""Synthesizing a texture on a mesh: from exemplar or words, and mesh, to texture file."""

from __future__ import annotations

import math
import os
from functools import partial
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from mitex.cache import content_key
from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.features.text_image import TextImageModel
from mitex.features.text_model import text_image_model
from mitex.geometry.triangles import twice_area
from mitex.mesh import Mesh
from mitex.mesh.fields import vector_field
from mitex.methods.layout import layout_ratio, with_content_layout, with_layout
from mitex.methods.surface.config import PRESETS, WORDS, SurfaceConfig
from mitex.methods.surface.content import content_colours, content_picture
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.surface.scale_map import ScaleMap
from mitex.methods.surface.task import SurfaceTask
from mitex.methods.surface.texture import SurfaceTexture
from mitex.methods.surface.tile import TileDomain
from mitex.methods.surface.words import Words
from mitex.methods.words.wording import check_text, words_options
from mitex.runtime import available_memory
from mitex.training.fit import Run
from mitex.training.lbfgs import Lbfgs
from mitex.training.optim import Adam
from mitex.training.settings import RunOptions

# Peak over precomputation and steps, measured at 512^2 and 1024^2 with bfloat16 features.
BYTES_PER_TEXEL, BYTES_PER_TRIPLE = 3600, 900
VALUES = np.array([128, 256, 768, 1536, 1536])  # that VGG-16 has of each element, block by block


def fit(
    exemplar: Exemplar | str | Path,
    mesh: Mesh | str | Path | None = None,
    out: str | Path | None = None,
    *,
    keep_uvs: bool = False,
    content: str | Path | None = None,
    orientation: np.ndarray | str | Path | None = None,
    scale_map: np.ndarray | str | Path | None = None,
    **options: Unpack[RunOptions],
) -> SurfaceTexture:
    """Synthesizes the look of an exemplar on a mesh; writes a run folder with the texture in it.

    Args:
        exemplar: maps, or what `Exemplar.load` takes.
        mesh: or what `Mesh.load` takes; None for a flat tile that repeats without a seam.
        out: run folder; must be new or empty, or hold a run to resume; None writes no file.
        keep_uvs: use the mesh's own UVs.
        content: style transfer: a texture on the mesh's own UVs (an image file), which are kept then, or "ao"
            for the mesh's ambient occlusion.
        orientation: a vector field that the exemplar's up shall follow, see `mitex.mesh.fields`; else the
            frames follow the config.
        scale_map: where the pattern's size varies: factors of it, see `ScaleMap.of`.
        options: preset ("fast", "noise", "paper", or "style", the default with `content`), and those of
            `RunOptions`.

    Returns:
        The texture, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Cancelled: by `cancel`; a checkpoint has been saved if there is a folder.
        Interrupted: by Ctrl-C, likewise.
    """
    presets = PRESETS if content is None else {"style": PRESETS["style"], **PRESETS}
    run = Run.of(presets, out, **options)
    if run.config.text is not None:
        raise ConfigError("the settings are for words, not for an exemplar", "call `fit_text` for words")
    return _synthesized(run, Exemplar.of(exemplar), mesh, None, keep_uvs, content, orientation, scale_map)


def fit_text(
    text: str,
    mesh: Mesh | str | Path,
    out: str | Path | None = None,
    *,
    exemplar: Exemplar | str | Path | None = None,
    clip: str | os.PathLike[str] | None = None,
    keep_uvs: bool = False,
    content: str | Path | None = None,
    orientation: np.ndarray | str | Path | None = None,
    scale_map: np.ndarray | str | Path | None = None,
    **options: Unpack[RunOptions],
) -> SurfaceTexture:
    """Synthesizes on a mesh what words say; writes a run folder as `fit`.

    Args:
        text: what the mesh is made of, such as "red bricks".
        mesh, out, keep_uvs, content: as of `fit`.
        exemplar: whose features the texture shall have as well; None for words alone.
        clip: CLIP folder, or "words" for the model that ships with Mitex; None for the first that there is.
        orientation, scale_map: as of `fit`, for an exemplar.
        options: preset ("text" or "text-words"), and those of `RunOptions`; by default "text-words" for the
            model that ships with Mitex, else "text".

    Returns:
        The texture, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError, Cancelled, Interrupted: as `fit`.
    """
    inputs = {"text": text, "text_model": clip and os.fspath(clip)}
    run = Run.of(PRESETS, out, **words_options(options, inputs))
    config = run.config
    check_text(config.text, config.preset, WORDS)
    if exemplar is None and (orientation is not None or scale_map is not None):
        raise ConfigError("an orientation or a scale map turns and scales an exemplar", "give `exemplar` too")
    if exemplar is None:
        _check_scale(config)
    else:
        config.exemplar_side()
    model = text_image_model(config.text_model)
    given = Mesh.of(mesh)
    model.encode_texts([config.prompt(given.name)])  # refuses unknown words before the mesh is unwrapped
    target = None if exemplar is None else Exemplar.of(exemplar)
    return _synthesized(run, target, given, model, keep_uvs, content, orientation, scale_map)


def _synthesized(
    run: Run[SurfaceConfig],
    exemplar: Exemplar | None,
    mesh: Mesh | str | Path | None,
    model: TextImageModel | None,
    keep_uvs: bool,
    content: str | Path | None,
    orientation: np.ndarray | str | Path | None,
    scale_map: np.ndarray | str | Path | None,
) -> SurfaceTexture:
    """The texture of a fit from an exemplar, from words in the eyes of a model, or from both."""
    config = run.config
    picture = None if content is None else content_picture(content)
    if mesh is None:
        if keep_uvs or any(option is not None for option in (content, orientation, scale_map)):
            raise ConfigError("a tile takes no UVs, content, orientation or scale map", "leave them out")
        domain: SurfaceDomain = TileDomain.flat(config)
    else:
        given = Mesh.of(mesh)
        upwards = None if orientation is None else vector_field(given, orientation)
        sizes = None if scale_map is None else ScaleMap.of(scale_map, given)
        if picture is None:
            surface = with_layout(given, config.resolution, keep_uvs)
        else:
            surface = with_content_layout(given, ", or `content=ao`")
        ratio = layout_ratio(given, surface, config.resolution, keep_uvs or picture is not None)
        domain = SurfaceDomain.of(surface, config, upwards, sizes, run.folder is not None, ratio)
    run.control.check()
    if exemplar is not None:
        domain.exemplar_side(config)  # refuses a size that it cannot have
    check_memory(domain.mesh, config, 1 if exemplar is None else len(exemplar.maps), domain.steps)
    start = None if content is None else content_colours(picture, domain)
    inputs = {
        "content_key": content_key(start),
        "orientation_key": content_key(domain.orientation),
        "scale_map_key": content_key(domain.factors),
    }
    words = None if model is None else Words(config, model, domain)
    task = SurfaceTask(config, exemplar, domain, start, inputs, words, run.resume)
    origin: dict[str, Any] = {key: getattr(config, key) for key in ("resolution", "frames", "angle")}
    if words is not None:
        origin |= {"text": config.text, "text_model": words.distance.model.name}
    return run.train(
        task,
        str(config.text) if exemplar is None else exemplar.name,
        lambda about: SurfaceTexture(domain, task.in_texel_order(), tuple(task.layout), about | origin),
        **config.schedule,
        optimizer=Lbfgs if config.optimizer == "lbfgs" else partial(Adam, shared=config.shared_moment),
    )


def _check_scale(config: SurfaceConfig) -> None:
    """Refuses a scale for words alone that nothing follows."""
    if config.scale != SurfaceConfig.scale and not config.text_width:
        problem = f"a scale of {config.scale:g} changes nothing without an exemplar, as text_width is 0"
        raise ConfigError(problem, "leave out `scale`, or set text_width")


def check_memory(mesh: Mesh, config: SurfaceConfig, maps: int = 1, steps: np.ndarray | None = None) -> None:
    """Refuses a resolution whose synthesis does not fit into the memory that is free.

    Args:
        mesh: with the texture's UVs.
        config: settings.
        maps: of the exemplar.
        steps: (N,) how far apart the taps of the texels are, if that varies.

    Raises:
        ConfigError: with the estimate.
    """
    assert mesh.uv is not None
    share = 0.5 * np.abs(twice_area(mesh.uv)).sum()
    each = BYTES_PER_TEXEL + BYTES_PER_TRIPLE * (min(config.triples, maps) - 1)
    memory = each * share * config.resolution**2 * (1.0 if steps is None else _crowding(steps))
    free = available_memory()
    if free is not None and memory > free:
        fits = int(config.resolution * math.sqrt(free / memory))
        raise ConfigError(
            f"a texture of {config.resolution}^2 needs about {memory / 1e9:.1f} GB of memory, "
            f"and {free / 1e9:.1f} GB are free",
            f"set resolution to {max(fits, 1)} or less",
        )


def _crowding(steps: np.ndarray) -> float:
    """How many times as many values the network has where taps of texels are `steps` (N,) of them apart.

    Pooling joins texels that are nearer to each other than the taps, so that small steps leave more elements.
    """
    pooled = 2.0 ** np.arange(len(VALUES))
    elements = np.minimum(1.0, (pooled * steps[:, None]) ** -2).mean(axis=0)
    return float(elements @ VALUES / (pooled**-2 @ VALUES))
