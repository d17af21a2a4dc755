"""Protects the search for loads that drive a body beyond a tilt."""

import numpy as np
import pytest
from support.disturbed import COUPLE, FORCE, random_held, tied_config

from rbstab.config.build import system_of
from rbstab.experiment.disturbed.breaking import smallest_breaking


@pytest.mark.slow
def test_the_couples_that_break_case_1_are_about_those_of_another_program():
    """It found 144.6 and 288.2 N m for |Θ| = 0.5 and 1, which allow tilts of 0.522 and 1.079."""
    system = system_of(tied_config("permanent"))
    for tilt, reference in ((0.522, 144.6), (1.079, 288.2)):
        couple = smallest_breaking(system, np.zeros(6), [COUPLE], [1.0], tilt)
        assert couple == pytest.approx(reference, rel=0.06)


@pytest.mark.slow
def test_near_rest_the_smallest_couple_is_that_of_the_linear_system():
    """For a tilt ρ it is ρ/∫|h|dt in the worst direction: here by the eigenvalues."""
    system = system_of(random_held(0))
    couple = smallest_breaking(system, np.zeros(6), [COUPLE], [1.0], 1e-3)
    assert couple is not None

    def rates(y):
        return system.rates(y)

    A = np.array([(rates(1e-6 * e) - rates(-1e-6 * e)) / 2e-6 for e in np.eye(6)]).T
    B = np.vstack([np.zeros((3, 3)), np.linalg.inv(system.body.inertia_about_contact)])
    values, vectors = np.linalg.eig(A)
    times = np.linspace(0.0, 6.0, 4001)
    waves = np.exp(np.outer(times, values))
    h = np.einsum("ik,tk,kj->tij", vectors[:3], waves, np.linalg.solve(vectors, B + 0j)).real
    n = np.random.default_rng(0).normal(size=(4000, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    along = np.linalg.norm(np.einsum("di,tij->tdj", n, h), axis=2)
    most = ((along[1:] + along[:-1]).sum(axis=0) * (times[1] / 2)).max()
    assert couple == pytest.approx(1e-3 / most, rel=0.02)


def test_a_force_at_the_held_point_breaks_nothing():
    config = tied_config("permanent")
    at_contact = FORCE._replace(point=tuple(config.plain()["body"]["contact_point"]))
    system = system_of(config)
    assert smallest_breaking(system, np.zeros(6), [at_contact], [100.0], 0.5) is None
