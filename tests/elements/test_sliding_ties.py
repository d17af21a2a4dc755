"""Sliding ties in all modes: force and event functions against closed forms.

Their energies are in `test_passivity.py`.
"""

import numpy as np
import pytest
from support.differences import relative_error
from support.pose import attitude
from support.systems import random_body, random_Z

from rbstab.elements.sliding import CrossingTie, FilippovTie, LayeredTie
from rbstab.mechanics.motion import motion_from_centre

POSITION = {"rate_weight": 0.0, "slope": 1.0}
SLOPE = {"rate_weight": 1.0, "slope": 7.0}
CASES = {
    "crossing": (CrossingTie, POSITION),
    "layered position": (LayeredTie, POSITION),
    "layered slope": (LayeredTie, SLOPE),
    "sliding": (FilippovTie, SLOPE),
}


def random_modes(rng, kind):
    """Return modes in which an axis is on each side, in a layer, or held."""
    if kind is CrossingTie:
        return rng.choice([0.0, 1.0], size=3)
    pairs = [(1.0, 0.0), (0.0, 1.0), (0.0, 0.0)] if kind is LayeredTie else None
    pairs = pairs or [(1.0, 0.0), (0.0, 0.0), (1.0, 1.0)]
    return np.array([pairs[k] for k in rng.permutation(3)]).T.ravel()


def random_tie(rng, kind, surface):
    return kind(
        name="one",
        point=rng.normal(size=3),
        anchor=rng.normal(size=3),
        K_s=rng.uniform(50, 200, size=3),
        layer_width=float(rng.uniform(0.5, 2)),
        mode=random_modes(rng, kind),
        **surface,
    )


@pytest.fixture(params=CASES)
def made(request, rng):
    """A tie, the body's state Z with its motion, and equivalent forces."""
    kind, surface = CASES[request.param]
    element = random_tie(rng, kind, surface)
    body, Z = random_body(rng), random_Z(rng)
    equivalent_forces = rng.normal(size=3) if element.slides else np.zeros(0)
    return element, Z, motion_from_centre(body, rng.normal(size=3), Z), equivalent_forces


def displacement(element, X, A):
    return X + A @ element.point - element.anchor


def test_force_is_that_of_the_law_axis_by_axis(made):
    element, Z, motion, equivalent_forces = made
    X, V, A = Z[6:9], Z[9:12], attitude(Z[:3])
    E = displacement(element, X, A)
    F = V + A @ np.cross(Z[3:6], element.point)
    s = element.rate_weight * F + element.slope * E
    expected = np.empty(3)
    for axis in range(3):
        first, second = (
            (element.mode[axis], 0.0)
            if len(element.mode) == 3
            else (element.mode[axis], element.mode[axis + 3])
        )
        if isinstance(element, LayeredTie):
            inside = s[axis] / element.layer_width
            sign = 1.0 if first else -1.0 if second else inside
            expected[axis] = -element.K_s[axis] * sign
        elif second:
            expected[axis] = equivalent_forces[axis]
        else:
            expected[axis] = -element.K_s[axis] * (1.0 if first else -1.0)
    wrench = element.wrench(motion, equivalent_forces)
    assert relative_error(wrench.force, expected) < 1e-12
    assert relative_error(wrench.couple, np.cross(element.point, A.T @ expected)) < 1e-12
    if element.rate_weight:
        # On s = F + κE nothing is stored: all power is counted as lost.
        assert element.stored(motion, equivalent_forces) == 0
        assert element.dissipated(motion, equivalent_forces) == pytest.approx(
            -expected @ F, rel=1e-12
        )


def test_event_functions_of_a_sliding_tie(rng):
    """s and -1 on a free axis; 1 - λ/K_s and 1 + λ/K_s on a held one; ±s - δ beside a layer."""
    element, layered = random_tie(rng, FilippovTie, SLOPE), random_tie(rng, LayeredTie, POSITION)
    Z = random_Z(rng)
    motion = motion_from_centre(random_body(rng), np.zeros(3), Z)
    A = attitude(Z[:3])
    E = displacement(element, Z[6:9], A)
    s = Z[9:12] + A @ np.cross(Z[3:6], element.point) + 7.0 * E
    load = rng.uniform(-1, 1, size=3)
    held = element.mode[3:] > 0
    g = element.guards(motion, load * element.K_s)
    np.testing.assert_allclose(g[:3], np.where(held, 1 - load, s), rtol=1e-12)
    np.testing.assert_allclose(g[3:], np.where(held, 1 + load, -1.0), rtol=1e-12)
    E = displacement(layered, Z[6:9], A)
    beside = np.concatenate([E, -E]) - layered.layer_width
    np.testing.assert_allclose(layered.guards(motion, np.zeros(0)), beside, rtol=1e-12)
