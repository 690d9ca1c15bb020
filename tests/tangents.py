"""Tangents of finite strain against differences of the forces."""

import numpy as np


def tangent_errors(elastic, u0, u1, d, h=1e-6):
    """Largest errors, over the largest change along d (N, d), of the tangent at u1 and of a step from u0."""
    errors = []
    for force, tangent in (
        (elastic.internal_force, elastic.tangent),
        (lambda u: elastic.step_force(u0, u), lambda u: elastic.step_tangent(u0, u)),
    ):
        change = (force(u1 + h * d) - force(u1 - h * d)) / (2 * h)
        found = (tangent(u1) @ d.ravel()).reshape(d.shape)
        errors.append(np.abs(found - change).max() / np.abs(change).max())
    return errors
