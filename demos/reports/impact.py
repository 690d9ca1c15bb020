"""A ball of steel strikes a road, in a process of its own: cycles, seconds and memory of multigrid in time.

    python impact.py REFINEMENTS STEPS [CORRECTION]

prints one line of JSON. mm, ms, N.
"""

import json
import subprocess
import sys
from pathlib import Path
from statistics import median

import numpy as np
from bodies import NU, E, R

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_ball
from model import MassRedistribution, MovingBody

DENSITY, SPEED = 7.85e-3, 10.0
CELLS = 2.0  # that waves pass in a step, of the finest near the road


def struck_ball(refinements: int) -> tuple[MovingBody, np.ndarray, float]:
    """Quarter of a half ball on the road, its velocity, and a time step."""
    body = Body.from_grid(half_ball(R, "quarter"), refinements)
    elasticity = Elasticity(body, Isotropic(E, NU))
    support = Support(body).fix("x0", x=0.0).fix("y0", y=0.0)
    rest = np.zeros_like(body.coordinates)
    road = Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    moving = MovingBody.from_forms(elasticity, DENSITY, rest, road, "sphere", support)
    waves = np.sqrt(E * (1 - NU) / ((1 + NU) * (1 - 2 * NU) * DENSITY))
    return moving, rest - [0.0, 0.0, SPEED], CELLS * 0.05 * R * 0.5**refinements / waves


def peak_memory() -> int:
    """Most bytes that this process has held; `getrusage` counts what held it before it began its program, too."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * int(next(line for line in lines if line.startswith("VmHWM")).split()[1])


def strike(refinements: int, steps: int, correction: str = "auto") -> dict:
    """March so many steps into the contact: medians of cycles and seconds, touching nodes, peak memory."""
    moving, velocity, dt = struck_ball(refinements)
    scheme = MassRedistribution(moving, dt, correction=correction, tolerance=1e-8)
    state, cycles, seconds = scheme.start(velocity=velocity), [], []
    for _ in range(steps):
        state = scheme.step(state)
        cycles.append(state.cycles)
        seconds.append(state.seconds)
    return {
        "dofs": velocity.size,
        "correction": scheme.correction,
        "cycles": median(cycles),
        "worst": max(cycles),
        "seconds": median(seconds),
        "setup_seconds": scheme.setup_seconds,
        "touching": state.count,
        "GiB": peak_memory() / 2**30,
    }


def strike_apart(*arguments: object) -> dict:
    """Do what `strike` does, in a process whose memory is its own."""
    command = [sys.executable, __file__, *map(str, arguments)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


if __name__ == "__main__":
    print(json.dumps(strike(int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:])))
