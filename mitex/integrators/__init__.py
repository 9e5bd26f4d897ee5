"""The integrators of Mitex as Mitsuba plugins; `import mitex.plugins` registers them.

`feature` images all channels of a texture, `shell` path-traces scenes with a radiance field. The docstrings
of the classes are the reference, in the form of those in `mitex.textures`.
"""

from mitex.integrators.feature import FeatureIntegrator
from mitex.integrators.shell import ShellIntegrator

__all__ = ["FeatureIntegrator", "ShellIntegrator"]
