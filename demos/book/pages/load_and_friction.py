# %% [markdown]
# # Load, friction, and the way there
#
# Move the sliders: an elastic half cylinder ($R = 10$ mm, $E = 210$ GPa, $\nu = 0.3$) under a rigid platen is pressed on a road
# with up to $P = 10$ kN/mm and pulled to the right with up to $Q = 0.9\, \mu P$. All answers were computed by the node loop
# when this book was built; below the picture is the code.

# %% tags=["remove-input"]
import json
import warnings
from pathlib import Path

import numpy as np
from IPython.display import HTML, display

import model
from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder
from model import BeyondLinear, BodyOnRoad, ContactSolver, follow

warnings.simplefilter("ignore", BeyondLinear)  # said below
STEPS, MUS = 20, (0.1, 0.2, 0.3, 0.5, 0.8)
body = Body.from_grid(half_cylinder(10.0))
elasticity = Elasticity(body, Isotropic(210e3, 0.3))
system = elasticity.system(elasticity.total_force("top", (0.0, -1e4)), Support(body).platen("top"))
push, pull = system.load, system.reduce(elasticity.total_force("top", (0.9e4, 0.0)))
parts = np.arange(1, STEPS + 1) / STEPS
PATHS = {  # of the full push and pull, step by step
    "press only": [(part, 0.0) for part in parts],
    "press, then pull": [(min(2 * part, 1.0), max(2 * part - 1.0, 0.0)) for part in parts],
    "press and pull together": [(part, part) for part in parts],
}
contacts = {mu: BodyOnRoad(system, "arc", Plane(), friction=mu, reach=2.0) for mu in MUS}
order = np.argsort(contacts[MUS[0]].points[:, 0])
middle = body.coordinates[body.cells].mean(axis=1)
shown = body.cells[(abs(middle[:, 0]) < 1.5) & (middle[:, 1] < 1.2)]
nodes, number = np.unique(shown, return_inverse=True)
sides = np.concatenate([number.reshape(shown.shape)[:, ends] for ends in ([0, 1], [1, 3], [3, 2], [2, 0])])
states = []
for path in PATHS.values():
    for mu, contact in contacts.items():
        loads = [push * P + pull * (mu * Q) for P, Q in path]
        for solution in follow(ContactSolver(contact.problem), loads):
            moved = body.coordinates[nodes] + contact.displacement(solution)[nodes]
            states.append(
                {
                    "p": contact.pressure(solution)[order].round(0).tolist(),
                    "tau": contact.traction(solution)[order, 0].round(0).tolist(),
                    "status": solution.status[order].tolist(),
                    "mesh": moved.round(3).ravel().tolist(),
                }
            )
data = {
    "x": contacts[MUS[0]].points[order, 0].round(4).tolist(),
    "mus": MUS,
    "paths": [
        {"name": name, "P": [10 * P for P, _ in path], "Q": [9 * Q for _, Q in path]}
        for name, path in PATHS.items()
    ],
    "sides": np.unique(np.sort(sides, axis=1), axis=0).tolist(),
    "states": states,
}
script = Path(model.__file__).parents[1] / "demos" / "book" / "load_and_friction.js"
display(
    HTML(
        f"<div id='load-and-friction'></div><script type='application/json' id='load-and-friction-data'>"
        f"{json.dumps(data, separators=(',', ':'))}</script><script>{script.read_text()}</script>"
    )
)

# %% [markdown]
# ## What to look for
#
# - *Press only.* The body spreads as it is pressed, and the road holds it back: shear without any pull. With little friction nearly
#   all of the patch slips, and the shear is smallest in the middle; with much of it only the rim slips. The share that sticks does
#   not depend on the load (Spence): move the load at $\mu = 0.5$ and watch the strip.
# - *Press, then pull.* Slip begins at the rims and eats its way inwards, from the trailing edge on the left faster than from the right.
# - *Together.* The same loads at the end, another answer: the stick zone lies at the leading edge. **Friction remembers
#   the way.**
# - Strains reach 5 % at the full load, about as far as linear strain, which this is, can be trusted.
# - With a pull of $0.9\, \mu P$ a stick zone is left in all of them. At $\mu P$ the body would slide.
#
# ## The code behind it

# %% tags=["hide-cell"]
print(f"{len(states)} load steps, {len(MUS)} coefficients of friction, {len(PATHS)} paths")
assert max(max(abs(t) - 0.8 * p for t, p in zip(s["tau"], s["p"])) for s in states) < 2.0  # MPa; rounded
assert min(min(s["p"]) for s in states) >= 0.0
# The cells that made the picture are in this page's notebook.
