"""Mitsuba and Dr.Jit, on an LLVM that works: `from mitex.runtime.jit import dr, mi`, wherever either is used.

Dr.Jit opens its LLVM when it is imported, so Mitex chooses one before. No variant is set; `init` does that.
Types such as `mi.Float` are those of the variant in use: they are looked up when a function runs, and
signatures name them under `from __future__ import annotations`. Type checkers read `jit.pyi`.
"""

from mitex.runtime.session import load_mitsuba

mi = load_mitsuba(needs_llvm=False)
import drjit as dr  # noqa: E402  (only now, see above)

__all__ = ["dr", "mi"]
