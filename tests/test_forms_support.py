"""Supports: what is prescribed is obtained, what is tied moves as one, and the matrix stays symmetric."""

import numpy as np
import pytest
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

from forms import Elasticity, Isotropic, Support
from geometry import Body, box, half_cylinder_nested, rectangle


def solve(system):
    u = spsolve(system.A.tocsc(), system.load.ravel())
    return u.reshape(system.load.shape)


@pytest.mark.parametrize("dim", [2, 3])
def test_prescribed_displacements_are_obtained_and_reactions_balance(dim):
    body = Body.from_grid(rectangle(2.0, 1.0, 4, 3) if dim == 2 else box(2.0, 1.0, 1.0, 3, 2, 2))
    elasticity = Elasticity(body, Isotropic(10.0, 0.3))
    K, load = elasticity.stiffness(), elasticity.total_force("top", np.arange(1.0, dim + 1))
    before = K.data.copy()
    held = dict(zip("xyz", np.zeros(dim)))
    system = Support(body).fix("left", **held).fix("right", x=0.1).apply(K, load)
    np.testing.assert_array_equal(K.data, before)
    assert abs(system.A - system.A.T).max() < 1e-14
    u = system.expand(solve(system))
    np.testing.assert_allclose(u[body.nodes("left")], 0, atol=1e-14)
    np.testing.assert_allclose(u[body.nodes("right"), 0], 0.1)
    reaction = (K @ u.ravel()).reshape(u.shape) - load
    assert abs(reaction[~system.fixed]).max() < 1e-12
    np.testing.assert_allclose(reaction.sum(axis=0), -np.arange(1.0, dim + 1))


def test_prescribed_unknowns_keep_a_lone_diagonal_entry():
    body = Body.from_grid(rectangle(1.0, 1.0, 3, 3))
    K = Elasticity(body, Isotropic(10.0, 0.3)).stiffness()
    system = Support(body).fix("left", x=0.5).apply(K, np.zeros((16, 2)))
    A = system.A.tocsr()
    for row in np.flatnonzero(system.fixed.ravel()):
        line = A[[row]].toarray().ravel()
        assert line[row] == K.diagonal()[row] and np.count_nonzero(line) == 1
        assert system.load.ravel()[row] == 0.5 * line[row]


def test_platen_moves_as_one_and_carries_the_resultant():
    body = Body.from_grid(half_cylinder_nested(10.0), 2)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    K, load = elasticity.stiffness(), elasticity.total_force("top", (5.0, -100.0))
    bottom = body.nearest_node((0, 0))
    system = Support(body).platen("top").fix("arc", x=0.0, y=0.0).apply(K, load)
    platen = system.node_of[body.nodes("top")]
    assert np.ptp(platen) == 0
    assert len(system.load) == len(body.coordinates) - len(body.nodes("top")) + 1
    ends = np.intersect1d(body.nodes("arc"), body.nodes("top"))
    assert len(ends) == 2 and system.fixed[platen[0]].all()  # the ends of the arc hold the platen
    system = Support(body).platen("top").fix_node(bottom, x=0.0, y=0.0).apply(K, load)
    np.testing.assert_allclose(system.load[platen[0]], (5.0, -100.0))
    np.testing.assert_allclose(system.load.sum(axis=0), (5.0, -100.0))
    np.testing.assert_allclose(system.coordinates[platen[0]], (0, 10.0), atol=1e-14)
    assert abs(system.A - system.A.T).max() < 1e-12 * abs(system.A.data).max()
    u = system.expand(solve(system))
    assert np.ptp(u[body.nodes("top")], axis=0).max() == 0
    residual = system.reduce((K @ u.ravel()).reshape(u.shape) - load)
    assert abs(residual[~system.fixed]).max() < 1e-8


def test_platen_on_every_mesh_of_the_hierarchy():
    body = Body.from_grid(half_cylinder_nested(10.0), 2)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    K = elasticity.stiffness()
    system = Support(body).platen("top").apply(K, np.zeros_like(body.coordinates))
    assert [P.shape for P in system.prolongations] == [(913, 233), (233, 61)]
    node = system.node_of[body.nodes("top")[0]]
    for P in system.prolongations:
        np.testing.assert_allclose(P.sum(axis=1), 1)
        row = P[[node]]
        assert row.nnz == 1 and row.data[0] == 1
        node = row.indices[0]
        assert P[:, [node]].tocsc().indices.size > 10  # it reaches the neighbours of all of its nodes
    # Tying before and after the transfer is the same.
    tie = sparse.csr_array((np.ones(945), (np.arange(945), system.node_of)), shape=(945, 913))
    coarse = Body.from_grid(half_cylinder_nested(10.0, 1))
    coarse_of = (
        Support(coarse)
        .platen("top")
        .apply(Elasticity(coarse, Isotropic(1.0, 0.3)).stiffness(), np.zeros_like(coarse.coordinates))
    )
    assert coarse_of.A.shape == (2 * 233, 2 * 233)
    values = np.random.default_rng(0).normal(size=233)
    fine = tie @ (system.prolongations[0] @ values)
    assert np.ptp(fine[body.nodes("top")]) == 0
    copies = np.flatnonzero(np.diff(body.prolongations[0].indptr) == 1)
    untied = np.full(249, np.nan)
    untied[body.prolongations[0].indices[body.prolongations[0].indptr[copies]]] = fine[copies]
    np.testing.assert_allclose(body.prolongations[0] @ untied, fine, atol=1e-14)


def test_without_platen_the_hierarchy_is_the_bodys():
    body = Body.from_grid(rectangle(1.0, 1.0, 2, 2), 2)
    K = Elasticity(body, Isotropic(1.0, 0.3)).stiffness()
    system = Support(body).fix("left", x=0.0).apply(K, np.zeros_like(body.coordinates))
    assert all(a is b for a, b in zip(system.prolongations, body.prolongations))
    np.testing.assert_array_equal(system.node_of, np.arange(len(body.coordinates)))


def test_two_platens_meet_in_the_middle():
    body = Body.from_grid(rectangle(1.0, 1.0, 3, 3))
    elasticity = Elasticity(body, Isotropic(1.0, 0.0))
    load = elasticity.total_force("top", (0.0, 1.0)) + elasticity.total_force("bottom", (0.0, -1.0))
    support = Support(body).platen("top").platen("bottom").fix("bottom", x=0.0, y=0.0).fix("top", x=0.0)
    system = support.apply(elasticity.stiffness(), load)
    np.testing.assert_allclose(system.expand(solve(system))[body.nodes("top"), 1], 1.0)


def test_wrong_supports_are_refused():
    body = Body.from_grid(rectangle(1.0, 1.0, 2, 2))
    K, load = Elasticity(body, Isotropic(1.0, 0.3)).stiffness(), np.zeros((9, 2))
    nan = load.copy()
    nan[3] = np.nan
    cases = {
        "no boundary 'roof'": lambda: Support(body).fix("roof", x=0.0),
        "no boundary 'lid'": lambda: Support(body).platen("lid"),
        "prescribed on 'top'": lambda: Support(body).fix("top"),
        "in the plane": lambda: Support(body).fix("top", z=0.0),
        "is nan": lambda: Support(body).fix("top", x=np.nan),
        "no node 9": lambda: Support(body).fix_node(9, x=0.0),
        "shares nodes": lambda: Support(body).platen("top").platen("left"),
        "need forces of .9, 2.": lambda: Support(body).apply(K, np.zeros((8, 2))),
        "not finite": lambda: Support(body).apply(K, nan),
        "different prescribed": lambda: (
            Support(body)
            .platen("top")
            .fix_node(body.nodes("top")[0], x=0.0)
            .fix_node(body.nodes("top")[1], x=1.0)
            .apply(K, load)
        ),
    }
    for words, call in cases.items():
        with pytest.raises(ValueError, match=words):
            call()
