"""Time steps of finite rotation and finite strain that gain no energy, and keep momentum and spin.

    u1 = u0 + dt v0 + e,     v1 = v0 + 2 e / dt,     2 M e / dt^2 + R(u0, u1) = load + p1,

where R is the step's mean internal force (`Hyperelasticity.step_force`), whose work is the change of the
elastic energy and which has no moment. Contact is that of the end of the step: p1 >= 0, g1 >= 0, p1 g1 = 0,
so that it does the work -p1 g0 <= 0, and friction the work -mu p1 |slip|. With the nodes that may touch
massless, and brought into equilibrium where contact plays a part, energy never grows.

Newton's method goes around the contact loop: each iteration is a contact problem for an increment, with the
gaps of the present configuration. Its matrix is constant, 2 M / dt^2 + K / 2 turned with the body, and
Anderson's extrapolation makes good what it lacks; where that fails, the symmetric part of the exact tangent
takes over, damped; where that fails, the step is halved.

Source: Simo and Tarnow, Z. angew. Math. Phys. 43 (1992) 757; Gonzalez, Comput. Methods Appl. Mech. Engrg. 190
(2000) 1763; Khenous, Laborde and Renard, Eur. J. Mech. A/Solids 27 (2008) 918.
"""

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from scipy.sparse import bsr_array

from model.curved.anderson_acceleration import Anderson
from model.dynamics.mass_redistribution import MassRedistribution
from model.dynamics.midpoint import Midpoint
from model.dynamics.time_integrator import State, StepSolver, Touch, Work
from model.finite_strain.moving_body import FiniteBody
from model.finite_strain.turned_solver import TurnedSolver, mean_rotation
from model.node_loop.node_loop import length
from model.problem.contact_problem import ContactProblem
from model.solvers.convergence_record import NotConverged, Record

CONSTANT = 60  # iterations with the constant matrix
EXACT = 40  # iterations with the exact tangent
HALVINGS = 4  # of the step


class FiniteMidpoint(Midpoint):
    """Midpoint.step for finite strain."""

    body: FiniteBody
    halvings = 0

    def step(self, before: State) -> State:
        """Return the state one step later."""
        began, dt = perf_counter(), self.dt
        u0, v0 = before.displacement, before.velocity
        load = self.mean_load(before)
        u1, touch = self._end(before, load)
        change = u1 - u0
        v1 = 2.0 / dt * change - v0
        return self.after(
            before,
            touch,
            began,
            displacement=u1,
            velocity=v1,
            acceleration=(v1 - v0) / dt,
            mean_force=touch.force,
            work=self._work(touch, change, before),
        )
