"""A small dense contact problem in which every node is a candidate: the node loop, helped by Newton steps."""

import numpy as np

from .blocks import BlockMatrix
from .contact_loop import FREE, SLIP, STICK, place_all_on_surface
from .friction import FrictionLaw
from .loop import NodeLoop

CHAIN = 12  # Newton steps that may pass before the residual must have fallen


class SmallProblem:
    """The contact problem of k nodes with a dense matrix.

    The loop alone would solve it; Newton steps on what the loop has decided (free, slip, stick) make it quick. A chain of steps
    that does not lower the natural residual is dropped, and the loop goes on alone for longer: contact sets that flip for ever are left to it.

    Parameters
    ----------
    A : BlockMatrix
        Dense, symmetric positive definite, k block rows with all k blocks in order.
    normal : (k, d)
        Unit normals.
    friction : FrictionLaw or None
        The law.
    """

    def __init__(self, A: BlockMatrix, normal: np.ndarray, friction: FrictionLaw | None):
        k, d = A.indptr.size - 1, A.data.shape[1]
        self.loop = NodeLoop(A, np.arange(k), normal, friction)
        dense = A.data.reshape(k, k, d, d)
        self.dense = dense.transpose(0, 2, 1, 3).reshape(k * d, k * d)
        self.turned = np.einsum("iab,ijbc,jec->iaje", self.loop.frame, dense, self.loop.frame, optimize=True)

    def solve(self, status: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Solve the problem the loop is aimed at.

        Parameters
        ----------
        status : (k,)
            First guess, updated in place.
        tolerance : float
            Natural residual at which to stop; rounding may stop it earlier, which the caller's own residual will tell.

        Returns
        -------
        displacement (k, d), contact force (k, d), status (k,)
        """
        loop = self.loop
        u = np.zeros(loop.shape)
        place_all_on_surface(loop.contact, u, status)
        loop.hold_sticking(u, status)
        best = loop.residual(u, status)
        sweeps, idle = 1, 0
        while best > max(tolerance, min(self._rounding(u), 1e-8)) and idle < 20:
            trial, trial_status, after = self._newton_chain(u, status, best)
            if after < best:
                idle = 0 if after < 0.5 * best else idle + 1
                u, status, best, sweeps = trial, trial_status, after, 1
                continue
            idle += 1
            loop.sweep(u, status, sweeps)
            best = loop.residual(u, status)
            sweeps = min(4 * sweeps, 1024)
        loop.residual(u, status)
        return u, loop.force, status

    def _newton_chain(self, u, status, best):
        """Newton steps, each followed by a sweep, until the residual falls below `best`; it may rise on the way."""
        loop = self.loop
        u, status = u.copy(), status.copy()
        for _ in range(CHAIN):
            before = status.copy()
            u += self._newton_step(u, status)
            place_all_on_surface(loop.contact, u, status)
            status[(before == FREE) & (status == SLIP)] = STICK  # who touches sticks a priori; the sweep decides
            loop.hold_sticking(u, status)
            loop.sweep(u, status)
            after = loop.residual(u, status)
            if after < best:
                break
        return u, status, after

    def _rounding(self, u: np.ndarray) -> float:
        """Natural residual that rounding alone can cause at displacement u (k, d)."""
        size = np.abs(self.dense) @ np.abs(u).ravel()
        return 4e-16 * float(np.linalg.norm(size)) / (self.loop.load_size + float(np.linalg.norm(self.loop.force)) or 1.0)

    def _newton_step(self, u: np.ndarray, status: np.ndarray) -> np.ndarray:
        """Solve for the unknowns that are linear at present: free nodes whole, slip nodes along the surface with their friction following."""
        loop = self.loop
        k, d = loop.shape
        linear = np.zeros((k, d), dtype=bool)
        linear[status == FREE] = True
        linear[status == SLIP, 1:] = True
        missing = np.einsum("iab,ib->ia", loop.frame, loop.R)
        J = self.turned
        if loop.friction is not None and np.any(status == SLIP):
            J = J.copy()
            self._follow_friction(J, u, status)
        step = np.zeros((k, d))
        if linear.any():
            mask = linear.ravel()
            square = J.reshape(k * d, k * d)[np.ix_(mask, mask)]
            # nothing may hold the body yet: let it fall the right way, not where rounding points
            square[np.diag_indices_from(square)] += 1e-13 * np.abs(square.diagonal()).max()
            try:
                step[linear] = np.linalg.solve(square, missing[linear])
            except np.linalg.LinAlgError:  # no unique slip: leave it to the loop
                return step
        return np.einsum("iab,ia->ib", loop.frame, step)

    def _follow_friction(self, J: np.ndarray, u: np.ndarray, status: np.ndarray) -> None:
        """Subtract from J (k, d, k, d) the derivative of the friction force of each slipping node."""
        loop = self.loop
        bound = loop.friction.bound.ctypes
        frame, contact = loop.frame, loop.contact
        force = np.einsum("iab,ib->ia", frame, loop.force)
        slip = np.einsum("iab,ib->ia", frame[:, 1:], u) - contact.reference
        for i in np.flatnonzero(status == SLIP):
            size = np.linalg.norm(force[i, 1:])
            if size == 0.0:
                continue
            direction = force[i, 1:] / size
            p, m, state = force[i, 0], loop.slip_rate * np.linalg.norm(slip[i]), contact.state[i]
            dp, dm = 1e-6 * p + 1e-300, 1e-6 * m + 1e-300
            by_pressure = (bound(p + dp, m, state) - bound(p, m, state)) / dp
            by_slip = loop.slip_rate * (bound(p, m + dm, state) - bound(p, m, state)) / dm
            J[i, 1:] -= by_pressure * direction[:, None, None] * J[i, 0][None]
            # the force points against the slip: |slip| grows by -direction . slip
            outer = np.outer(direction, direction)
            J[i, 1:, i, 1:] += by_slip * outer
            if m > 0.0:
                J[i, 1:, i, 1:] += loop.slip_rate * size / m * (np.eye(outer.shape[0]) - outer)
