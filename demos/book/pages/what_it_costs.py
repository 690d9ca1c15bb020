# %% [markdown]
# # What each option costs
#
# Measured when this book was built, on one core of whatever machine that was: trust the ratios. The problem is that of
# {doc}`section_3_1_1_normal_loading` on nested meshes, without friction, to a natural residual of $10^{-8}$.

# %% tags=["hide-input"]
import warnings
from time import perf_counter

import numpy as np
from IPython.display import Markdown, display
from tabulate import tabulate

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder_nested, ring
from model import BeyondLinear, BodyOnRoad, ContactSolver, MovingBody, follow, solve
from model.dynamics.schemes import SCHEMES

warnings.simplefilter("ignore", BeyondLinear)  # of interest here are seconds


def cylinder(refinements, friction=None):
    """Half cylinder of 56 x 4^k quadrilaterals under a platen."""
    body = Body.from_grid(half_cylinder_nested(10.0), refinements)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    support = Support(body).platen("top").fix("top", x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -1e4)), support)
    return BodyOnRoad(system, "arc", Plane(), friction=friction, reach=3.0)


def table(rows, headers):
    """Show a table."""
    display(Markdown(tabulate(rows, headers, tablefmt="github", floatfmt=".2g")))


for name in ("direct", "multigrid", "algebraic"):  # compiles what is not compiled yet
    solve(cylinder(1).problem, name)

# %% [markdown]
# ## `correction=` of `solve` and `ContactSolver`
#
# `none` is the loop alone, which a mesh of 224 quadrilaterals under a platen can just bear. Work units are seconds over those of one
# sweep of the same mesh.

# %% tags=["hide-input"]
rows = []
for refinements, corrections in (
    (1, ("none", "direct", "multigrid")),
    (3, ("direct", "multigrid", "algebraic")),
):
    problem = cylinder(refinements).problem
    for name in corrections:
        answer = solve(problem, name, tolerance=1e-8)
        rows.append(
            [
                name,
                problem.b.size,
                answer.setup_seconds,
                answer.seconds,
                answer.sweeps,
                answer.cycles,
                answer.residual,
            ]
        )
table(rows, ["correction", "unknowns", "set-up (s)", "solve (s)", "sweeps", "cycles", "residual"])

# %% [markdown]
# ## `friction=`, and load steps
#
# The same with $\mu = 0.5$ in ten steps: `direct` keeps its factorisation, multigrid its meshes.

# %% tags=["hide-input"]
rows = []
for name in ("direct", "multigrid"):
    contact = cylinder(3, friction=0.5)
    began = perf_counter()
    path = list(
        follow(
            ContactSolver(contact.problem, name),
            [contact.problem.b * k / 10 for k in range(1, 11)],
            tolerance=1e-8,
        )
    )
    rows.append(
        [
            name,
            contact.problem.b.size,
            perf_counter() - began,
            max(s.cycles for s in path),
            max(s.residual for s in path),
        ]
    )
table(rows, ["correction", "unknowns", "ten steps (s)", "cycles of the worst step", "worst residual"])

# %% [markdown]
# ## `tolerance=`
#
# Two digits more cost two or three cycles more; what a cycle buys beyond the mesh's own error is thrown away.

# %% tags=["hide-input"]
contact, hertz = cylinder(3), 8570.66
rows = []
for tolerance in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
    answer = solve(contact.problem, "multigrid", tolerance=tolerance)
    rows.append([tolerance, answer.cycles, answer.seconds, contact.pressure(answer).max() / hertz - 1])
table(rows, ["tolerance", "cycles", "solve (s)", "peak pressure over Hertz's, - 1"])

# %% [markdown]
# ## Time integrators
#
# The ring of {doc}`section_3_2_bouncing_ring` on 256 quadrilaterals, $\mu = 0.1$, a hundred steps of 5 ms from the moment it touches. Central
# differences would need steps below those of the fastest wave through an element.

# %% tags=["hide-input"]
body = Body.from_grid(ring(0.5, 0.2, 64, 4, lowest=(0.0, 0.01)))
elasticity = Elasticity(body, Isotropic(1000.0, 0.3))
moving = MovingBody.from_forms(
    elasticity, 1.0, elasticity.body_force((0.0, -9.81)), Plane(), "outer", friction=0.1
)
velocity = np.tile([0.0, -3.0], (len(body.coordinates), 1))
rows = []
for name, scheme in SCHEMES.items():
    if "central" not in name:
        integrator = scheme(moving, 0.005)
        began = perf_counter()
        state = integrator.run(integrator.start(velocity=velocity), 100)
        rows.append([name, 1e3 * integrator.setup_seconds, 10 * (perf_counter() - began)])
table(rows, ["scheme", "set-up (ms)", "a step (ms)"])
