# %% [markdown]
# # The ring on a rough road
#
# **You will learn** what roughness does: contacts that come and go, and a surface that vibrates and would sound. **You need**
# section 3.2 and the tread block. The paper's ring falls on a rough profile and bounces forward over it. In each step
#
# $$ A e = b + f, \qquad g(x + e) \ge 0, \qquad p \ge 0, \qquad p\,g = 0, \qquad |\tau| \le \mu p, \tag{5, 6, 7} $$
#
# with $A$ of mass and stiffness, $e$ the difference from where inertia alone would take the body, $g$ the distance to the
# nearest point of the road, $p$ along its normal there and $\tau$ across it. On a plane road contact-stabilised Newmark never
# gains energy. On a rough one a node slides within a step over a hill while the normal turns. The road's force is put along
# that mean normal $\bar n$ which does work on the change of the gap alone, Gonzalez's discrete gradient:
#
# $$ \bar n \cdot (x^1 - x^0) = g^1 - g^0. \tag{a} $$

# %%
import warnings

import numpy as np
from harness.motion import keeping
from harness.pictures import forces_and_contacts, spectrum_figure, way_over_the_road
from harness.riding import Ride, note_ride, note_spectra, octave_level
from harness.rough_roads import note_profile, rough_heights, write_profile, write_profile_for_paraview
from harness.scene import Scene

from forms import Elasticity, Isotropic
from geometry import Body, Plane, RoadSeenFromAfar, SmoothRoad, read_samples, ring
from model import MassRedistribution, MovingBody, UnresolvedWaves, ledger_figure

scene = Scene("ring_on_rough_road", "The paper's ring, dropped on a rough road and bouncing forward over it.")
scene.built("M", "K").left_out("C", "gmsh", "pyvista")
h, gravity, speed, mu = 0.5, 9.81, 10.0, 0.1  # m, m/s^2, m/s, 1
FALL, KINETIC = np.sqrt(2 * h / gravity), 0.5 * np.pi * (0.5**2 - 0.2**2) * speed**2  # s, J/m
dt, end = 2e-3, 0.5 if scene.quick else 1.2  # s
warnings.simplefilter("ignore", UnresolvedWaves)  # said by the results


@scene.assembly
def launched(road):
    body = Body.from_grid(ring(0.5, 0.2, 96, 6, lowest=(0.0, h)))
    elasticity = Elasticity(body, Isotropic(E=1000.0, nu=0.3), "plane strain")
    weight = elasticity.body_force((0.0, -gravity))
    return elasticity, MovingBody.from_forms(elasticity, 1.0, weight, road, "outer", friction=mu)


# %% [markdown]
# **The road**: random heights whose power spectrum falls with the square of the wavenumber, as measured roads' does (ISO
# 8608), between wavelengths of 0.7 m and of 7 cm, three nodes of the ring; sampled every 5 mm, written to a file as a
# profilometer would, and read back. At 10 m/s they shake the ring at 14 to 143 Hz. Then **the ride**, on it and on a plane.

# %%
x, wavelengths = np.arange(-2.0, 16.0, 0.005), (0.07, 0.7)  # m
heights = rough_heights(x, 4e-3, wavelengths, power=0.5, waves=32, seed=7)
write_profile(scene.out / "road.csv", x, heights)
profile = SmoothRoad.through(*read_samples(scene.out / "road.csv"))
rough = RoadSeenFromAfar(profile, heights.max(), reach=0.05)
note_profile(scene, x, heights, profile)

(elasticity, on_rough), (_, on_plane) = launched(rough), launched(Plane())
A, velocity = {"A": elasticity.body.nearest_node((0.0, h))}, [speed, 0.0] + 0.0 * on_rough.coordinates
every = 2, round((0.1 if scene.quick else 0.2) / dt)  # steps, of the series and of the snapshots
keep, snapshots = keeping(scene.out / "ring.xdmf", elasticity, on_rough, *every)
ride = Ride(on_rough, rough, velocity, dt, end, A, on_step=keep)
write_profile_for_paraview(scene.out / "ring_road.xdmf", profile, x[x < 1 + speed * end])
rides = {"rough road": ride, "plane road": Ride(on_plane, on_plane.road, velocity, dt, end, A)}
histories = {name: each.history for name, each in rides.items()}
for name, each in rides.items():
    note_ride(scene, name.split()[0], each, KINETIC, FALL)
picture = way_over_the_road(elasticity, snapshots, A["A"], ride.pressed[1], on_rough.contact_nodes, profile)
scene.figure(picture, "ring_on_the_road")
scene.figure(forces_and_contacts(histories), "force")
scene.figure(ledger_figure(histories), "energy_ledger")

# %% [markdown]
# **The spectrum of its surface velocity**: of the outer nodes from the first touch on, the motion as a rigid body taken out.
# The plane road strikes the ring, and it rings in its modes; the rough road shakes it besides, at the frequencies
# v / wavelength, in grey, and above, since touching and letting go are sudden.

# %%
spectra = {name: each.spectrum(FALL) for name, each in rides.items()}
note_spectra(scene, spectra, (31.5, 63.0, 125.0))
scene.figure(
    spectrum_figure(spectra, speed / np.array(wavelengths[::-1]), "Surface velocity of the ring"), "spectrum"
)
problem, again, difference = ride.hardest_step(mu)  # on the planes that its rounds have ended at
problem.save(scene.out / "problem.npz", again)
scene.result("difference_of_the_step_solved_anew", difference, "m", 0.0)

# %% [markdown]
# **In ParaView**, open `ring.xdmf` and `ring_road.xdmf`, *Warp By Vector* on `displacement`, colour by `velocity`, and play.
#
# ## Exercises
#
# 1. A small gain is left, from the projection of contact-stabilised Newmark. And with mass redistribution, which has none?
# 2. Halve the roughness. By how many decibels does the level in the octave about 63 Hz fall?
# 3. At which speed would the 7 cm waves shake the ring at 63 Hz?

# %% tags=["hide-cell"]
# 1. Nothing but rounding.
gain = Ride(on_rough, rough, velocity, dt, 0.45, A, MassRedistribution).history["gain"].max() / KINETIC
scene.result("max_energy_gain[mass redistribution]", gain, "of the initial kinetic energy, in a step", 0.0)
assert gain < 1e-12
# 2. Were the ring always on the road, by 6; it flies and strikes, and the strike does not depend on the roughness.
half = RoadSeenFromAfar(SmoothRoad.through(x, heights / 2), heights.max() / 2, reach=0.05)
smoother = Ride(launched(half)[1], half, velocity, dt, end, A).spectrum(FALL)
print(f"{octave_level(spectra['rough road'], smoother, 63.0):.1f} dB")
# 3. v = 63 Hz times 0.07 m = 4.4 m/s, or 16 km/h.
assert abs(63 * wavelengths[0] * 3.6 - 16) < 0.2

# %% [markdown]
# **Further reading.** O. Gonzalez, *Time integration and discrete Hamiltonian systems*, J. Nonlinear Sci. 6 (1996) 449-467.
# ISO 8608:2016, *Mechanical vibration: Road surface profiles*. Smaller steps: `reports/rough_road_steps.py`.

# %%
scene.finish(ride.history)
