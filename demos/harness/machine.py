"""The machine that a figure was measured on: processor, BLAS kernels, memory bandwidth."""

import os
import platform
from pathlib import Path
from time import perf_counter

import numpy as np
from numba import njit
from threadpoolctl import threadpool_info

OWNERS = {"numpy": "numpy", "scipy": "scipy", "dolfinx_solver": "PETSc", "basix": "basix"}


def machine() -> dict:
    """Processor, and for each BLAS that is loaded its kernel, version and threads.

    A kernel is the processor family that OpenBLAS was compiled or told to run for. The variable
    OPENBLAS_CORETYPE may name a slower one than the processor has.

    Examples
    --------
    >>> sorted(machine())
    ['blas', 'cores', 'coretype', 'processor']
    """
    return {
        "processor": processor(),
        "cores": len(os.sched_getaffinity(0)),
        "blas": blas_kernels(),
        "coretype": os.environ.get("OPENBLAS_CORETYPE", ""),
    }


def blas_kernels() -> dict[str, str]:
    """Kernel of each loaded BLAS by the name of the library that brought it, as {"PETSc": "Zen 0.3.32, ..."}."""
    kernels = {}
    for library in threadpool_info():
        if library["user_api"] == "blas":
            folders = Path(library["filepath"]).parts
            owner = next((name for part in folders for key, name in OWNERS.items() if key in part), "system")
            threads = f"{library['num_threads']} thread" + "s" * (library["num_threads"] > 1)
            kernel = library.get("architecture") or library["internal_api"]
            kernels[owner] = f"{kernel} ({library['internal_api']} {library['version']}, {threads})"
    return dict(sorted(kernels.items())) or {"system": "one that threadpoolctl does not know, as Netlib's"}


def processor() -> str:
    """Name of the processor, as in "AMD EPYC 9554"."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


@njit(cache=True)
def _triad(a: np.ndarray, b: np.ndarray, c: np.ndarray, s: float) -> None:
    for i in range(a.size):
        a[i] = b[i] + s * c[i]


def triad_bandwidth(megabytes: int = 256, repeat: int = 5) -> float:
    """Bytes per second that one core moves in a = b + s c, the largest of some runs.

    Counts two reads and one write, as the STREAM benchmark does (McCalpin, 1995).

    Parameters
    ----------
    megabytes : int
        Size of each of the three arrays; several times the last cache, or the cache is what is measured.
    repeat : int
    """
    a, b, c = (np.full(megabytes * 2**17, float(k)) for k in range(3))
    fastest = np.inf
    for _ in range(repeat + 1):  # the first compiles
        began = perf_counter()
        _triad(a, b, c, 3.0)
        fastest = min(fastest, perf_counter() - began)
    return 24.0 * a.size / fastest
