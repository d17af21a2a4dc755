"""Less accurate expansions of a motion: near the accurate ones, and proved all the same."""

import numpy as np
import pytest
from flint import ctx
from support.enclosures import config_of, enclosure, outside
from support.exact_motions import motion_of

from rbstab.analysis.motion_proof.expansion import FAST, NARROW, Accuracy, Expansion
from rbstab.analysis.motion_proof.motion import PRECISION, enclosed_motion
from rbstab.analysis.motion_proof.step import step_from
from rbstab.analysis.motion_proof.taylor import extended, jacobian_slopes, polynomial

VARIANTS = ["visco-elastic", "embedded", "permanent", "free"]


@pytest.fixture(params=VARIANTS)
def start(request):
    """The equations, the set of the start, and the scale of the states."""
    with ctx.workprec(PRECISION):
        system, states, scale = enclosure(config_of(request.param, 3))
        yield system.rates, states, scale


def size_of(p, h):
    """The coefficients of p as doubles, times hᵏ, shape (states, terms)."""
    found = np.array([[float(entry) for entry in row] for row in p])
    return found * h ** np.arange(found.shape[1])


@pytest.mark.parametrize("degree", [2, 5, 9])
def test_further_coefficients_follow_from_the_derivatives(start, degree):
    field, states, _ = start
    first = polynomial(field, states.centre, degree)
    slopes = jacobian_slopes(field, first, degree + 1)
    order = 2 * degree + 2
    found = size_of(extended(field, first, slopes, order), 0.01)
    exact = size_of(polynomial(field, states.centre, order), 0.01)
    assert found.shape == exact.shape
    for k in range(order + 1):
        scale = max(np.abs(exact[:, k]).max(), 1e-13 * np.abs(exact[:, degree + 1]).max())
        assert np.abs(found[:, k] - exact[:, k]).max() < 1e-10 * scale, k


def test_one_coefficient_more_would_be_wrong(start):
    """The limit 2d + 2 is sharp, so the coefficients up to there are no accident."""
    field, states, _ = start
    first = polynomial(field, states.centre, 2)
    slopes = jacobian_slopes(field, first, 3)
    found = size_of(extended(field, first, slopes, 7), 1.0)[:, 7]
    exact = size_of(polynomial(field, states.centre, 7), 1.0)[:, 7]
    assert np.abs(found - exact).max() > 1e-6 * np.abs(exact).max()


def test_derivatives_are_those_along_the_whole_polynomial(start):
    field, states, _ = start
    expansion = Expansion(field, states.centre, FAST)
    assert len(expansion.p[0]) == FAST.order + 1
    whole = jacobian_slopes(field, expansion.p, FAST.jacobian_terms)
    assert [entry[:2] for entry in expansion.slopes] == [entry[:2] for entry in whole]
    for (_, _, ours), (_, _, theirs) in zip(expansion.slopes, whole, strict=True):
        assert len(ours) <= len(theirs)
        assert all(a.overlaps(b) for a, b in zip(ours, theirs, strict=False))
        # A series without a last term may be shorter; what is missing is zero.
        assert all(b == 0 for b in theirs[len(ours) :])


def test_a_step_is_the_same_with_a_kept_expansion(start):
    field, states, scale = start
    expansion = Expansion(field, states.centre)
    assert expansion.accuracy == NARROW
    for longest in (0.05, 0.001):
        kept = step_from(field, states, scale, longest, expansion)
        new = step_from(field, states, scale, longest)
        assert kept is not None
        assert new is not None
        assert (kept.h, kept.distance.tobytes()) == (new.h, new.distance.tobytes())
        assert kept.end.radius.tobytes() == new.end.radius.tobytes()


@pytest.mark.parametrize("accuracy", [FAST, Accuracy(6, 4, 1e-6, extended=True)])
@pytest.mark.parametrize("variant", VARIANTS)
def test_the_exact_motion_is_inside(variant, accuracy):
    config = config_of(variant, 1)
    t, exact, change = list(motion_of(config, 2.0**-8, 5))[-1]
    assert change < 1e-30
    with ctx.workprec(PRECISION):
        system, start, scale = enclosure(config)
        for step in enclosed_motion(system, start, scale, accuracy):
            if step.end_time >= t:
                middle, distance = step.state_at(t)
                break
    assert outside(exact, middle, distance) == [0.0] * len(exact)
    assert distance.max() < 1e-2
    assert distance.max() > 1e-14  # it is not the narrow one
