# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # The rod against a wall: smaller steps, finer meshes, error against run time
#
# With the same mesh and ever smaller dt, each kick of Newmark's held node lasts shorter and weighs more: its
# energy grows, while that of the stabilised schemes settles. With h and dt halved together, dt = 2 h (central
# differences: 0.8 h), a scheme of second order shows order
# $\tfrac32 \cdot \tfrac23 = 1$ in L2 on a displacement with a kink, and $\tfrac12 \cdot \tfrac23 = \tfrac13$
# on a pressure that jumps (Brenner, Thomée and Wahlbin, 1975): fronts are smeared over a width $h^{2/3}$. At
# the release the wall cuts such a front off before its tail has passed; the rod leaves late by as much, and
# from there on the displacement is of order 2/3. Orders are measured on the two finest meshes.

# %%
import warnings

import numpy as np
from bodies import rod
from harness.scene import Scene

from model import UnresolvedWaves, integrate
from model.closed_forms.rod import RodImpact
from model.dynamics.schemes import IMPLICIT, SCHEMES
from model.figures.figures import convergence_figure

scene = Scene("rod_orders", "The rod against a wall: smaller steps, finer meshes, error against run time.")
scene.built("M", "K").left_out("C", "friction", "gmsh", "pyvista")
exact = RodImpact()
warnings.simplefilter("ignore", UnresolvedWaves)  # a wave with a sharp front is resolved by no dt
rod = scene.assembly(rod)


def impact(name, moving, dt, until=3.0):
    """Relative errors of a run by kind, its last energy, its run time, and its residual."""
    scheme, x = SCHEMES[name](moving, dt), moving.coordinates[:, 0]
    first = scheme.start(np.column_stack([exact.displacement(x, 0.0), 0 * x]))
    squares, pressure, seconds, residual = [], [], scheme.setup_seconds, 0.0
    for state in integrate(scheme, first, round(until / dt)):
        squares.append(np.mean((state.displacement[:, 0] - exact.displacement(x, state.time)) ** 2) / 0.25**2)
        pressure.append(state.contact_force[:, 0].sum() - exact.contact_pressure(state.time))
        seconds, residual = seconds + state.seconds, max(residual, state.residual)
    v = state.velocity.ravel()
    energy = (moving.strain_energy(state.displacement) + 0.5 * v @ (scheme.M @ v)) / exact.energy
    errors = {
        "displacement until release": np.sqrt(np.mean(squares[: int(1.9 / dt)])),
        "displacement": np.sqrt(np.mean(squares)),
        "pressure": np.sqrt(np.mean(np.square(pressure)) * until) / 0.5,
        "energy": abs(energy - 1.0),
    }
    return errors, energy, seconds, residual


# %%
moving = rod(200)
steps = (0.02, 0.01, 0.005) if scene.quick else (0.02, 0.01, 0.005, 0.0025, 0.00125, 0.000625)
energies = {name: [impact(name, moving, dt)[1] for dt in scene.progress(steps, name)] for name in IMPLICIT}
for name, values in energies.items():
    scene.result(f"energy_at_end[{name},dt={steps[-1]:g}]", values[-1] / 8, "J", 1 / 8, "closed form")
picture = convergence_figure(np.array(steps), energies, "dt (s)", "energy at t = 3 over the true one")
scene.figure(picture, "energy_against_dt")

# %%
elements = (25, 50, 100) if scene.quick else (25, 50, 100, 200, 400, 800)
EXPECTED = {"displacement until release": 1.0, "displacement": 2 / 3, "pressure": 1 / 3, "energy": None}
errors = {kind: {name: [] for name in SCHEMES} for kind in EXPECTED}
seconds, residuals = {name: [] for name in SCHEMES}, []
for count in scene.progress(elements, "meshes"):
    moving = rod(count)
    for name in SCHEMES:
        found, _, spent, residual = impact(name, moving, (0.8 if "central" in name else 2.0) / count)
        for kind, value in found.items():
            errors[kind][name].append(value)
        seconds[name].append(spent)
        residuals.append(residual)
for kind, expected in EXPECTED.items():
    lines, key = errors[kind], kind.replace(" ", "_")
    for name, values in lines.items():
        order = np.log2(values[-2] / values[-1])
        scene.result(f"order_of_{key}[{name}]", order, "1", expected, expected and "a scheme of second order")
        scene.result(f"error_of_{key}[{name},h=1/{elements[-1]}]", values[-1], "relative", 0.0)
    label = f"relative error of the {kind}"
    h, slope = 1 / np.array(elements), expected and round(expected, 2)
    scene.figure(convergence_figure(h, lines, "h (m)", label, slope), f"order_of_{key}")
    scene.figure(convergence_figure(seconds, lines, "run time (s)", label), f"{key}_against_run_time")

# %%
scene.finish(
    dofs=moving.coordinates.size,
    contact_candidates=moving.contact_nodes.size,
    sweeps=0,
    cycles=0,
    work_units=0,
    solve_seconds=sum(map(sum, seconds.values())),
    residual=max(residuals),
)
