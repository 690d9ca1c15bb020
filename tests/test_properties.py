"""Random scenes must be right and random nonsense refused; the cases are those of demos/reports/extremes."""

import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parents[1] / "demos"))
from extremes.random_scenes import (
    MOVING,
    REFUSALS,
    STATIC,
    Between,
    OneOf,
    Powers,
    Whole,
    complaint,
    motion_error,
    static_error,
)

few = settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


def values(what):
    """Strategy for what a space draws from."""
    match what:
        case OneOf():
            return st.sampled_from(what.values)
        case Whole():
            return st.integers(what.low, what.high)
        case Between():
            return st.floats(what.low, what.high)
        case Powers():
            return st.floats(what.low, what.high).map(lambda x: 10.0**x)


def arguments(space):
    return st.fixed_dictionaries({name: values(what) for name, what in space.items()})


@few
@given(arguments(STATIC))
def test_equilibrium_gaps_pressures_cone_and_node_order(scene):
    error, residual = static_error(**scene)
    assert error < 1e-6
    assert residual <= 1e-10


@few
@given(arguments(MOVING))
def test_energy_and_momentum_of_a_thrown_ring(motion):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a limit of the model is passed is said, and is no fault
        error, residual = motion_error(**motion)
    assert error < 1e-6
    assert residual <= 1e-10


@pytest.mark.parametrize("number", range(len(REFUSALS)))
@settings(max_examples=8, deadline=None, derandomize=True)
@given(data=st.data())
def test_nonsense_is_refused_in_a_sentence_that_names_it(number, data):
    refusal = REFUSALS[number]
    value = data.draw(st.one_of(*map(values, refusal.bad)))
    assert complaint(refusal, value) == ""


def test_the_judge_is_strict():
    """A wrong number, NaN, a traceback, a bare error, and a refusal of what makes sense are all wrong."""
    from harness.verdict import Cases, judge

    cases = Cases()

    @cases.add(
        "judge", "{answer}", 1e-9, answer=[(0.0, 0.0), (1.0, 0.0), (0.0, 1e-9), (np.nan, 0.0), (0.0, np.nan)]
    )
    def number(answer):
        return answer

    @cases.add(
        "judge",
        "{error}",
        1e-9,
        error=[
            KeyError("x"),
            RuntimeError("It did not converge at all."),
            ValueError("It makes no sense to me."),
        ],
    )
    @cases.add(
        "judge",
        "{error}, refused",
        1e-9,
        refuses=True,
        error=[ValueError("It makes no sense to me."), np.linalg.LinAlgError("Singular")],
    )
    def fails(error):
        raise error

    outcomes = [judge(case).outcome for case in cases]
    assert outcomes == ["right", *["wrong"] * 4, "refused", "wrong", *["wrong"] * 3]
