"""Mitsuba with the plugins of Mitex, for the variant in use and for every one set later.

Importing this module registers them; it sets no variant::

    import mitex.plugins
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    mi.load_dict({"type": "vertex_field", ...})

Code that needs them takes `init` from here; that of `mitex.runtime` knows no plugin.
"""

from mitex.integrators import feature, lit_shell, motion, shell
from mitex.runtime import init
from mitex.runtime.jit import mi
from mitex.textures import decoded_field, texel_field, vertex_field

__all__ = ["PLUGINS", "init", "register"]

# Each has a function register(), which builds its class for the current variant and registers it.
PLUGINS = (vertex_field, texel_field, decoded_field, feature, motion, shell, lit_shell)


def register() -> None:
    """Registers every plugin for the current variant; Mitsuba forgets them when the variant changes."""
    for plugin in PLUGINS:
        plugin.register()


def _on_variant(_old: str | None, _new: str) -> None:
    register()


mi.detail.add_variant_callback(_on_variant)
if mi.variant() is not None:
    register()
