"""The integrators of Mitex as Mitsuba plugins; `import mitex.plugins` registers them.

`feature` images all channels of a texture, `motion` how fast a vector field moves on the picture, `shell`
and `lit_shell` path-trace scenes with a radiance field, in its own light or in that of the scene. The
docstrings of the classes are the reference, in the form of those in `mitex.textures`.
"""

from mitex.integrators.feature import FeatureIntegrator
from mitex.integrators.lit_shell import LitShellIntegrator
from mitex.integrators.motion import MotionIntegrator
from mitex.integrators.shell import ShellIntegrator

__all__ = ["FeatureIntegrator", "LitShellIntegrator", "MotionIntegrator", "ShellIntegrator"]
