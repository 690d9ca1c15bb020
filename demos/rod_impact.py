# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # A rod against a wall: why plain Newmark is not enough
#
# A rod of length, density and modulus 1 is held at $x = 1$ and may touch a wall with its end $x = 0$. It
# starts at rest, evenly compressed, its end half a length away from the wall:
#
# $$ \ddot u = u'', \qquad u(1, t) = 0, \qquad u(0, t) \ge 0, \qquad u(x, 0) = \tfrac{1 - x}{2}. \tag{1} $$
#
# D'Alembert's waves give everything: the end touches for $1 < t < 2$, the wall presses with exactly 1/2 all
# that time, the energy is 1/8 for ever, and the motion repeats with period 3. In space the rod is a strip of
# quadrilaterals one element high with $\nu = 0$ and $u_y = 0$, which is the rod exactly; in time it is
#
# - **Newmark**, $\beta = 1/4$, $\gamma = 1/2$, the paper's. Its energy changes in a step by
#   $\tfrac12 \sum (p^n + p^{n+1})(g^{n+1} - g^n)$, and a node held on the wall keeps its speed, with the
#   sign flipping every step;
# - **HHT** and **generalised alpha**, which damp what oscillates;
# - **contact-stabilised Newmark**, which lets no speed carry a node into the wall, and never gains energy;
# - **mass redistribution**, which leaves the node at the wall no mass to bounce with, and never gains either;
# - **central differences**, explicit, on a lumped mass.

# %%
import warnings
from time import perf_counter
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
from harness.scene import Scene

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, rectangle
from model import History, MovingBody, UnresolvedWaves, march
from model.closed_forms.rod import RodImpact
from model.dynamics.schemes import IMPLICIT, SCHEMES
from model.dynamics.step_problem import save_step
from model.figures.figures import LOOKS, convergence_figure

exact = RodImpact()
scene = Scene("rod_impact", "A rod against a wall: what exact contact does to time integrators.")
scene.built("M", "K")
scene.left_out("C", "friction", "gmsh")
warnings.simplefilter("ignore", UnresolvedWaves)  # a wave with a sharp front is resolved by no dt
assembly_seconds = 0.0


# %%
def strip(elements):
    """Rod of so many elements, the wall at its left end."""
    global assembly_seconds
    began = perf_counter()
    body = Body.from_grid(rectangle(1.0, 1.0, elements, 1))
    support = Support(body).fix("right", x=0.0).fix("top", y=0.0).fix("bottom", y=0.0)
    elasticity = Elasticity(body, Isotropic(E=1.0, nu=0.0), "plane stress")
    nothing, wall = np.zeros_like(body.coordinates), Plane(normal=(1.0, 0.0))
    moving = MovingBody.from_forms(elasticity, 1.0, nothing, wall, "left", support)
    assembly_seconds += perf_counter() - began
    return moving


def impact(name, moving, dt, recorded=False, until=3.0):
    """Run to time `until`; return errors of displacement and pressure (L2), last energy, and run time."""
    scheme = SCHEMES[name](moving, dt)
    x = moving.coordinates[:, 0]
    start = np.zeros_like(moving.coordinates)
    start[:, 0] = exact.displacement(x, 0.0)
    first = scheme.start(start)
    history = History(scheme, first, {"end": int(np.argmin(x))}) if recorded else None
    pressed = first
    squares, pressure, seconds = [], [], scheme.setup_seconds
    for state in march(scheme, first, round(until / dt), history):
        squares.append(np.mean((state.displacement[:, 0] - exact.displacement(x, state.time)) ** 2) / 0.25**2)
        pressure.append(state.contact_force[:, 0].sum() - exact.contact_pressure(state.time))
        seconds += state.seconds
        pressed = state if state.time < 1.5 else pressed
    if recorded and name == "mass redistribution":
        save_step(scene.out / "problem.npz", scheme, pressed)
    v = state.velocity.ravel()
    return SimpleNamespace(
        displacement=np.sqrt(np.mean(squares)),
        until_release=np.sqrt(np.mean(squares[: int(1.9 / dt)])),
        pressure=np.sqrt(np.mean(np.square(pressure)) * until) / 0.5,
        energy=(moving.strain_energy(state.displacement) + 0.5 * v @ (scheme.M @ v)) / exact.energy,
        seconds=seconds,
        history=history,
    )


# %% [markdown]
# ## 200 elements
#
# The implicit schemes take dt = 0.01, in which a wave crosses two elements; central differences are stable
# for less than one and take dt = 0.004.

# %%
rod = strip(200)
runs = {name: impact(name, rod, 0.004 if "central" in name else 0.01, True).history for name in SCHEMES}
for name, run in runs.items():
    time, force = run["time"], run["force_x"]
    off = np.abs(force[(time > 1.1) & (time < 1.9)] / 0.5 - 1.0).max()
    scene.result(f"pressure_off_by[{name}]", off, "of 1/2", 0.0, "closed form, 1.1 < t < 1.9")
    release = time[np.flatnonzero(run["contacts"])[-1]]
    scene.result(f"release[{name}]", release, "s", 2.0, "closed form; the last step in contact")
    scene.result(f"touches[{name}]", len(run.touches("end")), "1", 1, "closed form")
    gain = run["gain"].max() / exact.energy
    scene.result(f"max_energy_gain[{name}]", gain, "of 1/8 in a step", 0.0, "closed form")
    energy = (run["kinetic"] + run["strain"])[-1]
    scene.result(f"energy_at_end[{name}]", energy, "J", exact.energy, "closed form")
identity = np.abs(runs["Newmark"]["gain"] - runs["Newmark"]["numerical"]).max() / exact.energy
scene.result("newmark_energy_identity_error", identity, "of 1/8", 0.0, "dE = 1/2 sum (p0 + p1)(g1 - g0)")

figure, axes = plt.subplots(3, len(runs), figsize=(15, 6.5), sharex=True, sharey="row", layout="constrained")
fine = np.linspace(0.0, 3.0, 1201)
for column, (name, run), look in zip(axes.T, runs.items(), LOOKS):
    for axis, values in zip(
        column, (exact.displacement(0.0, fine), exact.contact_pressure(fine), 0.125 + 0 * fine)
    ):
        axis.plot(fine, values, color="0.75", linewidth=3.5)
    for axis, values in zip(column, (run["u_x(end)"], run["force_x"], run["kinetic"] + run["strain"])):
        axis.plot(run["time"], values, color=look["color"], linewidth=1)
        axis.grid(color="0.9", linewidth=0.6)
    column[0].set_title(name, fontsize="medium")
    column[2].set_xlabel("t (s)")
labels = {"u(0, t) (m)": (-0.03, 0.55), "pressure (Pa)": (-0.1, 1.3), "energy (J)": None}
for axis, (label, limits) in zip(axes[:, 0], labels.items()):
    axis.set(ylabel=label, ylim=limits)
scene.figure(figure, "impact")

# %% [markdown]
# With the same mesh and ever smaller dt, each kick of Newmark's held node lasts shorter and weighs more: its
# energy grows, while that of the stabilised schemes settles.

# %%
steps = (0.02, 0.01, 0.005) if scene.quick else (0.02, 0.01, 0.005, 0.0025, 0.00125, 0.000625)
energies = {name: [impact(name, rod, dt).energy for dt in scene.progress(steps, name)] for name in IMPLICIT}
for name, values in energies.items():
    scene.result(f"energy_at_end[{name},dt={steps[-1]:g}]", values[-1] / 8, "J", 1 / 8, "closed form")
figure = convergence_figure(np.array(steps), energies, "dt (s)", "energy at t = 3 over the true one")
scene.figure(figure, "energy_against_dt")

# %% [markdown]
# ## Convergence, and error against run time
#
# h and dt are halved together, dt = 2 h (central differences: 0.8 h). A scheme of second order shows order
# $\tfrac32 \cdot \tfrac23 = 1$ in L2 on a displacement with a kink, and $\tfrac12 \cdot \tfrac23 = \tfrac13$
# on a pressure that jumps (Brenner, Thomée and Wahlbin, 1975): fronts are smeared over a width $h^{2/3}$. At
# the release the wall cuts such a front off before its tail has passed; the rod leaves late by as much, and
# from there on the displacement is of order 2/3. Orders are measured on the two finest meshes.

# %%
elements = (25, 50, 100) if scene.quick else (25, 50, 100, 200, 400, 800)
KINDS = {"displacement until release": 1.0, "displacement": 2 / 3, "pressure": 1 / 3, "energy": None}
errors = {kind: {name: [] for name in SCHEMES} for kind in KINDS}
seconds = {name: [] for name in SCHEMES}
for count in scene.progress(elements, "meshes"):
    rod = strip(count)
    for name in SCHEMES:
        run = impact(name, rod, (0.8 if "central" in name else 2.0) / count)
        errors["displacement until release"][name].append(run.until_release)
        errors["displacement"][name].append(run.displacement)
        errors["pressure"][name].append(run.pressure)
        errors["energy"][name].append(abs(run.energy - 1.0))
        seconds[name].append(run.seconds)
for kind, expected in KINDS.items():
    lines, key = errors[kind], kind.replace(" ", "_")
    for name, values in lines.items():
        order = np.log2(values[-2] / values[-1])
        scene.result(f"order_of_{key}[{name}]", order, "1", expected, expected and "a scheme of second order")
        scene.result(f"error_of_{key}[{name},h=1/{elements[-1]}]", values[-1], "relative", 0.0)
    label = f"relative error of the {kind}"
    scene.figure(
        convergence_figure(1 / np.array(elements), lines, "h (m)", label, expected and round(expected, 2)),
        f"order_of_{key}",
    )
    scene.figure(convergence_figure(seconds, lines, "run time (s)", label), f"{key}_against_run_time")

# %%
for name, run in runs.items():
    run.write(scene.out / f"history_{name.replace(' ', '_')}.csv")
scene.cost(**runs["Newmark"].cost(), assembly_seconds=assembly_seconds)
scene.finish()
