"""Eq. 22, 40, 41 and 44: the connectors at C are assemblies of springs and dampers."""

import numpy as np
import pytest
from scipy.linalg import eigh
from support.differences import derivative, relative_error
from support.elements import random_spd
from support.systems import random_body, random_Z

from rbstab.elements.element import NO_STATE
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.mechanics.motion import motion_from_contact


@pytest.fixture
def motion(rng):
    return motion_from_contact(random_body(rng), rng.normal(size=3), random_Z(rng))


@pytest.fixture
def embedded(rng):
    return EmbeddedConnector(*(random_spd(rng, scale) for scale in (2000, 90, 1500, 150)))


def relaxed(connector, E):
    """Return the D at which the two springs in series pull equally."""
    return np.linalg.solve(connector.K_c + connector.K_d, connector.K_c @ E)


def test_eq_22_state_of_the_connector_relaxes_exponentially(rng, motion, embedded):
    # D has three modes, and each decays at its own rate.
    end, start = relaxed(embedded, motion.E), rng.normal(size=3)
    paces, modes = eigh(embedded.K_c + embedded.K_d, embedded.L_d)
    pace, amplitudes = paces.max(), modes.T @ embedded.L_d @ (start - end)

    def D(t):
        return end + modes @ (np.exp(-paces * t) * amplitudes)

    for t in (0.0, 1 / pace):
        expected = derivative(lambda s, t=t: D(t + s), 1e-2 / pace)
        actual = embedded.rates(motion, D(t))
        assert relative_error(actual, expected, pace * np.abs(D(t)).max()) < 1e-12


def test_eq_22_connector_at_rest_is_two_springs_in_series(motion, embedded):
    D, at_rest = relaxed(embedded, motion.E), motion._replace(F=np.zeros(3))
    scale = np.abs(np.linalg.solve(embedded.L_d, embedded.K_c @ motion.E)).max()
    np.testing.assert_allclose(embedded.rates(at_rest, D), 0, atol=1e-13 * scale)
    compliance = np.linalg.inv(embedded.K_c) + np.linalg.inv(embedded.K_d)
    expected = -np.linalg.solve(compliance, motion.E)
    assert relative_error(embedded.wrench(at_rest, D).contact_force, expected) < 1e-14


def test_eq_40_is_the_limit_of_eq_22_for_a_node_held_stiffly(rng, motion, embedded):
    stiff = EmbeddedConnector(embedded.K_c, embedded.L_c, 1e12 * embedded.K_d, embedded.L_d)
    plain = ViscoElasticConnector(embedded.K_c, embedded.L_c)
    settled = stiff.wrench(motion, relaxed(stiff, motion.E)).contact_force
    # 1e-10: the node still moves a little with a stiffness of 1e12 times the connector's.
    assert relative_error(settled, plain.wrench(motion, NO_STATE).contact_force) < 1e-10
