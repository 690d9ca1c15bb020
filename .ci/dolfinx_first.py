"""Lets scripts import dolfinx first on the PyPI wheel, whose MPI only `dolfinx_solver` finds."""

import sys


class DolfinxFirst:
    """Imports dolfinx_solver when dolfinx, petsc4py or mpi4py is asked for, and is gone."""

    @staticmethod
    def find_spec(name, path=None, target=None):
        """Find nothing, but see to the order."""
        if name in ("dolfinx", "petsc4py"):
            sys.meta_path.remove(DolfinxFirst)
            import dolfinx_solver  # noqa: F401


sys.meta_path.insert(0, DolfinxFirst)
