"""Protects rest states where an element of a user holds the body: found, isolated, counted.

U = ½ Σ w_i (θ_i - c_i)² with max(h, 0), where h = 0 is a plane or a sphere, has rest states in
closed form.
"""

from itertools import product

import numpy as np
import pytest
from support.kinks import kinked, plane, sphere

from rbstab.analysis.proof.boxes import whole_range
from rbstab.analysis.proof.branch_and_bound import SearchOutcome, prove
from rbstab.analysis.proof.guards.barrier import BarrierEnergy
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.guards.soft import SoftEnergy
from rbstab.analysis.proof.least_value import least_value
from rbstab.analysis.proof.searches.zeros import search
from rbstab.analysis.proof.traced.held import surface_at, surfaces
from rbstab.analysis.proof.trigonometric import TrigonometricForm

CENTRE = np.array([0.3, 0.7, -0.2])
NORMAL = np.array([0.6, 1.0, -0.5])
END = np.array([2.0, 1.5, 2.0])


def form_with(*energies, weights=(1.0, 1.0, 1.0), centre=CENTRE, guard=None, ridge=False):
    w, c = np.array(weights), np.array(centre)
    constant = np.full((1, 1, 1), 0.5 * float(w @ (c * c)))
    lines = tuple(kinked(one, ridge=ridge) for one in energies)
    return TrigonometricForm(np.diag(w), -w * c, constant, guard=guard, lines=lines)


def proved(form, end=END):
    found = prove(form, search(form, 0, 50, end), end=end)
    without_hints = prove(form, (), end=end)
    assert len(without_hints.inside) == len(found.inside)
    assert without_hints.outcome is found.outcome
    return found


def share_of(couple, offset, weights):
    """Return λ for which Θ = c - λK W⁻¹n is on the plane."""
    return (NORMAL @ CENTRE - offset) / (couple * NORMAL @ (NORMAL / weights))


@pytest.mark.parametrize("weights", [(1.0, 1.0, 1.0), (2.0, 0.7, 3.0), (1.0, 1.0, -3.0)])
@pytest.mark.parametrize(("couple", "offset"), [(5.0, 0.5), (0.15, 0.5), (5.0, 1.1)])
def test_the_one_rest_state_is_where_the_closed_form_is(couple, offset, weights):
    """The plane holds it, is too weak, or is not reached; also of a saddle."""
    w = np.array(weights)
    share = share_of(couple, offset, w)
    expected = CENTRE - np.clip(share, 0.0, 1.0) * couple * NORMAL / w
    held = bool(0 < share < 1)
    assert held is (couple == 5.0 and offset == 0.5)
    form = form_with(plane(NORMAL, offset, couple), weights=weights)
    found = proved(form, end=np.array([2.0, 1.5, 2.0]))
    assert found.outcome is SearchOutcome.PROVED
    (zero,) = found.inside
    assert zero.at_kink is held
    np.testing.assert_allclose(zero.Theta, expected, atol=1e-12)
    assert np.all(zero.enclosure.low[0] <= expected + 1e-15)
    assert np.all(expected - 1e-15 <= zero.enclosure.high[0])
    if held:
        surface = surface_at(form, zero.Theta)
        assert surface is not None
        along = np.linalg.svd(NORMAL[np.newaxis])[2][1:]
        index = int(np.sum(np.linalg.eigvalsh(along @ np.diag(w) @ along.T) < 0))
        assert surface.index(zero.enclosure) == index == surface.approximate_index(zero.Theta)
        assert index == int(weights[2] < 0)


@pytest.mark.parametrize("weights", [(1.0, 1.0, 1.0), (2.0, 0.7, 3.0), (1.0, 1.0, -3.0)])
@pytest.mark.parametrize(("couple", "offset"), [(0.6, 0.5), (0.15, 0.5), (0.6, 1.1)])
def test_a_ridge_has_a_rest_state_on_it_and_one_on_each_side(weights, couple, offset):
    """Or one alone, where the load pushes it over. U falls on both sides of a ridge."""
    w = np.array(weights)
    share = share_of(couple, offset, w)
    beyond, before = CENTRE, CENTRE - couple * NORMAL / w
    on_ridge = CENTRE - share * couple * NORMAL / w
    expected = [(beyond, 0)] if share > 0 else []
    expected += [(before, 0)] if share < 1 else []
    expected += [(on_ridge, 1)] if 0 < share < 1 else []
    assert len(expected) == (3 if couple == 0.6 and offset == 0.5 else 1)
    form = form_with(plane(NORMAL, offset, couple), weights=weights, ridge=True)
    found = proved(form)
    assert found.outcome is SearchOutcome.PROVED
    assert len(found.inside) == len(expected)
    for Theta, on in expected:
        (zero,) = (one for one in found.inside if np.abs(one.Theta - Theta).max() < 1e-9)
        assert zero.at_kink is bool(on)
        assert np.all(zero.enclosure.low[0] <= Theta + 1e-15)
        assert np.all(Theta - 1e-15 <= zero.enclosure.high[0])
        if on:
            surface = surface_at(form, zero.Theta)
            assert surface is not None
            index = 1 + int(weights[2] < 0)
            assert surface.index(zero.enclosure) == index == surface.approximate_index(zero.Theta)


def test_the_least_energy_is_on_no_ridge():
    """Of two wells, and on a face across both of them."""
    form = form_with(plane(NORMAL, 0.5, 0.6), ridge=True)
    random = np.random.default_rng(5)
    points = random.uniform(-END, END, (200_000, 3))
    whole = least_value(form, whole_range(END), 100_000)
    assert whole.closed
    before = CENTRE - 0.6 * NORMAL
    lowest = min(form.value(np.array([CENTRE, before])))
    assert whole.value == pytest.approx(lowest, abs=1e-12)
    assert whole.lower_bound <= lowest <= form.value(points).min()
    points[:, 0] = END[0]
    box = whole_range(END)
    box.low[0, 0] = END[0]
    face = least_value(form, box, 100_000)
    assert face.closed
    assert face.value <= form.value(points).min()
    assert face.value - face.lower_bound < 1e-8


@pytest.mark.parametrize("ridge", [False, True])
@pytest.mark.parametrize("edge", [0.0, 1.0])
def test_where_the_share_is_at_its_ends_nothing_is_claimed(edge, ridge):
    """The rest state is on the plane, and one side of it is at rest too, to first order."""
    couple = 0.4
    offset = float(NORMAL @ (CENTRE - edge * couple * NORMAL))
    found = proved(form_with(plane(NORMAL, offset, couple), ridge=ridge))
    assert found.outcome is not SearchOutcome.PROVED
    # A ridge has another rest state, away from it.
    assert len(found.inside) == int(ridge)


def test_a_sphere_holds_the_body_at_its_nearest_point():
    """½|Θ - c|² pulls to c outside of the sphere. The farthest point would need λ below 0."""
    centre = np.array([0.0, 0.0, 1.2])
    form = form_with(sphere(0.5, 10.0), centre=centre)
    found = proved(form)
    assert found.outcome is SearchOutcome.PROVED
    (zero,) = found.inside
    np.testing.assert_allclose(zero.Theta, [0, 0, 0.5], atol=1e-12)
    assert surfaces(form)[0].index(zero.enclosure) == 0


def test_a_strip_between_two_planes_holds_on_one_of_them():
    parts = plane(NORMAL, 0.5, 5.0), plane(-NORMAL, 0.4, 5.0)
    found = proved(form_with(*parts))
    assert found.outcome is SearchOutcome.PROVED
    (zero,) = found.inside
    assert zero.Theta @ NORMAL == pytest.approx(0.5, abs=1e-12)


def test_where_two_planes_meet_it_is_not_decided():
    """The rest state is on both, which no enclosure shows; but nothing else is at rest."""
    parts = plane([0, 1.0, 0.0], 0.4, 5.0), plane([1.0, 0.0, 0.0], 0.1, 5.0)
    found = prove(form_with(*parts), (), end=END, box_limit=20_000)
    assert found.outcome is not SearchOutcome.PROVED
    assert len(found.inside) == 0
    corner = np.array([0.1, 0.4, -0.2])
    assert np.any(
        np.all((found.undecided.low <= corner) & (corner <= found.undecided.high), axis=1)
    )


GUARDS = {
    "barrier": Guard(BarrierEnergy(0.5)),
    "stiff": Guard(None, (SoftEnergy(0.0, 3.0, 0.1),)),
    "repelling": Guard(None, (SoftEnergy(0.02, 0.0, 0.1),)),
}


@pytest.mark.parametrize("name", GUARDS)
def test_beside_guards_the_state_is_that_of_a_search(name):
    from scipy.optimize import minimize

    form = form_with(plane(NORMAL, 0.5, 5.0), guard=GUARDS[name])
    found = proved(form)
    assert found.outcome is SearchOutcome.PROVED
    (zero,) = found.inside
    assert zero.at_kink
    along = np.linalg.svd(NORMAL[np.newaxis])[2][1:]
    on_plane = 0.5 * NORMAL / (NORMAL @ NORMAL)

    def energy(y):
        return float(form.without_kinks.value((on_plane + y @ along)[np.newaxis])[0])

    best = minimize(energy, along @ (CENTRE - on_plane), tol=1e-12)
    np.testing.assert_allclose(zero.Theta, on_plane + best.x @ along, atol=1e-5)


@pytest.mark.parametrize("guarded", [False, True])
def test_the_least_value_over_a_box_is_the_closed_form(guarded):
    """It lies on the plane; the bound is as sharp as that of a smooth energy."""
    form = form_with(plane(NORMAL, 0.5, 5.0), guard=GUARDS["barrier"] if guarded else None)
    found = least_value(form, whole_range(END), 100_000)
    assert found.closed
    gap = (NORMAL @ CENTRE - 0.5) / (NORMAL @ NORMAL)
    if not guarded:
        assert found.value == pytest.approx(0.5 * gap * gap * (NORMAL @ NORMAL), rel=1e-9)
    assert found.lower_bound <= found.value
    assert found.value - found.lower_bound < 1e-7
    assert found.examined < 20_000


def test_no_other_point_of_a_domain_is_at_rest():
    """Against the closed form: for other loads the state moves, and is in the domain still once."""
    form = form_with(plane(NORMAL, 0.5, 5.0))
    (zero,) = proved(form).inside
    low, high = zero.domain.low[0], zero.domain.high[0]
    assert np.all(high - low > 0.1)
    for corner in product(*zip(low, high, strict=True)):
        Theta = np.array(corner)
        # λ = -n'∇F / n'∇h, over the domain: strictly between 0 and 1.
        share = -(NORMAL @ (Theta - CENTRE)) / (5.0 * NORMAL @ NORMAL)
        assert 0 < share < 1


def test_a_turning_surface_keeps_its_states_apart():
    """On a sphere U = ½ Σ w_i θ_i² has two minima and four saddles, by symmetry.

    All w_i are negative: U falls outwards up to the sphere, the most along θ3, and rises beyond it.
    """
    form = form_with(sphere(0.5, 10.0), weights=(-1.0, -2.0, -3.0), centre=np.zeros(3))
    found = proved(form, end=np.array([1.0, 1.1, 1.2]))
    assert found.outcome is SearchOutcome.PROVED
    held = [zero for zero in found.inside if zero.at_kink]
    assert len(found.inside) == 7
    assert len(held) == 6
    (surface,) = surfaces(form)
    indices = {int(np.argmax(np.abs(zero.Theta))): surface.index(zero.enclosure) for zero in held}
    assert indices == {0: 2, 1: 1, 2: 0}
    (centre,) = (zero for zero in found.inside if not zero.at_kink)
    np.testing.assert_allclose(centre.Theta, 0, atol=1e-12)


@pytest.mark.parametrize("share", [0.2, 0.8])
def test_a_domain_ends_before_the_rest_states_on_both_sides(share):
    """U = -½ θ1² + max(θ1 - λ, 0) + ...: a maximum along θ1 on both sides of the held minimum.

    All is linear, so only λ tells that they are others: it is 0 at one of them, and 1 at the other.
    """
    form = form_with(plane([1, 0, 0], share, 1.0), weights=(-1, 1, 1), centre=np.zeros(3))
    found = proved(form)
    assert found.outcome is SearchOutcome.PROVED
    places = sorted((float(zero.Theta[0]), zero.at_kink) for zero in found.inside)
    assert [held for _, held in places] == [False, True, False]
    np.testing.assert_allclose([place for place, _ in places], [0, share, 1], atol=1e-12)
