# pyright: reportMissingModuleSource=false
import drjit as dr

from mitex.runtime import mitsuba_types as mi

__all__ = ["dr", "mi"]
