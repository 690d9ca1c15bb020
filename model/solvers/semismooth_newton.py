"""The small dense contact problem with friction: semismooth Newton, and pivoting where it fails.

A Newton step solves for what the loop has decided (free, slip, stick), the friction force of slipping nodes
following their pressure and slip; the loop then decides again. A chain of steps counts if the natural
residual falls (a watchdog, Chamberlain et al., Math. Program. Study 16 (1982)). Otherwise pivoting decides
from nothing. Where that comes to no end, or the law is not Coulomb's, or the problem in space is large, the
friction bounds are held at what they are. That leaves a convex problem,

    J(u) = 1/2 u.S u - b.u + sum bound |slip|  is least over  gap + n.u >= 0,                           (1)

which sweeps and damped Newton steps solve from anywhere, J falling (Graeser and Sander, IMA J. Numer. Anal.
39 (2019)); Coulomb's law is the fixed point bound = mu p.

Everything here is in the frames of the nodes: component 0 along the normal, the others along the tangents.
The sweep and the residual are those of the whole problem. `bound` is the address of the friction law.
"""

from typing import NamedTuple

import numpy as np
from numba import cfunc, njit
from scipy.linalg.lapack import dpotrf, dpotri

from model.node_loop.blocks import BlockMatrix, generalised_inverses
from model.node_loop.contact_sweep import (
    FREE,
    SLIP,
    STICK,
    Candidates,
    contact_sweeps,
    place_all_on_surface,
)
from model.node_loop.friction_laws import SIGNATURE, FrictionLaw, allowed
from model.node_loop.friction_tangent import friction_tangent
from model.node_loop.natural_residual import natural_residual
from model.solvers.iterative_refinement import ROUNDING
from model.solvers.pivoting import contact_by_pivoting
from model.solvers.projected_newton import free_modes, null_space, project_newton

CHAIN = 12  # Newton steps that may pass before the residual must have fallen
ENOUGH = 0.1  # of the residual: a Newton step that leaves no more needs no sweep to mend it
PATIENCE = 20  # chains, pivotings and convex problems without half the residual
STEPS = 30  # of a convex problem
EDGES = 8  # of the polygon that stands for a friction disc where pivoting decides
ROWS = (
    300  # of a tableau of polygons: a pivot takes 0.1 ms, of 1,200 rows 3 ms, and there are as many as rows
)
POLYGONS = 4  # one after the other, each turned to the last one's answer
HALVINGS = 10  # of a Newton step whose energy does not fall

residual_2d, residual_3d = natural_residual(2, True), natural_residual(3, True)
sweeps_2d, sweeps_3d = contact_sweeps(2, True), contact_sweeps(3, True)


@cfunc(SIGNATURE, cache=True)
def held_bound(pressure, slip, node):
    """The bound that is held, as a friction law."""
    return node[0]


class SmallProblem:
    """The contact problem of k nodes with a dense matrix, along s components each: the normal, or all.

    Parameters
    ----------
    W : (k s, k s)
        Displacements under unit forces with the pins at rest, in the frames of the nodes.
    G : (k s, p)
        Displacements when the pins move by a unit.
    resistance : (p, p)
        What the pins resist by themselves.
    springs : (k, d, d) or None
        Springs that hold the nodes, in their frames. W and G are then along all d components.
    sides : int
        s.
    friction : FrictionLaw or None
        The law; None where s = 1.
    steps : (1,) int
        Counts steps of Newton and of pivoting.
    """

    def __init__(
        self,
        W: np.ndarray,
        G: np.ndarray,
        resistance: np.ndarray,
        springs: np.ndarray | None,
        sides: int,
        friction: FrictionLaw | None,
        steps: np.ndarray,
    ):
        S, Y, Z = bordered_inverse(W, G, resistance)
        S = symmetric(S)
        free = np.eye(G.shape[1])[:, np.abs(resistance).sum(axis=0) == 0.0]
        total, T, R, k = S, np.zeros((0, 0)), np.zeros((0, 0)), W.shape[0] // sides
        if springs is not None:
            d = springs.shape[1]
            k, C = len(springs), block_diagonal(springs)
            if free.size:
                free = free @ null_space(C @ G @ free, np.abs(C).max() * np.abs(G).max())
            G, total = G.reshape(k, d, -1)[:, :sides].reshape(k * sides, -1), S + C
            if sides < d:
                along = np.arange(k * d) % d > 0
                T = np.ascontiguousarray(
                    np.linalg.pinv(total[np.ix_(along, along)], rcond=1e-13, hermitian=True)
                )
                across = total[np.ix_(~along, along)]
                R = across @ T
                total = total[np.ix_(~along, ~along)] - R @ across.T
        self.arrays = Condensed(
            np.ascontiguousarray(total),
            np.ascontiguousarray(S),
            Y,
            Z,
            T,
            R,
            G @ free,
            BlockMatrix(
                np.arange(0, k * k + 1, k, dtype=np.uint64),
                np.tile(np.arange(k, dtype=np.uint32), k),
                np.empty((k * k, sides, sides)),
            ),
            np.arange(k),
            np.arange(k, dtype=np.int32),
            np.arange(k, dtype=np.uint32),
            np.empty((k, sides, sides)),
            np.empty((k, sides, sides)),
            np.empty((k, sides, sides)),
            steps,
        )
        prepare(self.arrays)
        self._bound = None if friction is None else friction.address

    def solve(
        self,
        whole: "Whole",
        active: np.ndarray,
        slip_rate: float,
        tolerance: float,
        slight: float,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Find the forces that the nodes miss, all others in equilibrium.

        Parameters
        ----------
        whole : Whole
            Its status is updated in place.
        active : (k,)
            The numbers among the candidates of the nodes of this problem.
        slip_rate : float
            What slip is multiplied by for the friction law.
        tolerance : float
            Natural residual at which to stop; rounding may stop it earlier, which the caller's own residual
            will tell.
        slight : float
            Force that is taken for rounding where it drives a rigid mode.

        Returns
        -------
        force : (k, d)
            Forces of the road that are missing.
        pins : (p,)
            Displacements of the pins.
        move : (k, s) or (k, d)
            Displacements of the nodes from u, in their frames; with springs along all d components.
        """
        force, pins = np.empty((active.size, whole.u.shape[1])), np.empty(whole.power.size)
        moved = np.empty((active.size, self.arrays.whole.shape[0] // active.size))
        solve_active(
            self.arrays,
            whole,
            active,
            force,
            pins,
            moved,
            self._bound,
            held_bound.address,
            slip_rate,
            tolerance,
            slight,
        )
        return force, pins, moved


def block_diagonal(blocks: np.ndarray) -> np.ndarray:
    """The matrix (k d, k d) of blocks (k, d, d) on its diagonal."""
    k, d = blocks.shape[:2]
    full = np.zeros((k, d, k, d))
    full[np.arange(k), :, np.arange(k)] = blocks
    return full.reshape(k * d, k * d)


def symmetric(S: np.ndarray) -> np.ndarray:
    """S with its lower triangle on both sides."""
    return np.tril(S) + np.tril(S, -1).T


def bordered_inverse(
    W: np.ndarray, G: np.ndarray, resistance: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Blocks S (k, k), Y (k, p), Z (p, p) of the inverse of [[W, G], [G^T, -resistance]]."""
    k, p = G.shape
    if p == 0:
        factor, trouble = dpotrf(W, lower=1)
        S = np.linalg.inv(W) if trouble else dpotri(factor, lower=1)[0]
        return S, np.zeros((k, 0)), np.zeros((0, 0))
    w, g = W.diagonal().mean() or 1.0, np.abs(G).max()
    inverse = np.linalg.inv(np.block([[W / w, G / g], [G.T / g, -resistance * (w / g**2)]]))
    return inverse[:k, :k] / w, inverse[:k, k:] / g, inverse[k:, k:] * (w / g**2)


class Whole(NamedTuple):
    """What the small problem is told of the whole.

    Attributes
    ----------
    candidates : Candidates
        All of them, n.
    u, free : (N, d)
        Displacement, and where it would go from there with the known forces alone and the pins at rest.
    power : (p,)
        Work of the known forces when the pins move by a unit.
    gap, after : (n,)
        Gaps at u, and as they would be by what has been found so far: where to start.
    known : (n, d)
        Known forces of the road.
    status : (n,)
        First guess.
    """

    candidates: Candidates
    u: np.ndarray
    free: np.ndarray
    power: np.ndarray
    gap: np.ndarray
    after: np.ndarray
    known: np.ndarray
    status: np.ndarray


class Condensed(NamedTuple):
    """The arrays of a small problem.

    Attributes
    ----------
    S : (k s, k s) stiffness, with springs
    whole : (k e, k e) stiffness along e = s components, or with springs along all d
    Y, Z : (k e, p), (p, p) what moves the pins
    T, R : where e > s, what the other components do by themselves, and pass on
    G : (k s, m) rigid modes, S G = 0
    blocks : BlockMatrix, S once more
    nodes, number, order : (k,) 0, 1, 2, ...
    frame : (k, s, s) unit matrices: the problem is in the nodes' frames already
    block, inverse : (k, s, s) diagonal blocks of S, and their inverses
    steps : (1,) steps of Newton and of pivoting so far
    """

    S: np.ndarray
    whole: np.ndarray
    Y: np.ndarray
    Z: np.ndarray
    T: np.ndarray
    R: np.ndarray
    G: np.ndarray
    blocks: BlockMatrix
    nodes: np.ndarray
    number: np.ndarray
    order: np.ndarray
    frame: np.ndarray
    block: np.ndarray
    inverse: np.ndarray
    steps: np.ndarray


@njit(cache=True, error_model="numpy")
def prepare(arrays):
    """Fill in what else follows from the stiffness."""
    k, s = arrays.block.shape[:2]
    S = arrays.S
    for c in range(k):
        for e in range(k):
            for a in range(s):
                for b in range(s):
                    arrays.blocks.data[c * k + e, a, b] = S[c * s + a, e * s + b]
        for a in range(s):
            for b in range(s):
                arrays.frame[c, a, b] = 1.0 if a == b else 0.0
                arrays.block[c, a, b] = S[c * s + a, c * s + b]
    generalised_inverses(arrays.block, arrays.nodes, arrays.inverse)


@njit(cache=True, error_model="numpy")
def solve_active(
    arrays,
    whole,
    active,
    force,
    pins,
    moved,
    bound,
    held,
    slip_rate,
    tolerance,
    slight,
):
    """Fill `force` (k, d; global), `pins`, `moved` (k, e) and the status (n,) of the active candidates."""
    candidates, u, free, power, gap, after, known, status = whole
    k, s = arrays.block.shape[:2]
    d = force.shape[1]
    e = moved.shape[1]
    target, load, local = np.empty(k * e), np.zeros(k * e), np.zeros((k, s))
    b, move = np.zeros((k, s)), np.zeros((k, s))
    gaps, state, found = np.empty(k), np.empty((k, candidates.state.shape[1])), np.empty((k, s))
    reference, decided = np.empty((k, s - 1)), np.empty(k, dtype=status.dtype)
    for j in range(k):
        c = active[j]
        i = candidates.nodes[c]
        gaps[j], state[j], decided[j] = gap[c], candidates.state[c], status[c]
        for a in range(e):
            go, been, push = 0.0, 0.0, 0.0
            for m in range(d):
                go += candidates.frame[c, a, m] * free[i, m]
                been += candidates.frame[c, a, m] * u[i, m]
                push += candidates.frame[c, a, m] * known[c, m]
            target[j * e + a] = go
            if a < s:
                local[j, a] = push
                load[j * e + a] = -push
            if 0 < a < s:
                reference[j, a - 1] = candidates.reference[c, a - 1] - been
    for i in range(k * e):
        for j in range(k * e):
            load[i] += arrays.whole[i, j] * target[j]
        for q in range(power.size):
            load[i] += arrays.Y[i, q] * power[q]
    others = k * (e - s)
    for j in range(k):
        for a in range(s):
            b[j, a] = load[j * e + a]
        for i in range(others):
            b[j, 0] -= arrays.R[j, i] * load[i // (e - 1) * e + i % (e - 1) + 1]
    # a node's own stiffness, for that which is left of it in S may be none
    own = arrays.block if bound is None else candidates.block[active]
    contact = Candidates(arrays.nodes, arrays.number, arrays.frame, own, gaps, reference, state)
    if bound is None:
        move[:, 0] = after[active] - gaps
        project_newton(arrays, contact, b[:, 0], move, decided, found, slight)
    else:
        solve_small(arrays, contact, b, move, decided, found, bound, held, slip_rate, tolerance, slight)
    moved[:, :s] = move
    for i in range(others):
        along = 0.0
        for j in range(others):
            along += arrays.T[i, j] * load[j // (e - 1) * e + j % (e - 1) + 1]
        for j in range(k):
            along -= arrays.R[j, i] * move[j, 0]
        moved[i // (e - 1), i % (e - 1) + 1] = along
    for q in range(power.size):
        pins[q] = 0.0
        for m in range(power.size):
            pins[q] -= arrays.Z[q, m] * power[m]
        for i in range(k * e):
            pins[q] += arrays.Y[i, q] * (moved[i // e, i % e] - target[i])
    for j in range(k):
        c = active[j]
        status[c] = decided[j]
        for m in range(d):
            force[j, m] = 0.0
            for a in range(s):
                force[j, m] += candidates.frame[c, a, m] * (found[j, a] - local[j, a])


@njit(cache=True, error_model="numpy")
def linear_unknowns(status, d):
    """Numbers of the unknowns that are linear at present: free nodes whole, slip nodes along the surface."""
    numbers = np.empty(status.size * d, dtype=np.int64)
    count = 0
    for c in range(status.size):
        for a in range(d):
            if status[c] == FREE or (status[c] == SLIP and a > 0):
                numbers[count] = c * d + a
                count += 1
    return numbers[:count]


@njit(cache=True, error_model="numpy")
def residual_of(arrays, contact, b, u, status, R, force, bound, slip_rate):
    """Fill R and the admissible forces; return the natural residual."""
    if u.shape[1] == 2:
        residual_2d(arrays.blocks, b, u, contact, status, bound, slip_rate, R, force)
    else:
        residual_3d(arrays.blocks, b, u, contact, status, bound, slip_rate, R, force)
    missing = np.sqrt(np.sum(R**2))
    scale = np.sqrt(np.sum(b**2)) + np.sqrt(np.sum(force**2))
    return missing / scale if scale > 0.0 else 0.0  # nothing pushes, nothing is missing


@njit(cache=True, error_model="numpy")
def sweep(arrays, contact, b, u, status, bound, slip_rate):
    """Visit every node once."""
    condensed = Candidates(
        arrays.nodes,
        arrays.number,
        arrays.frame,
        arrays.block,
        contact.gap,
        contact.reference,
        contact.state,
    )
    loop = (1, arrays.blocks, arrays.inverse, b, u, arrays.order, condensed, status, bound, slip_rate)
    if u.shape[1] == 2:
        sweeps_2d(*loop)
    else:
        sweeps_3d(*loop)


@njit(cache=True, error_model="numpy")
def energy(arrays, contact, b, u):
    """J with held friction bounds, 1/2 u.S u - b.u + sum bound |slip|, and the rounding of its sums."""
    d = u.shape[1]
    total, size = 0.0, 0.0
    for c in range(u.shape[0]):
        slip = 0.0
        for a in range(d):
            s = -2.0 * b[c, a]
            for j in range(u.shape[0]):
                for e in range(d):
                    s += arrays.S[c * d + a, j * d + e] * u[j, e]
            total += 0.5 * s * u[c, a]
            size += abs(s * u[c, a]) + abs(b[c, a] * u[c, a])
            if a > 0:
                slip += (u[c, a] - contact.reference[c, a - 1]) ** 2
        total += contact.state[c, 0] * np.sqrt(slip)
    return total, 4 * ROUNDING * size


@njit(cache=True, error_model="numpy")
def part_until_rest(S, contact, u, R, force, status, numbers, step):
    """Part of a Newton step at which elastic energy and friction's work (present pressures) are least.

    Slip that would turn round stops instead: where friction alone holds the body, Newton's step has no end.
    """
    d = u.shape[1]
    slope, curvature = 0.0, 0.0
    for row in range(numbers.size):
        c, a = numbers[row] // d, numbers[row] % d
        slope -= step[row] * (R[c, a] - (force[c, a] if status[c] == SLIP else 0.0))
        for column in range(numbers.size):
            curvature += step[row] * S[numbers[row], numbers[column]] * step[column]
    low, high = 0.0, 1.0
    for count in range(100):
        part = 0.5 * (low + high) if count > 1 else 1.0 - count  # both ends first
        power, row = slope + part * curvature, 0
        while row < numbers.size:
            c = numbers[row] // d
            if status[c] != SLIP:
                row += 1
                continue
            friction, speed, slip = 0.0, 0.0, 0.0
            for a in range(1, d):  # of a slipping node all tangential unknowns are among the numbers
                s = u[c, a] - contact.reference[c, a - 1] + part * step[row]
                friction += force[c, a] ** 2
                speed += s * step[row]
                slip += s * s
                row += 1
            if slip > 0.0:
                power += np.sqrt(friction / slip) * speed
        if (count == 0 and power <= 0.0) or (count == 1 and power >= 0.0):
            return 1.0  # downhill all the way, or not at all
        if power > 0.0:
            high = part
        else:
            low = part
    return high


@njit(cache=True, error_model="numpy")
def newton_step(arrays, contact, u, status, R, force, bound, slip_rate, slight):
    """Step (k d,) for the unknowns that are linear at present, friction following the pressure and slip."""
    S, d = arrays.S, u.shape[1]
    arrays.steps[0] += 1
    numbers, whole = linear_unknowns(status, d), np.zeros(u.size)
    if numbers.size == 0:
        return whole
    by_pressure, support = np.empty_like(force), np.empty((force.shape[0], d, d))
    friction_tangent(contact, u, R, force, status, bound, slip_rate, by_pressure, support)
    J = np.empty((numbers.size, numbers.size))
    missing = np.empty(numbers.size)
    largest, fixed = 0.0, np.ones(u.size, dtype=np.bool_)
    for row in range(numbers.size):
        missing[row], fixed[numbers[row]] = R[numbers[row] // d, numbers[row] % d], False
        for column in range(numbers.size):
            J[row, column] = S[numbers[row], numbers[column]]
        largest = max(largest, abs(J[row, row]))
        c, a = numbers[row] // d, numbers[row] % d
        for column in range(numbers.size if status[c] == SLIP else 0):
            J[row, column] -= by_pressure[c, a] * S[c * d, numbers[column]]
            if numbers[column] // d == c:
                J[row, column] += support[c, a, numbers[column] % d]
    N = not_turned(free_modes(arrays.G, fixed), support, numbers, largest)
    drive = N.T @ missing
    if np.sum(drive**2) > slight**2 + 1e-3 * np.sum(missing**2):
        step = N @ drive
        part = part_until_next(contact, u, status, numbers, step)
    else:
        try:
            step = np.linalg.solve(J + largest * (N @ N.T), missing - N @ drive)
        except Exception:  # exactly singular: these slips have no unique answer
            return whole
        part = part_until_rest(S, contact, u, R, force, status, numbers, step)
    for row in range(numbers.size):
        whole[numbers[row]] = part * step[row]
    return whole


@njit(cache=True, error_model="numpy")
def not_turned(N, support, numbers, largest):
    """Modes N (l, z) of which friction does not resist that it would have to turn with the slip."""
    d, rubbed = support.shape[1], np.zeros(N.shape)
    for row in range(numbers.size):
        c, a = numbers[row] // d, numbers[row] % d
        for other in range(numbers.size):
            if numbers[other] // d == c:
                rubbed[row] += support[c, a, numbers[other] % d] * N[other]
    sizes, directions = np.linalg.eigh(N.T @ rubbed)
    return N @ directions[:, sizes <= ROUNDING * largest].copy()


@njit(cache=True, error_model="numpy")
def part_until_next(contact, u, status, numbers, step):
    """Part of a rigid motion until the next node comes to the road, or slips no further; 0 if none does."""
    d, part, row = u.shape[1], np.inf, 0
    while row < numbers.size:
        c, components = numbers[row] // d, d if status[numbers[row] // d] == FREE else d - 1
        speed, square = 0.0, 0.0
        if components == d:
            if step[row] < 0.0:
                part = min(part, max(contact.gap[c] + u[c, 0], 0.0) / -step[row])
        else:
            for a in range(1, d):
                speed += step[row + a - 1] * (u[c, a] - contact.reference[c, a - 1])
                square += step[row + a - 1] ** 2
            if speed < 0.0:
                part = min(part, -speed / square)
        row += components
    return part if part < np.inf else 0.0


@njit(cache=True, error_model="numpy")
def corrected(contact, u, status, step, bound):
    """Displacement and status after a step (k d,).

    Who arrives on the road sticks if the way to where it would stick takes no more than friction gives, with
    its neighbours at rest, as `place_on_road` has it; the next sweep decides.
    """
    trial, decided = u + step.reshape(u.shape), status.copy()
    for c in range(status.size):
        if status[c] != FREE or contact.gap[c] + trial[c, 0] >= 0.0:
            continue
        way = -trial[c]
        way[0] -= contact.gap[c]
        way[1:] += contact.reference[c]
        force = contact.block[c] @ way
        sticks = np.sum(force[1:] ** 2) <= allowed(bound, max(force[0], 0.0), 0.0, contact.state[c]) ** 2
        decided[c] = STICK if sticks else SLIP
    place_all_on_surface(contact, trial, decided)
    return trial, decided


@njit(cache=True, error_model="numpy")
def descend(arrays, contact, b, u, status, R, force, held, slip_rate, tolerance, slight):
    """Solve with the friction bounds held in contact.state, a convex problem.

    Sweeps lower the energy, and so does as much of Newton's step as does: truncated nonsmooth Newton.
    """
    for _ in range(STEPS):
        sweep(arrays, contact, b, u, status, held, slip_rate)
        residual = residual_of(arrays, contact, b, u, status, R, force, held, slip_rate)
        if residual <= tolerance:
            break
        least, rounding = energy(arrays, contact, b, u)
        step = newton_step(arrays, contact, u, status, R, force, held, slip_rate, slight)
        for _ in range(HALVINGS):
            trial, decided = corrected(contact, u, status, step, held)
            if energy(arrays, contact, b, trial)[0] < least + rounding:
                u[:], status[:] = trial, decided
                break
            step *= 0.5


@njit(cache=True, error_model="numpy")
def solve_small(arrays, contact, b, u, status, force, bound, held, slip_rate, tolerance, slight):
    """Fill u (k, d), status (k,) and force (k, d) with the solution, status being the first guess as well."""
    R = np.empty_like(u)
    place_all_on_surface(contact, u, status)
    best = residual_of(arrays, contact, b, u, status, R, force, bound, slip_rate)
    idle, lowest = 0, best
    pivots = u.shape[1] == 2 or u.shape[0] * (1 + EDGES) <= ROWS
    kept, kept_status = u.copy(), status.copy()
    while idle < PATIENCE:
        enough = max(tolerance, rounding_of(arrays, b, u, force))
        if best <= enough:
            break
        trial, decided, after = u, status, best
        for _ in range(CHAIN):
            step = newton_step(arrays, contact, trial, decided, R, force, bound, slip_rate, slight)
            trial, decided = corrected(contact, trial, decided, step, bound)
            after = residual_of(arrays, contact, b, trial, decided, R, force, bound, slip_rate)
            if after < ENOUGH * best:
                after = rest(arrays, contact, b, trial, decided, R, force, bound, slip_rate)
                break
            sweep(arrays, contact, b, trial, decided, bound, slip_rate)
            after = residual_of(arrays, contact, b, trial, decided, R, force, bound, slip_rate)
            if after < best:
                break
        if after >= best:
            residual_of(arrays, contact, b, u, status, R, force, bound, slip_rate)
            trial, decided, after = u.copy(), status.copy(), best
            if pivots:
                pivots = False
                after = pivoted(
                    arrays, contact, b, trial, decided, R, force, bound, slip_rate, enough, slight
                )
            else:
                bounds = np.empty((status.size, 1))
                for c in range(status.size):
                    slip = slip_rate * slip_of(contact, u, status, c)
                    bounds[c, 0] = allowed(bound, force[c, 0], slip, contact.state[c])
                convex = with_state(contact, bounds)
                descend(arrays, convex, b, trial, decided, R, force, held, slip_rate, 0.1 * best, slight)
                after = residual_of(arrays, contact, b, trial, decided, R, force, bound, slip_rate)
        idle = 0 if after < 0.5 * lowest else idle + 1
        u[:], status[:], best = trial, decided, after
        if best < lowest:
            kept[:], kept_status[:], lowest = u, status, best
    u[:], status[:], best = kept, kept_status, lowest
    residual_of(arrays, contact, b, u, status, R, force, bound, slip_rate)


@njit(cache=True, error_model="numpy")
def slip_of(contact, u, status, c):
    """Length of the slip of candidate c; 0 where it does not slip."""
    return np.sqrt(np.sum((u[c, 1:] - contact.reference[c]) ** 2)) if status[c] == SLIP else 0.0


@njit(cache=True, error_model="numpy")
def rest(arrays, contact, b, u, status, R, force, bound, slip_rate):
    """Let nodes stick whose friction is less than it would be in slip; return the natural residual."""
    for c in range(status.size):
        most = allowed(bound, force[c, 0], 0.0, contact.state[c])
        if status[c] == SLIP and np.sum(force[c, 1:] ** 2) < (1 - 1e-9) * most**2:
            status[c] = STICK
    place_all_on_surface(contact, u, status)
    return residual_of(arrays, contact, b, u, status, R, force, bound, slip_rate)


@njit(cache=True, error_model="numpy")
def rounding_of(arrays, b, u, force):
    """Natural residual that the rounding of S u alone may leave."""
    size = np.abs(arrays.S) @ np.abs(u).copy().reshape(u.size)
    scale = np.sqrt(np.sum(b**2)) + np.sqrt(np.sum(force**2))
    return 2 * ROUNDING * np.sqrt(np.sum(size**2)) / scale if scale > 0.0 else 1.0


@njit(cache=True, error_model="numpy")
def with_state(contact, state):
    """The candidates with another state."""
    return Candidates(
        contact.nodes,
        contact.number,
        contact.frame,
        contact.block,
        contact.gap,
        contact.reference,
        state,
    )


@njit(cache=True, error_model="numpy")
def pivoted(arrays, contact, b, u, status, R, force, bound, slip_rate, tolerance, slight):
    """Set u and status to what pivoting and Newton's steps from there find; return the natural residual.

    In space each node's polygon touches the disc where the friction of the last answer points.
    """
    k, d = u.shape
    mu, best = np.empty(k), np.inf
    trial, decided = u.copy(), status.copy()
    for _ in range(1 if d == 2 else POLYGONS):
        for c in range(k):
            p = force[c, 0] if force[c, 0] > 0.0 else 1.0
            slip = slip_rate * slip_of(contact, trial, decided, c)
            mu[c] = allowed(bound, p, slip, contact.state[c]) / p
        ways = directions(force)
        trial, found, _, count = contact_by_pivoting(arrays.S, b, contact.gap, contact.reference, mu, ways)
        decided = found.astype(status.dtype)
        arrays.steps[0] += count
        for _ in range(CHAIN):
            place_all_on_surface(contact, trial, decided)
            after = residual_of(arrays, contact, b, trial, decided, R, force, bound, slip_rate)
            if after < best:
                u[:], status[:], best = trial, decided, after
            if best <= tolerance:
                return best
            step = newton_step(arrays, contact, trial, decided, R, force, bound, slip_rate, slight)
            trial = trial + step.reshape(u.shape)
    return residual_of(arrays, contact, b, u, status, R, force, bound, slip_rate)


@njit(cache=True, error_model="numpy")
def directions(force):
    """Directions (k, m, d - 1) along the surface, the first against each node's friction."""
    k, d = force.shape
    ways = np.empty((k, 2 if d == 2 else EDGES, d - 1))
    for c in range(k):
        if d == 2:
            ways[c, 0, 0], ways[c, 1, 0] = 1.0, -1.0
            continue
        first = np.arctan2(-force[c, 2], -force[c, 1])
        for a in range(EDGES):
            angle = first + 2.0 * np.pi * a / EDGES
            ways[c, a, 0], ways[c, a, 1] = np.cos(angle), np.sin(angle)
    return ways
