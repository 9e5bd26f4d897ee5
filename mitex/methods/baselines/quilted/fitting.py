"""Quilting a picture of a captured texture: from its model to another one."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Unpack

import numpy as np

from mitex.methods.baselines.quilted import METHOD
from mitex.methods.baselines.quilted.albedo import in_even_light, quilted_albedo
from mitex.methods.baselines.quilted.config import PRESETS
from mitex.methods.baselines.quilted.texture import QuiltedTexture
from mitex.methods.nerf.synthesis.patch_images import render_patches
from mitex.methods.nerf.texture import NerfTexture
from mitex.training.fit import Run
from mitex.training.settings import RunOptions


def fit(
    texture: NerfTexture | str | Path, out: str | Path | None = None, **options: Unpack[RunOptions]
) -> QuiltedTexture:
    """Quilts pictures of a texture's patches, seen from above; writes a run folder with the result in it.

    Args:
        texture: captured, or what `NerfTexture.load` takes.
        out: run folder; must be new or empty; None writes no file.
        options: those of `RunOptions` but `steps` and `resume`; `on_step` is not called.

    Returns:
        The picture, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
    """
    run = Run.of(PRESETS, out, **options)
    captured = texture if isinstance(texture, NerfTexture) else NerfTexture.load(texture)
    config, name = run.config, str(captured.about["name"])

    def quilted(about: dict[str, Any]) -> QuiltedTexture:
        rng = np.random.default_rng(config.seed)
        patches = captured.patches(rng, config.patches)
        pictures = render_patches(captured.shell, patches)
        if config.relit:
            base, light = captured.model.base.mesh, np.array(captured.light)
            about = {**about, "light": light.tolist()}
            pictures = in_even_light(patches, pictures, base, light)
        size, evenness = (config.size, config.size), None if config.even else 0.0
        image = quilted_albedo(patches, pictures, size, rng, tileable=True, evenness=evenness)
        return QuiltedTexture(image, patches.gap, about)

    return run.compute(METHOD.name, name, quilted, captured=name)
