# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # The ring on a rough road
#
# What the paper is for, at a first glimpse: a tyre rolls over a rough road, the asperities that it touches
# change, and its surface vibrates and sounds. Here the paper's ring (section 3.2) falls on a rough profile
# instead of a plane, and bounces forward over it with friction. In each step of time
#
# $$ A e = b + f, \qquad g(x + e) \ge 0, \qquad p \ge 0, \qquad p\,g = 0, \qquad |\tau| \le \mu p, $$
#
# with A of the mass and the stiffness, e the departure from where inertia alone would take the body, g the
# distance to the nearest point of the road, p along its normal there and tau across it. The step is solved
# in rounds, on planes that follow the nodes, until every node that touches lies on the road itself.

# %%
import warnings
from time import perf_counter

import matplotlib.pyplot as plt
import numpy as np
from harness.scene import Scene
from matplotlib.collections import PolyCollection
from scipy.signal import welch

from forms import Elasticity, Isotropic
from geometry import Body, Plane, RoadSeenFromAfar, SmoothRoad, read_samples, ring
from model import (
    ContactProblem,
    ContactStabilised,
    History,
    MassRedistribution,
    MovingBody,
    Status,
    UnresolvedWaves,
    march,
    solve,
)
from model.dynamics.curved_steps import on_curved_road
from model.dynamics.moving_body import RigidPart
from model.figures.contact_map import MARKS
from model.figures.figures import COLOUR_MAP, LOOKS, new_figure, outlines
from model.figures.motion_figures import ledger_figure
from model.results.xdmf import Series, on_body

scene = Scene("ring_on_rough_road", "The paper's ring, dropped on a rough road and bouncing forward over it.")
scene.built("M", "K")
scene.left_out("C", "gmsh", "pyvista")
h, gravity, speed, mu = 0.5, 9.81, 10.0, 0.1  # m, m/s^2, m/s, 1
FALL = np.sqrt(2 * h / gravity)
assembly_seconds = 0.0
KINETIC = 0.5 * np.pi * (0.5**2 - 0.2**2) * speed**2
around, across, dt, end = (96, 6, 2e-3, 0.5) if scene.quick else (144, 9, 1e-3, 1.2)
warnings.simplefilter("ignore", UnresolvedWaves)  # the results say how many steps a period has

# %% [markdown]
# ## The road
#
# Random heights whose power spectrum falls with the square of the wavenumber, as measured roads' does
# (ISO 8608), between wavelengths of 0.7 m and of 7 cm, three nodes of the ring; sampled every 5 mm, written to a
# file as a profilometer would, and read back. The ring slides over them at 10 m/s: they shake it at 14 to 143 Hz.

# %%
longest, shortest, roughness, seed = 0.7, 0.07, 4e-3, 7  # m, m, standard deviation (m)
x = np.arange(-2.0, 16.0, 0.005)
random = np.random.default_rng(seed)
lengths = np.geomspace(shortest, longest, 32)  # each stands for a band as wide as its wavenumber
heights = np.cos(2 * np.pi * x[:, None] / lengths + random.uniform(0, 2 * np.pi, 32)) @ np.sqrt(lengths)
heights *= roughness / heights.std()
np.savetxt(scene.out / "road.csv", np.stack([x, heights], axis=1), delimiter=",", header="x,height")
profile = SmoothRoad.through(*read_samples(scene.out / "road.csv"))
rough = RoadSeenFromAfar(profile, heights.max(), reach=0.05)
scene.result("highest_summit", heights.max(), "m")
scene.result("deepest_hollow", heights.min(), "m")
scene.result("slope", np.std(profile.slope(x[:, None])), "1, standard deviation")


# %%
def launched(road, around=around, across=across):
    """Ring above the road, and its initial velocity."""
    global assembly_seconds
    began = perf_counter()
    body = Body.from_grid(ring(0.5, 0.2, around, across, lowest=(0.0, h)))
    elasticity = Elasticity(body, Isotropic(E=1000.0, nu=0.3), "plane strain")
    weight = elasticity.body_force((0.0, -gravity))
    moving = MovingBody.from_forms(elasticity, 1.0, weight, road, "outer", friction=mu)
    velocity = np.zeros_like(body.coordinates)
    velocity[:, 0] = speed
    assembly_seconds += perf_counter() - began
    return body, elasticity, moving, velocity


class Ride:
    """A run, with what is asked of it: how far nodes are off the road, and how the surface vibrates."""

    def __init__(
        self, road, scheme=ContactStabilised, around=around, across=across, dt=dt, end=end, on_step=None
    ):
        self.body, self.elasticity, self.moving, velocity = launched(road, around, across)
        scheme = scheme if isinstance(road, Plane) else on_curved_road(scheme)
        self.scheme = scheme(self.moving, dt)
        state = self.scheme.start(velocity=velocity)
        self.history = History(self.scheme, state, {"A": self.body.nearest_node((0.0, h))})
        rigid = RigidPart(self.scheme.M, self.body.coordinates)
        self.off, self.surface, self.hardest = 0.0, [], 0.0
        nodes, before = self.moving.contact_nodes, state
        for state in march(self.scheme, before, round(end / dt), self.history):
            touching = nodes[state.status != Status.FREE]
            if touching.size:
                at = self.body.coordinates[touching] + state.displacement[touching]
                self.off = max(self.off, np.abs(road.closest(at)[0]).max())
            self.surface.append(rigid.deformation(state.velocity)[nodes])
            force = state.contact_force[:, 1].sum()
            if force > self.hardest:
                self.hardest = force
                self.pressed = before, state, self.scheme.solvers["step"].loop.frame[:, 0].copy()
            if on_step is not None:
                on_step(self, state)
            before = state

    def spectrum(self):
        """Frequencies (Hz), and power spectral density of the surface velocity, mean over the nodes."""
        rate = 1 / self.scheme.dt
        velocity = np.array(self.surface)[round(FALL * rate) :]
        frequency, power = welch(velocity, rate, nperseg=min(round(0.25 * rate), len(velocity)), axis=0)
        return frequency, power.sum(axis=2).mean(axis=1)


# %% [markdown]
# ## The ride, over the rough road and over a plane
#
# Contact-stabilised Newmark never gains energy on a plane road. Nor does it here: within a step a node slides
# over a hill while the normal turns, and the force of the road is put along that mean normal which does work
# on the change of the gap alone, n . (x1 - x0) = g1 - g0 (Gonzalez's discrete gradient, `model/curved/tangent_planes.py`).
# A little is left, which falls more than tenfold with half the dt: the projection that comes before the step does
# not know where the step ends. Mass redistribution, below, has no such projection, and nothing left.

# %%
series, pictures = Series(scene.out / "ring.xdmf", launched(rough)[0]), {}
every = 1 if scene.quick else 4


def on_step(ride, state):
    """Write the fields, and keep some displacements for the figures."""
    u, at = state.displacement, ride.moving.contact_nodes
    if state.step % every == 0:
        nodal = {
            "displacement": u,
            "velocity": state.velocity,
            "contact_force": on_body(len(u), at, state.contact_force),
            "status": on_body(len(u), at, state.status, elsewhere=-1),
        }
        series.write(state.time, nodal, {"von_mises": ride.elasticity.von_mises(u)})
    if state.step % round(0.1 / ride.scheme.dt) == 0:
        pictures[state.time] = u


rides = {"rough road": Ride(rough, on_step=on_step), "plane road": Ride(Plane())}
for name, ride in rides.items():
    history, key = ride.history, name.split()[0]
    gain = history["gain"].max() / KINETIC
    scene.result(f"off_the_road[{key}]", ride.off, "body lengths", 1e-12, "wanted, at most")
    scene.result(f"min_gap[{key}]", history["lowest_gap"].min(), "m", 0.0, "non-penetration")
    scene.result(
        f"min_pressure[{key}]", history["lowest_pressure"].min(), "N/m, nodal force", 0.0, "no adhesion"
    )
    scene.result(f"max_coulomb_violation[{key}]", history["cone"].max(), "N/m", 0.0, "|tau| <= mu p")
    scene.result(
        f"max_energy_gain[{key}]", gain, "of the initial kinetic energy, in a step", 0.0, "never gained"
    )
    change = (history["total"][-1] - history["total"][0]) / KINETIC
    scene.result(f"energy_change[{key}]", change, "of the initial kinetic energy, friction counted", 0.0)
    scene.result(
        f"lost_to_friction[{key}]", history["friction"][-1] / KINETIC, "of the initial kinetic energy"
    )
    scene.result(f"momentum_error[{key}]", history["momentum_error"].max(), "N s/m", 0.0)
    bounces = history.bounces(apart=0.05)
    scene.result(f"first_touch[{key}]", bounces[0][0], "s", FALL, "sqrt(2 h / g), from the mean height")
    if len(bounces) > 1:
        scene.result(f"second_touch[{key}]", bounces[1][0], "s")
    scene.result(f"greatest_force[{key}]", ride.hardest, "N/m")
    scene.result(f"steps_per_wave_period[{key}]", history.resolution.fewest, "1", 10, "what it takes")

# %% [markdown]
# ## The spectrum of its surface velocity
#
# Of the outer nodes from the first touch on, the motion as a rigid body taken out. The plane road strikes the
# ring, and it rings in its modes; the rough road shakes it besides, at the frequencies v / wavelength, in grey, and
# above, since touching and letting go are sudden. With half the time step the spectra are the same up to about
# 80 Hz; above, they differ from wave to wave, but not in their level.

# %%
spectra = {name: ride.spectrum() for name, ride in rides.items()}
band = speed / longest, speed / shortest
for name, (frequency, power) in spectra.items():
    rms = np.sqrt(np.trapezoid(power, frequency))
    scene.result(f"surface_velocity[{name.split()[0]}]", rms, "m/s, rms from the first touch on")
for centre in (31.5, 63.0, 125.0):
    octave = (frequency >= centre / np.sqrt(2)) & (frequency < centre * np.sqrt(2))
    ratio = spectra["rough road"][1][octave].sum() / spectra["plane road"][1][octave].sum()
    scene.result(f"level_of_rough_over_plane[{centre:g} Hz]", 10 * np.log10(ratio), "dB, octave")
if not scene.quick:
    spectra["rough road, half the time step"] = Ride(rough, dt=dt / 2).spectrum()
    spectra["plane road, half the time step"] = Ride(Plane(), dt=dt / 2).spectrum()
figure, axes = new_figure(
    "frequency (Hz)", "velocity spectrum ((m/s)$^2$/Hz)", "Surface velocity of the ring", (7.5, 4.5)
)
axes.axvspan(*band, color="0.9", zorder=0, label="v / wavelengths of the road")
for look, (name, (frequency, power)) in zip(LOOKS, spectra.items()):
    axes.loglog(
        frequency[1:], power[1:], label=name, color=look["color"], linestyle=look["linestyle"], linewidth=1.2
    )
axes.set(xlim=(4, 400), ylim=(2e-5, 0.3))
axes.legend(framealpha=1.0, fontsize="small", loc="lower left")
scene.figure(figure, "spectrum")

# %% [markdown]
# ## The ring on the road
#
# Above all along its way, below at the moment of the greatest force; heights are to scale.

# %%
ride = rides["rough road"]
body, (_, pressed, _) = ride.body, ride.pressed
fine = np.linspace(-0.7, pictures[max(pictures)][:, 0].mean() + 0.8, 4000)
figure, (way, close) = plt.subplots(2, 1, figsize=(10, 6.2), layout="constrained", height_ratios=[1, 2])
for panel in (way, close):
    panel.fill_between(fine, profile.height(fine[:, None]), -0.1, color="0.7", linewidth=0)
    panel.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")
for time, u in pictures.items():
    moved = body.coordinates + u
    way.add_collection(
        PolyCollection(list(moved[outlines(body.cells)]), facecolor="white", edgecolor="0.4", linewidth=0.1)
    )
    way.plot(*moved[ride.history.points["A"]], "o", color=LOOKS[2]["color"], markersize=3)
    way.text(moved[:, 0].mean(), moved[:, 1].max() + 0.05, f"{time:.1f} s", ha="center", fontsize="x-small")
way.set(xlim=(fine[0], fine[-1]), ylim=(-0.1, 1.9))
moved = body.coordinates + pressed.displacement
cells = PolyCollection(list(moved[outlines(body.cells)]), cmap=COLOUR_MAP, edgecolor="0.3", linewidth=0.2)
cells.set_array(ride.elasticity.von_mises(pressed.displacement))
close.add_collection(cells)
figure.colorbar(cells, ax=close, label="von Mises stress (Pa)")
for kind, (colour, name) in MARKS.items():
    close.plot(
        *moved[ride.moving.contact_nodes[pressed.status == kind]].T,
        "o",
        color=colour,
        markersize=4,
        label=name,
    )
middle = moved[:, 0].mean()
close.set(xlim=(middle - 0.45, middle + 0.45), ylim=(-0.03, 0.25), title=f"t = {pressed.time:.3f} s")
close.legend(framealpha=0.9, loc="upper right")
scene.figure(figure, "ring_on_the_road")

# %%
figure, panels = plt.subplots(2, 1, figsize=(8, 5.5), sharex=True, layout="constrained")
for look, (name, ride) in zip(LOOKS, rides.items()):
    force, nodes = ride.history["force_y"], ride.history["contacts"]
    for panel, values in zip(panels, (force, nodes)):
        panel.plot(
            ride.history["time"],
            values,
            label=name,
            color=look["color"],
            linestyle=look["linestyle"],
            linewidth=1,
        )
panels[0].set(ylabel="force of the road, upwards (N/m)")
panels[1].set(ylabel="nodes that touch", xlabel="t (s)")
panels[0].legend(frameon=False)
scene.figure(figure, "force")
scene.figure(ledger_figure({name: ride.history for name, ride in rides.items()}), "energy_ledger")

# %% [markdown]
# ## The hardest step as a problem of its own
#
# With the planes that the rounds have ended at, the step's contact problem is one on a plane at each node, for
# any other solver. It is written with its unknown measured from 1 cm above the guess, where no gap is negative;
# solved anew from nothing it gives the same step.

# %%
ride = rides["rough road"]
before, after, normal = ride.pressed
moving, scheme, nodes = ride.moving, ride.scheme, ride.moving.contact_nodes
moved, _ = scheme.guess(before)
missing = moving.missing_force(before.time, before.displacement + 0.5 * moved, moved / scheme.dt)
moved = moved + (0.0, 0.01)
missing -= (scheme.effective_matrix() @ np.broadcast_to((0.0, 0.01), moved.shape).ravel()).reshape(
    moved.shape
)
was = moving.coordinates[nodes] + before.displacement[nodes]
above = was + moved[nodes]
_, _, foot = rough.closest(moving.coordinates[nodes] + after.displacement[nodes])
gap, back = np.einsum("ca,ca->c", normal, above - foot), rough.closest(was)[2] - above
problem = ContactProblem(scheme.effective_matrix(), missing, moving.coordinates, nodes, normal, gap, mu, back)
again = solve(problem, "direct")
problem.save(scene.out / "problem.npz", again)
difference = np.abs(again.displacement - (after.displacement - before.displacement - moved)).max()
scene.result("difference_of_the_step_solved_anew", difference, "m", 0.0)

# %% [markdown]
# ## Smaller steps
#
# What the first bounce takes from the energy, beside friction, with smaller and smaller steps; mass
# redistribution beside contact-stabilised Newmark. It is what touching nodes lose of their velocity towards
# the road.

# %%
steps = (4e-3,) if scene.quick else (2e-3, 1e-3, 5e-4)
integrators = {"contact-stabilised": ContactStabilised, "mass redistribution": MassRedistribution}
for name, integrator in integrators.items():
    taken, gains = [], []
    for step in scene.progress(steps, name):
        run = Ride(rough, integrator, 96, 6, step, 0.47)
        taken.append((run.history["total"][0] - run.history["total"][-1]) / KINETIC)
        gains.append(run.history["gain"].max() / KINETIC)
        scene.result(f"energy_taken[{name},dt={step:g}]", taken[-1], "of the initial kinetic energy", 0.0)
        scene.result(f"off_the_road[{name},dt={step:g}]", run.off, "body lengths", 1e-12, "wanted, at most")
    scene.result(
        f"max_energy_gain[{name}]",
        max(gains),
        "of the initial kinetic energy, in a step",
        0.0,
        "never gained",
    )
    if len(steps) > 1:
        order = np.log(taken[0] / taken[-1]) / np.log(steps[0] / steps[-1])
        scene.result(f"order_of_energy_taken[{name}]", order, "1, in dt")

# %%
scene.cost(**ride.history.cost(), assembly_seconds=assembly_seconds)
scene.finish()
