"""Every element gives up no more than it has stored: power in, change of energy, loss."""

import numpy as np
import pytest
from support.differences import along, relative_error
from support.systems import random_body, random_spd, random_Z

from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.gravity import Gravity
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.mechanics.motion import motion_from_centre

KINDS = {
    Gravity: (),
    TranslationalStabilizer: (900, 40),
    RotationalStabilizer: (90, 12),
    ViscoElasticConnector: (2000, 90),
    EmbeddedConnector: (2000, 90, 1500, 150),
}


@pytest.fixture(params=KINDS, ids=lambda kind: kind.__name__)
def element(request, rng):
    gains = [random_spd(rng, scale) for scale in KINDS[request.param]]
    return request.param(*(gains or [rng.normal(size=3) * 100]))


@pytest.fixture
def state(rng, element):
    """A body, a motion and the element's own states."""
    body, anchor = random_body(rng), rng.normal(size=3)
    return body, anchor, random_Z(rng), rng.normal(size=element.state_size)


def test_power_is_stored_or_dissipated(element, state):
    body, anchor, Z, own = state
    motion = motion_from_centre(body, anchor, Z)
    wrench = element.wrench(motion, own)
    taken_in = -(
        wrench.force @ motion.V + wrench.couple @ motion.Omega + wrench.contact_force @ motion.F
    )
    # Velocities move the places; whatever changes the velocities stores nothing.
    rates = np.concatenate(
        [motion.B @ motion.Omega, Z[6:9], motion.V, -Z[3:6], element.rates(motion, own)]
    )

    def stored(y):
        return element.stored(motion_from_centre(body, anchor, y[:12]), y[12:])

    stored_rate = along(stored, np.concatenate([Z, own]), rates)
    lost = element.dissipated(motion, own)
    assert relative_error(stored_rate, taken_in - lost, abs(taken_in) + abs(lost)) < 1e-11


def test_loss_is_positive_while_anything_moves(element, state):
    body, anchor, Z, own = state
    lost = element.dissipated(motion_from_centre(body, anchor, Z), own)
    assert lost == 0 if isinstance(element, Gravity) else lost > 0


def test_nothing_is_lost_at_rest(element, state):
    body, anchor, Z, own = state
    still = np.concatenate([Z[0:3], np.zeros(3), Z[6:9], np.zeros(3)])
    motion = motion_from_centre(body, anchor, still)
    if element.state_size:
        # The node at rest as well: where its two springs balance.
        own = np.linalg.solve(element.K_c + element.K_d, element.K_c @ motion.E)
    scale = element.dissipated(motion_from_centre(body, anchor, Z), own)
    assert abs(element.dissipated(motion, own)) <= 1e-20 * scale


def test_springs_store_nothing_unless_stretched(element, rng):
    body, anchor = random_body(rng), rng.normal(size=3)
    W_zero = np.concatenate([np.zeros(6), anchor, np.zeros(3)])
    motion = motion_from_centre(body, anchor, W_zero)._replace(X=np.zeros(3))
    own = np.zeros(element.state_size)
    # E of the anchor's place is zero to round-off.
    assert abs(element.stored(motion, own)) < 1e-25


def test_rates_are_those_of_the_own_states_alone(element, state):
    body, anchor, Z, own = state
    rates = element.rates(motion_from_centre(body, anchor, Z), own)
    assert rates.shape == own.shape == (3 if isinstance(element, EmbeddedConnector) else 0,)


def test_gains_cannot_be_changed(element):
    field = next(iter(vars(element)))
    with pytest.raises(AttributeError):
        setattr(element, field, np.eye(3))
