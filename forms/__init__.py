"""What moves: weak forms and their assembly into node-blocked arrays."""

from forms.elasticity import Elasticity
from forms.material import Anisotropic, Isotropic
from forms.support import Support, System

__all__ = ["Anisotropic", "Elasticity", "Isotropic", "Support", "System"]
