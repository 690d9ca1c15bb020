"""Judge a case by machine: right, refused, or wrong.

A case is a function that returns an error, measured against a closed form, a scaling law or an independent
solver, and the natural residual. It is *right* if both are small enough, *refused* if it makes no sense and
one sentence of a ValueError says so, and *wrong* in every other event: a wrong number, no number, a
traceback, no convergence, a refusal of what makes sense.
"""

import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from time import perf_counter
from typing import Any

import numpy as np

RESIDUAL = 1e-10  # natural residual of a right answer
QUICKLY = 5.0  # seconds within which a refusal must come


@dataclass(frozen=True)
class Case:
    """One case.

    Attributes
    ----------
    family, name : str
    run : callable
        Takes nothing; returns error and natural residual.
    tolerance : float
        Of the error.
    refuses : bool
        The case makes no sense, so that an answer is wrong.
    long : bool
        For full runs only.
    """

    family: str
    name: str
    run: Callable[[], tuple[float, float]]
    tolerance: float
    refuses: bool = False
    long: bool = False


@dataclass(frozen=True)
class Verdict:
    """What became of a case.

    Attributes
    ----------
    case : Case
    outcome : str
        "right", "refused" or "wrong".
    error, residual : float
        NaN where there is no answer.
    seconds : float
    words : str
        What was refused, went wrong, or was warned of.
    """

    case: Case
    outcome: str
    error: float
    residual: float
    seconds: float
    words: str


class Cases:
    """Collects cases: a function and the values of its arguments make a row of them.

    >>> cases = Cases()
    >>> @cases.add("roots", "x = {x:g}", 1e-15, x=[1e-300, 1.0, 1e300])
    ... def root_of_square(x):
    ...     return abs(np.sqrt(x) ** 2 / x - 1), 0.0
    >>> [judge(case).outcome for case in cases]
    ['right', 'right', 'right']
    """

    def __init__(self) -> None:
        self._cases: list[Case] = []

    def __iter__(self) -> Iterator[Case]:
        """Go through the cases in the order in which they were added."""
        return iter(self._cases)

    def add(
        self,
        family: str,
        name: str,
        tolerance: float = 1e-10,
        /,
        *,
        refuses: bool = False,
        long: bool = False,
        **values: Iterable[Any],
    ) -> Callable:
        """Decorate a function: one case for every combination of the values of its arguments.

        Parameters
        ----------
        family : str
        name : str
            Format string of the arguments.
        tolerance, refuses, long
            As for `Case`.
        **values : iterable
            Values of each argument.
        """

        def collect(function: Callable) -> Callable:
            for chosen in product(*values.values()):
                arguments = dict(zip(values, chosen))
                self._cases.append(
                    Case(
                        family,
                        name.format(**arguments),
                        partial(function, **arguments),
                        tolerance,
                        refuses,
                        long,
                    )
                )
            return function

        return collect


def judge(case: Case) -> Verdict:
    """Run a case and judge it; overflows and divisions by zero that numpy notices are wrong too."""
    began = perf_counter()
    error = residual = float("nan")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        warnings.simplefilter("error", RuntimeWarning)
        try:
            error, residual = map(float, case.run())
            good = error <= case.tolerance and residual <= RESIDUAL and not case.refuses
            outcome, words = "right" if good else "wrong", "; ".join(str(w.message) for w in said)
        except ValueError as refusal:
            words = str(refusal)
            good = case.refuses and is_sentence(words) and perf_counter() - began < QUICKLY
            outcome = "refused" if good else "wrong"
        except Exception as fault:  # whatever it is, it is wrong, and the others go on
            outcome, words = "wrong", f"{type(fault).__name__}: {fault}"
    return Verdict(case, outcome, error, residual, perf_counter() - began, words)


def is_sentence(words: str) -> bool:
    """Tell whether a message is one line that ends like a sentence and is long enough to be one."""
    return words.endswith(".") and "\n" not in words and len(words.split()) > 4


def deviation(value: Any, reference: Any, scale: float | None = None) -> float:
    """Return the largest difference, relative to the largest reference, or to `scale`."""
    value, reference = np.asarray(value, dtype=float), np.asarray(reference, dtype=float)
    scale = float(np.abs(reference).max()) if scale is None else scale
    difference = float(np.abs(value - reference).max())
    return difference / scale if difference else 0.0
