"""The compiled kernels beside PETSc's MatMult and MatSOR, on the same matrix."""

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np

from geometry import compat  # noqa: F401  # comes before petsc4py
from model.node_loop.blocks import (
    backward_sweep,
    block_matrix,
    defect,
    diagonal_positions,
    sweep_from_zero,
)
from model.node_loop.node_loop import NodeLoop

from petsc4py import PETSc  # isort: skip

BACKWARD = PETSc.Mat.SORType.LOCAL_BACKWARD_SWEEP


def quickest(run: Callable[[], Any], repeat: int = 5) -> float:
    """Seconds of the quickest of some runs; the first compiles."""
    seconds = []
    for _ in range(repeat + 1):
        began = perf_counter()
        run()
        seconds.append(perf_counter() - began)
    return min(seconds)


def kernel_seconds(problem: Any) -> tuple[dict[str, float], int]:
    """Seconds of each kernel on the problem's matrix, and bytes of A, u, load and defect, each once."""
    A, (N, d) = block_matrix(problem.A), problem.b.shape
    loop = NodeLoop(A, problem.contact_nodes, problem.normal, None)
    middle, size = diagonal_positions(A), (N * d, N * d)
    loop.set_load(problem.b, problem.gap)
    load, u, r = np.random.default_rng(0).normal(size=(N, d)), np.zeros((N, d)), np.zeros((N, d))
    place = np.zeros((N, d))
    status = loop.start(place)
    runs = {
        "defect": lambda: defect(d)(A, load, u, r),
        "sweep from zero, with defect": lambda: sweep_from_zero(d)(A, middle, loop.inverse, load, u, r),
        "backward sweep": lambda: backward_sweep(d, False)(A, middle, loop.inverse, load, u, None),
        "backward sweep, with defect": lambda: backward_sweep(d, True)(A, middle, loop.inverse, load, u, r),
        "sweep of the contact loop": lambda: loop.sweep(place, status),
    }
    scalar, csr = problem.A.tocsr(), (problem.A.indptr, problem.A.indices, problem.A.data)
    by_format = {
        "AIJ": PETSc.Mat().createAIJ(size, csr=(scalar.indptr, scalar.indices, scalar.data)),
        "BAIJ": PETSc.Mat().createBAIJ(size, d, csr=csr),
    }
    for name, M in by_format.items():
        x, y = M.createVecs()
        x.set(1.0)
        runs[f"PETSc MatMult, {name}"] = lambda M=M, x=x, y=y: M.mult(x, y)
        runs[f"PETSc MatSOR, {name}"] = lambda M=M, x=x, y=y: M.SOR(x, y, sortype=BACKWARD)
    moved_once = A.data.nbytes + A.indices.nbytes + 3 * load.nbytes
    return {name: quickest(run) for name, run in runs.items()}, moved_once
