"""What moves: weak forms and their assembly into node-blocked arrays."""

from forms.elasticity import Elasticity
from forms.hyperelasticity import Hyperelasticity
from forms.material import Anisotropic, Isotropic
from forms.own_forms import assemble
from forms.strain_energies import Cords, MooneyRivlin, NeoHookean, StrainEnergy, StVenantKirchhoff
from forms.support import Support
from forms.system import System

__all__ = [
    "Anisotropic",
    "Cords",
    "Elasticity",
    "Hyperelasticity",
    "Isotropic",
    "MooneyRivlin",
    "NeoHookean",
    "StVenantKirchhoff",
    "StrainEnergy",
    "Support",
    "System",
    "assemble",
]
