"""Least squares with variables that are not negative: the conditions of the least, and scipy's own."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from model.problem.nonnegative import nonnegative_forces


@settings(deadline=None, max_examples=200)
@given(seed=st.integers(0, 2**32 - 1), m=st.integers(1, 12), k=st.integers(0, 200), copies=st.integers(1, 3))
def test_no_force_can_take_more(seed, m, k, copies):
    random = np.random.default_rng(seed)
    work = np.tile(random.normal(size=(k, m)) * 10.0 ** random.uniform(-3, 3, (k, 1)), (copies, 1))
    load = random.normal(size=m)
    forces, left = nonnegative_forces(work, load)
    assert np.all(forces >= 0.0) and np.count_nonzero(forces) <= m
    size = np.linalg.norm(work, axis=1) * np.linalg.norm(load)
    assert np.all(work @ left >= -1e-9 * size)
    assert np.all(np.abs(work @ left)[forces > 0.0] <= 1e-9 * size[forces > 0.0])
    assert np.allclose(left, load + work.T @ forces, rtol=0, atol=1e-9 * np.linalg.norm(load))


def test_a_load_in_the_cone_is_balanced():
    random = np.random.default_rng(1)
    for _ in range(100):
        work = random.normal(size=(500, 6))
        load = -(random.random(500) ** 8) @ work
        assert np.linalg.norm(nonnegative_forces(work, load)[1]) < 1e-12 * np.linalg.norm(load)
