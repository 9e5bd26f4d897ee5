"""Deep geometric texture synthesis (Hertz et al. 2020)."""

from mitex.methods.geometric.config import PRESETS, GeometricConfig
from mitex.methods.geometric.fit import fit
from mitex.methods.geometric.references import REFERENCES
from mitex.methods.geometric.texture import GeometricTexture

__all__ = ["PRESETS", "REFERENCES", "GeometricConfig", "GeometricTexture", "fit"]
