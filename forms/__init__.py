"""What moves: weak forms and their assembly into node-blocked arrays."""

from forms.elasticity import Elasticity
from forms.material import Anisotropic, Isotropic
from forms.support import Support
from forms.system import System, assemble

__all__ = ["Anisotropic", "Elasticity", "Isotropic", "Support", "System", "assemble"]
