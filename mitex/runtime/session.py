"""Starting Mitsuba in this process: LLVM first, then the variant."""

import sys
from importlib import import_module
from typing import Any

from mitex.errors import ConfigError, RuntimeUnavailable
from mitex.runtime import llvm, workers
from mitex.runtime.collection import collect_between_kernels
from mitex.runtime.signals import deferred

DEFAULT_VARIANT = "llvm_ad_rgb"


def init(variant: str = DEFAULT_VARIANT, needs: str = "") -> Any:
    """Makes Mitsuba ready and returns the module `mitsuba`; cheap to call again.

    A variant that has been set already stays; use `mitsuba.set_variant` to change it. As `mitex.init` it also
    registers the plugins of Mitex, for the variant in use and for every later one: see `mitex.plugins`.

    Args:
        variant: The variant to set when none is set.
        needs: Parts that the name of the variant in use must have, joined by underscores: "ad" of what is
            computed on whole arrays, "ad_rgb" of pictures.

    Raises:
        ConfigError: This Mitsuba has no such variant, or the one in use lacks what is needed.
        RuntimeUnavailable: Mitsuba is not installed, or the variant needs LLVM and none is usable.
    """
    loaded = sys.modules.get("mitsuba")
    variant = (loaded.variant() if loaded else None) or variant
    mi = load_mitsuba(needs_llvm=variant.startswith("llvm"))
    if variant not in mi.variants():
        names = ", ".join(mi.variants())
        raise ConfigError(f"Mitsuba has no variant '{variant}'", f"choose one of {names}")
    if mi.variant() is None:
        try:
            with deferred():
                mi.set_variant(variant)
        except ImportError as e:
            raise RuntimeUnavailable(
                f"Mitsuba cannot start '{variant}' ({e})", "choose another variant or run `mitex doctor`"
            ) from e
    check_variant(needs)
    return mi


def check_variant(needs: str) -> None:
    """Checks the variant that the program has chosen, if it has; loads nothing.

    Args:
        needs: As of `init`.

    Raises:
        ConfigError: The variant lacks what is needed.
    """
    loaded = sys.modules.get("mitsuba")
    variant = loaded.variant() if loaded else None
    if variant is not None and not set(filter(None, needs.split("_"))) <= set(variant.split("_")):
        raise ConfigError(
            f"this does not work in Mitsuba's variant '{variant}', which is in use",
            f"call mitsuba.set_variant('{DEFAULT_VARIANT}') first, or do it in another process",
        )


def load_mitsuba(needs_llvm: bool = True) -> Any:
    """Imports Mitsuba with a usable LLVM, sets no variant, and returns the module.

    Args:
        needs_llvm: Whether the lack of a usable LLVM is an error; scalar and CUDA variants do without.

    Raises:
        RuntimeUnavailable: Mitsuba cannot be imported, or LLVM is needed and none is usable.
    """
    if "drjit" not in sys.modules:
        try:
            llvm.select_llvm()
        except RuntimeUnavailable:
            if needs_llvm:
                raise
    try:
        with deferred():
            mi = import_module("mitsuba")
            dr = import_module("drjit")
    except ImportError as e:
        raise RuntimeUnavailable(
            f"Mitsuba cannot be imported ({e})", "run `pip install 'mitsuba>=3.9,<3.10'` in this environment"
        ) from e
    if needs_llvm:
        _check_loaded_llvm(dr)
    workers.apply_thread_count()
    collect_between_kernels()
    return mi


def _check_loaded_llvm(dr: Any) -> None:
    """Refuses what Dr.Jit has opened, before a kernel is compiled with it: that would end the process."""
    major, minor, patch = dr.detail.llvm_version()
    if major >= llvm.OLDEST:
        return
    what = f"with LLVM {major}.{minor}.{patch}, which is too old" if major >= 0 else "without a usable LLVM"
    library, verdict = llvm.find_llvm()  # says better what is wrong if there is none
    raise RuntimeUnavailable(
        f"Dr.Jit was loaded {what}",
        f"call `mitex.init()` before the first import of mitsuba or drjit, or set {llvm.VARIABLE}="
        f"{library.path} (LLVM {verdict.version}) before starting Python",
    )
