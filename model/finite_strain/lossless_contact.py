"""Energy-momentum steps in which frictionless contact takes no energy at all: rolling without resistance.

Nodes that may touch carry no mass. So they are in equilibrium at the end of every step, pressed by the road
or free, and the elastic energy is a function W of the other nodes alone, smooth however contacts come and go.
A step keeps the energy if the forces on the other nodes do exactly the work by which W changes. Those of the
step stress miss it by the work of the forces at massless nodes, f . (u1 - u0), most of which is p1 g0 / 2
where a node touches down; a stress a (C1 - C0), with one small number a for the whole body, makes it up:

    a fhat . du (other nodes) = W1 - W0 - f . du (other nodes) - friction . slip.

It has neither sum nor moment. What is left of the energy's change is what friction takes, mu p1 |slip|; on a
road that bends too, for the normal forces have no part in it.

Contact is exact at the ends of steps, and the mean force of a step on the massless nodes is along the normal,
or in friction's cone, to the order of the step only. Where there is no friction, what it has along the road
is taken off again, its sum and its moment, by a rigid acceleration of all masses: so momentum along the road
and spin about its normal are kept as the energy is.

Source: the reduced energy after Khenous, Laborde and Renard, Eur. J. Mech. A/Solids 27 (2008) 918; a stress
along C1 - C0 after O. Gonzalez, Comput. Methods Appl. Mech. Engrg. 190 (2000) 1763; that contact can be made
to keep the energy within a step after T. A. Laursen and G. R. Love, Int. J. Numer. Meth. Engng 53 (2002) 245.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from model.dynamics.time_integrator import State, Touch, Work
from model.finite_strain.energy_momentum import EnergyMomentum
from model.finite_strain.moving_body import FiniteBody
from model.node_loop.node_loop import along_road
from model.problem.rigid_modes import rigid_motions
from model.solvers.convergence_record import NotConverged

STILL = 1e-14  # mean square of C1 - C0 that is rounding


class LosslessContact(EnergyMomentum):
    """The energy-momentum method with contact that takes no energy; parameters as for `EnergyMomentum`.

    For roads of any shape, and for what rolls, or bounces often: there `EnergyMomentum` loses p1 g0 whenever
    a node touches down. Steps in contact cost a third more, and vibrations that an impact has excited stay. A
    step for which no such `a` is found is halved, and at last taken as `EnergyMomentum` takes it; its loss is
    in the ledger.

    Examples
    --------
    >>> from forms import Hyperelasticity, NeoHookean
    >>> from geometry import Body, Plane, rectangle
    >>> from model import FiniteBody, LosslessContact
    >>> rubber = Hyperelasticity(Body.from_grid(rectangle(2.0, 1.0, 6, 4)), NeoHookean(E=1e4, nu=0.3))
    >>> weight, road = rubber.body_force((0.0, -10.0)), Plane((0.0, -0.001))
    >>> scheme = LosslessContact(FiniteBody.from_forms(rubber, 1.0, weight, road, "bottom"), dt=0.005)
    >>> state = scheme.run(scheme.start(), 5)
    >>> bool(state.gap.min() == 0.0)  # it has landed
    True
    """

    name = "energy-momentum, lossless contact"
    bends = True
    part_missing = 0.1  # nothing else is taken, so that what is missing shows in the energy
    part_inside = 0.01

    def __init__(self, body: FiniteBody, dt: float, **options: Any):
        super().__init__(body, dt, **options)
        self._lossless = False
        self._inner = np.setdiff1d(np.arange(len(body.coordinates)), body.contact_nodes)
        volume = body.elastic.body_force(np.eye(body.dim)[0]).sum()
        self._still = STILL * float(volume)
        flat = (
            not body.elastic.axisymmetric
        )  # a ring about an axis has one rigid motion, across the road or along
        self._slides_freely = body.friction is None and not self.body.supported and flat

    def _end(self, before: State) -> tuple[np.ndarray, Touch]:
        """Return the displacement (N, d) at the end of a step, and what touches there."""
        self._lossless, self._energy = before.count > 0, self.body.strain_energy(before.displacement)
        found = None if self._lossless else super()._end(before)
        if found is not None and found[1].count == 0:
            return found
        self._lossless = True
        try:
            u1, touch = super()._end(before)
        except NotConverged:
            if self.halvings:
                raise
            self._lossless = False
            return super()._end(before) if found is None else found
        return u1, replace(touch, force=2.0 * touch.force)

    def _missing(
        self, before: State, load: np.ndarray, u1: np.ndarray, touch: Touch | None
    ) -> tuple[np.ndarray, float]:
        """Return what is missing (N, d), at massless nodes half of it at the end, and the size of forces."""
        missing, scale = super()._missing(before, load, u1, touch)
        if self._lossless:
            nodes = self.body.contact_nodes
            rest = 0.5 * (load - self.body.surface.internal_force(u1))[nodes]
            missing[nodes] = np.where(self.body.prescribed[nodes], 0.0, rest)
        return missing, scale

    def _internal(self, before: State, load: np.ndarray, u1: np.ndarray, touch: Touch | None) -> np.ndarray:
        """Return the step's internal force (N, d), a fhat included."""
        body, nodes, inner, u0 = self.body, self.body.contact_nodes, self._inner, before.displacement
        f = body.forces.step_force(u0, u1)
        if self._lossless and touch is not None:  # the guess is too far off to tell
            du, fhat = u1 - u0, body.forces.rate_force(u0, u1)
            if self._slides_freely:
                rigid = RigidPush(self.M, body.coordinates + 0.5 * (u0 + u1), nodes)
                f += rigid(along_road(f[nodes] - load[nodes], self._normal))
                fhat += rigid(along_road(fhat[nodes], self._normal))
            outer = load[nodes] + 2.0 * along_road(touch.force, self._normal)
            wanted = body.strain_energy(u1) - self._energy - float(np.vdot(outer, du[nodes]))
            wanted -= float(np.vdot(f[inner], du[inner]))
            work = float(np.vdot(fhat[inner], du[inner]))
            f += wanted * work / (work**2 + self._still**2) * fhat
        self._of_road = f[nodes] - load[nodes]
        return f

    def _mean_force(self, touch: Touch) -> np.ndarray:
        """Mean contact force (n, d) of a step."""
        if not self._lossless:
            return touch.force
        along = along_road(self._of_road, self._normal) if self._slides_freely else 0.0
        return self._of_road - along

    def _contact_work(self, touch: Touch, change: np.ndarray, before: State) -> Work:
        """Work and impulse of the contact forces of a step."""
        work = super()._contact_work(touch, change, before)
        return replace(work, normal=0.0, numerical=0.0) if self._lossless else work

    def _settle(self, state: State) -> float:
        """Bring the massless nodes into equilibrium where they are not yet."""
        return 0.0 if self._lossless else super()._settle(state)


class RigidPush:
    """Forces of a rigid acceleration of all masses, with the sum and the moment of forces at some nodes.

    Parameters
    ----------
    M : sparse (N d, N d)
    x : (N, d)
        Where the nodes are.
    nodes : (n,)
    """

    def __init__(self, M: Any, x: np.ndarray, nodes: np.ndarray):
        motions = rigid_motions(x)
        flat = motions.reshape(x.size, -1)
        self._inertia, self._at = M @ flat, motions[nodes]
        self._masses = flat.T @ self._inertia

    def __call__(self, force: np.ndarray) -> np.ndarray:
        """Return the forces (N, d) for forces (n, d) at the nodes."""
        wrench = np.einsum("cap,ca->p", self._at, force)
        return (self._inertia @ np.linalg.solve(self._masses, wrench)).reshape(-1, force.shape[1])
