"""Registers the Mitsuba plugins of Mitex, for the variant in use and for every one chosen later.

Importing this module is enough; it sets no variant::

    import mitex.plugins
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    mi.load_dict({"type": "vertex_field", ...})
"""

from importlib import import_module

from mitex.runtime import load_mitsuba

# Each has a function register(), which builds its class for the current variant and registers it.
MODULES = (
    "mitex.textures.vertex_field",
    "mitex.textures.texel_field",
    "mitex.integrators.feature",
    "mitex.integrators.shell",
)

mi = load_mitsuba(needs_llvm=False)


def register() -> None:
    """Registers every plugin for the current variant; Mitsuba forgets them when the variant changes."""
    for name in MODULES:
        import_module(name).register()


def _on_variant(_old: str | None, _new: str) -> None:
    register()


mi.detail.add_variant_callback(_on_variant)
if mi.variant() is not None:
    register()
