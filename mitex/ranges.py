"""Least and largest values, which the library and, before it loads anything, the command line check."""

SEEDS = (0, 2**32 - 1)
TEXELS = (16, 8192)  # along the side of a map
SCALES = (0.05, 20)  # of a pattern
TURNS = (-360, 360)  # of a camera, or of a pattern on a surface [degrees]
EVEN_VERTICES = (12, 2_000_000)  # of a mesh that is remeshed

# Of path-traced pictures and films.
PIXELS = (16, 4096)  # along the side
SAMPLES = (1, 65536)  # of a pixel
EXPOSURES = (-10, 10)  # [stops]
DISPLACEMENTS = (-0.5, 0.5)  # [radii of the mesh]
FRAMES = (2, 3600)
FRAME_RATES = (1, 60)  # [1/s]


def elevations(floating: bool) -> tuple[float, float]:
    """Of a camera [degrees]: what stands on a floor is not seen from below."""
    return (-85 if floating else 0), 85
