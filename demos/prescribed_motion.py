# %% [markdown]
# # Prescribed motion: a press, a belt, and a spring that holds
#
# **You will learn** to move supports and roads by functions of a load parameter, to hold a body by springs, and to read
# what every support bears. **You need** section 3.1.2.
#
# A rubber block lies on a belt. A platen presses it down by 0.1 mm while $t$ goes from 0 to 1, and is then kept there. From
# $t = 1$ on the belt moves. The platen can follow it against a spring of stiffness $k$ alone. So the spring pulls with
#
# $$ Q = k\, s \quad\text{until}\quad Q = \mu N, \tag{a} $$
#
# $s$ being the way of the platen, $N$ the force of the press: from there on the belt slides under the block.
#
# Motions are functions of the time, or of whatever `follow` counts by, and are asked at every step; a number stays. Then
# `reactions` gives the sheet of all forces of a step: the press bears N, the spring ("ground") Q, nothing is left over.

# %%
import numpy as np
from harness.pictures import panels_over
from harness.scene import Scene

from forms import Elasticity, Isotropic, Support
from geometry import Body, MovingRoad, Plane, rectangle
from model import BodyOnRoad, follow

scene = Scene("prescribed_motion", "A block pressed on a belt and held by a spring: motions as functions.")
scene.built("K").left_out("M", "C", "gmsh")
E, nu, mu, k, deep, end = 10.0, 0.3, 0.5, 1.0, 0.1, 2.0
steps = (4, 20) if scene.quick else (10, 80)


@scene.assembly
def block(k=k):
    body = Body.from_grid(rectangle(20.0, 10.0, 16 if scene.quick else 40, 8 if scene.quick else 20))
    elasticity = Elasticity(body, Isotropic(E, nu))
    support = Support(body).platen("top").fix("top", y=lambda t: -deep * min(t, 1.0)).spring("top", x=k)
    belt = MovingRoad(Plane(), lambda t: (max(t - 1.0, 0.0) * end, 0.0))
    system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    return BodyOnRoad(system, "bottom", belt, friction=mu)


contact = block()
body = contact.system.body
times = np.concatenate([np.linspace(0, 1, steps[0] + 1)[1:], np.linspace(1, 2, steps[1] + 1)[1:]])
solutions = list(scene.progress(follow(contact, times), "the press, then the belt", len(times)))

sheets = [contact.reactions(solution) for solution in solutions]
print(sheets[-1])
N = np.array([-sheet.force["reactions"][1] for sheet in sheets])
Q = np.array([-sheet.force["ground"][0] for sheet in sheets])
platen = body.nodes("top")[0]
s = np.array([contact.displacement(solution)[platen, 0] for solution in solutions])
way = np.maximum(times - 1.0, 0.0) * end
scene.result("Q_over_N", Q[-1] / N[-1], "1", mu, "Coulomb: the belt slides")
scene.result("platen_way", s[-1], "mm", mu * N[-1] / k, "eq. (a)")
scene.result("spring_off", np.abs(Q - k * s).max() / Q[-1], "of Q", 0.0, "eq. (a), all steps")
remainder = max(sheet.remainder for sheet in sheets)
scene.result("sheet_open_by", remainder, "of the largest force", 0.0, "equilibrium")
slips = np.array([np.mean(solution.status[solution.status > 0] == 1) for solution in solutions])
rigid, since = np.minimum(k * way, mu * N), slice(steps[0] - 1, None)
forces = {"Q, force of the spring": Q, r"$\mu N$": mu * N, "Q, rigid block, (a)": rigid}
panels = {"force (N/mm)": forces, "share of touching nodes that slip": {"computed": slips}}
scene.figure(panels_over(way, panels, "way of the belt (mm)", since), "belt")
contact.write(scene.out / "belt.xdmf", solutions[-1])
contact.problem.save(scene.out / "problem.npz")
scene.finish(solutions[-1])

# %% [markdown]
# Slip begins at the edges, where the pressure of a block that is bonded to its platen falls off, long before all of it
# slides; so the curve bends over before it is level. **In ParaView**, open `belt.xdmf`, and colour by `contact_traction`, X.
#
# ## Exercises
#
# 1. How far must the belt go before all slides, if the block were rigid? Compare with the figure.
# 2. Turn the belt's plane, `MovingRoad(Plane(), turn=lambda t: 0.01 * t)`, under the pressed block. Which support bears a
#    moment?
# 3. Take a spring three times as stiff. What becomes of Q at the end, and of the way of the platen?
#
# **Further reading.** E. Rabinowicz, *Friction and Wear of Materials*, Wiley, 1965, on sliders that springs pull. B. N. J.
# Persson, *Sliding Friction*, Springer, 2000, chapter 3.

# %% tags=["hide-cell"]
# 1. By mu N / k; the shear of the rubber adds to it.
sliding = way[np.argmax((slips == 1.0) & (way > 0))]
print(f"rigid {mu * N[-1] / k:.3f} mm, rubber {sliding:.3f} mm")
assert sliding > mu * N[-1] / k
# 2. The platen, which does not tilt.
contact.road = MovingRoad(Plane((10.0, 0.0), (0.0, 1.0)), turn=lambda t: 0.003 * t, centre=(10.0, 0.0))
*_, tilted = follow(contact, [0.5, 1.0])
print(contact.reactions(tilted, about=(10.0, 10.0)))
# 3. Q is mu N as before, and the way a third.
*_, stiff = follow(block(3 * k), times)
assert abs(contact.displacement(stiff)[platen, 0] / (s[-1] / 3) - 1) < 0.01
