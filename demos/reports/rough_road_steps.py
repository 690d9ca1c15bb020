# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # The ring on the rough road: a finer mesh, smaller steps
#
# The ride of `ring_on_rough_road.py` on 1,296 quadrilaterals with dt = 1 ms and half of it: the spectra agree up to about
# 80 Hz; above, they differ from wave to wave, but not in their level. And what the first bounce takes from the
# energy, beside friction, with smaller and smaller steps: it is what touching nodes lose of their velocity
# towards the road.

# %%
import warnings

import numpy as np
from bodies import FALL, GRAVITY, KINETIC, launched_ring
from harness.pictures import spectrum_figure
from harness.riding import Ride, note_ride
from harness.rough_roads import rough_heights
from harness.scene import Scene

from geometry import Plane, RoadSeenFromAfar, SmoothRoad
from model import ContactStabilised, MassRedistribution, UnresolvedWaves
from model.figures.figures import convergence_figure

scene = Scene("rough_road_steps", "The ring on the rough road: a finer mesh, smaller steps.")
scene.built("M", "K").left_out("C", "gmsh", "pyvista")
warnings.simplefilter("ignore", UnresolvedWaves)  # the results say how many steps a period has
launched_ring = scene.assembly(launched_ring)
mu, speed, wavelengths, fall = 0.1, 10.0, (0.07, 0.7), np.sqrt(2 * FALL / GRAVITY)
x = np.arange(-2.0, 16.0, 0.005)
heights = rough_heights(x, 4e-3, wavelengths, power=0.5, waves=32, seed=7)
rough = RoadSeenFromAfar(SmoothRoad.through(x, heights), heights.max(), reach=0.05)


def ride(road, dt, end, around=96, across=6, integrator=ContactStabilised):
    """A run over a road."""
    body, _, moving, velocity = launched_ring(mu, 0, around, across, road)
    return Ride(moving, road, velocity, dt, end, {"A": body.nearest_node((0.0, FALL))}, integrator)


# %%
size, dt, end = ((96, 6), 2e-3, 0.5) if scene.quick else ((144, 9), 1e-3, 1.2)
rides = {"rough road": ride(rough, dt, end, *size), "plane road": ride(Plane(), dt, end, *size)}
for name, each in rides.items():
    note_ride(scene, name.split()[0], each, KINETIC, fall)
spectra = {name: each.spectrum(fall) for name, each in rides.items()}
for name, (frequency, power) in spectra.items():
    rms = np.sqrt(np.trapezoid(power, frequency))
    scene.result(f"surface_velocity[{name.split()[0]}]", rms, "m/s, rms from the first touch on")
for centre in (31.5, 63.0, 125.0):
    octave = (frequency >= centre / np.sqrt(2)) & (frequency < centre * np.sqrt(2))
    ratio = spectra["rough road"][1][octave].sum() / spectra["plane road"][1][octave].sum()
    scene.result(f"level_of_rough_over_plane[{centre:g} Hz]", 10 * np.log10(ratio), "dB, octave")
if not scene.quick:
    for name, road in (("rough road", rough), ("plane road", Plane())):
        spectra[f"{name}, half the time step"] = ride(road, dt / 2, end, *size).spectrum(fall)
band = speed / wavelengths[1], speed / wavelengths[0]
scene.figure(spectrum_figure(spectra, band, "Surface velocity of the ring"), "spectrum")

# %%
steps, taken = (4e-3, 2e-3) if scene.quick else (2e-3, 1e-3, 5e-4), {}
integrators = {"contact-stabilised": ContactStabilised, "mass redistribution": MassRedistribution}
for name, integrator in integrators.items():
    gains, taken[name] = [], []
    for step in scene.progress(steps, name):
        run = ride(rough, step, 0.47, integrator=integrator)
        taken[name].append((run.history["total"][0] - run.history["total"][-1]) / KINETIC)
        gains.append(run.history["gain"].max() / KINETIC)
        key, unit = f"{name},dt={step:g}", "of the initial kinetic energy"
        scene.result(f"energy_taken[{key}]", taken[name][-1], unit, 0.0)
        scene.result(f"off_the_road[{key}]", run.off, "body lengths", 1e-12, "wanted", "at most")
    scene.result(f"max_energy_gain[{name}]", max(gains), f"{unit}, in a step", 0.0, "never gained")
    order = np.log(taken[name][0] / taken[name][-1]) / np.log(steps[0] / steps[-1])
    scene.result(f"order_of_energy_taken[{name}]", order, "1, in dt")
label = "energy taken by the first bounce (of the kinetic energy)"
scene.figure(convergence_figure(np.array(steps), taken, "dt (s)", label, 1.0), "energy_taken")

# %%
scene.finish(rides["rough road"].history)
